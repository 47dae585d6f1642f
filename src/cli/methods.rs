//! Methods and their settings, as flags name them.

use super::args::MethodName;
use super::values;
use motorfit::identify::Method;
use motorfit::optimize::{GeneticOptions, GwoOptions, JayaOptions, Sharing};
use motorfit::text::excerpt;
use motorfit::{Error, Result};

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

/// Changes a setting of a method.
pub(super) fn set(method: &mut Method, key: &str, value: &str) -> Result<()> {
    let number = || values::number(value, "--set");
    match (method, key, value) {
        (Method::Gwo(gwo), "a-start", _) => gwo.a_start = number()?,
        (Method::Gwo(gwo), "a-end", _) => gwo.a_end = number()?,
        (Method::Jaya(jaya), "sharing", "generation") => jaya.sharing = Sharing::Generation,
        (Method::Jaya(jaya), "sharing", "agent") => jaya.sharing = Sharing::Agent,
        (Method::Jaya(jaya), "greedy", "true") => jaya.greedy = true,
        (Method::Jaya(jaya), "greedy", "false") => jaya.greedy = false,
        (Method::Genetic(genetic), "mutation", _) => genetic.mutation = number()?,
        (Method::Genetic(genetic), "pressure", _) => genetic.pressure = number()?,
        (Method::Genetic(genetic), "crossover", _) => genetic.crossover = number()?,
        (Method::Genetic(genetic), "elites", _) => {
            genetic.elites = value.parse().map_err(|_| {
                let message = format!("--set elites=\"{}\" is no count", excerpt(value));
                Error::usage(message, "Give a whole number, 0 or more.")
            })?;
        }
        _ => {
            return Err(Error::usage(
                format!("--set \"{}={}\" is no setting of this method", excerpt(key), excerpt(value)),
                "gwo has a-start and a-end; jaya sharing=generation|agent and greedy=true|false; \
                 ga mutation, pressure, crossover and elites.",
            ));
        }
    }
    Ok(())
}
