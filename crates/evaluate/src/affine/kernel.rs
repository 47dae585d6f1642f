//! Steps of `L` candidates with `N` states side by side, the first `M` of which are measured.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::coefficients::{Coefficients, Values};
use super::rows::{AffineRows, CHUNK, Piece};
use crate::lanes::add_loss;
use crate::step::least;
use motorfit_motor::{Number as _, margin_to_passage, multiply_add, passed};

/// States and sums of squared errors.
struct Lanes<const N: usize, const M: usize, const L: usize> {
    x: [Values<L>; N],
    sums: [Values<L>; M],
}

/// Returns the sums of squared errors over a recording, for each output in the order of the kernel.
#[inline(always)]
pub(super) fn sums<
    const N: usize,
    const M: usize,
    const L: usize,
    const FMA: bool,
    const WEIGHTED: bool,
    const REACTS: bool,
>(
    of: &Coefficients<N, L>,
    rows: &AffineRows,
) -> [Values<L>; M] {
    let mut lanes = Lanes { x: of.initial, sums: [[0.0; L]; M] };
    let taps = of.taps.len();
    let mut gains = [[[0.0; L]; N]; CHUNK];
    for &Piece { from, to, is_constant } in &rows.pieces {
        let computed = if is_constant { 1 } else { to - from };
        for n in 0..computed {
            gains[n] = of.gain::<FMA>(&rows.inputs[(from + n) * taps..(from + n + 1) * taps]);
        }
        let samples = Samples {
            measured: &rows.measured[from * M..to * M],
            weights: if WEIGHTED { &rows.weights[from * M..to * M] } else { &[] },
            stride: usize::from(!is_constant),
        };
        run_samples::<N, M, L, FMA, WEIGHTED, REACTS>(of, &mut lanes, samples, &gains);
    }
    lanes.sums
}

/// Measured values and weights of consecutive steps, shape `[steps, outputs]`.
#[derive(Clone, Copy)]
struct Samples<'a> {
    measured: &'a [f64],
    weights: &'a [f64],
    /// Distance of the gains of consecutive steps: 0 for the same one.
    stride: usize,
}

#[inline(always)]
fn run_samples<
    const N: usize,
    const M: usize,
    const L: usize,
    const FMA: bool,
    const WEIGHTED: bool,
    const REACTS: bool,
>(
    of: &Coefficients<N, L>,
    lanes: &mut Lanes<N, M, L>,
    samples: Samples<'_>,
    gains: &[[Values<L>; N]; CHUNK],
) {
    // The black box forces the lanes through memory; otherwise the compiler splits them into scalars.
    let lanes = std::hint::black_box(lanes);
    let Lanes { mut x, mut sums } = *lanes;
    let mut at = 0;
    for (n, measured) in samples.measured.chunks_exact(M).enumerate() {
        let gain = &gains[at % CHUNK];
        at += samples.stride;
        for output in 0..M {
            let weight = if WEIGHTED { samples.weights[n * M + output] } else { 1.0 };
            for lane in 0..L {
                let error = measured[output] - x[output][lane];
                sums[output][lane] = add_loss::<FMA, false, WEIGHTED>(sums[output][lane], error, weight);
            }
        }
        let before = x;
        for row in 0..N {
            for lane in 0..L {
                let mut next = gain[row][lane];
                for column in (0..N).rev() {
                    next = multiply_add::<FMA>(of.phi[row][column][lane], before[column][lane], next);
                }
                x[row][lane] = next;
            }
        }
        if REACTS {
            react::<N, L, FMA>(of, &before, &mut x);
        }
    }
    (lanes.x, lanes.sums) = (x, sums);
}

/// Subtracts the reactions from the states at the end of a step. Steps in which a state passes zero are computed once more.
#[inline(always)]
fn react<const N: usize, const L: usize, const FMA: bool>(
    of: &Coefficients<N, L>,
    before: &[Values<L>; N],
    x: &mut [Values<L>; N],
) {
    let free = *x;
    let mut margins = [f64::INFINITY; L];
    for own in 0..N {
        if !of.acts[own] {
            continue;
        }
        for lane in 0..L {
            let (limit, state) = (of.limits[own][lane], x[own][lane]);
            let margin = margin_to_passage(before[own][lane], state, limit);
            margins[lane] = if margin < margins[lane] { margin } else { margins[lane] };
            let taken = state.clip(limit);
            x[own][lane] = state - taken;
            for other in 0..N {
                if other != own {
                    x[other][lane] = multiply_add::<FMA>(of.adds[own][other][lane], taken, x[other][lane]);
                }
            }
        }
    }
    if least(&margins) < 0.0 {
        pass::<N, L, FMA>(of, (before, &free), &margins, x);
    }
}

/// Computes the states of those candidates once more that may pass zero in the step. A function of its own keeps the code of the kernels
/// small.
#[inline(never)]
fn pass<const N: usize, const L: usize, const FMA: bool>(
    of: &Coefficients<N, L>,
    (before, free): (&[Values<L>; N], &[Values<L>; N]),
    margins: &Values<L>,
    next: &mut [Values<L>; N],
) {
    for lane in (0..L).filter(|lane| margins[*lane] < 0.0) {
        let mut x: [f64; N] = std::array::from_fn(|state| free[state][lane]);
        for own in (0..N).filter(|own| of.acts[*own]) {
            let after = passed(before[own][lane], x[own], of.limits[own][lane]);
            let taken = x[own] - after;
            for other in 0..N {
                x[other] = multiply_add::<FMA>(of.adds[own][other][lane], taken, x[other]);
            }
            x[own] = after;
        }
        for state in 0..N {
            next[state][lane] = x[state];
        }
    }
}
