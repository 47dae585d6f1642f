//! Figures of reports.

use super::page::Figure;
use super::plot::{Chart, Line, boxes, chart, correlation, panels};
use crate::criterion::{Criterion, Scale};
use crate::evaluate::{Initial, Model, Problem};
use crate::identify::{Identification, IdentifySpec};
use crate::motor::{Axis, Discretization, Parameter, Parameters, Scope, Space, simulate};
use crate::numeric::{count, sorted};
use crate::record::{Quantity, Record};
use crate::report::compare::quartiles;
use crate::study::compare::{Block, Comparison, MethodEstimates, MethodResult, Reached, reached};

/// Simulates a motor under the input of a recording and returns current \[A\] and speed \[rad/s\]; both are empty if the
/// recording cannot be simulated.
#[must_use]
pub fn model(record: &Record, parameters: &Parameters, initial: [f64; 2], how: Discretization) -> [Vec<f64>; 2] {
    // The inputs are taken from a problem, as in the fit, because preparation may have changed them.
    let criterion = Criterion { scale: Scale::None, ..Criterion::default() };
    let model = Model { discretization: how, initial: Initial::Measured };
    let Ok(problem) = Problem::new(std::slice::from_ref(record), model, Space::table2(), criterion) else {
        return Default::default();
    };
    simulate(parameters, &problem.signals()[0].drive(), initial, problem.model().discretization)
}

const CHANNELS: [(&str, &str); 2] = [("Current", "current [A]"), ("Speed", "speed [rad/s]")];

/// Returns the figure of measured and modelled signals, their residuals, and the transient enlarged. `name` is the
/// name of the model in the legend.
#[must_use]
pub fn responses(id: &str, record: &Record, name: &str, signals: &[Vec<f64>; 2]) -> Figure {
    let time = &record.samples().time_s;
    let [from, to] = transient(record);
    let line = |name: &str, values: &[f64]| {
        let points = time.iter().copied().zip(values.iter().copied()).collect();
        Line { name: name.to_owned(), points, ..Line::default() }
    };
    let inside = |line: &Line| Line {
        points: line.points.iter().copied().filter(|(t, _)| (from..=to).contains(t)).collect(),
        ..line.clone()
    };
    let chart =
        |title: String, label: &str, lines: Vec<Line>| Chart { lines, ..Chart::new(title, ["time [s]", label]) };
    let (mut complete, mut residuals, mut enlarged) = (Vec::new(), Vec::new(), Vec::new());
    let by_current = record.driver() == Quantity::Current;
    for (channel, (title, label)) in CHANNELS.into_iter().enumerate() {
        if by_current && channel == 0 {
            complete.push(chart(title.to_owned(), label, vec![line("input", record.input())]));
            continue;
        }
        let (measured, model) = (record.measured()[channel].unwrap_or_default(), &signals[channel]);
        let residual: Vec<f64> = measured.iter().zip(model).map(|(a, b)| a - b).collect();
        let lines = vec![line("measured", measured), line(name, model)];
        enlarged.push(chart(format!("{title}, transient"), label, lines.iter().map(inside).collect()));
        complete.push(chart(title.to_owned(), label, lines));
        // The empty line gives the residual the colour of its model.
        let lines = vec![Line::default(), line(name, &residual)];
        residuals.push(chart(format!("{title} residual"), label, lines));
    }
    let charts: Vec<Chart> = complete.into_iter().chain(residuals).chain(enlarged).collect();
    Figure {
        id: id.to_owned(),
        map: false,
        svg: panels(&charts, 2, [560.0, 300.0]),
        alternative: format!("Current and speed over time, measured and by {name}, with residuals"),
        caption: match by_current {
            true => {
                "Top: the current, which is the input, and the measured and modelled speed. Bottom: the residual, and \
                     the transient after the largest change of the input, enlarged."
            }
            false => {
                "Top: measured and modelled signals. Middle: residuals. Bottom: the transient after the largest \
                      change of the voltage, enlarged."
            }
        }
        .to_owned(),
    }
}

