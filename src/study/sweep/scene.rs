//! What a run is run on: a motor's recordings, read, prepared and perhaps with noise added.

use super::Sweep;
use super::line::{Outcome, Stop};
use super::manifest::{Job, Motor};
use crate::criterion::Noise;
use crate::estimate::fit_problem;
use crate::evaluate::{Problem, Scalar};
use crate::experiment::{noise_of, with_noise};
use crate::identify::{
    DeviceSpec, Fitted, IdentifySpec, Method, Polish, check, fit_on, identify, needs_voltage, search_space,
};
use crate::record::{Record, Severity};
use crate::{Error, Result};
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The recordings of a motor, or why there are none.
pub(super) type Read = std::result::Result<Arc<Vec<Record>>, Error>;

impl Sweep {
    /// Reads the recordings of a motor; they must be those that were planned.
    pub(super) fn read(&self, motor: usize) -> Read {
        let Motor { files, .. } = &self.manifest.motors[motor];
        let mut records = Vec::new();
        for file in files {
            let path = self.manifest.file(file);
            let read = self.study().reading.records(&path)?;
            let digest = read.first().and_then(|record| record.source().sha256.clone());
            if file.sha256.is_none() || digest != file.sha256 {
                let message = match file.sha256 {
                    None => "could not be read when the sweep was planned",
                    Some(_) => "has changed since the sweep was planned",
                };
                return Err(Error::data(message, "Plan the study again in a new folder, or bring the file back.")
                    .in_file(&path));
            }
            records.extend(read);
        }
        needs_voltage(&records)?;
        Ok(Arc::new(records))
    }

    /// The same with noise added: the same for every method, drawn by the seed and the recording.
    pub(super) fn with_noise(&self, records: &Read, noise: usize, seed: u64) -> Read {
        let Some(noise) = self.study().noise[noise].noise else { return records.clone() };
        let records = records.clone()?;
        let noisy =
            |(n, record): (usize, &Record)| with_noise(record, noise_of(record, noise), key(record, n, noise, seed));
        Ok(Arc::new(records.iter().enumerate().map(noisy).collect::<Result<_>>()?))
    }
}

/// The seed of a recording's noise: of another recording, another.
fn key(record: &Record, place: usize, noise: Noise, seed: u64) -> u64 {
    let digest = record.source().sha256.as_deref().unwrap_or_default();
    let digest = Sha256::digest(format!("{seed} {digest} {place} {noise:?}"));
    digest.iter().take(8).fold(0, |key, byte| (key << 8) | u64::from(*byte))
}

/// Fits without a search, each done once whatever the factors that it does not depend on.
pub(super) struct Direct<'a> {
    sweep: &'a Sweep,
    records: Read,
    /// The problem of all fits.
    plain: Option<Result<Problem>>,
    fits: BTreeMap<&'static str, Result<Fitted>>,
    outcomes: BTreeMap<[&'static str; 4], Outcome>,
}

impl<'a> Direct<'a> {
    pub(super) fn new(sweep: &'a Sweep, records: Read) -> Self {
        Self { sweep, records, plain: None, fits: BTreeMap::new(), outcomes: BTreeMap::new() }
    }

    /// What a run finds.
    pub(super) fn outcome(&mut self, job: &Job) -> Outcome {
        let f = &job.factors;
        let key = [f.method.name(), f.polish.name(), f.criterion.name(), f.scale.name()];
        if let Some(known) = self.outcomes.get(&key) {
            return known.clone();
        }
        let spec = self.sweep.study().spec(f);
        let (outcome, is_fixed) = match self.records.clone() {
            Err(error) => (Err(error), true),
            Ok(records) if f.method == Method::Auto => match whole(&records, &spec) {
                // A search depends on its seed and budget.
                Ok((outcome, searched)) => (Ok(outcome), !searched),
                Err(error) => (Err(error), false),
            },
            Ok(records) => (self.fitted(&records, &spec), true),
        };
        let outcome = outcome.unwrap_or_else(|error| self.sweep.failed(&error));
        if is_fixed {
            self.outcomes.insert(key, outcome.clone());
        }
        outcome
    }

    /// Steiglitz–McBride with its polish, at its cost in the run's criterion.
    fn fitted(&mut self, records: &[Record], spec: &IdentifySpec) -> Result<Outcome> {
        let problem = Problem::new(records, spec.model, spec.space.clone(), spec.criterion)?;
        check(records, spec, &problem)?;
        let make = || fit_problem(records, &spec.space, spec.model);
        let plain = self.plain.get_or_insert_with(make).as_ref().map_err(Clone::clone)?;
        let fitted = self.fits.entry(spec.polish.name()).or_insert_with(|| fit_on(plain, records, spec)).clone()?;
        outcome(&problem, &fitted).map(|outcome| Outcome { evaluations: fitted.iterations as u64, ..outcome })
    }
}

/// A fit at its cost on a problem of the same recordings.
pub(super) fn outcome(problem: &Problem, fitted: &Fitted) -> Result<Outcome> {
    let problem = problem.with_space(fitted.space.clone());
    let problem = match &fitted.initial {
        Some(initial) => problem.starting_from(initial),
        None => problem,
    };
    let cost = Scalar::cost(&problem, &fitted.values);
    Ok(Outcome::found(&fitted.parameters, cost, 0, Stop::Converged).with_fit(fitted))
}

/// The main job, with its verification and diagnoses, and whether it searched.
fn whole(records: &[Record], spec: &IdentifySpec) -> Result<(Outcome, bool)> {
    let found = identify(records, &IdentifySpec { device: DeviceSpec::Cpu, ..spec.clone() })?;
    let fitted = Fitted {
        parameters: found.parameters,
        values: found.space.free().iter().map(|axis| found.parameters.get(axis.parameter)).collect(),
        at_bound: found.space.free().iter().map(|axis| found.at_bound(axis.parameter)).collect(),
        space: found.space.clone(),
        initial: None,
        uncertainty: found.uncertainty.clone(),
        fit_percent: found.fit_percent,
        iterations: 0,
        warnings: found.warnings.iter().filter(|w| w.severity == Severity::Report).map(|w| w.code).collect(),
    };
    let stop = if found.searched.method == "sm" { Stop::Converged } else { Stop::BudgetSpent };
    let outcome = Outcome::found(&found.parameters, found.cost, found.evaluations, stop).with_fit(&fitted);
    Ok((outcome, found.searched.method != "sm"))
}

/// The problem that a search is run on.
pub(super) fn problem(records: &[Record], spec: &IdentifySpec) -> Result<Problem> {
    let space = search_space(records, spec)?;
    let problem = Problem::new(records, spec.model, space, spec.criterion)?;
    check(records, &IdentifySpec { polish: Polish::None, ..spec.clone() }, &problem)?;
    Ok(problem)
}
