//! Steiglitz–McBride: both transfer functions, with a shared denominator, by iterated prefiltering and least squares.
//!
//! Each iteration filters all signals by 1/Â, with Â the denominator of the previous iteration, and solves
//! `y_F(n) = −a₁ y_F(n−1) − a₂ y_F(n−2) + Σ b_k u_F(n−k)` for current and speed together by QR, each channel divided by its
//! noise σ. Roots outside the unit circle are reflected. The iteration ends when a step is far below its standard error.
//! Reference: K. Steiglitz, L. E. McBride, IEEE Trans. Automatic Control 10 (1965). [`super::recover`] converts the result to
//! motor parameters.

use super::failure::SmFailure;
use super::motor::first_sigma;
use super::recover::{Sampled, recover};
use super::refine::{check_plain, plain};
use super::triangle::{BLOCK, Triangle, Upper, solve};
use motorfit_core::numeric::count;
use motorfit_core::{Error, Result};
use motorfit_evaluate::{Model, Problem, Signals};
use motorfit_motor::{Discretization, Parameters};
use motorfit_record::Record;
use std::ops::Range;

/// The estimate of Steiglitz–McBride.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The estimated motor.
    pub parameters: Parameters,
    /// Number of least-squares solutions, one for each prefilter.
    pub iterations: usize,
    /// True if the last step was far below its standard error.
    pub converged: bool,
    /// True if the estimate is from a copy at even steps, because the recording has an irregular clock.
    pub is_resampled: bool,
}

/// Estimates the motor of one recording; the inner result holds the reason if there is no estimate.
///
/// # Errors
/// Propagates the errors of [`Signals::new`].
pub fn steiglitz_mcbride(record: &Record, model: Model) -> Result<std::result::Result<Estimate, SmFailure>> {
    let Model { discretization, initial } = model;
    Ok(estimate(&Signals::new(record, &plain(), initial, discretization)?, discretization))
}

/// Estimates like [`steiglitz_mcbride`] on a recording of a problem made by [`super::fit_problem`]; the search space of the
/// problem is ignored.
///
/// # Errors
/// Returns `Usage` if the problem has another criterion or no recording of this index.
pub fn steiglitz_mcbride_on(problem: &Problem, recording: usize) -> Result<std::result::Result<Estimate, SmFailure>> {
    check_plain(problem)?;
    let Some(signals) = problem.signals().get(recording) else {
        let message = format!("recording {recording} of {}", problem.signals().len());
        return Err(Error::usage(message, "Count recordings from 0."));
    };
    Ok(estimate(signals, problem.model().discretization))
}

/// Largest number of iterations.
const ITERATIONS_MAX: usize = 60;
/// Length of a step, in standard errors, below which the iteration ends.
const STEP_MAX: f64 = 1e-3;
/// Ratio of a pivot of R to the norm of its column below which the excitation is rank-deficient.
const RANK: f64 = 1e-11;

/// Columns of each channel: its values at n − 2, n − 1 and n.
const OWN: usize = 3;

/// The signals and the layout of the regression.
struct Columns<'a> {
    signals: &'a Signals,
    /// Smallest k in Σ b_k u(n−k): 0 for a first-order hold, else 1.
    first_tap: usize,
    /// True if a torque was recorded and is not zero.
    torque: bool,
    /// True if the transient from the first sample needs columns of its own.
    moving: bool,
    /// Noise σ of current \[A\] and speed \[rad/s\].
    sigma: [f64; 2],
}

/// Solution of one least-squares problem.
struct Solution {
    sampled: Sampled,
    /// Triangular factor of the denominator's regression; its last diagonal entry is the norm of the residuals.
    triangle: Upper,
}

fn estimate(signals: &Signals, method: Discretization) -> std::result::Result<Estimate, SmFailure> {
    if !(signals.has(0) && signals.has(1)) {
        return Err(SmFailure::ChannelMissing);
    }
    if !signals.step_index.is_empty() {
        return Err(SmFailure::Irregular);
    }
    let foh = method.uses_next_input();
    let columns = Columns {
        signals,
        first_tap: usize::from(!foh),
        torque: signals.torque.iter().any(|t| *t != 0.0),
        moving: !signals.starts_at_rest() || (foh && signals.voltage[0] != 0.0),
        sigma: first_sigma(signals),
    };
    let mut last: Option<([f64; 2], f64)> = None;
    let (mut solution, mut converged, mut iterations) = (columns.solve([0.0; 2])?, false, 1);
    while iterations < ITERATIONS_MAX {
        let (denominator, mut moved) = (solution.sampled.denominator, f64::INFINITY);
        if let Some((before, moved_before)) = last {
            let step = [denominator[0] - before[0], denominator[1] - before[1]];
            moved = f64::max(step[0].abs(), step[1].abs());
            // Without noise both the step and its standard error shrink to rounding errors, so a step that no longer
            // decreases also ends the iteration.
            if is_short(step, &solution.triangle, signals.len()) || (moved < 1e-9 && moved > 0.3 * moved_before) {
                converged = true;
                break;
            }
        }
        last = Some((denominator, moved));
        solution = columns.solve(reflected(denominator))?;
        iterations += 1;
    }
    let parameters = recover(&solution.sampled, signals.step_s[0], method)?;
    Ok(Estimate { parameters, iterations, converged, is_resampled: false })
}

