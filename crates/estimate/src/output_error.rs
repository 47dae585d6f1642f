//! Output errors of the linear motor and their derivatives, as sums of products.
//!
//! Each sample and channel has the row `[∂x/∂ln R … ∂x/∂ln J, ∂x/∂i₀, ∂x/∂ω₀, y − x]`. The products of the row with itself
//! are summed: JᵀJ, Jᵀe and eᵀe in one symmetric matrix of shape `[8, 8]`. The derivatives follow the one-step map: with
//! `x⁺ = x + D x + g`, `S⁺ = Φ S + ∂D x + ∂g`.
//!
//! Cost: a sample takes 2×5 vector operations of 8 lanes for the derivatives of the state and 2×8 for the products.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::gram::{BLOCK, HALF, Panel, Square, own_products};
use super::linear_steps::{INITIAL, ROW, SplitTables, Step, Steps, WholeSteps};
use motorfit_evaluate::{Level, Signals, at_level};
use motorfit_motor::{Method, Parameters, seeded, step_maps};

/// Index of the error in a row.
pub(super) const ERROR: usize = 7;

/// Sums of the products of rows, a symmetric matrix.
type Products = Square;

/// A recording simulated at given parameters from a given initial state.
struct Case<'a> {
    signals: &'a Signals,
    parameters: &'a Parameters,
    initial: [f64; 2],
    method: Method,
}

/// Returns the sums of the products of both channels (current, speed) over the active samples of a recording, from the
/// state `initial`.
pub(super) fn products(signals: &Signals, parameters: &Parameters, initial: [f64; 2], method: Method) -> [Products; 2] {
    let case = Case { signals, parameters, initial, method };
    match Level::best() {
        Level::Avx512 => avx512(&case),
        Level::Avx2 => avx2(&case),
        Level::Portable => portable(&case),
    }
}

at_level! {
    fn avx512(case: &Case<'_>) -> [Products; 2] = avx512 { run::<ROW, true>(case) } else avx2
}

at_level! {
    fn avx2(case: &Case<'_>) -> [Products; 2] = avx2 { run::<HALF, true>(case) } else portable
}

fn portable(case: &Case<'_>) -> [Products; 2] {
    run::<HALF, false>(case)
}

#[inline(always)]
fn run<const TILE: usize, const FMA: bool>(case: &Case<'_>) -> [Products; 2] {
    let Case { signals, parameters, method, .. } = *case;
    let motor = seeded(parameters);
    // Loops, because iterator adapters would not be compiled for the target features of this function.
    let Some(split) = &signals.split else {
        let mut steps = Vec::with_capacity(signals.step_s.len());
        for h in &signals.step_s {
            steps.push(Step::new(&step_maps(&motor, *h, method)));
        }
        return walk::<TILE, FMA, 1>(case, &WholeSteps(steps));
    };
    let tables = split.tables(&motor, method);
    let [mut coarse, mut fine] = [Vec::with_capacity(tables[0].len()), Vec::with_capacity(tables[1].len())];
    for maps in &tables[0] {
        coarse.push(Step::new(maps));
    }
    for maps in &tables[1] {
        fine.push(Step::new(maps));
    }
    walk::<TILE, FMA, 2>(case, &SplitTables { split, coarse, fine, is_first_order_hold: method.uses_next_input() })
}

/// Returns the sums over the active samples; each step has `PARTS` parts.
#[inline(always)]
fn walk<const TILE: usize, const FMA: bool, const PARTS: usize>(
    case: &Case<'_>,
    steps: &impl Steps<PARTS>,
) -> [Products; 2] {
    let Case { signals, initial, .. } = *case;
    let mut x = initial;
    let mut s = [[0.0; ROW]; 2];
    s[0][INITIAL] = 1.0;
    s[1][INITIAL + 1] = 1.0;
    let mut totals = [[[0.0; ROW]; ROW]; 2];
    let mut rows = [Panel::EMPTY; 2];
    let mut filled = 0;
    // A masked sample becomes a row of zeros; masks are too rare for a separate loop.
    let masked = !signals.weight.is_empty();
    for run in signals.active_runs() {
        let parts = steps.parts(run);
        for (n, y) in (run.start..run.end).zip(&signals.measured[run.start..run.end]) {
            for channel in 0..2 {
                rows[channel].0[filled] = s[channel];
                rows[channel].0[filled][ERROR] = y[channel] - x[channel];
                if masked && signals.weight[n][channel] == 0.0 {
                    rows[channel].0[filled] = [0.0; ROW];
                }
            }
            filled += 1;
            if filled == BLOCK {
                add::<TILE, FMA>(&rows, filled, &mut totals);
                filled = 0;
            }
            for part in &parts {
                part.pass::<FMA>(&mut x, &mut s);
            }
        }
    }
    add::<TILE, FMA>(&rows, filled, &mut totals);
    for sums in &mut totals {
        for a in HALF..ROW {
            for b in 0..HALF {
                sums[a][b] = sums[b][a];
            }
        }
    }
    totals
}

/// Adds the products of the first `count` rows of both channels, except those that symmetry gives.
#[inline(always)]
fn add<const TILE: usize, const FMA: bool>(rows: &[Panel; 2], count: usize, totals: &mut [Products; 2]) {
    for (rows, totals) in rows.iter().zip(totals) {
        own_products::<TILE, FMA>(rows, count, totals);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{fit_problem, simulated::simulated};
    use motorfit_evaluate::{Initial, Model};
    use motorfit_motor::{Discretization, Space};
    use std::sync::Arc;

    #[test]
    fn steps_in_two_parts_give_the_sums_of_whole_steps() {
        let time_s: Vec<f64> = (0..300).map(|n| 1e-3 * (f64::from(n) + 0.3 * (1.7 * f64::from(n)).sin())).collect();
        let voltage = time_s.iter().map(|t| 10.0 * (40.0 * t).sin()).collect();
        let torque = Some(time_s.iter().map(|t| 0.02 * (90.0 * t).cos()).collect());
        let record = simulated(time_s, voltage, torque);
        let motor = Parameters { k: 0.06, ..Parameters::M2 };
        for discretization in [Discretization::Zoh, Discretization::Foh] {
            let model = Model { discretization, initial: Initial::Measured };
            let problem = fit_problem(std::slice::from_ref(&record), &Space::table2(), model).unwrap();
            let mut signals = problem.signals()[0].clone();
            assert!(signals.split.is_some());
            let parts = products(&signals, &motor, [0.1, 1.0], problem.method());
            Arc::make_mut(&mut signals).split = None;
            let whole = products(&signals, &motor, [0.1, 1.0], problem.method());
            for (parts, whole) in parts.iter().zip(&whole) {
                for (a, b) in (0..ROW).flat_map(|a| (0..ROW).map(move |b| (a, b))) {
                    let size = (whole[a][a] * whole[b][b]).sqrt();
                    // The tolerance covers rounding: maps are composed of up to 32 maps, trajectories of 300 steps.
                    assert!((parts[a][b] - whole[a][b]).abs() <= 1e-11 * size, "{discretization:?} {a} {b}");
                }
            }
        }
    }
}
