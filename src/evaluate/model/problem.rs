//! A model on recordings: programs, rows, costs of candidates.

use super::method::ModelMethod;
use super::recording::{ModelRecording, open_initial};
use super::space::ModelSpace;
use crate::candidates::Candidates;
use crate::criterion::{Criterion, Scale};
use crate::evaluate::interpreter::{Clock, Job, Loss, Register, Rows, Work};
use crate::model::graph::Leaf;
use crate::model::program::{Program, Roots, compile};
use crate::model::step::{Step, StepSettings};
use crate::model::{IntegrationMethod, Model};
use crate::numeric::{count, peak, standard_deviation};
use crate::text::counted;
use crate::{Error, Result};
use rayon::prelude::*;
#[cfg(feature = "gpu")]
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
}

/// Lanes of a block of candidates.
const PARTS: usize = 8;
pub(in crate::evaluate) const LANES: usize = Register::<PARTS>::LANES;

/// Programs of a step: the step itself, the entries of its matrices, and both with derivatives.
#[derive(Debug, Clone)]
pub(in crate::evaluate) struct Programs {
    pub step: Step,
    pub program: Program,
    pub matrices: Option<Program>,
    pub tangent: Program,
    pub tangent_matrices: Option<Program>,
}

impl Programs {
    fn new(model: &Model, settings: &StepSettings) -> Result<Self> {
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
            tangent: compiled(&mut tangent)?,
            tangent_matrices: matrices(&mut tangent, true)?,
            step,
        })
    }
}

/// A recording with what its evaluation needs.
#[derive(Debug, Clone)]
pub(in crate::evaluate) struct Prepared {
    pub recording: ModelRecording,
    pub rows: Rows,
    /// Rows of the program with derivatives.
    pub tangent_rows: Rows,
    pub loss: Loss,
    /// Index of its programs.
    pub programs: usize,
    /// Factor of the sum of each output; 0 for one that was not measured.
    pub factors: Vec<f64>,
    /// Initial values of the open states, in their units.
    pub open: Vec<f64>,
}

/// The next number of a problem.
#[cfg(feature = "gpu")]
static NUMBERS: AtomicU64 = AtomicU64::new(0);

