//! The figures of a sweep: the motors of a line, and costs by factor.

use super::line::{Spread, spreads};
use super::tables::id;
use super::words::{Unit, block_name, label, many, plural};
use crate::motor::Scope;
use crate::report::Figure;
use crate::report::plot::{Boxes, Histogram, box_rows, histograms};
use crate::study::sweep::{Limits, SweepSummary};

/// Boxes of a figure, and boxes all in all.
const BOXES: usize = 12;
const BOXES_ALL: usize = 36;

/// How the parameters spread over the motors; `None` of one motor.
#[must_use]
pub(super) fn motors(summary: &SweepSummary, limits: &Limits) -> Option<Figure> {
    if summary.results.len() < 2 {
        return None;
    }
    let panel = |spread: Spread| {
        let (parameter, scope) = spread.named;
        let unit = Unit::for_all(spread.named, &spread.values);
        let of = if let Scope::Recording(n) = scope { format!(" of recording {}", n + 1) } else { String::new() };
        Histogram {
            title: title_case(parameter.name()) + &of,
            labels: [unit.head(), "motors [1]".to_owned()],
            values: spread.values.iter().map(|value| unit.scale(*value)).collect(),
            limits: spread.limits.map(|pair| pair.map(|limit| unit.scale(limit))),
        }
    };
    let panels: Vec<Histogram> = spreads(summary, limits).into_iter().map(panel).collect();
    let mut caption = format!("The parameters of {} motors.", many(summary.results.len()));
    if !limits.is_empty() {
        caption.push_str(" Dashed: the limits; motors outside of them are of the same colour.");
    }
    let beyond: usize = panels.iter().map(Histogram::beyond).sum();
    if beyond > 0 {
        let values = plural(beyond as u64, "value lies", "values lie");
        caption.push_str(&format!(" {} {values} so far from the others that no bar shows them.", many(beyond)));
    }
    Some(Figure {
        id: "motors".to_owned(),
        map: false,
        svg: histograms(&panels, 3),
        alternative: "Histograms of resistance, inductance, motor constant, friction and inertia over the motors"
            .to_owned(),
        caption,
    })
}

fn title_case(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Costs of a block: boxes for each cell, or of a single cell a histogram.
#[must_use]
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
    let figure = |(k, cells): (usize, &[crate::study::sweep::Cell])| {
        let groups = cells.iter().map(|cell| (label(summary, cell), cell.costs.clone())).collect();
        let panel = Boxes { title: String::new(), groups };
        Figure {
            id: format!("{}-{}", id(summary, "costs", n), k + 1),
            map: false,
            svg: box_rows(&panel, &label_of, [low, high], is_log),
            alternative: "Boxes of the costs of all runs, one for each combination of levels".to_owned(),
            caption: String::new(),
        }
    };
    let mut figures: Vec<Figure> = shown.chunks(BOXES).enumerate().map(figure).collect();
    if let Some(last) = figures.last_mut() {
        let logarithms = if is_log { " of the logarithms" } else { "" };
        last.caption = format!("Quartiles and median{logarithms} over runs; whiskers reach 1.5 of the box.");
        if block.cells.len() > shown.len() {
            let (first, all) = (many(shown.len()), many(block.cells.len()));
            last.caption.push_str(&format!(" The first {first} of {all}; the table has all."));
        }
    }
    figures
}

/// How often which cost is.
fn single(summary: &SweepSummary, n: usize, costs: &[f64], is_log: bool) -> Option<Figure> {
    if costs.len() < 2 {
        return None;
    }
    let name = block_name(&summary.blocks[n]);
    let values = costs.iter().map(|cost| if is_log { cost.log10() } else { *cost }).collect();
    let axis = if is_log { format!("log10 of the cost ({name}) [1]") } else { format!("cost ({name}) [1]") };
    let panel = Histogram { labels: [axis, "runs [1]".to_owned()], values, ..Histogram::default() };
    let mut caption = format!("The costs of {} runs.", many(costs.len()));
    let beyond = panel.beyond();
    if beyond > 0 {
        let runs = plural(beyond as u64, "run is", "runs are");
        caption.push_str(&format!(" {} {runs} so far from the others that no bar shows them.", many(beyond)));
    }
    Some(Figure {
        id: id(summary, "costs", n),
        map: false,
        svg: histograms(&[panel], 1),
        alternative: "Histogram of the costs of all runs".to_owned(),
        caption,
    })
}
