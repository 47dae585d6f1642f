//! The GPU evaluator of users' models.

use super::evaluator::Gpu;
use super::sums::TASK;
use super::variant::Precision;
use motorfit_core::Result;
use motorfit_core::candidates::Candidates;
use motorfit_evaluate::model::ModelProblem;
use motorfit_evaluate::{Batch, Evaluator};
use motorfit_model::wgsl::ShaderPrecision;
use rayon::prelude::*;

/// Returns the precision of the shader of a model.
fn of_shader(precision: Precision) -> ShaderPrecision {
    if precision == Precision::F64 { ShaderPrecision::F64 } else { ShaderPrecision::F32 }
}

impl Gpu {
    /// Returns true if shaders can evaluate a problem of a model. The CPU evaluates those with moving averages, with delays on an irregular
    /// clock, or with delayed signals that depend on other delayed signals, and those whose candidates all diverge at once, so that their
    /// shader cannot be checked.
    ///
    /// # Errors
    /// Returns a device error if the device fails or computes wrongly.
    pub fn serves_model(&mut self, problem: &ModelProblem) -> Result<bool> {
        let precision = of_shader(self.precision);
        self.guard(|gpu| Ok(gpu.models.get(&gpu.device, problem, precision)?.is_some()))
    }

    /// Evaluates candidates of a model.
    fn costs_of_model(&mut self, problem: &ModelProblem, candidates: Candidates<'_>, costs: &mut [f64]) -> Result<()> {
        let precision = of_shader(self.precision);
        costs.fill(0.0);
        let is_served = self.guard(|Self { device, models, .. }| {
            let Some(loaded) = models.get(device, problem, precision)? else { return Ok(false) };
            let most = loaded.candidates_max(device);
            for (chunk, totals) in costs.chunks_mut(most).enumerate() {
                let rows: Vec<&[f64]> = (0..totals.len()).map(|n| candidates.row(chunk * most + n)).collect();
                for recording in 0..problem.recordings() {
                    let sums = loaded.sums(device, problem, (recording, usize::MAX), &rows)?;
                    let factors = problem.prepared(recording).1.factors.iter().filter(|factor| **factor > 0.0);
                    for (sums, factor) in sums.iter().zip(factors) {
                        totals.iter_mut().zip(sums).for_each(|(total, sum)| *total += factor * sum);
                    }
                }
            }
            Ok(true)
        })?;
        if !is_served {
            return problem.costs(candidates, costs);
        }
        let samples = (0..problem.recordings()).map(|n| problem.recording(n).count_most()).sum();
        costs.par_iter_mut().enumerate().with_min_len(TASK).for_each(|(row, cost)| {
            // Shaders do not keep NaN.
            let is_number = candidates.row(row).iter().all(|value| !value.is_nan());
            *cost = if is_number { problem.criterion().cost(*cost, samples) } else { f64::INFINITY };
        });
        Ok(())
    }
}

impl Evaluator<ModelProblem> for Gpu {
    fn evaluate(&mut self, batch: &Batch<'_, ModelProblem>, costs: &mut [f64]) -> Result<()> {
        batch.check(costs)?;
        let mut rest = costs;
        for group in batch.groups {
            let (own, others) = rest.split_at_mut(group.candidates.count());
            self.costs_of_model(group.problem, group.candidates, own)?;
            rest = others;
        }
        Ok(())
    }

    fn is_exact(&self) -> bool {
        self.precision == Precision::F64
    }

    fn name(&self) -> String {
        Self::name(self)
    }
}