/// A model on one or more recordings.
#[derive(Debug, Clone)]
pub struct ModelProblem {
    /// Number of the problem in this process; copies have the same.
    #[cfg(feature = "gpu")]
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
            #[cfg(feature = "gpu")]
            number: NUMBERS.fetch_add(1, Ordering::Relaxed),
            model: model.clone(),
            space,
            settings,
            method,
            programs,
            recordings: prepared,
        })
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
        let one = |of: &Prepared| of.recording.count() * of.factors.iter().filter(|factor| **factor > 0.0).count();
        self.recordings.iter().map(one).sum()
    }

    /// Evaluates candidates, shape `[candidates, free parameters]`, and writes their costs, shape `[candidates]`. A candidate that
    /// diverges has the cost +∞.
    ///
    /// # Errors
    /// Returns `Usage` if the lengths do not match.
    pub fn costs(&self, candidates: Candidates<'_>, costs: &mut [f64]) -> Result<()> {
        self.check_candidates(&candidates, costs)?;
        costs.par_chunks_mut(LANES).enumerate().for_each_init(Work::<PARTS>::default, |work, (block, costs)| {
            let rows: Vec<&[f64]> = (0..costs.len()).map(|lane| candidates.row(block * LANES + lane)).collect();
            self.block(work, &rows, costs);
        });
        Ok(())
    }

    /// Returns an error unless there is a value for each free parameter and a cost for each candidate.
    pub(in crate::evaluate) fn check_candidates(&self, candidates: &Candidates<'_>, costs: &[f64]) -> Result<()> {
        if candidates.width() != self.space.free.len() || candidates.count() != costs.len() {
            let message = format!(
                "{} of {} for {} and a space of {}",
                counted(candidates.count(), "candidate"),
                counted(candidates.width(), "value"),
                counted(costs.len(), "cost"),
                counted(self.space.free.len(), "free parameter")
            );
            return Err(Error::usage(message, "Give one value per free parameter and one cost per candidate."));
        }
        Ok(())
    }

    /// Returns the number of the problem in this process.
    #[cfg(feature = "gpu")]
    pub(in crate::evaluate) fn number(&self) -> u64 {
        self.number
    }

    /// Returns the programs of a recording and the recording as prepared.
    #[cfg(feature = "gpu")]
    pub(in crate::evaluate) fn prepared(&self, recording: usize) -> (&Programs, &Prepared) {
        let prepared = &self.recordings[recording];
        (&self.programs[prepared.programs], prepared)
    }

    /// Returns the value of an input of a recording at a sample.
    #[cfg(feature = "gpu")]
    pub(super) fn input(&self, recording: usize, n: usize, leaf: Leaf) -> f64 {
        input(&self.model, &self.recordings[recording].recording, n, leaf)
    }

    /// Returns all parameters of up to [`LANES`] candidates on a recording, those of matrix exponentials included, shape
    /// `[parameters][candidates]`.
    #[cfg(feature = "gpu")]
    pub(in crate::evaluate) fn lanes(&self, candidates: &[&[f64]], recording: usize) -> Vec<[f64; LANES]> {
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
            work.run(&Job { program: &programs.program, rows: &prepared.rows, loss: prepared.loss });
            for (output, factor) in prepared.factors.iter().enumerate().filter(|(_, factor)| **factor > 0.0) {
                for (lane, total) in totals.iter_mut().enumerate() {
                    *total += factor * work.outputs[output].lane(lane);
                }
            }
            samples += prepared.recording.count();
        }
        for (cost, total) in costs.iter_mut().zip(totals) {
            *cost = self.settings.criterion.cost(total, samples);
        }
    }

    /// Loads the parameters of candidates for a recording; lanes beyond them repeat the last one.
    fn load(&self, work: &mut Work<PARTS>, programs: &Programs, (candidates, recording): (&[&[f64]], usize)) {
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

/// Makes rows, factors and initial values of a recording.
fn prepare(
    model: &Model,
    recording: ModelRecording,
    (programs, index): (&Programs, usize),
    criterion: &Criterion,
) -> Prepared {
    let (samples, outputs) = (recording.len(), model.outputs.len());
    let mut measured = vec![0.0; samples * outputs];
    let mut weights = vec![0.0; samples * outputs];
    let mut factors = vec![0.0; outputs];
    for (output, signal) in recording.measured.iter().enumerate() {
        let Some(signal) = signal else { continue };
        factors[output] = factor(criterion, &recording, output);
        for n in (0..samples).filter(|n| recording.counts(*n)) {
            measured[n * outputs + output] = signal[n];
            weights[n * outputs + output] = criterion.weight(recording.elapsed(n), recording.step(n));
        }
    }
    let is_plain = recording.counting.is_empty()
        && recording.measured.iter().all(Option::is_some)
        && !criterion.is_absolute()
        && !criterion.is_integral();
    let loss = match (criterion.is_absolute(), is_plain) {
        (true, _) => Loss::WeightedMagnitudes,
        (_, true) => Loss::Squares,
        _ => Loss::WeightedSquares,
    };
    let [own, of_tangent] = [&programs.program, &programs.tangent].map(|program| uniforms(program, model, &recording));
    let weights = if is_plain { Vec::new() } else { weights };
    let open = open_initial(model, &recording);
    let clock = clock(&recording);
    Prepared {
        tangent_rows: Rows { samples, uniforms: of_tangent, clock: clock.clone(), ..Rows::default() },
        rows: Rows { samples, uniforms: own, measured, weights, clock },
        recording,
        loss,
        programs: index,
        factors,
        open,
    }
}

/// Returns the steps of a recording, for operations with a memory.
fn clock(recording: &ModelRecording) -> Clock {
    let changes = |input: &Vec<f64>| input.iter().position(|value| value.to_bits() != input[0].to_bits());
    let first = recording.inputs.iter().filter_map(changes).min();
    let first_change_s = first.map_or(f64::INFINITY, |n| recording.elapsed(n));
    Clock { step_s: recording.step_s.clone(), first_change_s, samples: recording.len() }
}

/// Computes the uniforms of a program on a recording.
fn uniforms(program: &Program, model: &Model, recording: &ModelRecording) -> Vec<f64> {
    Rows::uniforms(&program.uniforms, recording.len(), &|n, leaf| input(model, recording, n, leaf))
}

/// Returns the value of an input at a sample, or at the next one.
fn input(model: &Model, recording: &ModelRecording, n: usize, leaf: Leaf) -> f64 {
    let value = |number: u16, n: usize| recording.inputs.get(usize::from(number)).map_or(0.0, |input| input[n]);
    match leaf {
        Leaf::Input(number) if usize::from(number) == model.inputs.len() => recording.step(n),
        Leaf::Input(number) => value(number, n),
        Leaf::NextInput(number) => value(number, (n + 1).min(recording.len() - 1)),
        Leaf::Parameter(_) | Leaf::State(_) | Leaf::Reaction(_) | Leaf::Memory(_) => 0.0,
    }
}

/// Returns the factor of the sum of an output; 0 if its scale is not defined.
fn factor(criterion: &Criterion, recording: &ModelRecording, output: usize) -> f64 {
    let Some(signal) = recording.counted(output) else { return 0.0 };
    let divisor = match criterion.scale {
        Scale::None => 1.0,
        Scale::Peak => peak(&signal),
        Scale::Std => standard_deviation(&signal),
        Scale::Noise => criterion.noise.sigma(output, &signal),
    };
    if divisor > 0.0 && count(signal.len()) > 0.0 { criterion.factor(divisor) } else { 0.0 }
}
