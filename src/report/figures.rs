//! The figures of reports, as charts.

use super::page::Figure;
use super::plot::{Boxes, Chart, Line, boxes, chart, correlation, panels};
use crate::criterion::{Criterion, Scale};
use crate::evaluate::{Initial, Model, Problem};
use crate::identify::{Identification, IdentifySpec};
use crate::motor::{Axis, Discretization, Parameter, Parameters, Scope, Space, simulate};
use crate::numeric::{count, sorted};
use crate::record::{Quantity, Record};
use crate::report::compare::quartiles;
use crate::study::compare::{Block, Comparison, MethodResult, reached};

/// What a model does under the inputs of a recording: current and speed.
#[must_use]
pub fn model(record: &Record, parameters: &Parameters, initial: [f64; 2], how: Discretization) -> [Vec<f64>; 2] {
    // As the fit has it: prepared recordings bring their own inputs.
    let criterion = Criterion { scale: Scale::None, ..Criterion::default() };
    let model = Model { discretization: how, initial: Initial::Measured };
    let Ok(problem) = Problem::new(std::slice::from_ref(record), model, Space::table2(), criterion) else {
        return Default::default();
    };
    simulate(parameters, &problem.signals()[0].drive(), initial, problem.model().discretization)
}

/// A named model of a recording.
pub struct Modelled {
    /// Its name in the legend.
    pub name: String,
    /// Current and speed.
    pub signals: [Vec<f64>; 2],
}

const CHANNELS: [(&str, &str); 2] = [("Current", "current [A]"), ("Speed", "speed [rad/s]")];

/// Measured against models: both signals, what is left of them, and the transient enlarged.
#[must_use]
pub fn responses(id: &str, record: &Record, models: &[Modelled]) -> Figure {
    let time = &record.samples().time_s;
    let window = transient(record);
    let line = |name: &str, values: Vec<f64>| Line {
        name: name.to_owned(),
        points: time.iter().copied().zip(values).collect(),
        ..Line::default()
    };
    let inside = |line: &Line| Line {
        points: line.points.iter().copied().filter(|(t, _)| (window[0]..=window[1]).contains(t)).collect(),
        ..line.clone()
    };
    let (mut whole, mut left, mut enlarged) = (Vec::new(), Vec::new(), Vec::new());
    let by_current = record.driver() == Quantity::Current;
    for (channel, (title, label)) in CHANNELS.into_iter().enumerate() {
        if by_current && channel == 0 {
            let lines = vec![line("input", record.input().to_vec())];
            whole.push(Chart { lines, ..Chart::new(title, ["time [s]", label]) });
            continue;
        }
        let measured = record.measured()[channel].map(<[f64]>::to_vec);
        let mut lines = vec![line("measured", measured.clone().unwrap_or_default())];
        lines.extend(models.iter().map(|m| line(&m.name, m.signals[channel].clone())));
        let mut residuals = vec![Line::default()];
        for m in models {
            let difference = measured.iter().flatten().zip(&m.signals[channel]).map(|(a, b)| a - b).collect();
            residuals.push(line(&m.name, difference));
        }
        let near = Chart {
            lines: lines.iter().map(inside).collect(),
            ..Chart::new(format!("{title}, transient"), ["time [s]", label])
        };
        whole.push(Chart { lines, ..Chart::new(title, ["time [s]", label]) });
        let title = format!("{title}: measured less model");
        left.push(Chart { lines: residuals, ..Chart::new(title, ["time [s]", label]) });
        enlarged.push(near);
    }
    let charts: Vec<Chart> = whole.into_iter().chain(left).chain(enlarged).collect();
    let names: Vec<&str> = models.iter().map(|m| m.name.as_str()).collect();
    Figure {
        id: id.to_owned(),
        map: false,
        svg: panels(&charts, 2, [560.0, 300.0]),
        alternative: format!("Current and speed over time, measured and by {}, with residuals", names.join(", ")),
        caption: match by_current {
            true => "Above: the current, which is the input, and the speed with the model. Below: what the model leaves, and \
                     the transient after the largest change of the input, enlarged.",
            false => "Above: measured and model. Middle: what the model leaves. Below: the transient after the largest \
                      change of the voltage, enlarged.",
        }
        .to_owned(),
    }
}

/// From shortly before the largest change of the voltage on, for a while; the beginning where nothing changes.
fn transient(record: &Record) -> [f64; 2] {
    let samples = record.samples();
    let (time, voltage) = (&samples.time_s, record.input());
    let change = |n: &usize| (voltage[*n] - voltage[n - 1]).abs();
    let at = (1..voltage.len()).max_by(|a, b| change(a).total_cmp(&change(b)).then(b.cmp(a))).unwrap_or(0);
    let whole = time[time.len() - 1] - time[0];
    [time[at] - 0.005 * whole, time[at] + 0.05 * whole]
}

