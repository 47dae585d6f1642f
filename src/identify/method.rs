//! How the optimum is found and refined.

use crate::optimize::{Genetic, GeneticOptions, Gwo, GwoOptions, Jaya, JayaOptions, Optimizer, Random, Setup};
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
    /// Its name in flags and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::LevenbergMarquardt => "lm",
            Self::None => "none",
        }
    }
}
