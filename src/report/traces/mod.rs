//! Signals over time as stacked panels, drawn for pages, where they follow the width and the colour scheme and a script can zoom
//! them, and as SVG files.

mod drawing;
mod file;
mod path;
mod ticks;

pub(super) use drawing::figure;
pub(super) use file::svg;
pub(super) use ticks::round_step;

/// Form in which a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Line, such as a modelled signal.
    Line,
    /// Line of a signal that is constant between samples.
    Steps,
    /// Light dots; where samples are dense, a band from the lowest to the highest of them.
    Dots,
    /// Vertical bars from zero, such as correlations over lags.
    Stems,
}

/// A curve of a panel.
#[derive(Debug, Clone)]
pub struct Trace {
    /// Name in the legend.
    pub name: String,
    /// Number of the colour: 0 for measured signals and inputs, from 1 for models and their residuals.
    pub color: usize,
    /// Form of the drawing.
    pub form: Form,
    /// Points `(x, y)`, in increasing order of x.
    pub points: Vec<(f64, f64)>,
    /// Half the width of a shaded band around the curve, in the unit of the panel; 0 for none.
    pub band: f64,
}

/// A panel: curves over one pair of axes.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Quantity with its unit, such as `current [A]`.
    pub label: String,
    /// Curves; the first are drawn below the others.
    pub traces: Vec<Trace>,
    /// Limits that are drawn as dashed lines at plus and minus this value; `None` for none.
    pub bound: Option<f64>,
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

/// Panels with a common legend and the same axis of time or lag.
#[derive(Debug, Clone)]
pub struct Traces {
    /// Identifier for links; unique on a page.
    pub id: String,
    /// Label of the common axis, with its unit.
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

impl Trace {
    /// Creates a curve without a band.
    #[must_use]
    pub fn new(name: &str, color: usize, form: Form, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.to_owned(), color, form, points, band: 0.0 }
    }

    /// Returns the curve with a shaded band of half the width `band`.
    #[must_use]
    pub fn with_band(self, band: f64) -> Self {
        Self { band, ..self }
    }
}

impl Panel {
    /// Creates a panel without limits and marks.
    #[must_use]
    pub fn new(label: &str, traces: Vec<Trace>) -> Self {
        Self { label: label.to_owned(), traces, bound: None, marks: Vec::new() }
    }

    /// Returns the panel with the points in a range of the first axis only.
    #[must_use]
    pub fn within(&self, [from, to]: [f64; 2]) -> Self {
        let kept = |trace: &Trace| {
            let points = trace.points.iter().copied().filter(|(x, _)| (from..=to).contains(x)).collect();
            Trace { points, ..trace.clone() }
        };
        Self { traces: self.traces.iter().map(kept).collect(), ..self.clone() }
    }

    /// Returns the names and colours of its curves.
    fn names(&self) -> impl Iterator<Item = (&str, usize, Form)> {
        self.traces.iter().map(|trace| (trace.name.as_str(), trace.color, trace.form))
    }

    /// Returns the ranges of its axes; the second has a margin.
    fn ranges(&self) -> [[f64; 2]; 2] {
        let points = || self.traces.iter().flat_map(|trace| trace.points.iter().map(|point| (*point, trace.band)));
        let finite = |v: &f64| v.is_finite() && v.abs() <= ticks::DRAWN_MAX;
        let xs = points().map(|((x, _), _)| x).filter(finite);
        let of = |((_, y), band): ((f64, f64), f64)| [y - band, y + band];
        let ys = points().flat_map(of).chain(self.bound.into_iter().flat_map(|bound| [-bound, bound])).filter(finite);
        let stems = self.traces.iter().any(|trace| trace.form == Form::Stems);
        let y = ticks::range(ys.chain(stems.then_some(0.0)));
        let margin = 0.06 * (y[1] - y[0]);
        [ticks::range(xs), [y[0] - margin, y[1] + margin]]
    }

    fn is_empty(&self) -> bool {
        self.traces.iter().all(|trace| trace.points.is_empty())
    }
}

impl Traces {
    /// Returns the panels with curves.
    fn drawn(&self) -> impl Iterator<Item = &Panel> {
        self.panels.iter().filter(|panel| !panel.is_empty())
    }

    /// Returns name, colour and form of each curve in the legend, each once.
    fn legend(&self) -> Vec<(&str, usize, Form)> {
        let mut names: Vec<(&str, usize, Form)> = Vec::new();
        for name in self.drawn().flat_map(Panel::names).filter(|(name, ..)| !name.is_empty()) {
            if names.iter().all(|known| known.0 != name.0) {
                names.push(name);
            }
        }
        names
    }

    /// Returns the common range of the first axis.
    fn range(&self) -> [f64; 2] {
        ticks::range(self.drawn().flat_map(|panel| panel.ranges()[0]))
    }
}