/// Correlations of an estimate; `None` without them.
#[must_use]
pub fn correlations(found: &Identification) -> Option<Figure> {
    let uncertainty = found.uncertainty.as_ref()?;
    let free = found.space.free();
    // Those of many recordings are too many to be seen.
    if free.len() > CORRELATED {
        return None;
    }
    let name = |axis: &Axis| match axis.scope {
        Scope::Shared => axis.parameter.symbol().to_owned(),
        Scope::Recording(n) => format!("{} {}", axis.parameter.symbol(), n + 1),
    };
    let names: Vec<String> = free.iter().map(name).collect();
    let values: Option<Vec<Vec<f64>>> =
        uncertainty.correlation[..free.len()].iter().map(|row| row[..free.len()].iter().copied().collect()).collect();
    let pairs = (0..free.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
    let values = values?;
    let strongest = pairs.max_by(|x, y| values[x.0][x.1].abs().total_cmp(&values[y.0][y.1].abs()));
    let caption = strongest.map_or(String::new(), |(a, b)| {
        format!("The strongest is {:.2}, of {} and {}.", values[a][b], names[a], names[b])
    });
    Some(Figure {
        id: "correlation".to_owned(),
        map: true,
        svg: correlation(&names, values),
        alternative: format!("Matrix of the correlations of the estimates of {}", names.join(", ")),
        caption,
    })
}

/// Parameters whose correlations are drawn at most.
const CORRELATED: usize = 16;

/// The lowest cost after each generation.
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

/// The lowest cost by generation: median and quartiles over runs.
#[must_use]
pub fn convergence(id: &str, block: &Block) -> Figure {
    let line = |result: &MethodResult| {
        let quartiles = quartiles(result);
        let points = quartiles.iter().enumerate().map(|(n, q)| (count(n) + 1.0, q[1])).collect();
        let band = Some((quartiles.iter().map(|q| q[0]).collect(), quartiles.iter().map(|q| q[2]).collect()));
        Line { name: result.method.name().to_owned(), points, band, steps: false }
    };
    let lines = block.results.iter().map(line).collect();
    let of = Chart { lines, ..Chart::new("Lowest cost so far", ["generation [1]", "cost [1]"]).log([false, true]) };
    Figure {
        id: format!("{id}-convergence"),
        map: false,
        svg: chart(&of),
        alternative: "Lowest cost after each generation for each method: median and quartiles over runs".to_owned(),
        caption: "Median over runs with the band of the middle half (the paper's Figs. 8\u{2013}10).".to_owned(),
    }
}

/// Errors of the parameters over runs; `None` where nothing is known that they could be errors of.
#[must_use]
pub fn errors(id: &str, comparison: &Comparison, block: &Block) -> Option<Figure> {
    let expected = comparison.expected()?;
    let panel = |p: Parameter| {
        let error = |value: f64| 100.0 * (value / expected.get(p) - 1.0);
        let group = |result: &MethodResult| {
            (result.method.name().to_owned(), result.values(p).into_iter().map(error).collect::<Vec<f64>>())
        };
        let mut groups: Vec<(String, Vec<f64>)> = block.results.iter().map(group).collect();
        if let Some(sm) = comparison.steiglitz.as_ref().filter(|sm| !sm.spread.is_empty()) {
            groups.push(("sm".to_owned(), sm.spread.iter().map(|found| error(found.get(p))).collect()));
        }
        Boxes { title: p.symbol().to_owned(), groups }
    };
    Some(Figure {
        id: format!("{id}-errors"),
        map: false,
        svg: boxes(&Parameter::ALL.map(panel), "relative error [%]"),
        alternative: "Boxes of the relative errors of each parameter over runs, for each method".to_owned(),
        caption: "Quartiles and median over runs; whiskers reach 1.5 of the box. Steiglitz\u{2013}McBride: over records with new \
                  noise."
            .to_owned(),
    })
}

/// Distributions: final costs, targets reached by evaluations and by time.
#[must_use]
pub fn distributions(id: &str, comparison: &Comparison, block: &Block) -> Figure {
    let (_, reached) = reached(block, comparison.spec.target);
    let name = |result: &MethodResult| result.method.name().to_owned();
    let costs = |result: &MethodResult| {
        let sorted = sorted(&result.costs());
        let points = sorted.iter().enumerate().map(|(n, cost)| (*cost, count(n + 1) / count(sorted.len()))).collect();
        Line { name: name(result), points, steps: true, ..Line::default() }
    };
    let by = |axis: &dyn Fn(usize) -> Vec<f64>| -> Vec<Line> {
        let line = |(n, result): (usize, &MethodResult)| {
            let points = axis(n).into_iter().zip(reached[n].share.iter().copied()).collect();
            Line { name: name(result), points, steps: true, ..Line::default() }
        };
        block.results.iter().enumerate().map(line).collect()
    };
    let evaluations = by(&|n| reached[n].evaluations.clone());
    let seconds = by(&|n| reached[n].seconds.iter().map(|s| 1e3 * s).collect());
    let charts = [
        Chart {
            lines: block.results.iter().map(costs).collect(),
            ..Chart::new("Final costs", ["cost [1]", "share of runs [1]"]).log([true, false])
        },
        Chart {
            lines: evaluations,
            ..Chart::new("Targets, equal evaluations", ["evaluations of a run [1]", "share reached [1]"])
        },
        Chart { lines: seconds, ..Chart::new("Targets, equal time", ["time of a run [ms]", "share reached [1]"]) },
    ];
    Figure {
        id: format!("{id}-distributions"),
        map: false,
        svg: panels(&charts, 3, [400.0, 340.0]),
        alternative: "Empirical distributions of final costs and of targets reached over evaluations and time".to_owned(),
        caption: "Left: how many runs end at a cost or below. Middle and right: share of all pairs of a run and a target reached, \
                  under equal evaluations and under equal time."
            .to_owned(),
    }
}

/// Final costs, run by run, the best first.
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
        caption: "Steps in a curve are optima in which runs are trapped.".to_owned(),
    }
}
