//! The problem of the DC motor as searches see it.

use super::problem::Problem;
use super::scalar::Scalar;
use super::search_problem::{CandidateValue, SearchProblem};
use super::simd::Simd;
use crate::criterion::Criterion;
use motorfit_core::coordinate::Coordinate;
use motorfit_motor::{Parameter, Scope};

impl SearchProblem for Problem {
    fn names(&self) -> Vec<String> {
        self.space().free().iter().map(|axis| axis.scope.name(axis.parameter)).collect()
    }

    fn axes(&self) -> Vec<Coordinate> {
        self.space().free().iter().map(|axis| Coordinate { is_logarithmic: false, ..axis.range() }).collect()
    }

    fn width(&self) -> usize {
        self.space().free().len()
    }

    fn criterion(&self) -> &Criterion {
        self.criterion()
    }

    fn steps(&self) -> usize {
        self.active()
    }

    fn cost_of(&self, candidate: &[f64]) -> f64 {
        Scalar::cost(self, candidate)
    }

    fn is_small(&self, candidates: usize) -> bool {
        Simd::is_small(self, candidates)
    }

    /// Returns the values of all parameters, fixed ones included.
    fn values_of(&self, candidate: &[f64]) -> Vec<(String, CandidateValue)> {
        let space = self.space();
        let extensions = space.free().iter().map(|axis| axis.parameter).chain(space.fixed().iter().map(|(p, _, _)| *p));
        let all = Parameter::ALL.into_iter().chain(extensions.filter(|p| p.is_extension()));
        let value = |p: Parameter| {
            let is_own = |scope: Scope| matches!(scope, Scope::Recording(_));
            let is_own = space.free().iter().any(|axis| axis.parameter == p && is_own(axis.scope));
            let of = |recording| self.motor(candidate, recording).get(p);
            let value = match is_own {
                true => CandidateValue::OfRecordings((0..self.signals().len()).map(of).collect()),
                false => CandidateValue::Shared(of(0)),
            };
            (p.symbol().to_owned(), value)
        };
        all.map(value).collect()
    }
}
