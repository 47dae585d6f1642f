//! A speed as the voltage filtered by a first-order lag, fitted by its output error: the time constant on a grid.

use super::regression::{Row, Solution, Sums};
use crate::numeric::{count, mean, squares_about};

/// Time constants of the grid, from half a block to this part of the blocks, each this many times the one before.
const LONGEST: f64 = 0.5;
const RATIO: f64 = 1.5;
/// Parts of the best of them that are tried then.
const FINE: [f64; 8] = [0.7, 0.8, 0.88, 0.94, 1.06, 1.13, 1.25, 1.4];
/// Samples are put together to so many blocks at most.
const BLOCKS: usize = 500;

/// Means of voltage and speed over blocks of samples.
pub(super) struct Blocks {
    pub volts: Vec<f64>,
    pub speed: Vec<f64>,
    /// Samples in a block.
    pub length: usize,
}

impl Blocks {
    pub(super) fn new(volts: &[f64], speed: &[f64]) -> Self {
        let length = volts.len().div_ceil(BLOCKS).max(1);
        let blocks = |values: &[f64]| values.chunks_exact(length).map(mean).collect();
        Self { volts: blocks(volts), speed: blocks(speed), length }
    }

    /// Returns the best fit of the speed by functions of the voltage, at most [`super::regression::WIDTH`], each behind one
    /// lag, that `is_allowed` by its coefficients; of all time constants, or of those near one in blocks.
    pub(super) fn fit(
        &self,
        functions: &[&dyn Fn(f64) -> f64],
        near: Option<f64>,
        is_allowed: impl Fn(&Row) -> bool,
    ) -> Option<Fit> {
        let mut best: Option<Fit> = None;
        let mut try_one = |constant: f64| {
            let decay = (-1.0 / constant).exp();
            let (solution, left) = self.fit_with(functions, decay);
            if is_allowed(&solution.coefficients) && best.as_ref().is_none_or(|best| left < best.left) {
                best = Some(Fit { constant, decay, solution, left });
            }
            best.as_ref().map(|best| best.constant)
        };
        let middle = near.or_else(|| {
            let longest = LONGEST * count(self.speed.len());
            let mut grid = std::iter::successors(Some(0.5), |constant| Some(RATIO * constant));
            grid.by_ref().take_while(|constant| *constant < longest).fold(None, |_, constant| try_one(constant))
        })?;
        FINE.iter().for_each(|part| {
            try_one(middle * part);
        });
        best
    }

    fn fit_with(&self, functions: &[&dyn Fn(f64) -> f64], decay: f64) -> (Solution, f64) {
        let mut sums = Sums::default();
        self.rows(functions, decay, |row, speed| sums.add(row, speed));
        let solution = sums.solve();
        let mut left = 0.0;
        self.rows(functions, decay, |row, speed| left += (speed - solution.predicted(row)).powi(2));
        (solution, left)
    }

    fn rows(&self, functions: &[&dyn Fn(f64) -> f64], decay: f64, mut visit: impl FnMut(&Row, f64)) {
        let mut row = Row::default();
        // The mean over a block of a lag that the block's voltage drives.
        let inside = 1.0 - (1.0 - decay) / -decay.ln();
        let mut states = Row::default();
        for (volts, speed) in self.volts.iter().zip(&self.speed) {
            for ((value, state), function) in row.iter_mut().zip(&mut states).zip(functions) {
                let end = function(*volts);
                *value = *state + inside * (end - *state);
                *state = end + decay * (*state - end);
            }
            visit(&row, *speed);
        }
    }

    /// Returns the sum of squares about the mean of the speed.
    pub(super) fn squares(&self) -> f64 {
        squares_about(mean(&self.speed), &self.speed)
    }
}

/// A fit: what a lag keeps over a block, the coefficients, and the sum of squares that is left.
pub(super) struct Fit {
    /// The time constant in blocks.
    pub constant: f64,
    pub decay: f64,
    pub solution: Solution,
    pub left: f64,
}
