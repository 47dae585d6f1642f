//! Linear prediction of a signal from the samples on one side and the input, for the rule on outliers.

use super::pulses::RUN_MAX;
use super::regression::{Row, Solution, Sums, WIDTH};
use super::view::View;
use motorfit_core::numeric::{count, order_statistic, whole};

/// Largest distance of a sample that a prediction uses.
pub(super) const REACH: usize = RUN_MAX + 1;
/// Largest number of rows of a regression.
const ROWS_MAX: usize = 700;
/// Smallest change of the input, as a fraction of its range, that counts as an edge.
const EDGE: f64 = 0.02;
/// Largest leverage of a row, relative to the mean leverage of [`WIDTH`] regressors, at which a prediction is not an
/// extrapolation.
const LEVERAGE: f64 = 6.0;
/// Largest distance from the median, in ranges, of values in a regression.
const OUTSIDE: f64 = 2.5;
/// Fewest samples of a class for an estimate of its scale.
const CLASS_MIN: usize = 30;
/// Order of the quantile of |residuals| that gives their scale, robust against a tenth of outliers, and that quantile for a
/// standard normal variable.
const QUANTILE: [f64; 2] = [0.9, 1.645];

/// A signal less its median, relative to its range without extreme values, and the input relative to its peak.
pub(super) struct Scaled<'a> {
    pub view: &'a View<'a>,
    pub values: Vec<f64>,
    input: Vec<f64>,
    /// True for samples with an edge of the input within [`REACH`] samples.
    pub is_edge: Vec<bool>,
    /// Median of the signal.
    pub middle: f64,
    /// Range of the signal without its extreme values.
    pub range: f64,
}

impl<'a> Scaled<'a> {
    /// Scales a signal; `None` for too few samples, or a signal that is constant except for single values.
    pub(super) fn new(view: &'a View<'a>, values: &[f64]) -> Option<Self> {
        let size = values.len();
        if size < 12 * REACH {
            return None;
        }
        // The extreme values are left out, so that outliers do not determine the range.
        let outer = (0.01_f64).max(6.0 / count(size));
        let mut copy = values.to_vec();
        let [low, middle, high] = [outer, 0.5, 1.0 - outer].map(|p| order_statistic(&mut copy, p));
        let range = high - low;
        if range <= 0.0 || view.input.peak == 0.0 {
            return None;
        }
        let changes = |n: &usize| {
            let change = (view.input.values[*n] - view.input.values[n - 1]).abs();
            change > (EDGE * view.input.range).max((6.0 * view.input.noise).min(0.1 * view.input.range))
        };
        let mut is_edge = vec![false; size];
        for n in (1..size).filter(changes) {
            is_edge[n.saturating_sub(REACH)..(n + REACH).min(size)].fill(true);
        }
        Some(Self {
            view,
            values: values.iter().map(|x| (x - middle) / range).collect(),
            input: view.input.values.iter().map(|v| v / view.input.peak).collect(),
            is_edge,
            middle,
            range,
        })
    }

    /// Returns the regressors of sample `m`: a constant, the samples `k` and `k + 1` before or after it and, near edges, the
    /// input in between.
    fn row(&self, m: usize, k: usize, is_before: bool) -> Row {
        let x = |n: usize| self.values[n];
        let v = |n: usize| self.input[n];
        let mut row = Row::default();
        row[0] = 1.0;
        (row[1], row[2]) = if is_before { (x(m - k), x(m - k - 1)) } else { (x(m + k), x(m + k + 1)) };
        if !self.is_edge[m] {
            return row;
        }
        if is_before {
            (0..k + 2).for_each(|lag| row[3 + lag] = v(m - lag));
        } else {
            (0..k + 2).for_each(|lag| row[3 + lag] = v(m + k - lag));
        }
        row
    }

    /// Returns true if no gap in time is within [`REACH`] of a sample.
    pub(super) fn is_regular(&self, m: usize) -> bool {
        let time = &self.view.time[m - REACH..=m + REACH];
        time.windows(2).all(|w| w[1] - w[0] < 2.5 * self.view.period())
    }
}

/// A predictor `k` samples ahead, or back, with the scale of its residuals.
///
/// Samples are predicted from samples alone, and near edges of the input from the input too.
pub(super) struct Predictor {
    k: usize,
    is_before: bool,
    /// Regressions away from edges of the input, and near them.
    classes: [Class; 2],
}

