//! Sources of candidates: a sample within the bounds, or a file of any length, read in batches.

mod csv;
#[cfg(feature = "parquet")]
mod parquet;

use motorfit::numeric::{index, whole_u64};
use motorfit::optimize::{Sample, Sampling};
use motorfit::setting::Setting;
use motorfit::settings::parse;
use motorfit::text::excerpt;
use motorfit::{Error, Result};
use std::fs::File;
use std::path::Path;

/// A source of candidates, read in batches.
pub(super) trait Source {
    /// Returns the number of candidates, `None` if it is not known in advance.
    fn count(&self) -> Option<u64>;

    /// Appends at most `most` candidates of `width` values each, row by row; nothing at the end.
    fn next(&mut self, most: usize, width: usize, values: &mut Vec<f64>) -> Result<()>;
}

/// A sample, and the number of its next candidate.
pub(super) struct Sampled(pub Sample, pub u64);

impl Source for Sampled {
    fn count(&self) -> Option<u64> {
        Some(self.0.count())
    }

    fn next(&mut self, most: usize, width: usize, values: &mut Vec<f64>) -> Result<()> {
        let count = most.min(index(self.0.count() - self.1));
        values.resize(count * width, 0.0);
        self.0.fill(self.1, values);
        self.1 += count as u64;
        Ok(())
    }
}

/// Opens a file of candidates, `-` for stdin, and finds the column of each free parameter.
pub(super) fn file(path: &Path, names: &[String]) -> Result<Box<dyn Source>> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet")) {
        #[cfg(feature = "parquet")]
        return Ok(Box::new(parquet::Table::open(path, names)?));
        #[cfg(not(feature = "parquet"))]
        return Err(Error::usage(
            "this build cannot read Parquet",
            "Build with the feature parquet, or give the candidates as CSV.",
        ));
    }
    Ok(Box::new(csv::Table::open(path, names)?))
}

fn open(path: &Path) -> Result<File> {
    File::open(path).map_err(|e| Error::data(format!("cannot be read: {e}"), "Check the path.").in_file(path))
}

/// Parses `uniform:N`, `lhs:N`, `sobol:N` or `grid:N`.
pub(super) fn sampling(text: &str) -> Result<(Sampling, u64)> {
    let bad = || {
        let message = format!("--sample: \"{}\" is not a kind of sample", excerpt(text));
        Error::usage(
            message,
            "Write uniform:N, lhs:N, sobol:N (N candidates) or grid:N (N values of each free parameter).",
        )
    };
    let (kind, number) = text.split_once(':').ok_or_else(bad)?;
    let kind = match kind {
        "uniform" => Sampling::Uniform,
        "lhs" => Sampling::LatinHypercube,
        "sobol" => Sampling::Sobol,
        "grid" => Sampling::Grid,
        _ => return Err(bad()),
    };
    // The number is parsed as a float, so that 1e8 is accepted.
    let number = parse::number(number, Setting::Sample)?;
    if !(1.0..=9e15).contains(&number) || number.fract() != 0.0 {
        return Err(bad());
    }
    Ok((kind, whole_u64(number)))
}

/// Returns the name of each free parameter and the index of its column in a file.
fn column_indices(file: &str, columns: &[&str], names: &[String]) -> Result<Vec<(String, usize)>> {
    let wrong = |what: &str, name: &str| {
        let found: Vec<String> = columns.iter().map(|column| format!("\"{}\"", excerpt(column))).collect();
        let message = format!("{file}: {what} {name}; there is {}", found.join(", "));
        let hint = format!("Name one column for each free parameter ({}), or fix it with --fix.", names.join(","));
        Error::data(message, hint)
    };
    let find = |name: &String| {
        let mut found = columns.iter().enumerate().filter(|(_, column)| *column == name).map(|(at, _)| at);
        let at = found.next().ok_or_else(|| wrong("no column", name))?;
        if found.next().is_some() { Err(wrong("several columns", name)) } else { Ok((name.clone(), at)) }
    };
    names.iter().map(find).collect()
}
