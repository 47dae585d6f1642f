//! Runs without a population on one dataset, each fit made once whatever the factors that it does not depend on.

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

/// Method, polish, criterion and scale by their names, and the place of the extensions.
type Key = ([&'static str; 4], usize);

/// The fits of a dataset.
pub(super) struct Fits<'a> {
    sweep: &'a Sweep,
    recordings: Read,
    /// The problem of all linear fits for a model of the study, by its place.
    plain: BTreeMap<usize, Result<Problem>>,
    /// Steiglitz–McBride, by polish and model.
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
                // A search depends on its seed and budget, and an error may be one of a search.
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

    /// Steiglitz–McBride with its polish, at its cost in the run's criterion.
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