/// Returns the interval around the largest change of the input \[s\], or at the start of a constant input.
fn transient(record: &Record) -> [f64; 2] {
    let samples = record.samples();
    let (time, voltage) = (&samples.time_s, record.input());
    let change = |n: &usize| (voltage[*n] - voltage[n - 1]).abs();
    let at = (1..voltage.len()).max_by(|a, b| change(a).total_cmp(&change(b)).then(b.cmp(a))).unwrap_or(0);
    let whole = time[time.len() - 1] - time[0];
    [time[at] - 0.005 * whole, time[at] + 0.05 * whole]
}

/// Returns the figure of the correlations of the estimates; `None` without a covariance or with too many parameters.
#[must_use]
pub fn correlations(found: &Identification) -> Option<Figure> {
    let uncertainty = found.uncertainty.as_ref()?;
    let free = found.space.free();
    // A matrix of the parameters of many recordings would not be legible.
    if free.len() > CORRELATED {
        return None;
    }
    let name = |axis: &Axis| match axis.scope {
        Scope::Shared => axis.parameter.symbol().to_owned(),
        Scope::Recording(n) => format!("{} {}", axis.parameter.symbol(), u64::from(n) + 1),
    };
    let names: Vec<String> = free.iter().map(name).collect();
    let rows = uncertainty.correlation.get(..free.len())?.iter();
    let values: Vec<Vec<f64>> =
        rows.map(|row| row.get(..free.len())?.iter().copied().collect()).collect::<Option<_>>()?;
    let pairs = (0..free.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
    let strongest = pairs.max_by(|x, y| values[x.0][x.1].abs().total_cmp(&values[y.0][y.1].abs()));
    let caption = strongest.map_or(String::new(), |(a, b)| {
        format!("The largest in magnitude is {:.2}, between {} and {}.", values[a][b], names[a], names[b])
    });
    Some(Figure {
        id: "correlation".to_owned(),
        map: true,
        svg: correlation(&names, values),
        alternative: format!("Matrix of the correlations of the estimates of {}", names.join(", ")),
        caption,
    })
}

/// Largest number of parameters whose correlations are drawn.
const CORRELATED: usize = 16;

/// Returns the figure of the lowest cost after each generation; `None` without a search.
#[must_use]
pub fn history(found: &Identification, spec: &IdentifySpec) -> Option<Figure> {
    if found.history.len() < 2 {
        return None;
    }
    let points = found.history.iter().enumerate().map(|(n, cost)| (count(n) + 1.0, *cost)).collect();
    let lines = vec![Line { name: found.searched.method.to_owned(), points, ..Line::default() }];
    let chart_of = Chart { lines, ..Chart::new("Search", ["generation [1]", "lowest cost [1]"]).log([false, true]) };
    Some(Figure {
        id: "history".to_owned(),
        map: false,
        svg: chart(&chart_of),
        alternative: "Lowest cost of the search after each generation, on a logarithmic axis".to_owned(),
        caption: format!("{} agents, seed {}.", spec.population, spec.seed),
    })
}

/// Returns the figure of the lowest cost after each generation: median and quartiles over runs.
#[must_use]
pub fn convergence(id: &str, block: &Block) -> Figure {
    let line = |result: &MethodResult| {
        let quartiles = quartiles(result);
        let points = quartiles.iter().enumerate().map(|(n, q)| (count(n) + 1.0, q[1])).collect();
        let band = Some((quartiles.iter().map(|q| q[0]).collect(), quartiles.iter().map(|q| q[2]).collect()));
        Line { name: result.method.name().to_owned(), points, band, steps: false }
    };
    let lines = block.results.iter().map(line).collect();
    let of = Chart { lines, ..Chart::new("Lowest cost", ["generation [1]", "cost [1]"]).log([false, true]) };
    Figure {
        id: format!("{id}-convergence"),
        map: false,
        svg: chart(&of),
        alternative: "Lowest cost after each generation for each method: median and quartiles over runs".to_owned(),
        caption: "Median and interquartile range over runs, as in the paper's Figs. 8\u{2013}10.".to_owned(),
    }
}

/// Returns the figure of the relative errors of the parameters over runs; `None` without true or refined parameters.
#[must_use]
pub fn errors(id: &str, comparison: &Comparison, block: &Block) -> Option<Figure> {
    let (expected, found) = (comparison.expected()?, comparison.estimates(block));
    let panel = |p: Parameter| {
        let error = |value: f64| 100.0 * (value / expected.get(p) - 1.0);
        let shown = found.iter().filter(|found| found.method != "sm" || !found.all.is_empty());
        let group =
            |found: &MethodEstimates| (found.method.to_owned(), found.values(p).into_iter().map(error).collect());
        (p.symbol(), shown.map(group).collect())
    };
    Some(Figure {
        id: format!("{id}-errors"),
        map: false,
        svg: boxes(Parameter::ALL.map(panel).to_vec(), "relative error [%]"),
        alternative: "Boxes of the relative errors of each parameter over runs, for each method".to_owned(),
        caption: "Median and quartiles over runs; whiskers extend to 1.5 interquartile ranges. Steiglitz\u{2013}McBride: over records with new \
                  noise."
            .to_owned(),
    })
}

/// Function that returns the points of the curve of a method.
type Points<'a> = dyn Fn(&MethodResult, &Reached) -> Vec<(f64, f64)> + 'a;

/// Returns the figure of the empirical distributions of final costs, and of targets reached over evaluations and over
/// time.
#[must_use]
pub fn distributions(id: &str, comparison: &Comparison, block: &Block) -> Figure {
    let (_, reached) = reached(block, comparison.spec.target);
    let chart = |title: &str, labels: [&str; 2], points: &Points<'_>| {
        let line = |(result, reached): (&MethodResult, &Reached)| {
            let name = result.method.name().to_owned();
            Line { name, points: points(result, reached), steps: true, ..Line::default() }
        };
        Chart { lines: block.results.iter().zip(&reached).map(line).collect(), ..Chart::new(title, labels) }
    };
    let costs = |result: &MethodResult, _: &Reached| {
        let sorted = sorted(&result.costs());
        sorted.iter().enumerate().map(|(n, cost)| (*cost, count(n + 1) / count(sorted.len()))).collect()
    };
    let targets = |axis: &[f64], unit: f64, reached: &Reached| {
        axis.iter().map(|value| unit * value).zip(reached.share.iter().copied()).collect()
    };
    let charts = [
        chart("Final costs", ["cost [1]", "fraction of runs [1]"], &costs).log([true, false]),
        chart("Targets over evaluations", ["evaluations of a run [1]", "fraction reached [1]"], &|_, reached| {
            targets(&reached.evaluations, 1.0, reached)
        }),
        chart("Targets over time", ["time of a run [ms]", "fraction reached [1]"], &|_, reached| {
            targets(&reached.seconds, 1e3, reached)
        }),
    ];
    Figure {
        id: format!("{id}-distributions"),
        map: false,
        svg: panels(&charts, 3, [400.0, 340.0]),
        alternative: "Empirical distributions of final costs and of targets reached over evaluations and time".to_owned(),
        caption: "Left: fraction of runs that end at or below a cost. Middle and right: fraction of all pairs of a run and a target \
                  that are reached, over evaluations and over time."
            .to_owned(),
    }
}

/// Returns the figure of the final costs of all runs in increasing order.
#[must_use]
pub fn waterfall(id: &str, block: &Block) -> Figure {
    let line = |result: &MethodResult| {
        let points = sorted(&result.costs()).into_iter().enumerate().map(|(n, cost)| (count(n) + 1.0, cost)).collect();
        Line { name: result.method.name().to_owned(), points, ..Line::default() }
    };
    let lines = block.results.iter().map(line).collect();
    let of = Chart { lines, ..Chart::new("Final costs, sorted", ["run [1]", "cost [1]"]).log([false, true]) };
    Figure {
        id: format!("{id}-waterfall"),
        map: false,
        svg: chart(&of),
        alternative: "Final costs of all runs in order, for each method, on a logarithmic axis".to_owned(),
        caption: "Plateaus above the lowest cost suggest local optima in which runs are trapped.".to_owned(),
    }
}
