//! Parts of the kernels: coefficients, states and sums of errors of `L` candidates side by side, and one step of them.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::signals::Signals;
use motorfit_motor::{StepMaps, multiply_add};

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

/// States, sums of errors and coefficients of a block of candidates.
pub(super) struct Lanes<const L: usize> {
    pub x: [[f64; L]; 2],
    pub sums: [[f64; L]; 2],
    pub phi: [[f64; L]; 4],
    pub gain: [[f64; L]; 2],
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
pub(super) fn gain<const L: usize, const CHANGING: usize>(maps: &StepMaps<L>, inputs: [f64; 3]) -> [[f64; L]; 2] {
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

/// Advances the states by one step.
#[inline(always)]
pub(super) fn advance<const L: usize, const FMA: bool>(
    [i, w]: &mut [[f64; L]; 2],
    phi: &[[f64; L]; 4],
    gain: &[[f64; L]; 2],
) {
    for lane in 0..L {
        let next =
            multiply_add::<FMA>(phi[0][lane], i[lane], multiply_add::<FMA>(phi[1][lane], w[lane], gain[0][lane]));
        w[lane] = multiply_add::<FMA>(phi[2][lane], i[lane], multiply_add::<FMA>(phi[3][lane], w[lane], gain[1][lane]));
        i[lane] = next;
    }
}

/// Adds the errors of one sample to the sums.
#[inline(always)]
pub(super) fn add_losses<const L: usize, const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool>(
    sums: &mut [[f64; L]; 2],
    x: &[[f64; L]; 2],
    measured: [f64; 2],
    weight: [f64; 2],
) {
    for channel in 0..2 {
        for lane in 0..L {
            let error = measured[channel] - x[channel][lane];
            let sum = &mut sums[channel][lane];
            *sum = add_loss::<FMA, ABSOLUTE, WEIGHTED>(*sum, error, weight[channel]);
        }
    }
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
