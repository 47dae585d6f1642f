//! Evaluators of populations of models.

use super::problem::ModelProblem;
use crate::{Evaluator, Simd};
use motorfit_core::Result;
use motorfit_core::candidates::Candidates;

/// Evaluates populations of candidates of a model.
pub trait ModelEvaluator: Send {
    /// Evaluates candidates, shape `[candidates, free parameters]`, and writes their costs, shape `[candidates]`. A candidate that
    /// diverges has the cost +∞.
    ///
    /// # Errors
    /// Returns `Usage` if the lengths do not match, and a device error if the device fails.
    fn costs(&mut self, problem: &ModelProblem, candidates: Candidates<'_>, costs: &mut [f64]) -> Result<()>;

    /// Returns the name of the device.
    fn name(&self) -> String;

    /// Returns the precision of the evaluation, `f32` or `f64`.
    fn precision(&self) -> &'static str;

    /// Returns the kind of the device: `cpu`, or that of an adapter.
    fn kind(&self) -> &'static str {
        "cpu"
    }

    /// Returns the graphics interface and the driver of an adapter; `None` for a CPU.
    fn driver(&self) -> Option<(String, String)> {
        None
    }
}

/// The SIMD evaluator on all threads of the caller's rayon pool, in f64.
#[derive(Debug, Clone, Copy, Default)]
pub struct ModelSimd;

impl ModelEvaluator for ModelSimd {
    fn costs(&mut self, problem: &ModelProblem, candidates: Candidates<'_>, costs: &mut [f64]) -> Result<()> {
        problem.costs(candidates, costs)
    }

    fn name(&self) -> String {
        Evaluator::name(&Simd::default())
    }

    fn precision(&self) -> &'static str {
        "f64"
    }
}
