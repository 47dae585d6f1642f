//! Notation of blocks, cells, units and counts of a sweep.

use crate::table::dash;
use motorfit_core::numeric::{quantile, sorted};
use motorfit_core::text::{SuitableUnit, printable, significant};
use motorfit_study::sweep::{Cell, Factors, SweepBlock, SweepParameter, SweepSummary};

/// Formats a count with commas between thousands.
pub(super) fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let thousands: Vec<_> = digits.as_bytes().rchunks(3).rev().map(String::from_utf8_lossy).collect();
    thousands.join(",")
}

/// Formats a count of type `usize` with commas between thousands.
pub(super) fn many(count: usize) -> String {
    grouped(count as u64)
}

/// Returns the singular or the plural of a word.
pub(super) fn plural<'a>(count: u64, one: &'a str, more: &'a str) -> &'a str {
    if count == 1 { one } else { more }
}

/// Formats a count with its word in the singular or plural.
pub(super) fn counted(count: u64, one: &str, more: &str) -> String {
    format!("{} {}", grouped(count), plural(count, one, more))
}

/// Returns the factors that distinguish cells: those with several levels, otherwise the method.
pub(super) fn factors(summary: &SweepSummary) -> Vec<&'static str> {
    if summary.varied.is_empty() { vec!["method"] } else { summary.varied.clone() }
}

/// Returns the headings of these factors in tables.
pub(super) fn heads(summary: &SweepSummary) -> Vec<&'static str> {
    let head = |name| if name == "population" { "agents" } else { name };
    factors(summary).into_iter().map(head).collect()
}

/// Formats the level of a factor of a run in a cell.
pub(super) fn level(name: &str, factors: &Factors, cell: &Cell) -> String {
    match name {
        "method" => factors.method.name().to_owned(),
        "polish" => factors.polish.name().to_owned(),
        "with" => cell.with.clone().unwrap_or_default(),
        "model" => machine(cell),
        "population" => factors.population.to_string(),
        "generations" => factors.generations.to_string(),
        _ => cell.noise.clone(),
    }
}

/// Returns the name of the machine of a cell: its model, or the extensions of the DC motor.
fn machine(cell: &Cell) -> String {
    match (&cell.model, &cell.with) {
        (Some(model), Some(with)) if model == "none" => with.clone(),
        (model, _) => model.clone().unwrap_or_default(),
    }
}

/// Returns the levels of the factors that distinguish cells.
pub(super) fn levels(summary: &SweepSummary, cell: &Cell) -> Vec<String> {
    factors(summary).into_iter().map(|name| level(name, &cell.factors, cell)).collect()
}

/// Formats the levels of a cell, as in `gwo, 100 agents, noise 40dB`.
pub(super) fn label(summary: &SweepSummary, cell: &Cell) -> String {
    let word = |name| {
        let level = level(name, &cell.factors, cell);
        match name {
            "population" => format!("{level} agents"),
            "method" => level,
            "generations" => format!("{level} generations"),
            name => format!("{name} {level}"),
        }
    };
    printable(&factors(summary).into_iter().map(word).collect::<Vec<_>>().join(", "))
}

/// Formats the criterion and scale of a block.
pub(super) fn block_name(block: &SweepBlock) -> String {
    let factors = block.cells.first().map(|cell| cell.factors);
    factors.map_or_else(String::new, |f| format!("{}, scale {}", f.criterion.name(), f.scale.name()))
}

/// Returns a cell with the model and the noise of a run, whose names the study gives.
pub(super) fn cell_of<'a>(block: &'a SweepBlock, f: &Factors) -> Option<&'a Cell> {
    block.cells.iter().find(|cell| (cell.factors.noise, cell.factors.machine) == (f.noise, f.machine))
}

/// A parameter with the unit that suits the size of its values.
pub(super) struct Unit {
    pub parameter: SweepParameter,
    unit: SuitableUnit,
}

impl Unit {
    /// Chooses the unit for a typical value.
    pub fn of(parameter: &SweepParameter, typical: f64) -> Self {
        Self { parameter: parameter.clone(), unit: SuitableUnit::of(typical, &parameter.unit) }
    }

    /// Chooses the unit for the median of values.
    pub fn for_all(parameter: &SweepParameter, values: &[f64]) -> Self {
        Self::of(parameter, quantile(&sorted(values), 0.5))
    }

    /// Converts a value to the unit.
    pub fn scale(&self, value: f64) -> f64 {
        self.unit.scale(value)
    }

    /// Formats a value in the unit; NaN is a dash.
    pub fn write(&self, value: f64, digits: usize) -> String {
        if value.is_nan() { dash() } else { significant(self.scale(value), digits) }
    }

    /// Formats a limit in the unit, without trailing zeros.
    pub fn limit(&self, value: f64) -> String {
        let text = significant(self.scale(value), 6);
        if text.contains('.') && !text.contains('e') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    }

    /// Returns symbol and unit, as in `L [mH]`.
    pub fn head(&self) -> String {
        let unit = if self.unit.text.is_empty() { "1" } else { &self.unit.text };
        format!("{} [{unit}]", self.parameter.name)
    }
}

/// Returns the cell with the lowest median cost, with its median; `None` for a single cell. If the noise varies, only
/// cells with its first level are compared, which the first text mentions.
pub(super) fn lowest(summary: &SweepSummary, block: &SweepBlock) -> Option<[String; 2]> {
    let first = block.cells.first().filter(|_| block.cells.len() > 1)?;
    let cells = block.cells.iter().filter(|cell| cell.factors.noise == first.factors.noise && !cell.costs.is_empty());
    let medians = cells.map(|cell| (cell, quantile(&sorted(&cell.costs), 0.5)));
    let (best, median) = medians.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let noise = summary.varied.contains(&"noise").then(|| format!(" under noise {}", printable(&first.noise)));
    Some([noise.unwrap_or_default(), format!("{} ({})", label(summary, best), significant(median, 3))])
}

/// Returns an identifier for files and links, with the number of the block if there are several.
pub(super) fn id(summary: &SweepSummary, name: &str, n: usize) -> String {
    if summary.blocks.len() > 1 { format!("block{}-{name}", n + 1) } else { name.to_owned() }
}
