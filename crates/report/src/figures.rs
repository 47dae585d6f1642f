//! Figures of reports.

use super::chart::{AxisScale, Band, Chart, Figure, Form, Panel, Series, boxes, correlation, figure};
use super::page::capital;
use super::recorded::{Recorded, RecordedInput, RecordedOutput};
use super::requested::Requested;
pub use super::signals::model;
use crate::compare::quartiles;
use motorfit_core::numeric::{count, rms, sorted};
use motorfit_core::text::listed;
use motorfit_identify::analysis::ResidualCorrelation;
use motorfit_identify::{Identification, Machine};
use motorfit_study::compare::{Block, ComparedParameter, Comparison, MethodEstimates, MethodResult, Reached, reached};

/// Simulated outputs of a machine, shape `[outputs][samples]`, with its name in the legend.
pub type Modelled<'a> = (&'a str, &'a [Vec<f64>]);

/// Returns the residuals of an output, measured minus modelled; NaN where they do not count: at masked samples, and in the intervals
/// `left_out` \[s\], which were excluded automatically.
fn residuals(signals: &Recorded, output: &RecordedOutput, modelled: &[f64], left_out: &[[f64; 2]]) -> Vec<f64> {
    let time = &signals.time_s;
    let is_left_out = |n: usize| left_out.iter().any(|[from, to]| (*from..=*to).contains(&time[n]));
    let of = |(n, (a, b)): (usize, (&f64, &f64))| if !output.counts(n) || is_left_out(n) { f64::NAN } else { a - b };
    output.measured.iter().flatten().zip(modelled).enumerate().map(of).collect()
}

