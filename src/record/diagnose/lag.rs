//! A speed as the voltage filtered by a first-order lag, fitted by its output error: the time constant on a grid.

use super::regression::{Row, Solution, Sums};
use crate::numeric::{count, mean, squares_about};

/// Time constants of the grid, from half a block to this part of the blocks, each this many times the one before.
const LONGEST: f64 = 0.5;
const RATIO: f64 = 1.5;
/// Parts of the best of them that are tried then.
const FINE: [f64; 8] = [0.7, 0.8, 0.88, 0.94, 1.06, 1.13, 1.25, 1.4];
/// Samples are put together to so many blocks at most, at first and to be sure.
pub(super) const COARSE: usize = 500;
pub(super) const FINE_BLOCKS: usize = 2000;
/// A lag alone, and one with a faster one, in parts of it: the winding's.
pub(super) static ONE_LAG: [f64; 1] = [1.0];
pub(super) static TWO_LAGS: [f64; 2] = [1.0, 0.2];

/// A voltage, and means of a speed over blocks of samples.
pub(super) struct Blocks<'a> {
    pub volts: &'a [f64],
    pub speed: Vec<f64>,
    /// Samples in a block.
    pub length: usize,
    /// The time constants of the lags, in parts of the first.
    lags: &'static [f64],
}

impl<'a> Blocks<'a> {
    pub(super) fn new(volts: &'a [f64], speed: &[f64], blocks: usize, lags: &'static [f64]) -> Self {
        let length = volts.len().div_ceil(blocks).max(1);
        Self { volts, speed: speed.chunks_exact(length).map(mean).collect(), length, lags }
    }

    /// Returns the best fit of the speed by functions of the voltage, at most [`super::regression::WIDTH`], each behind the
    /// lags, that `is_allowed` by its gains; of all time constants, or of those near one in blocks.
    pub(super) fn fit(
        &self,
        functions: &[&dyn Fn(f64) -> f64],
        near: Option<f64>,
        is_allowed: impl Fn(&Row) -> bool,
    ) -> Option<Fit> {
        // A voltage may change its sign within a block: the functions are of samples, and their means of blocks.
        let mean_of = |function: &&dyn Fn(f64) -> f64| -> Vec<f64> {
            let block = |block: &[f64]| block.iter().map(|v| function(*v)).sum::<f64>() / count(self.length);
            self.volts.chunks_exact(self.length).map(block).collect()
        };
        let ends: Vec<Vec<f64>> = functions.iter().map(mean_of).collect();
        let mut best: Option<Fit> = None;
        let mut try_one = |constant: f64| {
            let decay = (-1.0 / constant).exp();
            let (solution, left) = self.fit_with(&ends, decay);
            let mut gains = Row::default();
            solution.coefficients.iter().enumerate().for_each(|(k, c)| gains[k % functions.len()] += c);
            if is_allowed(&gains) && best.as_ref().is_none_or(|best| left < best.left) {
                best = Some(Fit { constant, decay, gains, left });
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

    fn fit_with(&self, ends: &[Vec<f64>], decay: f64) -> (Solution, f64) {
        let mut sums = Sums::default();
        self.rows(ends, decay, |row, speed| sums.add(row, speed));
        let solution = sums.solve();
        let mut left = 0.0;
        self.rows(ends, decay, |row, speed| left += (speed - solution.predicted(row)).powi(2));
        (solution, left)
    }

    /// Visits the rows: each function behind the first lag, then each behind the second.
    fn rows(&self, ends: &[Vec<f64>], decay: f64, mut visit: impl FnMut(&Row, f64)) {
        let decays: Vec<f64> = self.lags.iter().map(|part| decay.powf(part.recip())).collect();
        // The mean over a block of a lag that the block's voltage drives.
        let insides: Vec<f64> = decays.iter().map(|decay| 1.0 - (1.0 - decay) / -decay.ln()).collect();
        let mut row = Row::default();
        let mut states = Row::default();
        for (n, speed) in self.speed.iter().enumerate() {
            let columns = row.iter_mut().zip(&mut states);
            for (k, (value, state)) in columns.take(ends.len() * decays.len()).enumerate() {
                let (lag, end) = (k / ends.len(), ends[k % ends.len()][n]);
                *value = *state + insides[lag] * (end - *state);
                *state = end + decays[lag] * (*state - end);
            }
            visit(&row, *speed);
        }
    }

    /// Returns the sum of squares about the mean of the speed.
    pub(super) fn squares(&self) -> f64 {
        squares_about(mean(&self.speed), &self.speed)
    }
}

/// A fit: what the first lag keeps over a block, the gain of each function, and the sum of squares that is left.
pub(super) struct Fit {
    /// The time constant in blocks.
    pub constant: f64,
    pub decay: f64,
    pub gains: Row,
    pub left: f64,
}
