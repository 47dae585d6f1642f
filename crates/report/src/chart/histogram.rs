//! Histograms: numbers of values in bins, with limits.

use super::panels::{Form, Panel, Series};
use motorfit_core::numeric::{self, quantile, sorted, whole};

/// Smallest and largest number of bins.
const BINS: [f64; 2] = [5.0, 60.0];
/// Distance beyond the quartiles up to which values are drawn \[interquartile ranges\].
const FENCE: f64 = 15.0;

/// A histogram.
#[derive(Debug, Clone, Default)]
pub(crate) struct Histogram {
    /// Heading of the panel: what is counted.
    pub label: String,
    /// Label of the axis of the values, with its unit.
    pub axis: String,
    /// Values.
    pub values: Vec<f64>,
    /// Lower and upper limit, drawn dashed; values outside have another colour.
    pub limits: Option<[f64; 2]>,
}

/// Edges of the bins, and the numbers of all values and of the values within limits in each bin.
struct Bins {
    edges: Vec<f64>,
    all: Vec<f64>,
    within: Vec<f64>,
}

impl Histogram {
    /// Returns the range of values that is drawn. It excludes values far from the quartiles, and is widened for a
    /// constant.
    fn range(&self) -> [f64; 2] {
        let sorted = sorted(&self.values);
        let [low, high] = [0.25, 0.75].map(|p| quantile(&sorted, p));
        let reach = if high > low { FENCE * (high - low) } else { f64::INFINITY };
        let near = || sorted.iter().copied().filter(|v| (low - reach..=high + reach).contains(v));
        let [low, high] = [near().next(), near().next_back()].map(|end| end.unwrap_or(f64::NAN));
        let room = if high - low <= 1e-9 * low.abs() { 0.01 * low.abs().max(1e-9) } else { 0.0 };
        [low - room, high + room]
    }

    /// Returns the number of values outside the drawn range.
    pub(crate) fn beyond(&self) -> usize {
        let [low, high] = self.range();
        self.values.iter().filter(|v| !(low..=high).contains(*v)).count()
    }

    /// Counts the values in bins of the width by Freedman and Diaconis (1981); `None` without finite values.
    fn bins(&self) -> Option<Bins> {
        let [low, high] = self.range();
        let span = high - low;
        if !span.is_finite() {
            return None;
        }
        let sorted = sorted(&self.values);
        let quartiles = quantile(&sorted, 0.75) - quantile(&sorted, 0.25);
        let width = 2.0 * quartiles / numeric::count(sorted.len()).cbrt();
        let count = (span / width).ceil().clamp(BINS[0], BINS[1]);
        let last = whole(count) - 1;
        let bin = |value: f64| whole((value - low) / span * count).min(last);
        let edges: Vec<f64> = (0..=last + 1).map(|n| low + span * numeric::count(n) / count).collect();
        let (mut all, mut within) = (vec![0.0; edges.len() - 1], vec![0.0; edges.len() - 1]);
        for &value in self.values.iter().filter(|v| (low..=high).contains(*v)) {
            all[bin(value)] += 1.0;
            let is_within = self.limits.is_none_or(|[low, high]| (low..=high).contains(&value));
            within[bin(value)] += f64::from(u8::from(is_within));
        }
        Some(Bins { edges, all, within })
    }

    /// Returns the panel, in which the bars of values outside the limits are behind those of the values inside; `None` without
    /// finite values.
    pub(crate) fn panel(&self) -> Option<Panel> {
        let bins = self.bins()?;
        // A bin without values outside has no bar behind, whose colour would show through.
        let behind: Vec<f64> =
            bins.all.iter().zip(&bins.within).map(|(all, within)| if all > within { *all } else { 0.0 }).collect();
        let bars = |name, color, counts: &[f64]| {
            let points = bins.edges.iter().copied().zip(counts.iter().copied().chain([0.0])).collect();
            Series::new(name, color, Form::Bars, points)
        };
        let mut series = Vec::new();
        if behind.iter().any(|count| *count > 0.0) {
            series.push(bars("with those outside the limits", 2, &behind));
        }
        series.push(bars(if self.limits.is_some() { "inside the limits" } else { "" }, 1, &bins.within));
        let limits = self.limits.into_iter().flatten().filter(|limit| limit.is_finite()).collect();
        Some(Panel { axis: Some(self.axis.clone()), limits: [limits, Vec::new()], ..Panel::new(&self.label, series) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_in_a_bin_or_beyond() {
        let mut values: Vec<f64> = (0..1000).map(|n| 1.0 + 0.1 * (f64::from(n) * 0.7).sin()).collect();
        values.extend([9.0, -9.0]);
        let panel = Histogram { values, limits: Some([0.95, 1.05]), ..Histogram::default() };
        let bins = panel.bins().unwrap();
        let [all, within] = [&bins.all, &bins.within].map(|counts| counts.iter().sum::<f64>());
        let inside = panel.values.iter().filter(|v| (0.95..=1.05).contains(*v)).count();
        assert_eq!((all, within), (1000.0, f64::from(u32::try_from(inside).unwrap())));
        assert_eq!(panel.beyond(), 2);
        assert!(bins.edges.is_sorted() && (6..=61).contains(&bins.edges.len()), "{:?}", bins.edges);
    }

    #[test]
    fn values_that_are_the_same_are_one_bar() {
        let panel = |values| Histogram { values, ..Histogram::default() };
        assert!(panel(Vec::new()).bins().is_none());
        for value in [0.5, 0.0, -3e-7] {
            let bins = panel(vec![value; 9]).bins().unwrap();
            assert_eq!(bins.all.iter().filter(|count| **count > 8.5).count(), 1, "{value}: {:?}", bins.all);
            assert_eq!(panel(vec![value; 9]).panel().unwrap().series.len(), 1);
        }
        // The interquartile range is zero, and bins still exist.
        let values = [vec![0.0; 90], vec![1.0, 2.0]].concat();
        assert_eq!(panel(values).bins().unwrap().all.len(), 60);
    }
}
