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
        0..=4 => four(&case),
        5..=8 => eight(&case),
        9..=12 => twelve(&case),
        _ => all(&case),
    }
}

// One for each number of derivatives: whole vectors.
#[multiversion(targets("x86_64+avx2+fma"))]
fn four(case: &Case<'_>) -> [Products; 2] {
    case.products::<4>()
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn eight(case: &Case<'_>) -> [Products; 2] {
    case.products::<8>()
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn twelve(case: &Case<'_>) -> [Products; 2] {
    case.products::<12>()
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn all(case: &Case<'_>) -> [Products; 2] {
    case.products::<20>()
}

// Of the five parameters of the motor, those of extensions, and the two initial states.
const _: () = assert!(Parameter::COUNT + 2 <= 20);

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
    fn products<const P: usize>(&self) -> [Products; 2] {
        let Self { problem, recording, .. } = *self;
        let signals = &problem.signals()[recording];
        let (motor, initial) = self.numbers::<P>();
        let unknowns = self.unknowns();
        let first = problem.first_active(signals);
        let masked = !signals.weight.is_empty();
        let mut totals = [0, 1].map(|_| DMatrix::zeros(unknowns + 1, unknowns + 1));
        let mut rows = [0, 1].map(|_| Vec::with_capacity(BLOCK * (unknowns + 1)));
        let mut n = 0;
        walk_extended(&motor, &signals.drive(), problem.setting(signals), initial, |seen: [Dual<P>; 2]| {
            for channel in 0..2 {
                let counts = !masked || signals.weight[n][channel] != 0.0;
                if n >= first && counts {
                    rows[channel].extend_from_slice(&seen[channel].derivatives[..unknowns]);
                    rows[channel].push(signals.measured[n][channel] - seen[channel].value);
                }
                if rows[channel].len() == BLOCK * (unknowns + 1) {
                    add(&mut totals[channel], &mut rows[channel]);
                }
            }
            n += 1;
        });
        for (total, rows) in totals.iter_mut().zip(&mut rows) {
            add(total, rows);
        }
        totals
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

/// Adds the products of rows to a total, and empties them.
fn add(total: &mut Products, rows: &mut Vec<f64>) {
    let width = total.nrows();
    let rows_of = DMatrix::from_row_slice(rows.len() / width, width, rows);
    total.gemm_tr(1.0, &rows_of, &rows_of, 1.0);
    rows.clear();
}
