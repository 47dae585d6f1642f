//! Output-error fit of the speed as a sum of functions of the voltage, each filtered by first-order lags.
//!
//! The time constant is searched on a grid; the gains follow by linear least squares. Samples are averaged in blocks.

use super::regression::{Row, Solution, Sums};
use motorfit_core::numeric::{count, mean, squares_about};

/// Longest time constant of the grid, as a fraction of the number of blocks; the shortest one is half a block.
const LONGEST: f64 = 0.5;
/// Ratio of consecutive time constants of the grid.
const RATIO: f64 = 1.5;
/// Multiples of the best time constant of the grid that are tried afterwards.
const FINE: [f64; 8] = [0.7, 0.8, 0.88, 0.94, 1.06, 1.13, 1.25, 1.4];
/// Largest number of blocks in the first fit.
pub(super) const COARSE: usize = 500;
/// Largest number of blocks in the confirming fit.
pub(super) const FINE_BLOCKS: usize = 2000;
/// Relative time constants of a single lag.
pub(super) static ONE_LAG: [f64; 1] = [1.0];
/// Relative time constants of a mechanical lag and a faster, electrical one.
pub(super) static TWO_LAGS: [f64; 2] = [1.0, 0.2];

/// A voltage, and the means of a speed over blocks of samples.
pub(super) struct Blocks<'a> {
    /// Voltage of each sample \[V\].
    pub volts: &'a [f64],
    /// Mean speed of each block \[rad/s\].
    pub speed: Vec<f64>,
    /// Number of samples in a block.
    pub length: usize,
    /// Time constants of the lags, relative to the first one.
    lags: &'static [f64],
}

impl<'a> Blocks<'a> {
    pub(super) fn new(volts: &'a [f64], speed: &[f64], blocks: usize, lags: &'static [f64]) -> Self {
        let length = volts.len().div_ceil(blocks).max(1);
        Self { volts, speed: speed.chunks_exact(length).map(mean).collect(), length, lags }
    }

    /// Returns the best fit of the speed by functions of the voltage, each filtered by every lag, among the fits for whose
    /// gains `is_allowed` is true.
    ///
    /// Functions times lags number at most [`super::regression::WIDTH`]. `near` restricts the search to the neighbourhood of
    /// one time constant \[blocks\].
    pub(super) fn fit(
        &self,
        functions: &[&dyn Fn(f64) -> f64],
        near: Option<f64>,
        is_allowed: impl Fn(&Row) -> bool,
    ) -> Option<Fit> {
        // A voltage may change its sign within a block: the functions are evaluated at samples and then averaged.
        let mean_of = |function: &&dyn Fn(f64) -> f64| -> Vec<f64> {
            let block = |block: &[f64]| block.iter().map(|v| function(*v)).sum::<f64>() / count(self.length);
            self.volts.chunks_exact(self.length).map(block).collect()
        };
        let ends: Vec<Vec<f64>> = functions.iter().map(mean_of).collect();
        let mut best: Option<Fit> = None;
        let mut try_one = |constant: f64| {
            let decay = (-1.0 / constant).exp();
            let (solution, sse) = self.fit_with(&ends, decay);
            let mut gains = Row::default();
            solution.coefficients.iter().enumerate().for_each(|(k, c)| gains[k % functions.len()] += c);
            if is_allowed(&gains) && best.as_ref().is_none_or(|best| sse < best.sse) {
                best = Some(Fit { constant, decay, gains, sse });
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

    /// Fits the gains for one decay over a block and returns them with the sum of squared residuals.
    fn fit_with(&self, ends: &[Vec<f64>], decay: f64) -> (Solution, f64) {
        let mut sums = Sums::default();
        self.rows(ends, decay, |row, speed| sums.add(row, speed));
        let solution = sums.solve();
        let mut sse = 0.0;
        self.rows(ends, decay, |row, speed| sse += (speed - solution.predicted(row)).powi(2));
        (solution, sse)
    }

    /// Visits the rows of regressors: each function filtered by the first lag, then each by the second.
    fn rows(&self, ends: &[Vec<f64>], decay: f64, mut visit: impl FnMut(&Row, f64)) {
        let decays: Vec<f64> = self.lags.iter().map(|part| decay.powf(part.recip())).collect();
        // Mean step response of each lag over a block.
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

    /// Returns the sum of squares of the block speeds about their mean.
    pub(super) fn squares(&self) -> f64 {
        squares_about(mean(&self.speed), &self.speed)
    }
}

/// Result of a fit.
pub(super) struct Fit {
    /// Time constant of the first lag \[blocks\].
    pub constant: f64,
    /// Decay of the first lag over a block.
    pub decay: f64,
    /// Gain of each function, summed over the lags.
    pub gains: Row,
    /// Sum of squared residuals.
    pub sse: f64,
}
