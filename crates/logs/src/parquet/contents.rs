//! The contents of a Parquet file: its schema and row groups, which must fit each other and the file.

use super::super::log::Medium;
use super::footer::{Footer, Group, Node};
use super::pages::CODECS;
use super::schema::{Columns, Leaf};
use motorfit_core::text::{counted, quoted};
use motorfit_core::{Error, Result};
use std::io::{Read as _, SeekFrom};

const MAGIC: &[u8; 4] = b"PAR1";
/// Remedy for a damaged file.
pub(super) const AGAIN: &str = "Copy the file again.";
/// Largest size of a footer \[bytes\].
const FOOTER_MAX: u64 = 256 << 20;

/// Contents of the footer of a file.
pub(super) struct Contents {
    /// Length of the file \[bytes\].
    pub length: u64,
    pub nodes: Vec<Node>,
    pub groups: Vec<Group>,
    pub columns: Columns,
    /// Number of rows of all groups.
    pub rows: u64,
}

/// Reads the footer of a file and checks that schema and row groups fit each other.
pub(super) fn contents(medium: &mut dyn Medium) -> Result<Contents> {
    let length = medium.seek(SeekFrom::End(0)).map_err(unreadable)?;
    let Footer { nodes, groups } = footer(medium, length)?;
    let damaged = |what: &str| Error::data(format!("the footer is damaged: {what}"), AGAIN);
    let columns = Columns::of(&nodes).ok_or_else(|| damaged("the schema is not a tree"))?;
    let rows = groups.iter().try_fold(0_u64, |sum, group| sum.checked_add(group.rows));
    let rows = rows.ok_or_else(|| damaged("it has too many rows"))?;
    for (number, group) in groups.iter().enumerate() {
        if group.chunks.len() != columns.count {
            let counts = (counted(group.chunks.len(), "column"), columns.count);
            return Err(damaged(&format!("row group {number} has {}, expected {}", counts.0, counts.1)));
        }
    }
    Ok(Contents { length, nodes, groups, columns, rows })
}

fn unreadable(error: std::io::Error) -> Error {
    Error::data(format!("cannot be read: {error}"), AGAIN)
}

/// Reads the footer at the end of a file.
fn footer(medium: &mut dyn Medium, length: u64) -> Result<Footer> {
    let mut head = [0; 4];
    medium.rewind().map_err(unreadable)?;
    if length < 12 || medium.read_exact(&mut head).is_err() || !matches!(&head, b"PAR1" | b"PARE") {
        return Err(Error::data("is not a Parquet file: expected it to start with \"PAR1\"", AGAIN));
    }
    let mut tail = [0; 8];
    medium.seek(SeekFrom::Start(length - 8)).map_err(unreadable)?;
    medium.read_exact(&mut tail).map_err(unreadable)?;
    let [a, b, c, d, magic @ ..] = tail;
    if &magic == b"PARE" {
        return Err(Error::data("is encrypted", "Save it without encryption."));
    }
    let size = u64::from(u32::from_le_bytes([a, b, c, d]));
    if &magic != MAGIC || size > length - 12 {
        let message = format!("is cut off after {length} bytes or was not closed: found no footer at the end");
        return Err(Error::data(message, "Close the file where it is written, and copy it again."));
    }
    if size > FOOTER_MAX {
        let message = format!("has a footer of {size} bytes, expected at most {FOOTER_MAX}");
        return Err(Error::data(message, "Save less columns in fewer row groups."));
    }
    let start = length - 8 - size;
    let mut bytes = Vec::new();
    medium.seek(SeekFrom::Start(start)).map_err(unreadable)?;
    medium.take(size).read_to_end(&mut bytes).map_err(unreadable)?;
    Footer::read(&bytes)
        .map_err(|at| Error::data(format!("the footer is damaged at byte {}", start + at as u64), AGAIN))
}

/// Checks the compression and the place of a column in a row group.
pub(super) fn check(leaf: &Leaf, group: &Group, number: usize, length: u64) -> Result<()> {
    let Some(chunk) = group.chunks.get(leaf.column) else { return Ok(()) };
    let name = quoted(&format!("{}{}", leaf.before, leaf.after));
    let codec = usize::try_from(chunk.codec).ok().and_then(|n| CODECS.get(n));
    if !codec.is_some_and(|(_, is_read)| *is_read) {
        let codec = codec.map_or_else(|| format!("number {}", chunk.codec), |(codec, _)| (*codec).to_owned());
        let message =
            format!("column {name} has the compression {codec}, expected SNAPPY, ZSTD, GZIP, LZ4_RAW or none");
        return Err(Error::data(message, "Save it with compression=\"zstd\"."));
    }
    if chunk.start.checked_add(chunk.length).is_none_or(|end| end > length) {
        let (start, size) = (chunk.start, chunk.length);
        let message = format!(
            "column {name}, row group {number}: {size} bytes at byte {start} exceed the file of {length} bytes"
        );
        return Err(Error::data(message, AGAIN));
    }
    Ok(())
}