/// A regression and the scale of its residuals.
#[derive(Default)]
struct Class {
    solution: Solution,
    /// Number of rows.
    rows: f64,
    /// Standard deviation of the residuals, estimated from a quantile; infinite with too few samples.
    scale: f64,
}

impl Predictor {
    /// Fits a predictor from the samples before, or after, over a distance `k`.
    pub(super) fn new(of: &Scaled<'_>, k: usize, is_before: bool) -> Self {
        let samples = REACH..of.values.len() - REACH;
        let stride = (count(samples.len()) / count(ROWS_MAX)).max(1.0);
        let rows = whole(count(samples.len()) / stride);
        // The rows are offset by varying fractions of the stride, so that it cannot coincide with a period of the input.
        let at = |j: usize| samples.start + whole((count(j) + (count(j) * 0.618).fract()) * stride);
        let chosen: Vec<usize> = (0..rows).map(at).filter(|m| *m < samples.end && of.is_regular(*m)).collect();
        let class = |is_edge: bool| {
            let chosen: Vec<usize> = chosen.iter().copied().filter(|m| of.is_edge[*m] == is_edge).collect();
            Class::new(of, &chosen, |m| of.row(m, k, is_before))
        };
        Self { k, is_before, classes: [false, true].map(class) }
    }

    fn class(&self, of: &Scaled<'_>, m: usize) -> &Class {
        &self.classes[usize::from(of.is_edge[m])]
    }

    /// Returns the prediction of sample `m`.
    pub(super) fn predicted(&self, of: &Scaled<'_>, m: usize) -> f64 {
        self.class(of, m).solution.predicted(&of.row(m, self.k, self.is_before))
    }

    /// Returns the residual of sample `m`: the signal less its prediction.
    pub(super) fn residual(&self, of: &Scaled<'_>, m: usize) -> f64 {
        of.values[m] - self.predicted(of, m)
    }

    /// Returns the scale of the residual of sample `m`; infinite if it is not known.
    pub(super) fn scale(&self, of: &Scaled<'_>, m: usize) -> f64 {
        self.class(of, m).scale
    }

    /// Returns true if the prediction of sample `m` is not an extrapolation: the leverage of its regressors is small.
    pub(super) fn has_seen(&self, of: &Scaled<'_>, m: usize) -> bool {
        let class = self.class(of, m);
        class.solution.leverage(&of.row(m, self.k, self.is_before)) * class.rows < LEVERAGE * count(WIDTH)
    }
}

impl Class {
    /// Fits up to three times; each fit leaves out samples with residuals above 6 scales in the one before.
    fn new(of: &Scaled<'_>, chosen: &[usize], row: impl Fn(usize) -> Row) -> Self {
        let mut class = Self { scale: f64::INFINITY, ..Self::default() };
        if chosen.len() < CLASS_MIN {
            return class;
        }
        let rows: Vec<(Row, f64)> = chosen.iter().map(|m| (row(*m), of.values[*m])).collect();
        // Extreme values would bias the regression.
        let is_usual = |row: &Row, value: f64| row[1].abs().max(row[2].abs()).max(value.abs()) < OUTSIDE;
        let mut taken: Vec<bool> = rows.iter().map(|(row, value)| is_usual(row, *value)).collect();
        let mut sizes = Vec::with_capacity(rows.len());
        for _ in 0..3 {
            let mut sums = Sums::default();
            rows.iter().zip(&taken).filter(|(_, taken)| **taken).for_each(|((row, value), _)| sums.add(row, *value));
            class.rows = count(taken.iter().filter(|taken| **taken).count());
            class.solution = sums.solve();
            let size = |(row, value): &(Row, f64)| (value - class.solution.predicted(row)).abs();
            sizes.clear();
            sizes.extend(rows.iter().map(size));
            class.scale = (order_statistic(&mut sizes.clone(), QUANTILE[0]) / QUANTILE[1]).max(1e-9);
            let is_near =
                |(n, (row, value)): (usize, &(Row, f64))| sizes[n] < 6.0 * class.scale && is_usual(row, *value);
            let next: Vec<bool> = rows.iter().enumerate().map(is_near).collect();
            // The next fit would be identical.
            if next == taken {
                break;
            }
            taken = next;
        }
        class
    }
}
