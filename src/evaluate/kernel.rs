//! The kernel for the linear motor: simulates `L` candidates side by side through one recording.
//!
//! Cost per candidate and step: four multiply–adds for the state (`x⁺ = Φ x + g`, g constant over a run), two subtractions and
//! two multiply–adds for the errors, which are 8 operations on the FMA ports (6 on processors with separate ports for
//! additions). Inputs that change from sample to sample add one product for each state and input. `Φ = I + D` is rounded once
//! per candidate, which changes a trajectory by at most ε/(h·pole).
//!
//! The code uses plain arrays and no intrinsics; `at_level` compiles it once per SIMD level.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::at_level::at_level;
use super::cutoff::{Cut, Limits};
use super::problem::Problem;
use super::segment::Segment;
use super::signals::Signals;
use crate::motor::{StepMaps, multiply_add, step_maps};

/// A block of candidates and their problem.
pub(super) struct Block<'a> {
    pub problem: &'a Problem,
    /// The candidates, rows of `width` values.
    pub candidates: &'a [f64],
    pub width: usize,
    /// One cutoff for each candidate; empty if every cost is needed.
    pub cutoffs: &'a [f64],
}

/// Candidates side by side at AVX-512, the fastest number that its registers can take (measured).
pub(super) const LANES_AVX512: usize = 24;
/// Candidates side by side at the other levels (measured).
pub(super) const LANES: usize = 8;

