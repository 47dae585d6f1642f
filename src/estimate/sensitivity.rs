//! Output errors of a motor with extensions and their derivatives, as sums of products: what `output_error` is for the
//! linear motor, by the oracle itself in numbers that carry derivatives.

use super::normal::Products;
use crate::evaluate::Problem;
use crate::motor::{Dual, Extended, Number as _, Parameter, walk_extended};
use multiversion::multiversion;
use nalgebra::DMatrix;

/// Samples whose products are summed before they go to the total.
const BLOCK: usize = 64;

/// Sums of the products of both channels over the active samples of a recording. Rows hold the derivatives by the
/// coordinates of the axes `own` (places among the free ones), those by the initial state where that is free, and the
/// error.
pub(super) fn products(
    problem: &Problem,
    recording: usize,
    own: &[usize],
    values: &[f64],
    initial: [f64; 2],
) -> [Products; 2] {
    let case = Case { problem, recording, own, values, initial };
    match case.unknowns() {
        0..=8 => few(&case),
        9..=12 => some(&case),
        _ => all(&case),
    }
}

// Derivatives that are carried, and entries of a row with the error behind them: whole vectors.
#[multiversion(targets("x86_64+avx2+fma"))]
fn few(case: &Case<'_>) -> [Products; 2] {
    case.products::<8, 12>()
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn some(case: &Case<'_>) -> [Products; 2] {
    case.products::<12, 16>()
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn all(case: &Case<'_>) -> [Products; 2] {
    case.products::<ALL, 24>()
}

/// Of the five parameters of the motor, those of extensions, and the two initial states.
const ALL: usize = 20;
const _: () = assert!(Parameter::COUNT + 2 <= ALL);

struct Case<'a> {
    problem: &'a Problem,
    recording: usize,
    own: &'a [usize],
    values: &'a [f64],
    initial: [f64; 2],
}

impl Case<'_> {
    fn unknowns(&self) -> usize {
        self.own.len() + if self.problem.signals()[self.recording].initial_is_free { 2 } else { 0 }
    }

    #[inline(always)]
    fn products<const P: usize, const ROW: usize>(&self) -> [Products; 2] {
        let Self { problem, recording, .. } = *self;
        let signals = &problem.signals()[recording];
        let (motor, initial) = self.numbers::<P>();
        let unknowns = self.unknowns();
        let first = problem.first_active(signals);
        let masked = !signals.weight.is_empty();
        let mut sums = [0, 1].map(|_| Sums::<ROW> { size: unknowns + 1, ..Sums::default() });
        let mut n = 0;
        walk_extended(&motor, &signals.drive(), problem.setting(signals), initial, |seen: [Dual<P>; 2]| {
            for channel in 0..2 {
                let counts = !masked || signals.weight[n][channel] != 0.0;
                if n >= first && counts {
                    let mut row = [0.0; ROW];
                    row[..P].copy_from_slice(&seen[channel].derivatives);
                    row[unknowns] = signals.measured[n][channel] - seen[channel].value;
                    sums[channel].add(&row);
                }
            }
            n += 1;
        });
        sums.map(|sums| sums.total())
    }

    /// The motor and its initial state, each with its derivatives by the unknowns.
    fn numbers<const P: usize>(&self) -> (Extended<Dual<P>>, [Dual<P>; 2]) {
        let Self { problem, recording, own, values, initial } = *self;
        let plain = Extended::new(&problem.parameters(values, recording), &problem.extensions(values, recording));
        let constant = |v: f64| Dual::constant(v);
        let mut motor = Extended { motor: plain.motor.map(constant), extensions: plain.extensions.map(constant) };
        for (place, &axis) in own.iter().enumerate() {
            let (axis, value) = (&problem.space().free()[axis], values[axis]);
            let mut number = Dual::constant(value);
            number.derivatives[place] = axis.slope(value);
            motor.set(axis.parameter, number);
        }
        let mut start = initial.map(constant);
        if problem.signals()[recording].initial_is_free {
            start.iter_mut().enumerate().for_each(|(n, state)| state.derivatives[own.len() + n] = 1.0);
        }
        (motor, start)
    }
}

/// Sums of the products of rows, in blocks: rounding then grows with the length of a block.
struct Sums<const ROW: usize> {
    /// Entries of a row that are in use.
    size: usize,
    block: [[f64; ROW]; ROW],
    added: usize,
    whole: [[f64; ROW]; ROW],
}

impl<const ROW: usize> Default for Sums<ROW> {
    fn default() -> Self {
        Self { size: 0, block: [[0.0; ROW]; ROW], added: 0, whole: [[0.0; ROW]; ROW] }
    }
}

impl<const ROW: usize> Sums<ROW> {
    #[inline(always)]
    fn add(&mut self, row: &[f64; ROW]) {
        for (sums, one) in self.block[..self.size].iter_mut().zip(row) {
            for (sum, other) in sums.iter_mut().zip(row) {
                *sum += one * other;
            }
        }
        self.added += 1;
        if self.added == BLOCK {
            self.flush();
        }
    }

    fn flush(&mut self) {
        for (whole, block) in self.whole.iter_mut().flatten().zip(self.block.iter_mut().flatten()) {
            *whole += *block;
            *block = 0.0;
        }
        self.added = 0;
    }

    fn total(mut self) -> Products {
        self.flush();
        DMatrix::from_fn(self.size, self.size, |a, b| self.whole[a][b])
    }
}
