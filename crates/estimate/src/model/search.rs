//! State of a search for the lowest optimum, and the evidence that it is the lowest.

use super::ends::End;
use crate::fitted::Fitted as _;
use motorfit_core::numeric::rms;
use motorfit_evaluate::model::ModelProblem;

/// Starts over the bounds that must reach the lowest optimum.
#[doc(hidden)]
pub const ARRIVALS: usize = 3;

/// A search: the lowest end from each start that has one.
pub(super) struct Search<'a> {
    pub problem: &'a ModelProblem,
    pub seed: u64,
    pub ends: Vec<End>,
    pub evaluations: u64,
}

impl<'a> Search<'a> {
    pub fn new(problem: &'a ModelProblem, seed: u64) -> Self {
        Self { problem, seed, ends: Vec::new(), evaluations: 0 }
    }

    pub fn lowest(&self) -> Option<&End> {
        self.ends.iter().min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// Returns the ends of starts over the bounds. A given start may be the optimum of another search, and is no evidence.
    fn spread(&self) -> impl Iterator<Item = &End> {
        self.ends.iter().filter(|end| !end.at.is_given)
    }

    /// Returns the number of starts over the bounds that have an end: the model may diverge from others.
    pub fn starts(&self) -> usize {
        self.spread().count()
    }

    /// Returns the number of those from which the lowest cost was reached.
    pub fn arrivals(&self) -> usize {
        self.lowest().map_or(0, |lowest| self.spread().filter(|end| self.is_same(end, lowest)).count())
    }

    /// Returns true if an end has the cost of another.
    pub fn is_same(&self, end: &End, other: &End) -> bool {
        end.is_at(other.cost, self.problem.counted())
    }

    /// Returns true if enough starts reached the lowest optimum, or there is nothing to search.
    pub fn is_conclusive(&self) -> bool {
        self.problem.space().free.is_empty() || self.arrivals() >= ARRIVALS
    }

    /// Returns true if the lowest optimum leaves no more than noise of every output. Many descents may end in one that does not: on a
    /// plateau, where an effect does not act.
    pub fn explains(&self) -> bool {
        let Some(End { at, .. }) = self.lowest() else { return false };
        (0..self.problem.recordings()).all(|recording| {
            let residuals = self.problem.residuals(&at.values, recording, &at.initial[recording]);
            let is_noise =
                |(output, of): (usize, &Vec<f64>)| !self.problem.is_above_noise((recording, output), rms(of));
            residuals.iter().enumerate().all(is_noise)
        })
    }
}
