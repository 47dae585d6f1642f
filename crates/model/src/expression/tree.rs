//! Syntax trees of models.

use super::functions::Function;
pub(crate) use motorfit_core::expression::{Kind, Operator};

/// An expression over names and the functions of models.
pub(crate) type Expression = motorfit_core::expression::Expression<String, Function>;
