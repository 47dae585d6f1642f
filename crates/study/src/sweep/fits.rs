//! Runs without a population search on one dataset. A fit is computed once for all levels of the factors that it does
//! not depend on.

use super::dataset::{Dataset, Read, Recordings, Sets, of_model};
use super::line::Outcome;
use super::planned::Sweep;
use super::runs::Job;
use motorfit_core::Result;
use motorfit_estimate::fit_problem;
use motorfit_evaluate::Problem;
use motorfit_identify::device::DeviceSpec;
use motorfit_identify::model::{hold_out_model, identify_model};
use motorfit_identify::{Identification, IdentifySpec, Method, fit_on, has_all_channels, identify, with_cost_on};
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Names of method, polish, criterion and scale, and the index of the machine.
type Key = ([&'static str; 4], usize);

/// Fits of a dataset.
pub(super) struct Fits<'a> {
    sweep: &'a Sweep,
    sets: &'a Sets,
    dataset: Dataset,
    /// Recordings of the DC motor with the noise of the dataset.
    recordings: OnceCell<Read>,
    /// Problem of the linear fits, by index of the model.
    plain: BTreeMap<usize, Result<Problem>>,
    /// Estimates of Steiglitz–McBride, by polish and index of the model.
    linear: BTreeMap<(&'static str, usize), Result<Identification>>,
    outcomes: BTreeMap<Key, Outcome>,
}

impl<'a> Fits<'a> {
    pub(super) fn new(sweep: &'a Sweep, sets: &'a Sets, dataset: Dataset) -> Self {
        let recordings = OnceCell::new();
        Self {
            sweep,
            sets,
            dataset,
            recordings,
            plain: BTreeMap::new(),
            linear: BTreeMap::new(),
            outcomes: BTreeMap::new(),
        }
    }

    fn recordings(&self) -> Read {
        self.recordings.get_or_init(|| self.sweep.with_noise(self.sets, self.dataset)).clone()
    }

    /// Returns the result of a run.
    pub(super) fn outcome(&mut self, job: &Job) -> Outcome {
        let f = &job.factors;
        let key = ([f.method.name(), f.polish.name(), f.criterion.name(), f.scale.name()], f.machine);
        if let Some(known) = self.outcomes.get(&key) {
            return known.clone();
        }
        if self.sweep.study().machine(f).model.is_some() {
            return self.of_model(job).unwrap_or_else(|error| self.sweep.failed(&error));
        }
        let spec = self.sweep.study().spec(f);
        let (found, is_fixed) = match self.recordings() {
            Err(error) => (Err(error), true),
            Ok(of) if f.method == Method::Auto || spec.is_extended() || !has_all_channels(&of.fitted) => {
                let found = identify(&of.fitted, &IdentifySpec { device: DeviceSpec::Cpu, ..spec.clone() });
                // A search depends on its seed and budget, and an error may come from a search.
                let is_fixed = found.as_ref().is_ok_and(|found| !found.searched.has_population);
                (found.and_then(|found| of.validated(found, &spec)), is_fixed)
            }
            Ok(of) => (self.linear(&of, &spec, f.machine), true),
        };
        let outcome = found
            .map_or_else(|error| self.sweep.failed(&error), |found| Outcome::of(&found, &self.sweep.study().limits));
        if is_fixed {
            self.outcomes.insert(key, outcome.clone());
        }
        outcome
    }

    /// Identifies a model. Its search depends on the seed, so that each run has its own.
    fn of_model(&self, job: &Job) -> Result<Outcome> {
        let Some((level, spec)) = self.sweep.study().model(&job.factors) else { return Ok(Outcome::default()) };
        let recordings = self.sweep.recordings_of(self.sets, self.dataset.motor, level.number)?;
        let noise = self.sweep.study().noise[self.dataset.noise].noise;
        let [fitted, held_out] = of_model(&recordings, level, (noise, self.dataset.seed))?;
        let mut found = identify_model(&level.model, &fitted, &spec, &mut |_| ControlFlow::Continue(()))?;
        hold_out_model(&mut found, &fitted, &held_out, &spec)?;
        Ok(Outcome::of_model(&found, &self.sweep.study().limits))
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
