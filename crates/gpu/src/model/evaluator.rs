//! The evaluator of models on one adapter.

use super::super::device::{AdapterFacts, Device, Selector, caught};
use super::super::sums::TASK;
use super::check::check;
use super::loaded::Loaded;
use motorfit_core::candidates::Candidates;
use motorfit_core::{ErrorKind, Result};
use motorfit_evaluate::model::{ModelEvaluator, ModelProblem};
use motorfit_model::wgsl::ShaderPrecision;
use rayon::prelude::*;

/// Evaluates populations of models on a GPU. Problems with moving averages, with delays on an irregular clock, or with delayed signals that
/// depend on other delayed signals are evaluated on the CPU, and those whose candidates all diverge at once, so that their shader cannot be
/// checked.
pub struct ModelGpu {
    device: Device,
    precision: ShaderPrecision,
    /// The problem that was evaluated last; without units if shaders cannot evaluate it.
    last: Option<(u64, Option<Loaded>)>,
}

impl ModelGpu {
    /// Opens an adapter. A `precision` of `None` uses f64 if the device has it.
    ///
    /// # Errors
    /// Returns a device error if there is no matching adapter, or it lacks the requested f64 or cannot be opened.
    pub fn open(selector: &Selector, precision: Option<ShaderPrecision>) -> Result<Self> {
        let device = Device::open(selector, precision == Some(ShaderPrecision::F64))?;
        let usual = if device.facts.f64 { ShaderPrecision::F64 } else { ShaderPrecision::F32 };
        Ok(Self { device, precision: precision.unwrap_or(usual), last: None })
    }

    /// Returns the properties of the adapter.
    #[must_use]
    pub fn facts(&self) -> &AdapterFacts {
        &self.device.facts
    }

    /// Returns true if shaders can evaluate a problem. Puts it on the device, and compares the shaders with the graph of the model.
    ///
    /// # Errors
    /// Returns a device error if the device fails or computes wrongly.
    pub fn serves(&mut self, problem: &ModelProblem) -> Result<bool> {
        self.guard(|gpu| gpu.load(problem))?;
        Ok(self.last.as_ref().is_some_and(|(_, loaded)| loaded.is_some()))
    }

    #[cfg(test)]
    pub(super) fn device(&self) -> &Device {
        &self.device
    }

    fn load(&mut self, problem: &ModelProblem) -> Result<()> {
        if self.last.as_ref().is_some_and(|(number, _)| *number == problem.number()) {
            return Ok(());
        }
        self.last = None;
        let mut loaded = Loaded::new(&self.device, problem, self.precision)?;
        let is_checked = match &mut loaded {
            Some(loaded) => check(&self.device, loaded, problem, self.precision)?,
            None => false,
        };
        self.last = Some((problem.number(), loaded.filter(|_| is_checked)));
        Ok(())
    }

    /// Evaluates candidates and adds their sums to the totals.
    fn evaluate(&mut self, problem: &ModelProblem, candidates: Candidates<'_>, totals: &mut [f64]) -> Result<()> {
        let Some((_, Some(loaded))) = &mut self.last else { return Ok(()) };
        let most = loaded.candidates_max(&self.device);
        for (chunk, totals) in totals.chunks_mut(most).enumerate() {
            let rows: Vec<&[f64]> = (0..totals.len()).map(|n| candidates.row(chunk * most + n)).collect();
            for recording in 0..problem.recordings() {
                let sums = loaded.sums(&self.device, problem, (recording, usize::MAX), &rows)?;
                let factors = problem.prepared(recording).1.factors.iter().filter(|factor| **factor > 0.0);
                for (sums, factor) in sums.iter().zip(factors) {
                    totals.iter_mut().zip(sums).for_each(|(total, sum)| *total += factor * sum);
                }
            }
        }
        Ok(())
    }

    /// Runs `work`, also if it panics. After a device error nothing on the device is used again.
    fn guard<T>(&mut self, work: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        let facts = self.device.facts.clone();
        let done = caught(&facts, || work(self));
        if done.as_ref().is_err_and(|e| e.kind() == ErrorKind::Device) {
            self.last = None;
        }
        done
    }
}

impl ModelEvaluator for ModelGpu {
    fn costs(&mut self, problem: &ModelProblem, candidates: Candidates<'_>, costs: &mut [f64]) -> Result<()> {
        problem.check_candidates(&candidates, costs)?;
        if !self.serves(problem)? {
            return problem.costs(candidates, costs);
        }
        costs.fill(0.0);
        self.guard(|gpu| gpu.evaluate(problem, candidates, costs))?;
        let samples = (0..problem.recordings()).map(|n| problem.recording(n).count_most()).sum();
        costs.par_iter_mut().enumerate().with_min_len(TASK).for_each(|(row, cost)| {
            // Shaders do not keep NaN.
            let is_number = candidates.row(row).iter().all(|value| !value.is_nan());
            *cost = if is_number { problem.criterion().cost(*cost, samples) } else { f64::INFINITY };
        });
        Ok(())
    }

    fn name(&self) -> String {
        format!("{} ({})", self.device.facts.name, self.device.facts.backend)
    }

    fn precision(&self) -> &'static str {
        self.precision.name()
    }

    fn kind(&self) -> &'static str {
        self.device.facts.kind
    }

    fn driver(&self) -> Option<(String, String)> {
        Some((self.device.facts.backend.clone(), self.device.facts.driver.clone()))
    }
}