at_level! {
    pub(super) fn avx512(block: &Block<'_>, costs: &mut [f64]) = avx512 { run::<LANES_AVX512, true>(block, costs) } else avx2
}

at_level! {
    pub(super) fn avx2(block: &Block<'_>, costs: &mut [f64]) = avx2 { run::<LANES, true>(block, costs) } else portable
}

/// Measured values of consecutive samples, and their weights, which are empty if all are 1.
#[derive(Clone, Copy)]
pub(super) struct Samples<'a> {
    pub measured: &'a [[f64; 2]],
    pub weight: &'a [[f64; 2]],
}

impl<'a> Samples<'a> {
    #[inline(always)]
    pub(super) fn of(signals: &'a Signals, start: usize, end: usize) -> Self {
        Self { measured: &signals.measured[start..end], weight: signals.weight.get(start..end).unwrap_or_default() }
    }
}

/// Number of samples whose errors are summed before the sum is added to the total.
pub(super) const SUM_BLOCK: usize = 1024;

/// Runs a block with separate multiplications and additions, since `mul_add` is a library call without FMA instructions.
pub(super) fn portable(block: &Block<'_>, costs: &mut [f64]) {
    run::<LANES, false>(block, costs);
}

/// Writes the costs of up to `L` candidates. Lanes without a candidate repeat the last one.
#[inline(always)]
fn run<const L: usize, const FMA: bool>(block: &Block<'_>, costs: &mut [f64]) {
    let Block { problem, candidates, width, cutoffs } = *block;
    let limits = Limits::of(problem, cutoffs);
    let mut totals = [0.0; L];
    for (recording, signals) in problem.signals().iter().enumerate() {
        let mut parameters = [[0.0; L]; 5];
        for lane in 0..L {
            let row = lane.min(costs.len() - 1) * width;
            let values = problem.parameters(&candidates[row..row + width], recording).to_array();
            for (p, value) in values.into_iter().enumerate() {
                parameters[p][lane] = value;
            }
        }
        let mut cut = limits.as_ref().map(|limits| Cut::new(limits, problem, signals, totals));
        let absolute = problem.criterion().is_absolute();
        let sums = match (absolute, signals.weight.is_empty()) {
            (false, true) => simulate::<L, FMA, false, false>(problem, signals, &parameters, cut.as_mut()),
            (false, false) => simulate::<L, FMA, false, true>(problem, signals, &parameters, cut.as_mut()),
            (true, true) => simulate::<L, FMA, true, false>(problem, signals, &parameters, cut.as_mut()),
            (true, false) => simulate::<L, FMA, true, true>(problem, signals, &parameters, cut.as_mut()),
        };
        let is_abandoned = cut.as_ref().is_some_and(|cut| cut.is_passed(&sums));
        for lane in 0..L {
            totals[lane] += problem.scaled(signals, [sums[0][lane], sums[1][lane]]);
        }
        if is_abandoned {
            break;
        }
    }
    for (cost, total) in costs.iter_mut().zip(totals) {
        *cost = problem.cost(total);
    }
}

/// States, sums of errors and coefficients of a block of candidates.
struct Lanes<const L: usize> {
    x: [[f64; L]; 2],
    sums: [[f64; L]; 2],
    phi: [[f64; L]; 4],
    gain: [[f64; L]; 2],
}

/// Returns the weighted sums of errors over the active samples of one recording, shape `[channels][candidates]`; those so far
/// once all candidates are beyond the limits of `cut`.
#[inline(always)]
fn simulate<const L: usize, const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool>(
    problem: &Problem,
    signals: &Signals,
    parameters: &[[f64; L]; 5],
    mut cut: Option<&mut Cut<'_, L>>,
) -> [[f64; L]; 2] {
    let method = problem.method();
    let uniform = signals.step_index.is_empty();
    // Only irregular recordings need a table of step maps; regular ones avoid the allocation.
    let first = step_maps(parameters, signals.step_s[0], method);
    let table: Vec<StepMaps<L>> =
        if uniform { Vec::new() } else { signals.step_s.iter().map(|&h| step_maps(parameters, h, method)).collect() };
    let mut lanes =
        Lanes { x: signals.initial.map(|x| [x; L]), sums: [[0.0; L]; 2], phi: phi(&first), gain: first.torque };
    // NaN step maps must give a NaN cost even if the input is zero.
    let mut totals = [[0.0; L]; 2];
    for lane in 0..L {
        totals[0][lane] = 0.0 * first.d.iter().map(|d| d[lane]).sum::<f64>();
    }
    let mut summed = 0;
    for Segment { run, constant } in signals.active_segments() {
        let maps = if uniform { &first } else { &table[usize::from(run.step)] };
        if !uniform {
            lanes.phi = phi(maps);
        }
        lanes.gain = gain::<L, 3>(maps, [run.voltage[0], run.voltage[1], run.torque]);
        let mut start = run.start;
        while start < run.end {
            let end = run.end.min(start + SUM_BLOCK);
            let mut from = start;
            while from < end {
                let to = match &cut {
                    Some(cut) => cut.until(from, end),
                    None => end,
                };
                let samples = Samples::of(signals, from, to);
                if *constant {
                    run_samples::<L, FMA, ABSOLUTE, WEIGHTED, 0>(
                        &mut lanes,
                        maps,
                        samples,
                        std::iter::repeat([0.0; 3]),
                    );
                } else if method.uses_next_input() || !signals.torque.is_empty() {
                    let inputs = (from..to).map(|n| signals.inputs(n));
                    run_samples::<L, FMA, ABSOLUTE, WEIGHTED, 3>(&mut lanes, maps, samples, inputs);
                } else {
                    let volts = signals.voltage[from..to].iter().map(|&voltage| [voltage, 0.0, 0.0]);
                    run_samples::<L, FMA, ABSOLUTE, WEIGHTED, 1>(&mut lanes, maps, samples, volts);
                }
                if let Some(cut) = &mut cut
                    && cut.is_due(to - from)
                    && cut.is_passed(&so_far(&totals, &lanes.sums))
                {
                    return so_far(&totals, &lanes.sums);
                }
                from = to;
            }
            summed += end - start;
            start = end;
            if summed >= SUM_BLOCK {
                flush(&mut lanes, &mut totals);
                summed = 0;
            }
        }
    }
    flush(&mut lanes, &mut totals);
    totals
}

/// Returns the totals with the sums that are not in them yet, shape `[channels][candidates]`.
#[inline(always)]
pub(super) fn so_far<const L: usize>(totals: &[[f64; L]; 2], sums: &[[f64; L]; 2]) -> [[f64; L]; 2] {
    let mut so_far = *totals;
    for channel in 0..2 {
        for lane in 0..L {
            so_far[channel][lane] += sums[channel][lane];
        }
    }
    so_far
}

/// Adds the sums of a block of samples to the totals. Summation in blocks bounds the rounding error by the block length.
#[inline(always)]
fn flush<const L: usize>(lanes: &mut Lanes<L>, totals: &mut [[f64; L]; 2]) {
    *totals = so_far(totals, &lanes.sums);
    lanes.sums = [[0.0; L]; 2];
}

/// Simulates samples with the same step map. The first `CHANGING` inputs change from sample to sample, the others are constant.
#[inline(always)]
fn run_samples<const L: usize, const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool, const CHANGING: usize>(
    lanes: &mut Lanes<L>,
    maps: &StepMaps<L>,
    samples: Samples<'_>,
    inputs: impl Iterator<Item = [f64; 3]>,
) {
    // The black box forces the lanes through memory; otherwise the compiler splits them into scalars.
    let lanes = std::hint::black_box(lanes);
    let Lanes { mut x, mut sums, phi, gain: mut drive } = *lanes;
    for (n, (measured, inputs)) in samples.measured.iter().zip(inputs).enumerate() {
        let weight = if WEIGHTED { samples.weight[n] } else { [1.0; 2] };
        if CHANGING > 0 {
            drive = gain::<L, CHANGING>(maps, inputs);
        }
        let errors = step::<L, FMA>(&mut x, &phi, &drive, *measured);
        for channel in 0..2 {
            for lane in 0..L {
                let sum = &mut sums[channel][lane];
                *sum = add_loss::<FMA, ABSOLUTE, WEIGHTED>(*sum, errors[channel][lane], weight[channel]);
            }
        }
    }
    (lanes.x, lanes.sums) = (x, sums);
}

#[inline(always)]
pub(super) fn phi<const L: usize>(maps: &StepMaps<L>) -> [[f64; L]; 4] {
    let mut phi = maps.d;
    for lane in 0..L {
        phi[0][lane] += 1.0;
        phi[3][lane] += 1.0;
    }
    phi
}

/// Returns the contribution of the inputs to both states. With `CHANGING` = 1 only the first input is used.
#[inline(always)]
fn gain<const L: usize, const CHANGING: usize>(maps: &StepMaps<L>, inputs: [f64; 3]) -> [[f64; L]; 2] {
    let mut gain = [[0.0; L]; 2];
    for axis in 0..2 {
        for lane in 0..L {
            gain[axis][lane] = maps.taps[0][axis][lane] * inputs[0];
            if CHANGING > 1 {
                gain[axis][lane] += maps.taps[1][axis][lane] * inputs[1];
                gain[axis][lane] += maps.torque[axis][lane] * inputs[2];
            }
        }
    }
    gain
}

/// Returns the errors of one sample, shape `[channels][candidates]`, and advances the states by one step.
#[inline(always)]
fn step<const L: usize, const FMA: bool>(
    [i, w]: &mut [[f64; L]; 2],
    phi: &[[f64; L]; 4],
    gain: &[[f64; L]; 2],
    measured: [f64; 2],
) -> [[f64; L]; 2] {
    let mut errors = [[0.0; L]; 2];
    for lane in 0..L {
        errors[0][lane] = measured[0] - i[lane];
        errors[1][lane] = measured[1] - w[lane];
        let next =
            multiply_add::<FMA>(phi[0][lane], i[lane], multiply_add::<FMA>(phi[1][lane], w[lane], gain[0][lane]));
        w[lane] = multiply_add::<FMA>(phi[2][lane], i[lane], multiply_add::<FMA>(phi[3][lane], w[lane], gain[1][lane]));
        i[lane] = next;
    }
    errors
}

#[inline(always)]
pub(super) fn add_loss<const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool>(
    sum: f64,
    e: f64,
    weight: f64,
) -> f64 {
    match (ABSOLUTE, WEIGHTED) {
        (false, false) => multiply_add::<FMA>(e, e, sum),
        (false, true) => multiply_add::<FMA>(weight * e, e, sum),
        (true, false) => sum + e.abs(),
        (true, true) => multiply_add::<FMA>(weight, e.abs(), sum),
    }
}
