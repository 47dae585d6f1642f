//! Figures of a sweep: the parameters of the motors, and costs by factor.

use super::line::{Spread, spreads};
use super::tables::id;
use super::words::{Unit, block_name, counted, label, many};
use crate::motor::Scope;
use crate::numeric::count;
use crate::report::page::{Figure, capital};
use crate::report::plot::{Chart, Histogram, Line, box_rows, histograms, panels as chart_panels};
use crate::study::sweep::{Cell, Limits, Named, NamedRun, SweepSummary};

/// Largest number of boxes in a figure.
const BOXES: usize = 12;
/// Largest number of boxes in all figures.
const BOXES_ALL: usize = 36;

/// Returns the histograms of the parameters over the motors; `None` for fewer than two motors.
pub(super) fn motors(summary: &SweepSummary, limits: &Limits) -> Option<Figure> {
    if summary.results.len() < 2 {
        return None;
    }
    let panel = |spread: Spread| {
        let (parameter, scope) = spread.named;
        let unit = Unit::for_all(spread.named, &spread.values);
        let of =
            if let Scope::Recording(n) = scope { format!(" of recording {}", u64::from(n) + 1) } else { String::new() };
        Histogram {
            title: capital(parameter.name()) + &of,
            labels: [unit.head(), "motors [1]".to_owned()],
            values: spread.values.iter().map(|value| unit.scale(*value)).collect(),
            limits: spread.limits.map(|pair| pair.map(|limit| unit.scale(limit))),
        }
    };
    let panels: Vec<Histogram> = spreads(summary, limits).into_iter().map(panel).collect();
    let mut caption = format!("The parameters of {} motors.", many(summary.results.len()));
    if !limits.is_empty() {
        caption.push_str(" Dashed: the limits; motors outside have the same colour.");
    }
    caption.push_str(&beyond(&panels, "value is", "values are"));
    Some(Figure {
        id: "motors".to_owned(),
        map: false,
        svg: histograms(&panels, 3),
        alternative: "Histograms of the parameters over the motors".to_owned(),
        caption,
    })
}

/// Returns the run charts of the parameters: their values over the motors in the order of the study, which sorts files by name and so
/// by serial number or time, with the limits; `None` for fewer than three motors.
pub(super) fn run_chart(summary: &SweepSummary, limits: &Limits) -> Option<Figure> {
    if summary.results.len() < 3 {
        return None;
    }
    let place = |run: &NamedRun| count(run.job.motor + 1);
    let panel = |named: &Named| {
        let value = |run: &NamedRun| Some((place(run), run.estimate(*named)?.value?));
        let points: Vec<(f64, f64)> = summary.results.iter().filter_map(value).collect();
        let unit = Unit::for_all(*named, &points.iter().map(|(_, value)| *value).collect::<Vec<_>>());
        let scaled = |(motor, value): (f64, f64)| (motor, unit.scale(value));
        let ends = [points.first().map_or(0.0, |first| first.0), points.last().map_or(0.0, |last| last.0)];
        let limit = |(name, value): (&str, f64)| Line {
            name: format!("{name} limit"),
            points: ends.map(|motor| scaled((motor, value))).to_vec(),
            ..Line::default()
        };
        let line =
            Line { name: "motors".to_owned(), points: points.into_iter().map(scaled).collect(), ..Line::default() };
        let bounds = limits.of(named.0).into_iter().flat_map(|[low, high]| [("lower", low), ("upper", high)]);
        let lines = std::iter::once(line).chain(bounds.filter(|(_, value)| value.is_finite()).map(limit)).collect();
        Chart { lines, ..Chart::new(capital(named.0.name()), ["motor number [1]", &unit.head()]) }
    };
    let panels: Vec<Chart> = summary.parameters.iter().map(panel).collect();
    let limited = if limits.is_empty() { "" } else { " Dashed: the limits." };
    Some(Figure {
        id: "run-chart".to_owned(),
        map: false,
        svg: chart_panels(&panels, 2, [480.0, 300.0]),
        alternative: "Run charts: the parameters over the motors in their order, with the limits".to_owned(),
        caption: format!(
            "The parameters in the order of the motors.{limited} A drift or step shows a change of the line."
        ),
    })
}

/// Returns the figures of the costs of a block: boxes by cell, or a histogram for a single cell.
pub(super) fn costs(summary: &SweepSummary, n: usize) -> Vec<Figure> {
    let block = &summary.blocks[n];
    let all = || block.cells.iter().flat_map(|cell| &cell.costs).copied();
    let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max));
    let is_log = low > 0.0 && high > 10.0 * low;
    if let [cell] = &block.cells[..] {
        return single(summary, n, &cell.costs, is_log).into_iter().collect();
    }
    let shown = &block.cells[..block.cells.len().min(BOXES_ALL)];
    let label_of = format!("cost ({}) [1]", block_name(block));
    let figure = |(k, cells): (usize, &[Cell])| {
        let groups = cells.iter().map(|cell| (label(summary, cell), cell.costs.clone())).collect();
        Figure {
            id: format!("{}-{}", id(summary, "costs", n), k + 1),
            map: false,
            svg: box_rows(groups, &label_of, [low, high], is_log),
            alternative: "Boxes of the costs of all runs, one for each combination of levels".to_owned(),
            caption: String::new(),
        }
    };
    let mut figures: Vec<Figure> = shown.chunks(BOXES).enumerate().map(figure).collect();
    if let Some(last) = figures.last_mut() {
        let logarithms = if is_log { " of the logarithms" } else { "" };
        last.caption =
            format!("Median and quartiles{logarithms} over runs; whiskers extend to 1.5 interquartile ranges.");
        if block.cells.len() > shown.len() {
            let (first, all) = (many(shown.len()), many(block.cells.len()));
            last.caption.push_str(&format!(" Only the first {first} of {all} are drawn; the table has all."));
        }
    }
    figures
}

/// Returns the histogram of costs; `None` for fewer than two.
fn single(summary: &SweepSummary, n: usize, costs: &[f64], is_log: bool) -> Option<Figure> {
    if costs.len() < 2 {
        return None;
    }
    let name = block_name(&summary.blocks[n]);
    let values = costs.iter().map(|cost| if is_log { cost.log10() } else { *cost }).collect();
    let axis = if is_log { format!("log10 of the cost ({name}) [1]") } else { format!("cost ({name}) [1]") };
    let panels = [Histogram { labels: [axis, "runs [1]".to_owned()], values, ..Histogram::default() }];
    Some(Figure {
        id: id(summary, "costs", n),
        map: false,
        caption: format!("The costs of {} runs.{}", many(costs.len()), beyond(&panels, "run is", "runs are")),
        svg: histograms(&panels, 1),
        alternative: "Histogram of the costs of all runs".to_owned(),
    })
}

/// Returns the sentence on the number of values outside the drawn range.
fn beyond(panels: &[Histogram], one: &str, more: &str) -> String {
    match panels.iter().map(Histogram::beyond).sum::<usize>() {
        0 => String::new(),
        n => format!(" {} outside the drawn range.", counted(n as u64, one, more)),
    }
}
