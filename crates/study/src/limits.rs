//! Limits of studies, comparisons and benchmarks.

use super::{compare, sweep, throughput};
use motorfit_core::limit::{Limit, limit_of};
use motorfit_record::SAMPLES_MAX;

/// Returns the limits of studies, comparisons and benchmarks.
#[must_use]
pub fn limits() -> Vec<Limit> {
    let limits = [
        limit_of("runs of each method of a comparison", compare::RUNS_MAX, "refused"),
        limit_of("candidates of a population of a benchmark", throughput::POPULATION_MAX, "refused"),
        limit_of("samples of a benchmark", SAMPLES_MAX, "refused"),
    ];
    sweep::LIMITS.into_iter().chain(limits).collect()
}
