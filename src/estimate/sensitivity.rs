//! Output errors of a motor with extensions and their derivatives, as sums of products: what `output_error` is for the
//! linear motor, by the oracle itself in numbers that carry derivatives.

use super::gram::{BLOCK, HALF, Panel, Square, WIDE, panel_products, product, squares};
use crate::evaluate::{Level, Problem};
use crate::motor::{Dual, Extended, ExtendedWalk, Number as _, Parameter};
use multiversion::multiversion;
use nalgebra::DMatrix;

/// Sums of the products of rows, symmetric; the error is the last entry of a row.
pub(super) type Products = DMatrix<f64>;

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
    match (Level::best(), case.unknowns()) {
        (Level::Portable, 0..=8) => case.products::<8, 2, false>(),
        (Level::Portable, _) => case.products::<ALL, 3, false>(),
        (_, 0..=8) => few(&case),
        (_, 9..=12) => some(&case),
        _ => all(&case),
    }
}

// Derivatives that are carried, and panels of a row with the error behind them.
#[multiversion(targets("x86_64+avx2+fma"))]
fn few(case: &Case<'_>) -> [Products; 2] {
    case.products::<8, 2, true>()
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn some(case: &Case<'_>) -> [Products; 2] {
    case.products::<12, 2, true>()
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn all(case: &Case<'_>) -> [Products; 2] {
    case.products::<ALL, 3, true>()
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
    fn products<const P: usize, const PANELS: usize, const FMA: bool>(&self) -> [Products; 2] {
        let Self { problem, recording, .. } = *self;
        let signals = &problem.signals()[recording];
        let (motor, initial) = self.numbers::<P>();
        let unknowns = self.unknowns();
        let first = problem.first_active(signals);
        let masked = !signals.weight.is_empty();
        let mut sums = [0, 1].map(|_| Sums::<PANELS>::new());
        let drive = signals.drive();
        let mut walk = ExtendedWalk::new(&motor, &drive, problem.settings(signals), initial);
        // A closure, or an adapter of iterators, would not be compiled for the vectors of this function.
        for (n, measured) in signals.measured.iter().enumerate() {
            let Some(seen) = walk.next() else { break };
            for channel in 0..2 {
                if n >= first && (!masked || signals.weight[n][channel] != 0.0) {
                    let mut row = [[0.0; WIDE]; PANELS];
                    row.as_flattened_mut()[..P].copy_from_slice(&seen[channel].derivatives);
                    row.as_flattened_mut()[unknowns] = measured[channel] - seen[channel].value;
                    sums[channel].add::<FMA>(&row);
                }
            }
        }
        sums.map(|sums| sums.total::<FMA>(unknowns + 1))
    }

    /// The motor and its initial state, each with its derivatives by the unknowns.
    fn numbers<const P: usize>(&self) -> (Extended<Dual<P>>, [Dual<P>; 2]) {
        let Self { problem, recording, own, values, initial } = *self;
        let constant = |v: f64| Dual::constant(v);
        let mut motor = problem.motor(values, recording).map(constant);
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

/// Sums of the products of rows, in blocks: rounding then grows with the length of a block, and sums stay in registers.
struct Sums<const PANELS: usize> {
    rows: [Panel; PANELS],
    waiting: usize,
    totals: Vec<Square>,
}

impl<const PANELS: usize> Sums<PANELS> {
    fn new() -> Self {
        Self { rows: [Panel::EMPTY; PANELS], waiting: 0, totals: squares(PANELS) }
    }

    #[inline(always)]
    fn add<const FMA: bool>(&mut self, row: &[[f64; WIDE]; PANELS]) {
        for (panel, part) in self.rows.iter_mut().zip(row) {
            panel.0[self.waiting] = *part;
        }
        self.waiting += 1;
        if self.waiting == BLOCK {
            self.flush::<FMA>();
        }
    }

    #[inline(always)]
    fn flush<const FMA: bool>(&mut self) {
        panel_products::<HALF, FMA>(&self.rows, self.waiting, &mut self.totals);
        self.waiting = 0;
    }

    /// Returns the sums of the first `size` entries of a row.
    #[inline(always)]
    fn total<const FMA: bool>(mut self, size: usize) -> Products {
        self.flush::<FMA>();
        DMatrix::from_fn(size, size, |a, b| product(&self.totals, a, b))
    }
}
