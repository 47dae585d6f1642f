//! A model on recordings: programs, rows, costs of candidates.

use super::method::ModelMethod;
use super::prepared::input;
use super::prepared::{Prepared, Statistics, prepare};
use super::programs::Programs;
use super::recording::ModelRecording;
use super::space::ModelSpace;
use crate::affine::AffineJob;
use crate::criterion::Criterion;
use crate::interpreter::{Job, Loss, Register, Rows, RunProgram as _, Work};
use motorfit_core::candidates::Candidates;
use motorfit_core::{Error, Result};
use motorfit_model::graph::Leaf;
use motorfit_model::step::StepSettings;
use motorfit_model::{IntegrationMethod, Model};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Settings of a problem.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ModelSettings {
    /// Criterion of a search.
    pub criterion: Criterion,
    /// True if inputs are linear between samples, false if they are constant.
    pub is_first_order_hold: bool,
    /// Integration method and number of substeps; `None` chooses them.
    pub method: Option<(IntegrationMethod, usize)>,
    /// True if states that are measured or free start as they are measured, or from zero; false if a fit estimates their initial values.
    pub has_known_initial: bool,
}

/// Lanes of a block of candidates.
const PARTS: usize = 8;
/// The number of candidates of a block, a lane each.
#[doc(hidden)]
pub const LANES: usize = Register::<PARTS>::LANES;

/// The next number of a problem.
static NUMBERS: AtomicU64 = AtomicU64::new(0);

/// A model on one or more recordings.
#[derive(Debug, Clone)]
pub struct ModelProblem {
    /// Number of the problem in this process; copies have the same.
    pub(super) number: u64,
    pub(super) model: Model,
    pub(super) space: ModelSpace,
    pub(super) settings: ModelSettings,
    pub(super) method: ModelMethod,
    pub(super) programs: Vec<Programs>,
    pub(super) recordings: Vec<Prepared>,
}

impl ModelProblem {
    /// Makes a problem with an integration method; the signals of the recordings fit the model.
    pub(super) fn with_method(
        model: &Model,
        space: ModelSpace,
        recordings: Vec<ModelRecording>,
        (settings, method): (ModelSettings, ModelMethod),
    ) -> Result<Self> {
        let mut steps: Vec<Option<u64>> = Vec::new();
        let (mut programs, mut prepared): (Vec<Programs>, Vec<Prepared>) = (Vec::new(), Vec::new());
        for recording in recordings {
            let step_s = recording.regular_step_s();
            let known = steps.iter().position(|known| *known == step_s.map(f64::to_bits));
            let index = match known {
                Some(index) => index,
                None => {
                    let is_first_order_hold = settings.is_first_order_hold;
                    let (method, substeps) = (method.method, method.substeps);
                    programs
                        .push(Programs::new(model, &StepSettings { method, substeps, step_s, is_first_order_hold })?);
                    steps.push(step_s.map(f64::to_bits));
                    programs.len() - 1
                }
            };
            prepared.push(prepare(model, recording, (&programs[index], index), &settings.criterion));
        }
        Ok(Self {
            number: NUMBERS.fetch_add(1, Ordering::Relaxed),
            model: model.clone(),
            space,
            settings,
            method,
            programs,
            recordings: prepared,
        })
    }

    /// Returns the problem with a number of its own, as one that differs from others.
    pub(super) fn renumbered(self) -> Self {
        Self { number: NUMBERS.fetch_add(1, Ordering::Relaxed), ..self }
    }

    /// Returns the model.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Returns the search space.
    #[must_use]
    pub fn space(&self) -> &ModelSpace {
        &self.space
    }

    /// Returns the integration method.
    #[must_use]
    pub fn method(&self) -> &ModelMethod {
        &self.method
    }

    /// Returns the settings.
    #[doc(hidden)]
    pub fn settings(&self) -> ModelSettings {
        self.settings
    }

    /// Returns the criterion.
    #[must_use]
    pub fn criterion(&self) -> &Criterion {
        &self.settings.criterion
    }

    /// Returns a recording.
    ///
    /// # Panics
    /// Panics if there is no such recording.
    #[must_use]
    pub fn recording(&self, n: usize) -> &ModelRecording {
        &self.recordings[n].recording
    }

    /// Returns statistics of an output of a recording; `None` for one that was not measured.
    #[doc(hidden)]
    #[must_use]
    pub fn statistics(&self, (recording, output): (usize, usize)) -> Option<&Statistics> {
        let prepared = self.recordings.get(recording)?;
        let of = |output| Statistics::of(&prepared.recording, output);
        let all = prepared.statistics.get_or_init(|| (0..prepared.recording.measured.len()).map(of).collect());
        all.get(output)?.as_ref()
    }

    /// Returns the number of recordings.
    #[must_use]
    pub fn recordings(&self) -> usize {
        self.recordings.len()
    }

    /// Returns the operations per candidate and sample, a fused one as one.
    #[must_use]
    pub fn work(&self) -> usize {
        self.programs.first().map_or(0, |programs| programs.program.work())
    }

