//! The interface of readers of candidates, and the columns of a file.

use motorfit::coordinate::Coordinate;
use motorfit::numeric::index;
use motorfit::optimize::{Sample, Sampling};
use motorfit::text::excerpt;
use motorfit::{Error, Result};
use std::fs::File;
use std::path::Path;

/// A source of candidates, read in batches.
pub(in crate::cli) trait Source {
    /// Returns the number of candidates, `None` if it is not known in advance.
    fn count(&self) -> Option<u64>;

    /// Appends at most `most` candidates of `width` values each, row by row; nothing at the end.
    fn next(&mut self, most: usize, width: usize, values: &mut Vec<f64>) -> Result<()>;
}

/// A sample within bounds, even in the coordinates of the parameters.
pub(in crate::cli) struct Sampled {
    sample: Sample,
    axes: Vec<Coordinate>,
    /// Number of the next candidate.
    next: u64,
}

impl Sampled {
    pub(in crate::cli) fn new(sampling: Sampling, number: u64, axes: Vec<Coordinate>, seed: u64) -> Result<Self> {
        // Logarithms are sampled as fractions of their range.
        let range = |axis: &Coordinate| if axis.is_logarithmic { (0.0, 1.0) } else { (axis.min, axis.max) };
        let sample = Sample::new(sampling, number, axes.iter().map(range).collect(), seed)?;
        Ok(Self { sample, axes, next: 0 })
    }
}

impl Source for Sampled {
    fn count(&self) -> Option<u64> {
        Some(self.sample.count())
    }

    fn next(&mut self, most: usize, width: usize, values: &mut Vec<f64>) -> Result<()> {
        let count = most.min(index(self.sample.count() - self.next));
        values.resize(count * width, 0.0);
        self.sample.fill(self.next, values);
        self.next += count as u64;
        for (place, axis) in self.axes.iter().enumerate().filter(|(_, axis)| axis.is_logarithmic) {
            values.iter_mut().skip(place).step_by(width).for_each(|value| *value = axis.at(*value));
        }
        Ok(())
    }
}

/// Opens a file of candidates.
pub(super) fn open(path: &Path) -> Result<File> {
    File::open(path).map_err(|e| Error::data(format!("cannot be read: {e}"), "Check the path.").in_file(path))
}

/// Returns the name of each free parameter and the index of its column in a file.
pub(super) fn column_indices(file: &str, columns: &[&str], names: &[String]) -> Result<Vec<(String, usize)>> {
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
