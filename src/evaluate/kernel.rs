//! The kernel: `L` candidates side by side through one recording.
//!
//! Limit: per candidate and step, four multiply–adds for the state (`x⁺ = Φ x + g`, g constant over a run), two
//! subtractions and two multiply–adds for the errors: 8 operations on the FMA ports (6 where additions have ports of
//! their own). `Φ = I + D` is rounded once per candidate, which moves a trajectory by ε/(h·pole) at most.
//!
//! Where inputs change from sample to sample, what they add comes to that: a product for each state and input.
//!
//! Plain arrays, compiled once per feature level by `multiversion`; no intrinsics.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::problem::Problem;
use super::segment::Segment;
use super::signals::Signals;
use crate::motor::{StepMaps, multiply_add, step_maps};
use multiversion::multiversion;

/// Candidates of one block and what they are run on.
pub(super) struct Block<'a> {
    pub problem: &'a Problem,
    /// Rows of `width` values.
    pub candidates: &'a [f64],
    pub width: usize,
}

/// Candidates side by side at each level: what fills its registers (measured).
pub(super) const LANES_AVX512: usize = 24;
pub(super) const LANES: usize = 8;

// The second target is never chosen, because `Level` asks for what the first needs; were it, it would still have FMA.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
pub(super) fn avx512(block: &Block<'_>, costs: &mut [f64]) {
    run::<LANES_AVX512, true>(block, costs);
}

#[multiversion(targets("x86_64+avx2+fma"))]
pub(super) fn avx2(block: &Block<'_>, costs: &mut [f64]) {
    run::<LANES, true>(block, costs);
}

/// Samples that are passed under the same map: what was measured, and weights where they differ.
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

/// Samples whose errors are summed before they go to the total.
pub(super) const SUM_BLOCK: usize = 1024;

/// Without FMA `mul_add` would be a library call: multiply, then add.
pub(super) fn portable(block: &Block<'_>, costs: &mut [f64]) {
    run::<LANES, false>(block, costs);
}

/// Costs of up to `L` candidates; lanes without one repeat the last.
#[inline(always)]
fn run<const L: usize, const FMA: bool>(block: &Block<'_>, costs: &mut [f64]) {
    let Block { problem, candidates, width } = *block;
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
        let absolute = problem.criterion().is_absolute();
        let sums = match (absolute, signals.weight.is_empty()) {
            (false, true) => simulate::<L, FMA, false, false>(problem, signals, &parameters),
            (false, false) => simulate::<L, FMA, false, true>(problem, signals, &parameters),
            (true, true) => simulate::<L, FMA, true, false>(problem, signals, &parameters),
            (true, false) => simulate::<L, FMA, true, true>(problem, signals, &parameters),
        };
        for lane in 0..L {
            totals[lane] += problem.scaled(signals, [sums[0][lane], sums[1][lane]]);
        }
    }
    for (cost, total) in costs.iter_mut().zip(totals) {
        *cost = problem.cost(total);
    }
}

/// State, sums and coefficients of a block.
struct Lanes<const L: usize> {
    x: [[f64; L]; 2],
    sums: [[f64; L]; 2],
    phi: [[f64; L]; 4],
    gain: [[f64; L]; 2],
}

/// Weighted sums of errors per channel over the active samples of one recording.
#[inline(always)]
fn simulate<const L: usize, const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool>(
    problem: &Problem,
    signals: &Signals,
    parameters: &[[f64; L]; 5],
) -> [[f64; L]; 2] {
    let method = problem.method();
    let uniform = signals.step_index.is_empty();
    // Irregular recordings have a table of maps; a regular one, the rule, needs no allocation.
    let first = step_maps(parameters, signals.step_s[0], method);
    let table: Vec<StepMaps<L>> =
        if uniform { Vec::new() } else { signals.step_s.iter().map(|&h| step_maps(parameters, h, method)).collect() };
    let mut lanes =
        Lanes { x: signals.initial.map(|x| [x; L]), sums: [[0.0; L]; 2], phi: phi(&first), gain: first.torque };
    // A map without numbers has no trajectory, even where nothing drives the motor.
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
            let samples = Samples::of(signals, start, end);
            if *constant {
                run_stretch::<L, FMA, ABSOLUTE, WEIGHTED, 0>(&mut lanes, maps, samples, std::iter::repeat([0.0; 3]));
            } else if method.uses_next_input() || !signals.torque.is_empty() {
                let inputs = (start..end).map(|n| signals.inputs(n));
                run_stretch::<L, FMA, ABSOLUTE, WEIGHTED, 3>(&mut lanes, maps, samples, inputs);
            } else {
                let volts = signals.voltage[start..end].iter().map(|&voltage| [voltage, 0.0, 0.0]);
                run_stretch::<L, FMA, ABSOLUTE, WEIGHTED, 1>(&mut lanes, maps, samples, volts);
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

/// Moves the sums of a block to the totals: rounding then grows with the length of a block, not of the recording.
#[inline(always)]
fn flush<const L: usize>(lanes: &mut Lanes<L>, totals: &mut [[f64; L]; 2]) {
    for channel in 0..2 {
        for lane in 0..L {
            totals[channel][lane] += lanes.sums[channel][lane];
        }
    }
    lanes.sums = [[0.0; L]; 2];
}

/// Steps under the same map, of whose inputs the first `CHANGING` change from sample to sample.
#[inline(always)]
fn run_stretch<const L: usize, const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool, const CHANGING: usize>(
    lanes: &mut Lanes<L>,
    maps: &StepMaps<L>,
    samples: Samples<'_>,
    inputs: impl Iterator<Item = [f64; 3]>,
) {
    // Through memory: carried in registers from stretch to stretch, lanes would be taken apart into single numbers.
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

/// Returns the contribution of the inputs to both states; of one the others are zero.
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

/// One sample: its errors, and one step of the state.
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
