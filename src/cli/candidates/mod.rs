//! Where candidates come from: a sample of the bounds, or a file of any length, read piece by piece.

mod csv;
#[cfg(feature = "parquet")]
mod parquet;

use motorfit::motor::Axis;
use motorfit::numeric::whole_u64;
use motorfit::optimize::{Sample, Sampling};
use motorfit::setting::Setting;
use motorfit::settings::values;
use motorfit::text::excerpt;
use motorfit::{Error, Result};
use std::fs::File;
use std::path::Path;

/// Candidates that come one after the other.
pub(super) enum Source {
    Sample {
        sample: Sample,
        next: u64,
    },
    Csv(csv::Table),
    #[cfg(feature = "parquet")]
    Parquet(parquet::Table),
}

impl Source {
    /// Opens a file, `-` for stdin, and finds the column of each axis.
    pub(super) fn file(path: &Path, axes: &[Axis]) -> Result<Self> {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet")) {
            #[cfg(feature = "parquet")]
            return Ok(Self::Parquet(parquet::Table::open(path, axes)?));
            #[cfg(not(feature = "parquet"))]
            return Err(Error::usage(
                "this build reads no Parquet",
                "Build with the feature parquet, or give the candidates as CSV.",
            ));
        }
        Ok(Self::Csv(csv::Table::open(path, axes)?))
    }

    /// How many there are, where that is known.
    pub(super) fn count(&self) -> Option<u64> {
        match self {
            Self::Sample { sample, .. } => Some(sample.count()),
            Self::Csv(_) => None,
            #[cfg(feature = "parquet")]
            Self::Parquet(table) => Some(table.count()),
        }
    }

    /// The next candidates, at most `most`; none at the end.
    pub(super) fn next(&mut self, most: usize, width: usize, values: &mut Vec<f64>) -> Result<()> {
        values.clear();
        match self {
            Self::Sample { sample, next } => {
                let count = most.min(usize::try_from(sample.count() - *next).unwrap_or(usize::MAX));
                values.resize(count * width, 0.0);
                sample.fill(*next, values);
                *next += count as u64;
                Ok(())
            }
            Self::Csv(table) => table.next(most, width, values),
            #[cfg(feature = "parquet")]
            Self::Parquet(table) => table.next(most, values),
        }
    }
}

fn open(path: &Path) -> Result<File> {
    File::open(path).map_err(|e| Error::data(format!("cannot be read: {e}"), "Check the path.").in_file(path))
}

/// `uniform:N`, `lhs:N` or `grid:N`.
pub(super) fn sampling(text: &str) -> Result<(Sampling, u64)> {
    let bad = || {
        Error::usage(
            format!("--sample: \"{}\" is no sample", excerpt(text)),
            "Write uniform:N, lhs:N (N candidates) or grid:N (N values of each free parameter).",
        )
    };
    let (kind, number) = text.split_once(':').ok_or_else(bad)?;
    let kind = match kind {
        "uniform" => Sampling::Uniform,
        "lhs" => Sampling::LatinHypercube,
        "grid" => Sampling::Grid,
        _ => return Err(bad()),
    };
    // 1e8 is as good as 100000000.
    let number = values::number(number, Setting::Sample)?;
    if !(1.0..=9e15).contains(&number) || number.fract() != 0.0 {
        return Err(bad());
    }
    Ok((kind, whole_u64(number)))
}

/// The name of each axis, and its column among those of a file.
fn places(file: &str, columns: &[&str], axes: &[Axis]) -> Result<Vec<(String, usize)>> {
    let names: Vec<String> = axes.iter().map(|axis| axis.scope.name(axis.parameter)).collect();
    let wrong = |what: &str, name: &str| {
        let found: Vec<String> = columns.iter().map(|column| format!("\"{}\"", excerpt(column))).collect();
        Error::data(
            format!("{file}: {what} {name}; there is {}", found.join(", ")),
            format!("Name one column for each free parameter ({}), or hold it with --fix.", names.join(",")),
        )
    };
    let place = |name: &String| {
        let mut found = columns.iter().enumerate().filter(|(_, column)| *column == name).map(|(place, _)| place);
        let place = found.next().ok_or_else(|| wrong("no column", name))?;
        if found.next().is_some() { Err(wrong("several columns", name)) } else { Ok((name.clone(), place)) }
    };
    names.iter().map(place).collect()
}
