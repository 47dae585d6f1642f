//! Box plots: quartiles and whiskers by Tukey (1977), one box below the other with its name.

use super::panels::{Form, Panel, Series};
use super::scale::AxisScale;
use motorfit_core::numeric::{count, quantile, sorted};

/// Named groups of values, a box each.
pub(crate) type Groups = Vec<(String, Vec<f64>)>;

/// Length of the whiskers \[interquartile ranges\].
const WHISKER: f64 = 1.5;

/// Returns a panel with a box for each group of values, the first on top, on a first axis of its own. Values that cannot be drawn
/// are left out, and groups without others. On a logarithmic axis, boxes and whiskers are those of the logarithms.
pub(crate) fn boxes(label: &str, axis: &str, groups: &Groups, scale: AxisScale) -> Panel {
    let placed = |values: &[f64]| values.iter().map(|v| scale.place(*v)).filter(|v| v.is_finite()).collect::<Vec<_>>();
    let value = |place: f64| if scale == AxisScale::Log { 10.0_f64.powf(place) } else { place };
    let (mut names, mut series) = (Vec::new(), Vec::new());
    for (name, values) in groups {
        let values = sorted(&placed(values));
        let row = -count(names.len());
        let [first, median, third] = [0.25, 0.5, 0.75].map(|p| quantile(&values, p));
        let reach = WHISKER * (third - first);
        let is_near = |v: &&f64| (first - reach..=third + reach).contains(*v);
        let (Some(low), Some(high)) = (values.iter().find(is_near), values.iter().rev().find(is_near)) else {
            continue;
        };
        // A quartile may be interpolated beyond the last value that is near.
        let ends = [low.min(first), first, median, third, high.max(third)].map(|place| (value(place), row));
        let outside = values.iter().filter(|v| !is_near(v)).map(|place| (value(*place), row - 0.2)).collect();
        names.push(name.clone());
        series.push(Series::new(name, 1, Form::Box, ends.to_vec()));
        series.push(Series::new("", 1, Form::Dots, outside));
    }
    Panel { axis: Some(axis.to_owned()), scales: [scale, AxisScale::Rows(names)], ..Panel::new(label, series) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp, reason = "exact values are meant")]

    use super::*;

    #[test]
    fn boxes_have_quartiles_whiskers_and_outliers() {
        let values: Vec<f64> = (0..=8).map(f64::from).chain([100.0, f64::NAN]).collect();
        let groups = vec![("a".to_owned(), values), ("none".to_owned(), vec![f64::NAN]), ("b".to_owned(), vec![3.0])];
        let panel = boxes("cost [1]", "cost [1]", &groups, AxisScale::Linear);
        assert_eq!(panel.scales[1], AxisScale::Rows(vec!["a".to_owned(), "b".to_owned()]));
        // Ten values: quartiles at 2.25, 4.5 and 6.75; whiskers reach to 6.75 + 6.75.
        let places: Vec<f64> = panel.series[0].points.iter().map(|point| point.0).collect();
        assert_eq!(places, [0.0, 2.25, 4.5, 6.75, 8.0]);
        assert_eq!(panel.series[1].points, [(100.0, -0.2)]);
        assert_eq!(panel.series[2].points, [(3.0, -1.0); 5]);
        // The quartiles of logarithms: 1, 10, 100.
        let groups = vec![("a".to_owned(), vec![1.0, 100.0, 10.0, 0.0])];
        let panel = boxes("", "", &groups, AxisScale::Log);
        let median = panel.series[0].points[2].0;
        assert!((median - 10.0).abs() < 1e-12, "{median}");
    }
}
