//! A recording with what its evaluation needs.

use super::programs::Programs;
use super::recording::{ModelRecording, open_initial};
use crate::affine::AffineRows;
use crate::criterion::{Criterion, Scale};
use crate::interpreter::{Clock, Loss, Rows};
use motorfit_core::numeric::{count, noise_sigma, peak, rms, standard_deviation};
use motorfit_model::Model;
use motorfit_model::graph::Leaf;
use motorfit_model::program::Program;
use std::sync::OnceLock;

/// A recording with what its evaluation needs.
#[derive(Debug, Clone)]
pub struct Prepared {
    pub recording: ModelRecording,
    pub rows: Rows,
    /// Rows of the program with derivatives, in which each sample that counts has the weight 1.
    pub tangent_rows: Rows,
    pub loss: Loss,
    /// Rows of the kernel of affine models, if it suits.
    pub(crate) affine_rows: Option<AffineRows>,
    /// Index of its programs.
    pub programs: usize,
    /// Factor of the sum of each output; 0 for one that was not measured.
    pub factors: Vec<f64>,
    /// Initial values of the open states, in their units.
    pub open: Vec<f64>,
    /// Statistics of the outputs, computed on first use.
    pub(super) statistics: OnceLock<Vec<Option<Statistics>>>,
}

/// Statistics of a measured output over the samples that count.
#[derive(Debug, Clone, Copy)]
#[doc(hidden)]
pub struct Statistics {
    /// Root mean square.
    pub rms: f64,
    /// Standard deviation of the noise, estimated from the output alone.
    pub noise: f64,
    /// Standard deviation; the largest magnitude of an output that is constant.
    pub deviation: f64,
}

/// Smallest deviation of an output that is zero throughout.
const DEVIATION_MIN: f64 = 1e-9;

impl Statistics {
    /// Returns the statistics of an output; `None` for one that was not measured.
    pub(super) fn of(recording: &ModelRecording, output: usize) -> Option<Self> {
        let values = recording.counted(output)?;
        let deviation = standard_deviation(&values);
        let deviation = if deviation > 0.0 { deviation } else { peak(&values).max(DEVIATION_MIN) };
        Some(Self { rms: rms(&values), noise: noise_sigma(&values), deviation })
    }
}

/// Makes rows, factors and initial values of a recording.
pub(super) fn prepare(
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
        for n in (0..samples).filter(|n| recording.counts(output, *n)) {
            measured[n * outputs + output] = signal[n];
            weights[n * outputs + output] = criterion.weight(recording.elapsed(n), recording.step(n));
        }
    }
    let is_whole = recording.counting.is_empty() && recording.measured.iter().all(Option::is_some);
    let is_plain = is_whole && !criterion.is_absolute() && !criterion.is_integral();
    let loss = match (criterion.is_absolute(), is_plain) {
        (true, _) => Loss::WeightedMagnitudes,
        (_, true) => Loss::Squares,
        _ => Loss::WeightedSquares,
    };
    let [own, of_tangent] =
        [&programs.program, &programs.tangent].map(|program| uniforms(program, (model, programs.substeps), &recording));
    let all = (0..samples).flat_map(|n| (0..outputs).map(move |output| (output, n)));
    let counts = |output: usize, n: usize| recording.measured[output].is_some() && recording.counts(output, n);
    let counts: Vec<f64> = match is_whole {
        true => Vec::new(),
        false => all.map(|(output, n)| f64::from(u8::from(counts(output, n)))).collect(),
    };
    let weights = if is_plain { Vec::new() } else { weights };
    let open = open_initial(model, &recording);
    let clock = clock(&recording);
    let value = |number: usize, n: usize| recording.inputs.get(number).map_or(0.0, |input| input[n]);
    let affine_rows = programs
        .affine
        .as_ref()
        .filter(|_| loss != Loss::WeightedMagnitudes)
        .map(|program| AffineRows::new(program, samples, value, [&measured, &weights]));
    Prepared {
        tangent_rows: Rows {
            samples,
            uniforms: of_tangent,
            measured: measured.clone(),
            weights: counts,
            clock: clock.clone(),
        },
        rows: Rows { samples, uniforms: own, measured, weights, clock },
        affine_rows,
        recording,
        loss,
        programs: index,
        factors,
        open,
        statistics: OnceLock::new(),
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
fn uniforms(program: &Program, (model, substeps): (&Model, usize), recording: &ModelRecording) -> Vec<f64> {
    Rows::uniforms(&program.uniforms, recording.len(), &|n, leaf| input((model, substeps), recording, n, leaf))
}

/// Returns the value of an input at a sample, or at the next one. The inputs are followed by the step, and by marks of the substeps that
/// are instants of sampled laws.
pub(super) fn input((model, substeps): (&Model, usize), recording: &ModelRecording, n: usize, leaf: Leaf) -> f64 {
    let value = |number: u16, n: usize| recording.inputs.get(usize::from(number)).map_or(0.0, |input| input[n]);
    match leaf {
        Leaf::Input(number) if usize::from(number) == model.inputs.len() => recording.step(n),
        Leaf::Input(number) if usize::from(number) > model.inputs.len() => {
            let mark = usize::from(number) - model.inputs.len() - 1;
            let law = model.laws.get(mark / substeps);
            let is_instant = law.is_some_and(|law| recording.is_instant(n, (mark % substeps, substeps), law.period_s));
            f64::from(u8::from(is_instant))
        }
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
