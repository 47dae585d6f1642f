//! Charts of a sweep: the parameters of the motors, and costs by factor.

use super::line::{Spread, spreads};
use super::words::{Unit, block_name, counted, id, label, many};
use crate::chart::{AxisScale, Chart, Form, Histogram, Panel, Series, boxes};
use crate::page::capital;
use motorfit_core::numeric::count;
use motorfit_study::sweep::{Limits, NamedRun, SweepParameter, SweepSummary};

/// Largest number of boxes in a chart.
const BOXES: usize = 36;

/// Returns the histograms of the parameters over the motors; `None` for fewer than two motors.
pub(super) fn motors(summary: &SweepSummary, limits: &Limits) -> Option<Chart> {
    if summary.results.len() < 2 {
        return None;
    }
    let histogram = |spread: Spread| {
        let unit = Unit::for_all(&spread.parameter, &spread.values);
        let recording = spread.parameter.recording;
        let of = recording.map_or_else(String::new, |n| format!(" of recording {}", u64::from(n) + 1));
        Histogram {
            label: format!("{}{of}: motors [1]", capital(&spread.parameter.description)),
            axis: unit.head(),
            values: spread.values.iter().map(|value| unit.scale(*value)).collect(),
            limits: spread.limits.map(|pair| pair.map(|limit| unit.scale(limit))),
        }
    };
    let all: Vec<Histogram> = spreads(summary, limits).into_iter().map(histogram).collect();
    let mut caption = format!("The parameters of {} motors.", many(summary.results.len()));
    if !limits.is_empty() {
        caption.push_str(" Dashed: the limits.");
    }
    caption.push_str(&beyond(&all, "value is", "values are"));
    Some(Chart {
        id: "motors".to_owned(),
        panels: all.iter().filter_map(Histogram::panel).collect(),
        is_grid: true,
        alternative: "histogram over the motors".to_owned(),
        caption,
        ..Chart::default()
    })
}

/// Returns the run charts of the parameters: their values over the motors in the order of the study, which sorts files by name and so
/// by serial number or time, with the limits; `None` for fewer than three motors.
pub(super) fn run_chart(summary: &SweepSummary, limits: &Limits) -> Option<Chart> {
    if summary.results.len() < 3 {
        return None;
    }
    let place = |run: &NamedRun| count(run.job.motor + 1);
    let panel = |parameter: &SweepParameter| {
        let value = |run: &NamedRun| Some((place(run), run.estimate(&parameter.name)?.value?));
        let values: Vec<(f64, f64)> = summary.results.iter().filter_map(value).collect();
        let unit = Unit::for_all(parameter, &values.iter().map(|(_, value)| *value).collect::<Vec<_>>());
        let bounds = limits.of(&parameter.symbol);
        let points = |within: bool| {
            let of = values.iter().filter(|(_, value)| limits.permit(&parameter.symbol, *value) == within);
            of.map(|(motor, value)| (*motor, unit.scale(*value))).collect::<Vec<_>>()
        };
        let inside = if limits.is_empty() { "" } else { "inside the limits" };
        let series = [
            Series::new(inside, 1, Form::Marks, points(true)),
            Series::new("outside the limits", 2, Form::Marks, points(false)),
        ];
        let dashed =
            bounds.into_iter().flatten().filter(|limit| limit.is_finite()).map(|limit| unit.scale(limit)).collect();
        let series = series.into_iter().filter(|series| !series.points.is_empty()).collect();
        Panel {
            limits: [Vec::new(), dashed],
            ..Panel::new(&format!("{} {}", capital(&parameter.description), unit.head()), series)
        }
    };
    let limited = if limits.is_empty() { "" } else { " Dashed: the limits." };
    Some(Chart {
        id: "run-chart".to_owned(),
        axis: "number of the motor [1]".to_owned(),
        panels: summary.parameters.iter().map(panel).collect(),
        is_grid: false,
        alternative: "over the motors in their order, with the limits".to_owned(),
        caption: format!("The parameters in the order of the motors.{limited}"),
    })
}

/// Returns the chart of the costs of a block: boxes by cell, or a histogram for a single cell with at least two costs.
pub(super) fn costs(summary: &SweepSummary, n: usize) -> Option<Chart> {
    let block = &summary.blocks[n];
    let all = || block.cells.iter().flat_map(|cell| &cell.costs).copied();
    let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max));
    let scale = if low > 0.0 && high > 10.0 * low { AxisScale::Log } else { AxisScale::Linear };
    if let [cell] = &block.cells[..] {
        return single(summary, n, &cell.costs, scale == AxisScale::Log);
    }
    let logarithms = if scale == AxisScale::Log { " of the logarithms" } else { "" };
    let shown = &block.cells[..block.cells.len().min(BOXES)];
    let groups = shown.iter().map(|cell| (label(summary, cell), cell.costs.clone())).collect();
    let axis = format!("cost ({}) [1]", block_name(block));
    let mut caption =
        format!("Median and quartiles{logarithms} over runs; whiskers extend to 1.5 interquartile ranges.");
    if block.cells.len() > shown.len() {
        let (first, all) = (many(shown.len()), many(block.cells.len()));
        caption.push_str(&format!(" Only the first {first} of {all} are drawn; the table has all."));
    }
    Some(Chart {
        id: id(summary, "costs", n),
        panels: vec![boxes("Costs of all runs, by combination of levels", &axis, &groups, scale)],
        alternative: "a box for each combination of levels".to_owned(),
        caption,
        ..Chart::default()
    })
}

/// Returns the histogram of costs; `None` for fewer than two.
fn single(summary: &SweepSummary, n: usize, costs: &[f64], is_log: bool) -> Option<Chart> {
    if costs.len() < 2 {
        return None;
    }
    let name = block_name(&summary.blocks[n]);
    let values = costs.iter().map(|cost| if is_log { cost.log10() } else { *cost }).collect();
    let axis = if is_log { format!("log10 of the cost ({name}) [1]") } else { format!("cost ({name}) [1]") };
    let histogram = Histogram { label: "Runs [1]".to_owned(), axis, values, limits: None };
    Some(Chart {
        id: id(summary, "costs", n),
        panels: histogram.panel().into_iter().collect(),
        alternative: "histogram over the runs".to_owned(),
        caption: format!("The costs of {} runs.{}", many(costs.len()), beyond(&[histogram], "run is", "runs are")),
        ..Chart::default()
    })
}

/// Returns the sentence on the number of values outside the drawn range.
fn beyond(all: &[Histogram], one: &str, more: &str) -> String {
    match all.iter().map(Histogram::beyond).sum::<usize>() {
        0 => String::new(),
        n => format!(" {} outside the drawn range.", counted(n as u64, one, more)),
    }
}
