//! Programs of a step.

use crate::affine::AffineProgram;
use motorfit_core::{Error, Result};
use motorfit_model::Model;
use motorfit_model::program::{Program, Roots, compile};
use motorfit_model::step::{Step, StepSettings};

/// Programs of a step: the step itself, the entries of its matrices, and both with derivatives.
#[derive(Debug, Clone)]
pub struct Programs {
    pub step: Step,
    /// Number of substeps.
    pub substeps: usize,
    pub program: Program,
    pub matrices: Option<Program>,
    /// The step for the kernel of affine models, if it suits.
    pub(crate) affine: Option<AffineProgram>,
    pub tangent: Program,
    pub tangent_matrices: Option<Program>,
}

impl Programs {
    pub fn new(model: &Model, settings: &StepSettings) -> Result<Self> {
        let too_large = || {
            let message = format!("the step of the model {} needs too many registers", model.name());
            Error::data(
                message,
                "Leave out states or functions, or record at a higher rate so that fewer substeps are needed.",
            )
        };
        let mut step = Step::new(model, settings);
        let mut tangent = step.with_tangents();
        let compiled = |step: &mut Step| {
            let Step { graph, next, milestones, outputs, initial, memories, .. } = step;
            compile(graph, &Roots { next, milestones, initial, outputs, results: &[], memories }).ok_or_else(too_large)
        };
        let matrices = |step: &mut Step, with_rates: bool| {
            let Some(extras) = step.extras.clone() else { return Ok(None) };
            let mut roots = extras.roots;
            if with_rates {
                roots.extend(step.rates_of(&roots.clone()));
            }
            let only = Roots { next: &[], milestones: &[], initial: &[], outputs: &[], results: &roots, memories: &[] };
            compile(&mut step.graph, &only).map(Some).ok_or_else(too_large)
        };
        Ok(Self {
            program: compiled(&mut step)?,
            matrices: matrices(&mut step, false)?,
            affine: AffineProgram::new(&mut step, model, settings),
            tangent: compiled(&mut tangent)?,
            tangent_matrices: matrices(&mut tangent, true)?,
            substeps: settings.substeps.max(1),
            step,
        })
    }
}
