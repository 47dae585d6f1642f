//! Settings of an identification that results of all machines show.

use motorfit_evaluate::criterion::Criterion;
use motorfit_identify::model::ModelSpec;
use motorfit_identify::{IdentifySpec, Polish};

/// Requested method, budget and criterion of an identification.
#[derive(Debug, Clone, PartialEq)]
pub struct Requested {
    /// Name of the method.
    pub method: String,
    /// Name of the refinement.
    pub polish: &'static str,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of candidates in a population.
    pub population: usize,
    /// Number of generations.
    pub generations: usize,
    /// Criterion of the search.
    pub criterion: Criterion,
}

impl From<&IdentifySpec> for Requested {
    fn from(spec: &IdentifySpec) -> Self {
        let &IdentifySpec { population, generations, seed, criterion, polish, .. } = spec;
        Self { method: spec.method.name().to_owned(), polish: polish.name(), seed, population, generations, criterion }
    }
}

impl From<&ModelSpec> for Requested {
    fn from(spec: &ModelSpec) -> Self {
        let &ModelSpec { population, generations, seed, criterion, is_polished, .. } = spec;
        let polish = if is_polished { Polish::LevenbergMarquardt } else { Polish::None };
        Self { method: spec.method.name().to_owned(), polish: polish.name(), seed, population, generations, criterion }
    }
}