    /// Returns the number of samples that count over all recordings and measured outputs.
    #[must_use]
    pub fn counted(&self) -> usize {
        let one = |of: &Prepared| {
            let counting = (0..of.factors.len()).filter(|output| of.factors[*output] > 0.0);
            counting.map(|output| of.recording.count(output)).sum::<usize>()
        };
        self.recordings.iter().map(one).sum()
    }

    /// Evaluates candidates, shape `[candidates, free parameters]`, and writes their costs, shape `[candidates]`. A candidate that
    /// diverges has the cost +∞.
    ///
    /// # Errors
    /// Returns `Usage` if the lengths do not match.
    pub fn costs(&self, candidates: Candidates<'_>, costs: &mut [f64]) -> Result<()> {
        let (width, free) = (candidates.width(), self.space.free.len());
        if width != free || candidates.count() != costs.len() {
            let message = format!(
                "{} candidates of {width} values for {} costs and {free} free parameters",
                candidates.count(),
                costs.len()
            );
            return Err(Error::usage(message, "Give one value per free parameter and one cost per candidate."));
        }
        costs.par_chunks_mut(LANES).enumerate().for_each_init(Work::<PARTS>::default, |work, (block, costs)| {
            let rows: Vec<&[f64]> = (0..costs.len()).map(|lane| candidates.row(block * LANES + lane)).collect();
            self.block(work, &rows, costs);
        });
        Ok(())
    }

    /// Returns the number of the problem in this process.
    #[doc(hidden)]
    pub fn number(&self) -> u64 {
        self.number
    }

    /// Returns the programs of a recording and the recording as prepared.
    #[doc(hidden)]
    pub fn prepared(&self, recording: usize) -> (&Programs, &Prepared) {
        let prepared = &self.recordings[recording];
        (&self.programs[prepared.programs], prepared)
    }

    /// Returns the value of an input of a recording at a sample.
    pub(super) fn input(&self, recording: usize, n: usize, leaf: Leaf) -> f64 {
        let prepared = &self.recordings[recording];
        input((&self.model, self.programs[prepared.programs].substeps), &prepared.recording, n, leaf)
    }

    /// Returns all parameters of up to [`LANES`] candidates on a recording, those of matrix exponentials included, shape
    /// `[parameters][candidates]`.
    #[doc(hidden)]
    pub fn lanes(&self, candidates: &[&[f64]], recording: usize) -> Vec<[f64; LANES]> {
        let mut work = Work::<PARTS>::default();
        self.load(&mut work, self.prepared(recording).0, (candidates, recording));
        work.parameters.iter().map(|of| std::array::from_fn(|lane| of.lane(lane))).collect()
    }

    /// Evaluates up to [`LANES`] candidates.
    fn block(&self, work: &mut Work<PARTS>, candidates: &[&[f64]], costs: &mut [f64]) {
        let mut totals = [0.0; LANES];
        let mut samples = 0;
        for (number, prepared) in self.recordings.iter().enumerate() {
            let programs = &self.programs[prepared.programs];
            self.load(work, programs, (candidates, number));
            match (&programs.affine, &prepared.affine_rows) {
                (Some(program), Some(rows)) => AffineJob { program, rows }.run(work),
                _ => work.run(&Job { program: &programs.program, rows: &prepared.rows, loss: prepared.loss }),
            }
            for (output, factor) in prepared.factors.iter().enumerate().filter(|(_, factor)| **factor > 0.0) {
                for (lane, total) in totals.iter_mut().enumerate() {
                    *total += factor * work.outputs[output].lane(lane);
                }
            }
            samples += prepared.recording.count_most();
        }
        for (cost, total) in costs.iter_mut().zip(totals) {
            *cost = self.settings.criterion.cost(total, samples);
        }
    }

    /// Loads the parameters of candidates for a recording; lanes beyond them repeat the last one.
    pub(super) fn load(
        &self,
        work: &mut Work<PARTS>,
        programs: &Programs,
        (candidates, recording): (&[&[f64]], usize),
    ) {
        let prepared = &self.recordings[recording];
        let own = self.model.parameters.len();
        work.parameters.clear();
        work.parameters.resize(programs.step.all_parameters(), Register::ZERO);
        for lane in 0..LANES {
            let candidate = candidates[lane.min(candidates.len() - 1)];
            for (number, value) in self.space.values(candidate, recording).into_iter().enumerate() {
                work.parameters[number].set(lane, value);
            }
        }
        for (place, value) in prepared.open.iter().enumerate() {
            work.parameters[own + place] = Register::of(*value);
        }
        if let (Some(extras), Some(matrices)) = (&programs.step.extras, &programs.matrices) {
            work.run(&Job { program: matrices, rows: &Rows::default(), loss: Loss::Squares });
            let roots: Vec<[f64; LANES]> =
                work.results.iter().map(|result| std::array::from_fn(|lane| result.lane(lane))).collect();
            let first = programs.step.parameters;
            extras.compute(&roots, |number, values| {
                for (lane, value) in values.into_iter().enumerate() {
                    work.parameters[first + number].set(lane, value);
                }
            });
        }
    }
}
