//! Logs of numbers with their times: the interface between the readers of binary formats and the selection of columns.

use motorfit_core::Result;
use std::io::{Read, Seek};

/// Function that returns true if the name of a channel denotes times.
pub(crate) type IsTime = fn(&str) -> bool;

/// Bytes of a file, read in any order.
pub trait Medium: Read + Seek + Send {}
impl<T: Read + Seek + Send> Medium for T {}

/// A numeric field of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Path within the channel, such as `velocity[0]`; empty if the channel itself is a number.
    pub path: String,
    /// Unit as written in the log, where the format names one.
    pub unit: Option<String>,
}

/// Fields of a log that have their samples, and so their times, in common: an entry, a topic, a group of columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Name as in the log; empty for the only table of a file.
    pub name: String,
    /// Numeric fields.
    pub fields: Vec<Field>,
    /// Number of samples.
    pub count: u64,
    /// Times of the first and the last sample \[s\], counted as those of [`Series`]; `None` for a table without times of its own.
    pub span_s: Option<[f64; 2]>,
}

/// Samples of a channel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series {
    /// Time of each sample \[s\] since the earliest sample of the log; empty for a table without times of its own.
    pub time_s: Vec<f64>,
    /// Values of each requested field, of the length of the channel.
    pub columns: Vec<Vec<f64>>,
}

/// Texts of a log that change over time, such as the state of a test.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct States {
    /// Name of the entry.
    pub name: String,
    /// Time \[s\], counted as those of [`Series`], and text of each change, in the order of time.
    pub changes: Vec<(f64, String)>,
}

/// A log whose channels are known and whose samples are read on request.
pub trait Log {
    /// Returns the channels in the order of the file.
    fn channels(&self) -> &[Channel];

    /// Reads fields of channels: each request is the index of a channel and the indices of its fields.
    ///
    /// # Errors
    /// Returns a `Data` error if the file is damaged or cannot be read.
    fn read(&mut self, requests: &[(usize, Vec<usize>)]) -> Result<Vec<Series>>;

    /// Returns the texts that name tests; empty for formats without.
    fn states(&self) -> &[States] {
        &[]
    }

    /// Returns true if values are logged when they change, so that each holds until the next one.
    fn is_of_changes(&self) -> bool {
        false
    }

    /// Returns names and types of what is no number.
    fn others(&self) -> Vec<String> {
        Vec::new()
    }

    /// Returns names and values of constants, such as scalars beside the vectors.
    fn constants(&self) -> &[(String, f64)] {
        &[]
    }

    /// Returns notes on what was left out or assumed.
    fn notes(&self) -> &[String] {
        &[]
    }
}
