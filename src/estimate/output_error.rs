//! Output errors of one motor and their derivatives, as sums of products.
//!
//! Per sample and channel the row `[∂x/∂ln R … ∂x/∂ln J, ∂x/∂i₀, ∂x/∂ω₀, y − x]` is multiplied with itself and added
//! up: JᵀJ, Jᵀe and eᵀe in one symmetric matrix. The derivatives follow the motor: with `x⁺ = x + D x + g`,
//! `S⁺ = Φ S + ∂D x + ∂g`.
//!
//! Limit: 8 lanes a sample; 2×5 vector operations for the state's derivatives, 2×8 for the products.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::gram::{BLOCK, HALF, Panel, Square, own_products};
use crate::evaluate::{Level, Signals};
use crate::motor::{Method, Parameters, StepMap, multiply_add};
use multiversion::multiversion;

/// Five parameters, two initial states, the error.
const ROW: usize = 8;
/// Where the initial states and the error stand in a row.
pub(super) const INITIAL: usize = 5;
const ERROR: usize = 7;

/// Sums of the products of rows: symmetric.
type Products = Square;

/// A step with its derivatives, a lane for each entry of a row.
struct Step {
    map: StepMap,
    d: [[f64; ROW]; 4],
    taps: [[[f64; ROW]; 2]; 2],
    torque: [[f64; ROW]; 2],
}

impl Step {
    fn new((map, slopes): (StepMap, [StepMap; 5])) -> Self {
        let lanes = |of: &dyn Fn(&StepMap) -> f64| -> [f64; ROW] {
            std::array::from_fn(|lane| slopes.get(lane).map_or(0.0, of))
        };
        Self {
            map,
            d: std::array::from_fn(|n| lanes(&|s| s.d[n])),
            taps: std::array::from_fn(|t| std::array::from_fn(|axis| lanes(&|s| s.taps[t][axis]))),
            torque: std::array::from_fn(|axis| lanes(&|s| s.torque[axis])),
        }
    }
}

/// Sums of the products of both channels (current, speed) over the active samples of a recording, from the state
/// `initial`.
pub(super) fn products(signals: &Signals, parameters: &Parameters, initial: [f64; 2], method: Method) -> [Products; 2] {
    let maps = StepMap::all_with_sensitivities(parameters, &signals.step_s, signals.unit_s, method);
    let steps: Vec<Step> = maps.into_iter().map(Step::new).collect();
    match Level::best() {
        Level::Avx512 => avx512(signals, &steps, initial),
        Level::Avx2 => avx2(signals, &steps, initial),
        Level::Portable => run::<HALF, false>(signals, &steps, initial),
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
fn avx512(signals: &Signals, steps: &[Step], initial: [f64; 2]) -> [Products; 2] {
    run::<ROW, true>(signals, steps, initial)
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn avx2(signals: &Signals, steps: &[Step], initial: [f64; 2]) -> [Products; 2] {
    run::<HALF, true>(signals, steps, initial)
}

#[inline(always)]
fn run<const TILE: usize, const FMA: bool>(signals: &Signals, steps: &[Step], initial: [f64; 2]) -> [Products; 2] {
    let mut x = initial;
    let mut s = [[0.0; ROW]; 2];
    s[0][INITIAL] = 1.0;
    s[1][INITIAL + 1] = 1.0;
    let mut totals = [[[0.0; ROW]; ROW]; 2];
    let mut rows = [Panel::EMPTY; 2];
    let mut waiting = 0;
    // Masks are rare: a row that does not count is nothing.
    let masked = !signals.weight.is_empty();
    for run in signals.active_runs() {
        let Step { map, d, taps, torque } = &steps[usize::from(run.step)];
        let [v, v_next] = run.voltage;
        let gain: [f64; 2] =
            std::array::from_fn(|a| map.taps[0][a] * v + map.taps[1][a] * v_next + map.torque[a] * run.torque);
        let mut slope = [[0.0; ROW]; 2];
        for a in 0..2 {
            for lane in 0..ROW {
                slope[a][lane] = taps[0][a][lane] * v + taps[1][a][lane] * v_next + torque[a][lane] * run.torque;
            }
        }
        let phi = [map.d[0] + 1.0, map.d[1], map.d[2], map.d[3] + 1.0];
        for (n, y) in (run.start..run.end).zip(&signals.measured[run.start..run.end]) {
            for channel in 0..2 {
                rows[channel].0[waiting] = s[channel];
                rows[channel].0[waiting][ERROR] = y[channel] - x[channel];
                if masked && signals.weight[n][channel] == 0.0 {
                    rows[channel].0[waiting] = [0.0; ROW];
                }
            }
            waiting += 1;
            if waiting == BLOCK {
                add::<TILE, FMA>(&rows, waiting, &mut totals);
                waiting = 0;
            }
            let (s_i, s_w) = (s[0], s[1]);
            for a in 0..2 {
                for lane in 0..ROW {
                    let own = multiply_add::<FMA>(d[2 * a][lane], x[0], slope[a][lane]);
                    let forced = multiply_add::<FMA>(d[2 * a + 1][lane], x[1], own);
                    let turned = multiply_add::<FMA>(phi[2 * a + 1], s_w[lane], forced);
                    s[a][lane] = multiply_add::<FMA>(phi[2 * a], s_i[lane], turned);
                }
            }
            let [i, w] = x;
            x = [i + (map.d[0] * i + map.d[1] * w + gain[0]), w + (map.d[2] * i + map.d[3] * w + gain[1])];
        }
    }
    add::<TILE, FMA>(&rows, waiting, &mut totals);
    for sums in &mut totals {
        for a in HALF..ROW {
            for b in 0..HALF {
                sums[a][b] = sums[b][a];
            }
        }
    }
    totals
}

/// Adds the products of the first `count` rows of both channels; those below the diagonal's halves are left to symmetry.
#[inline(always)]
fn add<const TILE: usize, const FMA: bool>(rows: &[Panel; 2], count: usize, totals: &mut [Products; 2]) {
    for (rows, totals) in rows.iter().zip(totals) {
        own_products::<TILE, FMA>(rows, count, totals);
    }
}
