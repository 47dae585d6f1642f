//! The problem of a user's model as searches see it.

use super::problem::ModelProblem;
use super::space::ModelAxis;
use crate::criterion::Criterion;
use crate::search_problem::SearchProblem;
use motorfit_core::candidates::Candidates;
use motorfit_core::coordinate::Coordinate;
use motorfit_model::Model;

/// Operations of a step of the linear motor.
const OPERATIONS: usize = 8;

impl SearchProblem for ModelProblem {
    fn names(&self) -> Vec<String> {
        self.space().names(self.model())
    }

    fn axes(&self) -> Vec<Coordinate> {
        self.space().free.iter().map(ModelAxis::range).collect()
    }

    fn width(&self) -> usize {
        self.space().free.len()
    }

    fn criterion(&self) -> &Criterion {
        self.criterion()
    }

    fn steps(&self) -> usize {
        let samples: usize = (0..self.recordings()).map(|n| self.recording(n).len()).sum();
        samples.saturating_mul((self.work() / OPERATIONS).max(1))
    }

    fn cost_of(&self, candidate: &[f64]) -> f64 {
        let mut cost = [f64::INFINITY];
        // A candidate of another length has no cost.
        let _ = self.costs(Candidates::new(candidate, candidate.len().max(1)), &mut cost);
        cost[0]
    }

    fn user_model(&self) -> Option<&Model> {
        Some(self.model())
    }
}
