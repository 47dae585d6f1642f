//! Runs without a population search on one dataset. A fit is computed once for all levels of the factors that it does
//! not depend on.

use super::Sweep;
use super::dataset::{Read, Recordings};
use super::line::Outcome;
use super::runs::Job;
use crate::Result;
use crate::device::DeviceSpec;
use crate::estimate::fit_problem;
use crate::evaluate::Problem;
use crate::identify::{Identification, IdentifySpec, Method, fit_on, has_all_channels, identify, with_cost_on};
use std::collections::BTreeMap;

/// Names of method, polish, criterion and scale, and the index of the model.
type Key = ([&'static str; 4], usize);

/// Fits of a dataset.
pub(super) struct Fits<'a> {
    sweep: &'a Sweep,
    recordings: Read,
    /// Problem of the linear fits, by index of the model.
    plain: BTreeMap<usize, Result<Problem>>,
    /// Estimates of Steiglitz–McBride, by polish and index of the model.
    linear: BTreeMap<(&'static str, usize), Result<Identification>>,
    outcomes: BTreeMap<Key, Outcome>,
}

impl<'a> Fits<'a> {
    pub(super) fn new(sweep: &'a Sweep, recordings: Read) -> Self {
        Self { sweep, recordings, plain: BTreeMap::new(), linear: BTreeMap::new(), outcomes: BTreeMap::new() }
    }

    /// Returns the result of a run.
    pub(super) fn outcome(&mut self, job: &Job) -> Outcome {
        let f = &job.factors;
        let key = ([f.method.name(), f.polish.name(), f.criterion.name(), f.scale.name()], f.with);
        if let Some(known) = self.outcomes.get(&key) {
            return known.clone();
        }
        let spec = self.sweep.study().spec(f);
        let (found, is_fixed) = match self.recordings.clone() {
            Err(error) => (Err(error), true),
            Ok(of) if f.method == Method::Auto || spec.is_extended() || !has_all_channels(&of.fitted) => {
                let found = identify(&of.fitted, &IdentifySpec { device: DeviceSpec::Cpu, ..spec.clone() });
                // A search depends on its seed and budget, and an error may come from a search.
                let is_fixed = found.as_ref().is_ok_and(|found| !found.searched.has_population);
                (found.and_then(|found| of.validated(found, &spec)), is_fixed)
            }
            Ok(of) => (self.linear(&of, &spec, f.with), true),
        };
        let outcome = found.map_or_else(|error| self.sweep.failed(&error), |found| Outcome::of(&found));
        if is_fixed {
            self.outcomes.insert(key, outcome.clone());
        }
        outcome
    }

    /// Returns the Steiglitz–McBride estimate after the polish, with its cost in the criterion of the run.
    fn linear(&mut self, of: &Recordings, spec: &IdentifySpec, with: usize) -> Result<Identification> {
        let records = &of.fitted;
        let problem = Problem::new(records, spec.model, spec.space.clone(), spec.criterion)?;
        let make = || fit_problem(records, &spec.space, spec.model);
        let plain = self.plain.entry(with).or_insert_with(make).as_ref().map_err(Clone::clone)?;
        let fit = || of.validated(fit_on((&problem, plain), of.diagnosed(), spec)?, spec);
        let fitted = self.linear.entry((spec.polish.name(), with)).or_insert_with(fit).as_ref();
        fitted.map(|found| with_cost_on(&problem, found)).map_err(Clone::clone)
    }
}
