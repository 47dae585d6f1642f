//! Lines of results files, and the sweep that they belong to.

use super::line::{Line, Row, split};
use motorfit_core::file::unreadable;
use motorfit_core::{Error, Result};
use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::Path;

pub(super) fn no_results(path: &Path) -> Error {
    Error::data("is not a results file", "Move it away; its runs will be repeated.").in_file(path).at_line(1)
}

/// Location of a line in a results file \[bytes\], and its run.
pub(super) struct LineLocation {
    pub offset: u64,
    pub length: u32,
    pub row: Row,
}

/// Visits every complete line except the head; with `proof` only lines of that sweep. Returns the number of lines that
/// are damaged or of another sweep.
pub(super) fn scan_lines(
    path: &Path,
    proof: Option<&Origin<'_>>,
    mut see: impl FnMut(LineLocation, &[u8]),
) -> Result<u64> {
    let failed = |error: std::io::Error| unreadable(path, &error);
    let mut reader = BufReader::with_capacity(1 << 18, File::open(path).map_err(failed)?);
    let (mut line, mut offset, mut damaged) = (Vec::new(), 0_u64, 0);
    loop {
        line.clear();
        let length = reader.read_until(b'\n', &mut line).map_err(failed)?;
        if !line.ends_with(b"\n") {
            // This is the end of the file, or a line that is incomplete or being written.
            return Ok(damaged);
        }
        let is_proven = || proof.is_none_or(|origin| parse(&line).is_some_and(|line| (origin.is_of)(&line)));
        // The first line may be a result only if the head is lost.
        if offset > 0 || proof.is_some() {
            match (row(&line), u32::try_from(length)) {
                (Some(row), Ok(length)) if is_proven() => see(LineLocation { offset, length, row }, &line),
                _ => damaged += u64::from(offset > 0),
            }
        }
        offset += length as u64;
    }
}

/// Returns the run of a line, unless the line is damaged.
pub(super) fn row(line: &[u8]) -> Option<Row> {
    parse(line)
}

/// Parses a line without its time; `None` if it is damaged.
fn parse<T: for<'de> serde::Deserialize<'de>>(line: &[u8]) -> Option<T> {
    let (result, _) = split(std::str::from_utf8(line).ok()?.trim_end())?;
    serde_json::from_str(&result).ok()
}

/// The sweep that results files belong to.
pub(super) struct Origin<'a> {
    pub folder: &'a Path,
    /// Digest of the manifest.
    pub manifest: &'a str,
    /// Function that returns true if a line is of a run of this sweep.
    pub is_of: Box<dyn Fn(&Line) -> bool + 'a>,
}
