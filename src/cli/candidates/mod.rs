//! Sources of candidates: a sample within the bounds, or a file of any length, read in batches.

mod csv;
#[cfg(feature = "parquet")]
mod parquet;
mod source;

use motorfit::numeric::whole_u64;
use motorfit::optimize::Sampling;
use motorfit::setting::Setting;
use motorfit::settings::parse;
use motorfit::text::excerpt;
use motorfit::{Error, Result};
pub(super) use source::{Sampled, Source};
use std::path::Path;

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
