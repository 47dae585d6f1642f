//! Methods as flags name them.

use super::args::MethodName;
use motorfit::identify::Method;
use motorfit::optimize::{GeneticOptions, GwoOptions, JayaOptions};

/// A method with the settings that it has by itself.
pub(super) fn named(name: MethodName) -> Method {
    match name {
        MethodName::Auto => Method::Auto,
        MethodName::Sm => Method::SteiglitzMcBride,
        MethodName::Gwo => Method::Gwo(GwoOptions::default()),
        MethodName::Jaya => Method::Jaya(JayaOptions::default()),
        MethodName::Ga => Method::Genetic(GeneticOptions::default()),
        MethodName::Random => Method::Random,
    }
}
