//! A problem as searches and evaluators see it, of any machine.

use crate::criterion::Criterion;
use motorfit_core::coordinate::Coordinate;
use motorfit_model::Model;

/// Values of a parameter in a candidate.
#[derive(Debug, Clone, PartialEq)]
pub enum CandidateValue {
    /// The value in all recordings.
    Shared(f64),
    /// A value for each recording.
    OfRecordings(Vec<f64>),
}

/// A problem whose candidates are evaluated: the parameters of a machine that are free, and a criterion. The DC motor and users' models
/// implement it.
pub trait SearchProblem: Send + Sync + 'static {
    /// Returns the names of the free parameters, as `R`, or `R[0]` for that of the first recording.
    fn names(&self) -> Vec<String>;

    /// Returns the bounds of the free parameters, each with the coordinate in which candidates are spread over them.
    fn axes(&self) -> Vec<Coordinate>;

    /// Returns the number of free parameters, which is that of the values of a candidate.
    fn width(&self) -> usize;

    /// Returns the criterion.
    fn criterion(&self) -> &Criterion;

    /// Returns the number of steps of the linear motor that take the CPU as long as the evaluation of a candidate.
    fn steps(&self) -> usize;

    /// Returns the cost of a candidate, computed in f64; +∞ for one that diverges.
    fn cost_of(&self, candidate: &[f64]) -> f64;

    /// Returns true if the evaluation of so many candidates takes less time than waking the threads of a pool.
    fn is_small(&self, _candidates: usize) -> bool {
        false
    }

    /// Returns the model of a user; `None` for the DC motor.
    fn user_model(&self) -> Option<&Model> {
        None
    }

    /// Returns the values of a candidate by the names of the parameters.
    fn values_of(&self, candidate: &[f64]) -> Vec<(String, CandidateValue)> {
        let values = candidate.iter().copied().map(CandidateValue::Shared);
        self.names().into_iter().zip(values).collect()
    }

    /// Returns the bounds of the free parameters.
    fn bounds(&self) -> Vec<(f64, f64)> {
        self.axes().iter().map(|axis| (axis.min, axis.max)).collect()
    }
}
