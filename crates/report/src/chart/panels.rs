//! Charts as data: panels with series of points, over common or own axes.

use super::scale::{self, AxisScale};

/// Form in which the points of a series are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Line, such as a modelled signal.
    Line,
    /// Line of a quantity that is constant between points.
    Steps,
    /// Light dots; where samples are dense, a band from the lowest to the highest of them.
    Dots,
    /// Strong dots, one for each point.
    Marks,
    /// Vertical bars from zero, such as correlations over lags.
    Stems,
    /// Bars of a histogram: each point has the left edge and the height of a bar, and the last point the right edge of the last bar.
    Bars,
    /// A horizontal box: five points in the same row, at the lower whisker, the quartiles and the upper whisker.
    Box,
}

/// A shaded band around a curve.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum Band {
    /// No band.
    #[default]
    None,
    /// Half the width of a band around the curve, in the unit of the panel.
    Half(f64),
    /// Lower and upper end of the band at each point of the curve.
    Between(Vec<[f64; 2]>),
}

/// A series of points in a panel.
#[derive(Debug, Clone)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Number of the colour: 0 for measured signals and inputs, from 1 for models, methods and residuals.
    pub color: usize,
    /// Form of the drawing.
    pub form: Form,
    /// Points `(x, y)`, in increasing order of x.
    pub points: Vec<(f64, f64)>,
    /// Shaded band.
    pub band: Band,
}

/// A panel: series over one pair of axes.
#[derive(Debug, Clone, Default)]
pub struct Panel {
    /// Heading: the quantity of the second axis with its unit, such as `current [A]`.
    pub label: String,
    /// Label of a first axis of its own; `None` for the common axis of the chart.
    pub axis: Option<String>,
    /// Scales of both axes.
    pub scales: [AxisScale; 2],
    /// Series; the first are drawn below the others.
    pub series: Vec<Series>,
    /// Values of the first and of the second axis at which dashed lines are drawn.
    pub limits: [Vec<f64>; 2],
    /// Shaded intervals of the first axis.
    pub marks: Vec<Mark>,
}

/// A shaded interval of the first axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Ends of the interval; a short one is drawn with a minimum width.
    pub range: [f64; 2],
    /// Label; empty for none.
    pub label: String,
}

/// Panels with a common legend.
#[derive(Debug, Clone, Default)]
pub struct Chart {
    /// Identifier for links; unique on a page.
    pub id: String,
    /// Label of the common first axis, with its unit.
    pub axis: String,
    /// Panels, from the top.
    pub panels: Vec<Panel>,
    /// True if panels stand beside each other on a wide page.
    pub is_grid: bool,
    /// Alternative text for readers who cannot see the drawing.
    pub alternative: String,
    /// Caption.
    pub caption: String,
}

impl Series {
    /// Creates a series without a band.
    #[must_use]
    pub fn new(name: &str, color: usize, form: Form, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.to_owned(), color, form, points, band: Band::None }
    }

    /// Returns the series with a shaded band.
    #[must_use]
    pub fn with_band(self, band: Band) -> Self {
        Self { band, ..self }
    }

    /// Returns the values of the second axis at point `n`, with the ends of the band.
    pub(super) fn ends(&self, n: usize) -> [f64; 3] {
        let y = self.points[n].1;
        match &self.band {
            Band::None => [y; 3],
            Band::Half(half) => [y, y - half, y + half],
            Band::Between(ends) => ends.get(n).map_or([y; 3], |[low, high]| [y, *low, *high]),
        }
    }
}

impl Panel {
    /// Creates a panel over the common axis, with linear scales, without limits and marks.
    #[must_use]
    pub fn new(label: &str, series: Vec<Series>) -> Self {
        Self { label: label.to_owned(), series, ..Self::default() }
    }

    /// Returns the panel with the points in a range of the first axis only.
    #[must_use]
    pub fn within(&self, [from, to]: [f64; 2]) -> Self {
        let kept = |series: &Series| {
            let is_kept = |n: &usize| (from..=to).contains(&series.points[*n].0);
            let kept: Vec<usize> = (0..series.points.len()).filter(is_kept).collect();
            let band = match &series.band {
                Band::Between(ends) => Band::Between(kept.iter().filter_map(|n| ends.get(*n).copied()).collect()),
                other => other.clone(),
            };
            Series { points: kept.iter().map(|n| series.points[*n]).collect(), band, ..series.clone() }
        };
        Self { series: self.series.iter().map(kept).collect(), ..self.clone() }
    }

    /// Returns the names and colours of its series.
    pub(super) fn names(&self) -> impl Iterator<Item = (&str, usize, Form)> {
        self.series.iter().map(|series| (series.name.as_str(), series.color, series.form))
    }

    pub(super) fn has(&self, forms: &[Form]) -> bool {
        self.series.iter().any(|series| forms.contains(&series.form))
    }

    /// Returns the ranges of its axes as places on their scales, with a margin where needed.
    pub(super) fn ranges(&self) -> [[f64; 2]; 2] {
        let [first, second] = &self.scales;
        let xs = self.series.iter().flat_map(|series| series.points.iter().map(|point| point.0));
        let ends = |series: &Series| (0..series.points.len()).flat_map(|n| series.ends(n)).collect::<Vec<_>>();
        let ys = self.series.iter().flat_map(ends);
        let from_zero = self.has(&[Form::Stems, Form::Bars]).then_some(0.0);
        let of = |scale: &AxisScale, values: &mut dyn Iterator<Item = f64>| {
            scale::range(scale, values.map(|value| scale.place(value)).filter(|place| place.is_finite()))
        };
        let [low, high] = of(first, &mut xs.chain(self.limits[0].iter().copied()));
        let aside = if self.has(&[Form::Marks, Form::Bars, Form::Box]) { 0.025 * (high - low) } else { 0.0 };
        let x = [low - aside, high + aside];
        if let AxisScale::Rows(names) = second {
            return [x, [0.5 - motorfit_core::numeric::count(names.len().max(1)), 0.5]];
        }
        let [low, high] = of(second, &mut ys.chain(self.limits[1].iter().copied()).chain(from_zero));
        let margin = 0.06 * (high - low);
        [x, [if self.has(&[Form::Bars]) { low } else { low - margin }, high + margin]]
    }

    /// Returns the number of rows of boxes; `None` for a panel with a numeric axis.
    pub(super) fn rows(&self) -> Option<usize> {
        if let AxisScale::Rows(names) = &self.scales[1] { Some(names.len()) } else { None }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.series.iter().all(|series| series.points.is_empty())
    }
}

impl Chart {
    /// Returns the panels with points.
    pub(super) fn drawn(&self) -> impl Iterator<Item = &Panel> {
        self.panels.iter().filter(|panel| !panel.is_empty())
    }

    /// Returns name, colour and form of each series in the legend, each once.
    pub(super) fn legend(&self) -> Vec<(&str, usize, Form)> {
        let mut names: Vec<(&str, usize, Form)> = Vec::new();
        for name in self.drawn().flat_map(Panel::names).filter(|(name, _, form)| !name.is_empty() && *form != Form::Box)
        {
            if names.iter().all(|known| known.0 != name.0) {
                names.push(name);
            }
        }
        names
    }

    /// Returns the common range of the first axis.
    pub(super) fn range(&self) -> [f64; 2] {
        let common = || self.drawn().filter(|panel| panel.axis.is_none());
        let scale = common().next().map_or(AxisScale::Linear, |panel| panel.scales[0].clone());
        scale::range(&scale, common().flat_map(|panel| panel.ranges()[0]))
    }
}
