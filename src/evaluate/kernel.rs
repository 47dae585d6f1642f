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
use super::irregular::Clock;
use super::lanes::{Lanes, SUM_BLOCK, Samples, add_losses, advance, gain, phi, so_far};
use super::problem::Problem;
use super::segment::Segment;
use super::signals::Signals;
use crate::motor::{StepMaps, step_maps};

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
    let maps = step_maps(parameters, signals.step_s[0], method);
    let is_regular = signals.step_index.is_empty();
    let is_simple = !method.uses_next_input() && signals.torque.is_empty();
    // A closure would not be compiled for the SIMD level.
    let clock = if is_regular { None } else { Some(Clock::new::<FMA>(signals, parameters, method)) };
    let mut lanes =
        Lanes { x: signals.initial.map(|x| [x; L]), sums: [[0.0; L]; 2], phi: phi(&maps), gain: maps.torque };
    // NaN step maps must give a NaN cost even if the input is zero.
    let mut totals = [[0.0; L]; 2];
    for lane in 0..L {
        totals[0][lane] = 0.0 * maps.d.iter().map(|d| d[lane]).sum::<f64>();
    }
    let whole = [signals.active_segment()];
    let segments = if is_regular { signals.active_segments() } else { &whole };
    let mut summed = 0;
    for Segment { run, constant } in segments {
        lanes.gain = gain::<L, 3>(&maps, [run.voltage[0], run.voltage[1], run.torque]);
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
                if let Some(clock) = &clock {
                    clock.run::<FMA, ABSOLUTE, WEIGHTED>(&mut lanes, [from, to]);
                } else if *constant {
                    run_samples::<L, FMA, ABSOLUTE, WEIGHTED, 0>(
                        &mut lanes,
                        &maps,
                        samples,
                        std::iter::repeat([0.0; 3]),
                    );
                } else if is_simple {
                    let volts = signals.voltage[from..to].iter().map(|&voltage| [voltage, 0.0, 0.0]);
                    run_samples::<L, FMA, ABSOLUTE, WEIGHTED, 1>(&mut lanes, &maps, samples, volts);
                } else {
                    let inputs = (from..to).map(|n| signals.inputs(n));
                    run_samples::<L, FMA, ABSOLUTE, WEIGHTED, 3>(&mut lanes, &maps, samples, inputs);
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
        add_losses::<L, FMA, ABSOLUTE, WEIGHTED>(&mut sums, &x, *measured, weight);
        advance::<L, FMA>(&mut x, &phi, &drive);
    }
    (lanes.x, lanes.sums) = (x, sums);
}
