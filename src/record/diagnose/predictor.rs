//! Predictions of a signal from one of its sides and the input, for the rule on outliers.

use super::pulses::RUN_MAX;
use super::regression::{Row, Solution, Sums, WIDTH};
use super::view::View;
use crate::numeric::{count, order_statistic, whole};

/// Samples that a prediction looks at beyond its sample, at most.
pub(super) const REACH: usize = RUN_MAX + 1;
/// Equations of a regression at most.
const ROWS_MAX: usize = 700;
/// Changes of the input above this part of its range make its response.
const EDGE: f64 = 0.02;
/// A row of regressors whose leverage is so many times the mean is like none that was seen.
const LEVERAGE: f64 = 6.0;
/// Values beyond so many ranges from the median are left out of regressions.
const OUTSIDE: f64 = 2.5;
/// Samples of a class from which its scale is known.
const CLASS_MIN: usize = 30;
/// The quantile of |residuals| that their scale is made of, and that of a normal distribution: outliers may be one of ten.
const QUANTILE: [f64; 2] = [0.9, 1.645];

/// A signal in parts of its range, without its outermost values, and the input in parts of its peak.
pub(super) struct Scaled<'a> {
    pub view: &'a View<'a>,
    pub values: Vec<f64>,
    input: Vec<f64>,
    /// For each sample, true where the input changes within [`REACH`] samples.
    pub is_edge: Vec<bool>,
    /// The median of the signal and its range, without its outermost values.
    pub middle: f64,
    pub range: f64,
}

impl<'a> Scaled<'a> {
    /// Returns `None` where there are too few samples, or the signal is constant but for single values.
    pub(super) fn new(view: &'a View<'a>, values: &[f64]) -> Option<Self> {
        let size = values.len();
        if size < 12 * REACH {
            return None;
        }
        // So that a few values beyond all others do not set the range.
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

    /// The regressors for sample `m` from samples `k` and `k + 1` before it, or behind it, and the input between.
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

    /// Returns whether no gap in time is within reach of a sample.
    pub(super) fn is_regular(&self, m: usize) -> bool {
        let time = &self.view.time[m - REACH..=m + REACH];
        time.windows(2).all(|w| w[1] - w[0] < 2.5 * self.view.period())
    }
}

/// A regression for samples `k` beyond the last known one, with the usual size of its residuals.
///
/// Where the input is constant or changes slowly, samples are predicted from samples alone; near its changes from the input too.
pub(super) struct Predictor {
    k: usize,
    is_before: bool,
    /// Away from changes of the input, and near them.
    classes: [Class; 2],
}

#[derive(Default)]
struct Class {
    solution: Solution,
    rows: f64,
    /// Infinite where too few samples show what is usual.
    scale: f64,
}

impl Predictor {
    pub(super) fn new(of: &Scaled<'_>, k: usize, is_before: bool) -> Self {
        let samples = REACH..of.values.len() - REACH;
        let stride = (count(samples.len()) / count(ROWS_MAX)).max(1.0);
        let rows = whole(count(samples.len()) / stride);
        // The part of the stride varies, so that periods of the input do not meet it.
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

    /// Returns what the signal is predicted to be at sample `m`.
    pub(super) fn predicted(&self, of: &Scaled<'_>, m: usize) -> f64 {
        self.class(of, m).solution.predicted(&of.row(m, self.k, self.is_before))
    }

    /// Returns the signal at sample `m` less what it is predicted to be.
    pub(super) fn residual(&self, of: &Scaled<'_>, m: usize) -> f64 {
        of.values[m] - self.predicted(of, m)
    }

    /// Returns the usual size of the residual of sample `m`, infinite where it is not known.
    pub(super) fn scale(&self, of: &Scaled<'_>, m: usize) -> f64 {
        self.class(of, m).scale
    }

    /// Returns whether the regression has seen samples such as those that predict `m`.
    pub(super) fn has_seen(&self, of: &Scaled<'_>, m: usize) -> bool {
        let class = self.class(of, m);
        class.solution.leverage(&of.row(m, self.k, self.is_before)) * class.rows < LEVERAGE * count(WIDTH)
    }
}

impl Class {
    /// Fits up to thrice: samples that are far off after a fit are left out of the next.
    fn new(of: &Scaled<'_>, chosen: &[usize], row: impl Fn(usize) -> Row) -> Self {
        let mut class = Self { scale: f64::INFINITY, ..Self::default() };
        if chosen.len() < CLASS_MIN {
            return class;
        }
        let rows: Vec<(Row, f64)> = chosen.iter().map(|m| (row(*m), of.values[*m])).collect();
        // Values far outside would spoil the regression.
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
            // The next fit would be the same.
            if next == taken {
                break;
            }
            taken = next;
        }
        class
    }
}
