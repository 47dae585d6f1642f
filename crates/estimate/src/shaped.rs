//! Sums of products of output sensitivities after a shaping filter: `Xᵀ Γ X` with the covariance Γ of a stationary
//! autoregression.
//!
//! With innovations of variance one the residuals are `e[n] = Σ h[k] ε[n−k]`, h the impulse response of `1/A`. Hence
//! `Xᵀ Γ X = Σ_m Z[m] Z[m]ᵀ` with `Z[m] = Σ_n X[n] h[n−m]` over all m: X filtered backwards in time, including the ring-out
//! before the first sample. The sums depend on `Σ h[k] h[k+l]` alone, so the filter may equally run forwards with its
//! ring-out after the last sample. The ring-out contributes `Sᵀ P S` for the state S of the filter after the last sample,
//! `P = a aᵀ + Fᵀ P F` with the filter's companion matrix F and its coefficients a.

use super::sensitivity::{ALL, Case, Products, Sums};
use motorfit_evaluate::{Level, at_level};
use motorfit_motor::{ExtendedWalk, multiply_add};
use nalgebra::DMatrix;

/// Returns `Xᵀ Γ X` of both channels for innovations of variance one. X holds the sensitivities to the case's unknowns at
/// the samples that count, `filters` the coefficients of the autoregression of each channel.
pub(super) fn shaped_products(case: &Case<'_>, filters: &[Vec<f64>; 2]) -> [Products; 2] {
    match (Level::best(), case.unknowns()) {
        (Level::Portable, _) => portable(case, filters),
        (_, 0..=8) => few(case, filters),
        _ => all(case, filters),
    }
}

at_level! {
    fn few(case: &Case<'_>, filters: &[Vec<f64>; 2]) -> [Products; 2] = avx2 { run::<8, true>(case, filters) } else portable
}

at_level! {
    fn all(case: &Case<'_>, filters: &[Vec<f64>; 2]) -> [Products; 2] = avx2 { run::<ALL, true>(case, filters) } else portable
}

fn portable(case: &Case<'_>, filters: &[Vec<f64>; 2]) -> [Products; 2] {
    run::<ALL, false>(case, filters)
}

#[inline(always)]
fn run<const P: usize, const FMA: bool>(case: &Case<'_>, filters: &[Vec<f64>; 2]) -> [Products; 2] {
    let Case { problem, recording, .. } = *case;
    let signals = &problem.signals()[recording];
    let (motor, initial) = case.numbers::<P>();
    let first = problem.first_active(signals);
    let drive = signals.drive();
    let mut shaping = [0, 1].map(|channel| Shaping::<P>::new(&filters[channel]));
    let mut sums = [0, 1].map(|_| Sums::<P>::new(case.unknowns()));
    let mut walk = ExtendedWalk::composed(&motor, &drive, problem.settings(signals), (initial, signals.split.as_ref()));
    // A loop, because closures and iterator adapters would not be compiled for the target features of this function.
    for n in 0..signals.len() {
        let Some(seen) = walk.next() else { break };
        if n < first {
            continue;
        }
        for channel in 0..2 {
            // The residuals are those of the samples that were measured.
            if !signals.is_measured(channel, n) {
                continue;
            }
            // A masked sample is a row of zeros; the filter continues.
            let row = if signals.counts(channel, n) { seen[channel].derivatives } else { [0.0; P] };
            sums[channel].add::<FMA>(&shaping[channel].next::<FMA>(row));
        }
    }
    let [current, speed] = sums;
    let [of_current, of_speed] = shaping.map(|shaping| shaping.ring_out(case.unknowns()));
    [current.total::<FMA>() + of_current, speed.total::<FMA>() + of_speed]
}

/// The filter `1/A`, applied to rows.
struct Shaping<'a, const P: usize> {
    coefficients: &'a [f64],
    /// Ring buffer of the last filtered rows; the newest is at `latest`.
    past: Vec<[f64; P]>,
    latest: usize,
}

impl<'a, const P: usize> Shaping<'a, P> {
    fn new(coefficients: &'a [f64]) -> Self {
        Self { coefficients, past: vec![[0.0; P]; coefficients.len()], latest: 0 }
    }

    #[inline(always)]
    fn next<const FMA: bool>(&mut self, mut row: [f64; P]) -> [f64; P] {
        let (before, after) = self.past.split_at(self.latest);
        for (a, past) in self.coefficients.iter().zip(after.iter().chain(before)) {
            for (entry, past) in row.iter_mut().zip(past) {
                *entry = multiply_add::<FMA>(*a, *past, *entry);
            }
        }
        if !self.past.is_empty() {
            self.latest = (if self.latest == 0 { self.past.len() } else { self.latest }) - 1;
            self.past[self.latest] = row;
        }
        row
    }

    /// Returns the sum of products of the filter's outputs after the last row, with zero input, over the first `size`
    /// entries.
    fn ring_out(&self, size: usize) -> Products {
        let order = self.past.len();
        let state = DMatrix::from_fn(order, size, |k, entry| self.past[(self.latest + k) % order.max(1)][entry]);
        state.transpose() * gramian(self.coefficients) * state
    }
}

/// Largest number of squarings of the companion matrix: 2⁶⁰ samples.
const SQUARINGS: usize = 60;

/// Returns `Σ (Fᵀ)ᵐ a aᵀ Fᵐ` over m from 0 by doubling: each pass doubles the number of terms.
fn gramian(coefficients: &[f64]) -> DMatrix<f64> {
    let order = coefficients.len();
    let mut total = DMatrix::from_fn(order, order, |row, column| coefficients[row] * coefficients[column]);
    let companion = |row: usize, column: usize| match row {
        0 => coefficients[column],
        _ => f64::from(u8::from(row == column + 1)),
    };
    let mut power = DMatrix::from_fn(order, order, companion);
    for _ in 0..SQUARINGS {
        let more = power.transpose() * &total * &power;
        let is_done = more.norm() <= 1e-12 * total.norm();
        total += more;
        if is_done || order == 0 {
            break;
        }
        power = &power * &power;
    }
    total
}

/// Returns `Xᵀ Γ X` of any number of columns for innovations of variance one; an empty row is one of zeros.
pub(super) fn shaped_rows<'a>(
    rows: impl Iterator<Item = &'a [f64]>,
    width: usize,
    coefficients: &[f64],
) -> DMatrix<f64> {
    let order = coefficients.len();
    let mut past = vec![vec![0.0; width]; order.max(1)];
    let mut latest = 0;
    let mut total = DMatrix::zeros(width, width);
    for own in rows {
        let mut row = vec![0.0; width];
        row.iter_mut().zip(own).for_each(|(value, own)| *value = *own);
        for (k, a) in coefficients.iter().enumerate() {
            row.iter_mut().zip(&past[(latest + k) % order]).for_each(|(value, past)| *value += a * past);
        }
        for a in 0..width {
            for b in 0..width {
                total[(a, b)] += row[a] * row[b];
            }
        }
        latest = (latest + order.max(1) - 1) % order.max(1);
        past[latest] = row;
    }
    let state = DMatrix::from_fn(order, width, |k, entry| past[(latest + k) % order.max(1)][entry]);
    total + state.transpose() * gramian(coefficients) * state
}
