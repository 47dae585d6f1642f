//! How the optimum is found and refined.

use super::values;
use crate::optimize::{Genetic, GeneticOptions, Gwo, GwoOptions, Jaya, JayaOptions, Optimizer, Random, Setup, Sharing};
use crate::setting::{Setting, text};
use crate::text::excerpt;
use crate::{Error, Result};

/// How the optimum is found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Method {
    /// Steiglitz–McBride; a search by the Grey Wolf Optimizer where that cannot serve.
    #[default]
    Auto,
    /// Steiglitz–McBride.
    SteiglitzMcBride,
    /// Grey Wolf Optimizer.
    Gwo(GwoOptions),
    /// Jaya.
    Jaya(JayaOptions),
    /// Genetic algorithm.
    Genetic(GeneticOptions),
    /// Random search.
    Random,
}

impl Method {
    /// Its name in flags and results.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::SteiglitzMcBride => "sm",
            Self::Gwo(_) => "gwo",
            Self::Jaya(_) => "jaya",
            Self::Genetic(_) => "ga",
            Self::Random => "random",
        }
    }

    /// All there are, with the settings that they have by themselves.
    #[must_use]
    pub fn all() -> [Self; 6] {
        let (gwo, jaya) = (GwoOptions::default(), JayaOptions::default());
        let genetic = GeneticOptions::default();
        [Self::Auto, Self::SteiglitzMcBride, Self::Gwo(gwo), Self::Jaya(jaya), Self::Genetic(genetic), Self::Random]
    }

    /// Changes a setting.
    ///
    /// # Errors
    /// `Usage` when the method has no such setting, or it cannot be this.
    pub fn set(&mut self, key: &str, value: &str) -> Result<()> {
        let number = || values::number(value, Setting::Set);
        match (self, key, value) {
            (Self::Gwo(gwo), "a-start", _) => gwo.a_start = number()?,
            (Self::Gwo(gwo), "a-end", _) => gwo.a_end = number()?,
            (Self::Jaya(jaya), "sharing", "generation") => jaya.sharing = Sharing::Generation,
            (Self::Jaya(jaya), "sharing", "agent") => jaya.sharing = Sharing::Agent,
            (Self::Jaya(jaya), "greedy", "true") => jaya.greedy = true,
            (Self::Jaya(jaya), "greedy", "false") => jaya.greedy = false,
            (Self::Genetic(genetic), "mutation", _) => genetic.mutation = number()?,
            (Self::Genetic(genetic), "pressure", _) => genetic.pressure = number()?,
            (Self::Genetic(genetic), "crossover", _) => genetic.crossover = number()?,
            (Self::Genetic(genetic), "elites", _) => {
                genetic.elites = value.parse().map_err(|_| {
                    let message = text!([Set](" elites=\"{}\" is no count", excerpt(value)));
                    Error::usage(message, "Give a whole number, 0 or more.")
                })?;
            }
            _ => {
                return Err(Error::usage(
                    text!([Set](" \"{}={}\" is no setting of this method", excerpt(key), excerpt(value))),
                    "gwo has a-start and a-end; jaya sharing=generation|agent and greedy=true|false; \
                     ga mutation, pressure, crossover and elites.",
                ));
            }
        }
        Ok(())
    }

    /// Whether it always searches with a population.
    #[must_use]
    pub fn is_search(&self) -> bool {
        !matches!(self, Self::Auto | Self::SteiglitzMcBride)
    }

    /// A new run of its population search; for `Auto` that of the Grey Wolf Optimizer.
    ///
    /// # Errors
    /// `Usage` for settings that cannot be, and for Steiglitz–McBride, which has no population.
    pub fn optimizer(&self, setup: Setup) -> Result<Box<dyn Optimizer>> {
        Ok(match *self {
            Self::Auto => Box::new(Gwo::new(setup, GwoOptions::default())?),
            Self::SteiglitzMcBride => {
                return Err(Error::usage("Steiglitz–McBride has no population", "Choose gwo, jaya, ga or random."));
            }
            Self::Gwo(options) => Box::new(Gwo::new(setup, options)?),
            Self::Jaya(options) => Box::new(Jaya::new(setup, options)?),
            Self::Genetic(options) => Box::new(Genetic::new(setup, options)?),
            Self::Random => Box::new(Random::new(setup)?),
        })
    }
}

/// How what was found is refined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Polish {
    /// Output-error Levenberg–Marquardt: the maximum-likelihood estimate with its standard errors.
    #[default]
    LevenbergMarquardt,
    /// Not at all.
    None,
}

impl Polish {
    /// All there are.
    pub const ALL: [Self; 2] = [Self::LevenbergMarquardt, Self::None];

    /// Its name in flags and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::LevenbergMarquardt => "lm",
            Self::None => "none",
        }
    }
}