/// Returns the inputs, the measured and modelled outputs and their residuals over time, one below the other, and beside each
/// other the transient after the largest change of the input, enlarged. `left_out` are intervals that were excluded from the
/// fit automatically \[s\].
#[must_use]
pub fn response_charts(id: &str, recorded: &Recorded, models: &[Modelled<'_>], left_out: &[[f64; 2]]) -> [Chart; 2] {
    let curve = |values: &[f64]| recorded.time_s.iter().copied().zip(values.iter().copied()).collect::<Vec<_>>();
    let input = |of: &RecordedInput| {
        let form = if of.is_linear { Form::Line } else { Form::Steps };
        Panel::new(&of.label, vec![Series::new("", 0, form, curve(&of.values))])
    };
    let mut complete: Vec<Panel> = recorded.drawn().map(input).collect();
    let (mut signals, mut differences) = (Vec::new(), Vec::new());
    let mut is_complete = left_out.is_empty();
    for output in &recorded.outputs {
        let measured = output.measured.as_ref();
        is_complete &= output.counting.iter().all(|counts| *counts);
        let mut shown: Vec<Series> =
            measured.map(|of| Series::new("measured", 0, Form::Dots, curve(of))).into_iter().collect();
        let (mut left, mut limits) = (Vec::new(), Vec::new());
        for (n, (name, outputs)) in (1..).zip(models) {
            let Some(values) = outputs.get(output.number) else { continue };
            let series = Series::new(name, n, Form::Line, curve(values));
            if measured.is_none() {
                shown.push(series);
                continue;
            }
            let residual = residuals(recorded, output, values, left_out);
            let counting: Vec<f64> = residual.iter().copied().filter(|r| r.is_finite()).collect();
            let band = 1.96 * rms(&counting);
            shown.push(series.with_band(Band::Half(band)));
            left.push(Series::new(name, n, Form::Dots, curve(&residual)));
            if models.len() == 1 {
                limits.extend([-band, band]);
            }
        }
        signals.push(Panel::new(&output.label, shown));
        if !left.is_empty() {
            differences.push(Panel { limits: [Vec::new(), limits], ..Panel::new(&output.residual, left) });
        }
    }
    let [from, to] = transient(recorded);
    let enlarged = signals.iter().map(|panel| with_marks(panel.within([from, to]))).collect();
    complete.extend(signals.into_iter().chain(differences));
    let names = models.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let of = |id: String, panels, is_grid, caption: &str| Chart {
        id,
        axis: "time [s]".to_owned(),
        panels,
        is_grid,
        alternative: format!("measured and by {names}, over time"),
        caption: caption.to_owned(),
    };
    let excluded = if is_complete { "" } else { " Excluded samples have no residual." };
    let bands = format!(
        "Bands and dashed lines: \u{b1}1.96 times the standard deviation of the residuals, measured minus modelled.{excluded}"
    );
    let after = "The transient after the largest change of the input, enlarged.";
    [of(id.to_owned(), complete, false, &bands), of(format!("{id}-transient"), enlarged, true, after)]
}

/// Largest number of samples whose dots are drawn strongly, so that they stand out below the curve of a model.
const MARKED: usize = 250;

/// Returns a panel whose few measured samples are strong dots.
fn with_marks(mut panel: Panel) -> Panel {
    for series in panel.series.iter_mut().filter(|series| series.form == Form::Dots && series.points.len() <= MARKED) {
        series.form = Form::Marks;
    }
    panel
}

/// Returns the figure of measured and modelled signals, their residuals, and the transient enlarged, as a drawing of a fixed size.
/// `name` is the name of the model in the legend.
#[must_use]
pub fn responses(id: &str, recorded: &Recorded, name: &str, signals: &[Vec<f64>]) -> Figure {
    let names = recorded.outputs.iter().map(|output| output.name.as_str()).collect::<Vec<_>>();
    let alternative = format!("{} over time, measured and by {name}, with residuals", capital(&listed(&names, "and")));
    Figure { alternative, ..figure(&response_charts(id, recorded, &[(name, signals)], &[])) }
}

/// Returns the autocorrelation of the residuals of each output and their cross-correlation with the first input, with the limits
/// that 99 % of them are within if the model is adequate; `None` if they are not defined. `left_out` are intervals that were
/// excluded from the fit automatically \[s\].
#[must_use]
pub fn residual_correlations(
    id: &str,
    recorded: &Recorded,
    signals: &[Vec<f64>],
    left_out: &[[f64; 2]],
) -> Option<Chart> {
    let input = recorded.drawn().next()?;
    let driver = input.label.split(" [").next().unwrap_or_default();
    let mut panels = Vec::new();
    for output in &recorded.outputs {
        let (Some(measured), Some(modelled)) = (&output.measured, signals.get(output.number)) else { continue };
        let residual = residuals(recorded, output, modelled, left_out);
        // Lags are those of the samples at which the sensor measured.
        let is_own = |n: &usize| measured.get(*n).is_some_and(|value| value.is_finite());
        let own: Vec<usize> = (0..residual.len()).filter(is_own).collect();
        let of_own = |values: &[f64]| own.iter().filter_map(|n| values.get(*n).copied()).collect::<Vec<f64>>();
        let Some(of) = ResidualCorrelation::of(&of_own(&residual), &of_own(&input.values)) else { continue };
        let mut panel = |label: String, points, bound: f64| {
            let series = vec![Series::new("", 1, Form::Stems, points)];
            panels.push(Panel { limits: [Vec::new(), vec![-bound, bound]], ..Panel::new(&label, series) });
        };
        // The autocorrelation is even; lag 0, which is 1, is left out.
        let sides = of.autocorrelation.iter().enumerate().map(|(n, r)| (count(n + 1), *r));
        let both = sides.clone().rev().map(|(lag, r)| (-lag, r)).chain(sides).collect();
        let name = &output.name;
        panel(format!("{name} residual: autocorrelation"), both, of.autocorrelation_limit);
        let both = ResidualCorrelation::cross_lags().zip(of.cross_correlation).collect();
        panel(format!("{name} residual: cross-correlation with {driver}"), both, of.cross_correlation_limit);
    }
    let is_defined = !panels.is_empty();
    is_defined.then(|| Chart {
        id: id.to_owned(),
        axis: "lag [samples]".to_owned(),
        panels,
        is_grid: true,
        alternative: "over lags, with the limits of an adequate model".to_owned(),
        caption: "Dashed: limits for white residuals that are independent of the input, which 99 % of the lags are within. Positive lags: \
                  the residual follows the input."
            .to_owned(),
    })
}

/// Returns the interval around the largest change of the first input \[s\], or at the start of a constant input.
fn transient(recorded: &Recorded) -> [f64; 2] {
    let time = &recorded.time_s;
    let (Some(first), Some(last)) = (time.first(), time.last()) else { return [0.0; 2] };
    let values = recorded.drawn().next().map_or(&[][..], |input| &input.values);
    let change = |n: &usize| (values[*n] - values[n - 1]).abs();
    let at = (1..values.len()).max_by(|a, b| change(a).total_cmp(&change(b)).then(b.cmp(a))).unwrap_or(0);
    let whole = last - first;
    [time[at] - 0.005 * whole, time[at] + 0.05 * whole]
}

/// Returns the figure of the correlations of the estimates; `None` without a covariance, and for one or too many parameters.
#[must_use]
pub fn correlations<M: Machine>(found: &Identification<M>) -> Option<Figure> {
    let uncertainty = found.uncertainty.as_ref()?;
    let names = found.machine.free();
    // A matrix of the parameters of many recordings would not be legible.
    if names.is_empty() || names.len() > CORRELATED {
        return None;
    }
    let rows = uncertainty.correlation.get(..names.len())?.iter();
    let values: Vec<Vec<f64>> =
        rows.map(|row| row.get(..names.len())?.iter().copied().collect()).collect::<Option<_>>()?;
    let pairs = (0..names.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
    let strongest = pairs.max_by(|x, y| values[x.0][x.1].abs().total_cmp(&values[y.0][y.1].abs()));
    let caption = strongest.map_or(String::new(), |(a, b)| {
        format!(
            "Correlation of the estimates. The largest in magnitude is {:.2}, between {} and {}.",
            values[a][b], names[a], names[b]
        )
    });
    Some(Figure {
        id: "correlation".to_owned(),
        map: true,
        svg: correlation(&names, &values),
        alternative: format!("Matrix of the correlations of the estimates of {}", names.join(", ")),
        caption,
    })
}

/// Largest number of parameters whose correlations are drawn.
const CORRELATED: usize = 24;

/// Returns the chart of the lowest cost after each generation; `None` without a search.
#[must_use]
pub fn history<M>(found: &Identification<M>, requested: &Requested) -> Option<Chart> {
    if found.history.len() < 2 {
        return None;
    }
    let points = found.history.iter().enumerate().map(|(n, cost)| (count(n) + 1.0, *cost)).collect();
    let series = vec![Series::new(found.searched.method, 1, Form::Line, points)];
    Some(Chart {
        id: "history".to_owned(),
        axis: "generation [1]".to_owned(),
        panels: vec![Panel { scales: LOG_COST, ..Panel::new("lowest cost [1]", series) }],
        alternative: "of the search after each generation, on a logarithmic axis".to_owned(),
        caption: format!("{} agents, seed {}.", requested.population, requested.seed),
        ..Chart::default()
    })
}

/// A linear first axis and a logarithmic second one.
const LOG_COST: [AxisScale; 2] = [AxisScale::Linear, AxisScale::Log];

/// Function that returns the points of the curve of a method.
type Points<'a> = dyn Fn(&MethodResult, &Reached) -> Vec<(f64, f64)> + 'a;

/// Returns the chart of the lowest cost after each generation: median and quartiles over runs.
#[must_use]
pub fn convergence(id: &str, block: &Block) -> Chart {
    let of = |(n, result): (usize, &MethodResult)| {
        let quartiles = quartiles(result);
        let points = quartiles.iter().enumerate().map(|(n, q)| (count(n) + 1.0, q[1])).collect();
        let band = Band::Between(quartiles.iter().map(|q| [q[0], q[2]]).collect());
        Series::new(result.method.name(), n + 1, Form::Line, points).with_band(band)
    };
    let series = block.results.iter().enumerate().map(of).collect();
    Chart {
        id: format!("{id}-convergence"),
        axis: "generation [1]".to_owned(),
        panels: vec![Panel { scales: LOG_COST, ..Panel::new("lowest cost [1]", series) }],
        alternative: "after each generation for each method, median and quartiles over runs".to_owned(),
        caption: "Median and interquartile range over runs, as in the paper's Figs. 8\u{2013}10.".to_owned(),
        ..Chart::default()
    }
}

/// Returns the chart of the relative errors of the parameters over runs; `None` without true or refined parameters.
#[must_use]
pub fn errors(id: &str, comparison: &Comparison, block: &Block) -> Option<Chart> {
    let (expected, found) = (comparison.expected()?, comparison.estimates(block));
    let panel = |(n, (parameter, expected)): (usize, (&ComparedParameter, &f64))| {
        let error = |value: f64| 100.0 * (value / expected - 1.0);
        let shown = found.iter().filter(|found| found.method != "sm" || !found.all.is_empty());
        let group =
            |found: &MethodEstimates| (found.method.to_owned(), found.values(n).into_iter().map(error).collect());
        let label = format!("{} {}", parameter.name, parameter.description);
        boxes(label.trim_end(), "relative error [%]", &shown.map(group).collect(), AxisScale::Linear)
    };
    let sm = " Steiglitz\u{2013}McBride: over records with new noise.";
    let sm = if comparison.subject.model().is_none() { sm } else { "" };
    Some(Chart {
        id: format!("{id}-errors"),
        panels: comparison.parameters.iter().zip(&expected).enumerate().map(panel).collect(),
        is_grid: true,
        alternative: "relative errors over runs, a box for each method".to_owned(),
        caption: format!("Median and quartiles over runs; whiskers extend to 1.5 interquartile ranges.{sm}"),
        ..Chart::default()
    })
}

/// Returns the chart of the empirical distributions of final costs, and of targets reached over evaluations and over time.
#[must_use]
pub fn distributions(id: &str, comparison: &Comparison, block: &Block) -> Chart {
    let (_, reached) = reached(block, comparison.spec.target);
    let panel = |label: &str, axis: &str, points: &Points<'_>| {
        let of = |(n, (result, reached)): (usize, (&MethodResult, &Reached))| {
            Series::new(result.method.name(), n + 1, Form::Steps, points(result, reached))
        };
        let series = block.results.iter().zip(&reached).enumerate().map(of).collect();
        Panel { axis: Some(axis.to_owned()), ..Panel::new(label, series) }
    };
    let costs = |result: &MethodResult, _: &Reached| {
        let sorted = sorted(&result.costs());
        sorted.iter().enumerate().map(|(n, cost)| (*cost, count(n + 1) / count(sorted.len()))).collect()
    };
    let targets = |axis: &[f64], unit: f64, reached: &Reached| {
        axis.iter().map(|value| unit * value).zip(reached.share.iter().copied()).collect()
    };
    let ends = panel("runs that end at or below a cost, fraction [1]", "cost [1]", &costs);
    let panels = vec![
        Panel { scales: [AxisScale::Log, AxisScale::Linear], ..ends },
        panel("targets reached, fraction [1]", "evaluations of a run [1]", &|_, reached| {
            targets(&reached.evaluations, 1.0, reached)
        }),
        panel("targets reached, fraction [1]", "time of a run [ms]", &|_, reached| {
            targets(&reached.seconds, 1e3, reached)
        }),
    ];
    Chart {
        id: format!("{id}-distributions"),
        panels,
        is_grid: true,
        alternative: "for each method".to_owned(),
        caption: "Targets reached: fraction of all pairs of a run and a target.".to_owned(),
        ..Chart::default()
    }
}

/// Returns the chart of the final costs of all runs in increasing order.
#[must_use]
pub fn waterfall(id: &str, block: &Block) -> Chart {
    let of = |(n, result): (usize, &MethodResult)| {
        let points = sorted(&result.costs()).into_iter().enumerate().map(|(n, cost)| (count(n) + 1.0, cost)).collect();
        Series::new(result.method.name(), n + 1, Form::Line, points)
    };
    let series = block.results.iter().enumerate().map(of).collect();
    let axis = Some("run, in the order of cost [1]".to_owned());
    Chart {
        id: format!("{id}-waterfall"),
        panels: vec![Panel { axis, scales: LOG_COST, ..Panel::new("final cost [1]", series) }],
        alternative: "of all runs in order, for each method".to_owned(),
        caption: "Final costs of all runs in increasing order: plateaus above the lowest cost suggest local optima in which runs are trapped."
            .to_owned(),
        ..Chart::default()
    }
}
