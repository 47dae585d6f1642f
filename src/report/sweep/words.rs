//! The notation of blocks, cells, units and counts of a sweep.

use crate::motor::Parameter;
use crate::numeric::{quantile, sorted};
use crate::report::table::dash;
use crate::study::sweep::{Cell, Factors, Named, SweepBlock, SweepSummary};
use crate::text::{printable, significant};

/// A count with its thousands set apart.
pub(super) fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let thousands: Vec<_> = digits.as_bytes().rchunks(3).rev().map(String::from_utf8_lossy).collect();
    thousands.join(",")
}

/// The same of what is counted in memory.
pub(super) fn many(count: usize) -> String {
    grouped(count as u64)
}

/// A word in the number that fits.
pub(super) fn plural<'a>(count: u64, one: &'a str, more: &'a str) -> &'a str {
    if count == 1 { one } else { more }
}

/// A count with its word.
pub(super) fn counted(count: u64, one: &str, more: &str) -> String {
    format!("{} {}", grouped(count), plural(count, one, more))
}

/// The factors that tell cells apart: those with several levels, or else the method.
pub(super) fn factors(summary: &SweepSummary) -> Vec<&'static str> {
    if summary.varied.is_empty() { vec!["method"] } else { summary.varied.clone() }
}

/// Their headings in tables.
pub(super) fn heads(summary: &SweepSummary) -> Vec<&'static str> {
    let head = |name| if name == "population" { "agents" } else { name };
    factors(summary).into_iter().map(head).collect()
}

/// The level of a factor of a run in a cell.
pub(super) fn level(name: &str, factors: &Factors, cell: &Cell) -> String {
    match name {
        "method" => factors.method.name().to_owned(),
        "polish" => factors.polish.name().to_owned(),
        "with" => cell.with.clone().unwrap_or_default(),
        "population" => factors.population.to_string(),
        "generations" => factors.generations.to_string(),
        _ => cell.noise.clone(),
    }
}

/// The levels of the factors that tell cells apart.
pub(super) fn levels(summary: &SweepSummary, cell: &Cell) -> Vec<String> {
    factors(summary).into_iter().map(|name| level(name, &cell.factors, cell)).collect()
}

/// A cell in words: `gwo, 100 agents, noise 40dB`.
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

/// The criterion and scale of a block.
pub(super) fn block_name(block: &SweepBlock) -> String {
    let factors = block.cells.first().map(|cell| cell.factors);
    factors.map_or_else(String::new, |f| format!("{}, scale {}", f.criterion.name(), f.scale.name()))
}

/// The cell of a run: of its extensions and its noise, which have names of the study.
pub(super) fn cell_of<'a>(block: &'a SweepBlock, f: &Factors) -> Option<&'a Cell> {
    block.cells.iter().find(|cell| (cell.factors.noise, cell.factors.with) == (f.noise, f.with))
}

/// A unit with the prefix that suits a value.
pub(super) struct Unit {
    pub named: Named,
    exponent: i32,
}

impl Unit {
    /// For a typical value.
    pub fn of(named: Named, typical: f64) -> Self {
        // What is counted has no prefix.
        let size = if matches!(named.0.unit(), "1" | "samples") { 1.0 } else { typical.abs() };
        let fits = |(least, exponent): (f64, i32)| (size >= least).then_some(exponent);
        let exponent = [(0.1, 0), (1e-3, -3), (1e-6, -6), (1e-9, -9)].into_iter().find_map(fits).unwrap_or(0);
        Self { named, exponent }
    }

    /// For values: their median.
    pub fn for_all(named: Named, values: &[f64]) -> Self {
        Self::of(named, quantile(&sorted(values), 0.5))
    }

    /// A value in the unit.
    pub fn scale(&self, value: f64) -> f64 {
        value * 10.0_f64.powi(-self.exponent)
    }

    /// A value in the unit, written; a dash where there is none.
    pub fn write(&self, value: f64, digits: usize) -> String {
        if value.is_nan() { dash() } else { significant(self.scale(value), digits) }
    }

    /// A limit in the unit, as it was given.
    pub fn limit(&self, value: f64) -> String {
        let text = significant(self.scale(value), 6);
        if text.contains('.') && !text.contains('e') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    }

    /// Symbol and unit: `L [mH]`.
    pub fn head(&self) -> String {
        let (parameter, scope) = self.named;
        let unit = parameter.unit().replace('*', " ").replace("^2", "\u{b2}");
        let prefix = match (self.exponent, parameter) {
            // A kilogram has its prefix already.
            (-3, Parameter::J) => "10\u{207b}\u{b3} ",
            (-6, Parameter::J) => "10\u{207b}\u{2076} ",
            (-9, Parameter::J) => "10\u{207b}\u{2079} ",
            (-3, _) => "m",
            (-6, _) => "\u{b5}",
            (-9, _) => "n",
            _ => "",
        };
        format!("{} [{prefix}{unit}]", scope.name(parameter))
    }
}

/// The cell with the lowest median cost, in words with its median; before it, where noise is varied, that costs are compared
/// under its first level alone. `None` of a single cell.
pub(super) fn lowest(summary: &SweepSummary, block: &SweepBlock) -> Option<[String; 2]> {
    let first = block.cells.first().filter(|_| block.cells.len() > 1)?;
    let cells = block.cells.iter().filter(|cell| cell.factors.noise == first.factors.noise && !cell.costs.is_empty());
    let medians = cells.map(|cell| (cell, quantile(&sorted(&cell.costs), 0.5)));
    let (best, median) = medians.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let noise = summary.varied.contains(&"noise").then(|| format!(" under noise {}", printable(&first.noise)));
    Some([noise.unwrap_or_default(), format!("{} ({})", label(summary, best), significant(median, 3))])
}