/// Returns true if a step of the denominator is shorter than [`STEP_MAX`] standard errors.
fn is_short(step: [f64; 2], r: &Upper, samples: usize) -> bool {
    let length = (r[0][0] * step[0] + r[0][1] * step[1]).powi(2) + (r[1][1] * step[1]).powi(2);
    let variance = r[2][2] * r[2][2] / count(2 * samples);
    length <= STEP_MAX * STEP_MAX * variance
}

/// Returns the coefficients of `z² + a₁ z + a₂` with the roots outside the unit circle reflected into it.
fn reflected([a1, a2]: [f64; 2]) -> [f64; 2] {
    let discriminant = a1 * a1 - 4.0 * a2;
    if discriminant < 0.0 {
        return if a2 > 1.0 { [a1 / a2, 1.0 / a2] } else { [a1, a2] };
    }
    let far = -0.5 * (a1 + discriminant.sqrt().copysign(a1));
    let near = if far == 0.0 { 0.0 } else { a2 / far };
    let inside = |z: f64| if z.abs() > 1.0 { 1.0 / z } else { z };
    let (z1, z2) = (inside(far), inside(near));
    [-(z1 + z2), z1 * z2]
}

impl Columns<'_> {
    /// Solves the least-squares problem with all signals filtered by 1/Â.
    fn solve(&self, filter: [f64; 2]) -> std::result::Result<Solution, SmFailure> {
        let taps = 3 - self.first_tap;
        let common = taps + if self.torque { 2 } else { 0 } + if self.moving { 2 } else { 0 };
        let own = [common, common + OWN];
        let mut triangle = Triangle::of_two(common, OWN);
        self.add(filter, &mut triangle);
        let (all, norms) = triangle.finish();
        if (0..common).any(|n| all[n][n].abs() <= RANK * norms[n] || norms[n].is_nan()) {
            return Err(SmFailure::RankDeficient);
        }
        // The rows of R that concern the denominator, with the numerators of each channel eliminated.
        let reduced = |column: usize| -> [f64; 2 * OWN] {
            std::array::from_fn(|n| all[common + n][own[n / OWN] + column] / self.sigma[n / OWN])
        };
        let mut shared = Triangle::new(OWN);
        shared.add(&[&reduced(0), &reduced(1), &reduced(2)]);
        let (r, norms) = shared.finish();
        if !(0..2).all(|n| r[n][n].abs() > 1e-3 * RANK * norms[n]) {
            return Err(SmFailure::RankDeficient);
        }
        let lags = solve(&r, 2, &[r[0][2], r[1][2]]).ok_or(SmFailure::RankDeficient)?;
        let numerator = |own: usize| {
            let right = all.iter().map(|row| row[own + 2] - row[own] * lags[0] - row[own + 1] * lags[1]);
            let right: Vec<f64> = right.take(common).collect();
            solve(&all, common, &right).map(|all: Vec<f64>| all[..taps].to_vec())
        };
        let [Some(of_current), Some(of_speed)] = own.map(numerator) else { return Err(SmFailure::RankDeficient) };
        let denominator = [-lags[0], -lags[1]];
        Ok(Solution { sampled: Sampled { denominator, numerators: [of_current, of_speed] }, triangle: r })
    }

    /// Filters all samples and adds the rows of both channels to the triangular factor.
    fn add(&self, filter: [f64; 2], triangle: &mut Triangle) {
        // The filtered signals, each preceded by the last two values of the previous block: voltage, torque, a unit impulse
        // at the first sample, current, speed.
        let mut filtered = [[0.0; BLOCK + 2]; 5];
        for start in (0..self.signals.len()).step_by(BLOCK) {
            let count = BLOCK.min(self.signals.len() - start);
            self.filter(filter, start..start + count, &mut filtered);
            let lag = |signal: usize, by: usize| &filtered[signal][2 - by..][..count];
            let mut columns: Vec<&[f64]> = (self.first_tap..3).map(|tap| lag(0, tap)).collect();
            if self.torque {
                columns.extend([lag(1, 1), lag(1, 2)]);
            }
            if self.moving {
                columns.extend([lag(2, 0), lag(2, 1)]);
            }
            columns.extend([3, 4].into_iter().flat_map(|signal| [1, 2, 0].map(|by| lag(signal, by))));
            triangle.add(&columns);
            filtered.iter_mut().for_each(|signal| signal.copy_within(BLOCK.., 0));
        }
    }

    /// Filters a block of samples; the results are stored after the two values of the previous block.
    fn filter(&self, [a1, a2]: [f64; 2], samples: Range<usize>, filtered: &mut [[f64; BLOCK + 2]; 5]) {
        let Self { signals, torque, .. } = *self;
        let mut past: [[f64; 2]; 5] = std::array::from_fn(|s| [filtered[s][1], filtered[s][0]]);
        for (offset, n) in samples.enumerate() {
            let [current, speed] = signals.measured[n];
            let load = if torque { signals.torque[n] } else { 0.0 };
            let inputs = [signals.voltage[n], load, if n == 0 { 1.0 } else { 0.0 }, current, speed];
            for (s, [one, two]) in past.iter_mut().enumerate() {
                let now = (inputs[s] - a2 * *two) - a1 * *one;
                filtered[s][offset + 2] = now;
                [*one, *two] = [now, *one];
            }
        }
    }
}
