//! Output errors of a motor with extensions and their derivatives, as sums of products. The scalar simulation runs on dual
//! numbers; [`super::output_error`] serves the linear motor.

use super::gram::BLOCK;
use motorfit_evaluate::{Level, Problem, at_level};
use motorfit_motor::{Dual, Extended, ExtendedWalk, Number as _, Parameter, multiply_add};
use nalgebra::DMatrix;

/// Sums of the products of rows, symmetric; the error is the last entry of a row.
pub(super) type Products = DMatrix<f64>;

/// Returns the sums of the products of both channels over the active samples of a recording. A row holds the derivatives
/// with respect to the coordinates of the axes `own` (indices of free axes), those with respect to the initial state if it
/// is free, and the error.
pub(super) fn products(
    problem: &Problem,
    recording: usize,
    own: &[usize],
    values: &[f64],
    initial: [f64; 2],
) -> [Products; 2] {
    let case = Case { problem, recording, own, values, initial };
    match (Level::best(), case.unknowns()) {
        (Level::Portable, _) => portable(&case),
        (_, 0..=8) => few(&case),
        (_, 9..=12) => some(&case),
        _ => all(&case),
    }
}

// The numbers of derivatives and of entries of a row (derivatives and error) fill complete vectors.
at_level! {
    fn few(case: &Case<'_>) -> [Products; 2] = avx2 { case.products::<8, 12, true>() } else portable
}

at_level! {
    fn some(case: &Case<'_>) -> [Products; 2] = avx2 { case.products::<12, 16, true>() } else portable
}

at_level! {
    fn all(case: &Case<'_>) -> [Products; 2] = avx2 { case.products::<ALL, 24, true>() } else portable
}

fn portable(case: &Case<'_>) -> [Products; 2] {
    if case.unknowns() <= 8 { case.products::<8, 12, false>() } else { case.products::<ALL, 24, false>() }
}

/// Largest number of derivatives: the parameters of the motor and its extensions, and the two initial states, rounded up to
/// whole vectors. A model with more parameters must raise it.
pub(super) const ALL: usize = 20;
const _: () = assert!(Parameter::COUNT + 2 <= ALL);

/// A recording at given parameters and from a given initial state.
pub(super) struct Case<'a> {
    pub problem: &'a Problem,
    pub recording: usize,
    /// The free axes that the rows have entries for.
    pub own: &'a [usize],
    pub values: &'a [f64],
    pub initial: [f64; 2],
}

impl Case<'_> {
    /// Returns the number of unknowns of a row.
    pub(super) fn unknowns(&self) -> usize {
        self.own.len() + if self.problem.signals()[self.recording].initial_is_free { 2 } else { 0 }
    }

    #[inline(always)]
    fn products<const P: usize, const ROW: usize, const FMA: bool>(&self) -> [Products; 2] {
        let Self { problem, recording, .. } = *self;
        let signals = &problem.signals()[recording];
        let (motor, initial) = self.numbers::<P>();
        let unknowns = self.unknowns();
        let first = problem.first_active(signals);
        let masked = !signals.weight.is_empty();
        let mut sums = [0, 1].map(|_| Sums::<ROW>::new(unknowns + 1));
        let drive = signals.drive();
        let mut walk =
            ExtendedWalk::composed(&motor, &drive, problem.settings(signals), (initial, signals.split.as_ref()));
        // A loop, because closures and iterator adapters would not be compiled for the target features of this function.
        for (n, measured) in signals.measured.iter().enumerate() {
            let Some(seen) = walk.next() else { break };
            for channel in 0..2 {
                if n >= first && (!masked || signals.weight[n][channel] != 0.0) {
                    let mut row = [0.0; ROW];
                    row[..P].copy_from_slice(&seen[channel].derivatives);
                    row[unknowns] = measured[channel] - seen[channel].value;
                    sums[channel].add::<FMA>(&row);
                }
            }
        }
        let [current, speed] = sums;
        [current.total::<FMA>(), speed.total::<FMA>()]
    }

    /// Returns the motor and its initial state, with their derivatives with respect to the unknowns.
    pub(super) fn numbers<const P: usize>(&self) -> (Extended<Dual<P>>, [Dual<P>; 2]) {
        let Self { problem, recording, own, values, initial } = *self;
        let constant = |v: f64| Dual::constant(v);
        let mut motor = problem.motor(values, recording).map(constant);
        for (n, &axis) in own.iter().enumerate() {
            let (axis, value) = (&problem.space().free()[axis], values[axis]);
            let mut number = Dual::constant(value);
            number.derivatives[n] = axis.slope(value);
            motor.set(axis.parameter, number);
        }
        let mut start = initial.map(constant);
        if problem.signals()[recording].initial_is_free {
            start.iter_mut().enumerate().for_each(|(n, state)| state.derivatives[own.len() + n] = 1.0);
        }
        (motor, start)
    }
}

/// Sums of the products of rows, accumulated in blocks: rounding grows with the length of a block only, and the sums stay
/// in registers.
pub(super) struct Sums<const ROW: usize> {
    /// Number of entries of a row that are in use.
    size: usize,
    rows: [[f64; ROW]; BLOCK],
    filled: usize,
    totals: [[f64; ROW]; ROW],
}

/// Number of rows of the sums that are in registers at a time.
const TILE: usize = 2;

impl<const ROW: usize> Sums<ROW> {
    pub(super) fn new(size: usize) -> Self {
        Self { size, rows: [[0.0; ROW]; BLOCK], filled: 0, totals: [[0.0; ROW]; ROW] }
    }

    #[inline(always)]
    pub(super) fn add<const FMA: bool>(&mut self, row: &[f64; ROW]) {
        self.rows[self.filled] = *row;
        self.filled += 1;
        if self.filled == BLOCK {
            self.flush::<FMA>();
        }
    }

    #[inline(always)]
    fn flush<const FMA: bool>(&mut self) {
        for (tile, totals) in self.totals[..self.size.next_multiple_of(TILE)].chunks_exact_mut(TILE).enumerate() {
            let mut sums = [[0.0; ROW]; TILE];
            for row in &self.rows[..self.filled] {
                for (a, sums) in sums.iter_mut().enumerate() {
                    let one = row[tile * TILE + a];
                    for (sum, other) in sums.iter_mut().zip(row) {
                        *sum = multiply_add::<FMA>(one, *other, *sum);
                    }
                }
            }
            for (totals, sum) in totals.iter_mut().flatten().zip(sums.iter().flatten()) {
                *totals += sum;
            }
        }
        self.filled = 0;
    }

    #[inline(always)]
    pub(super) fn total<const FMA: bool>(mut self) -> Products {
        self.flush::<FMA>();
        DMatrix::from_fn(self.size, self.size, |a, b| self.totals[a][b])
    }
}
