//! Parquet files, as pandas, Polars and LeRobot write them: one table, whose columns are read on request.

mod bits;
mod column;
mod decode;
mod footer;
mod pages;
mod schema;
mod table;
#[cfg(test)]
mod tests;
mod thrift;

use super::cells::shortened;
use super::log::{Channel, Field, Log, Medium, Series};
use column::{LIST_MAX, Source};
use footer::{Footer, Group, Meaning, Node};
use motorfit_core::text::{counted, excerpt, quoted};
use motorfit_core::{Error, Result};
use pages::{Buffers, CODECS};
use schema::{Columns, Leaf, Physical};
use std::io::{Read as _, SeekFrom};
pub use table::{Column, Table};

const MAGIC: &[u8; 4] = b"PAR1";
const AGAIN: &str = "Copy the file again.";
/// Largest size of a footer \[bytes\].
const FOOTER_MAX: u64 = 256 << 20;
/// Largest number of fields.
const CHANNELS_MAX: usize = 10_000;
/// Largest number of values that are read at once.
const VALUES_MAX: u64 = 100_000_000;
/// Largest number of notes of one kind.
const NOTES_MAX: usize = 20;

/// A Parquet file.
struct Parquet {
    medium: Box<dyn Medium>,
    length: u64,
    groups: Vec<Group>,
    leaves: Vec<Leaf>,
    /// Leaf and element of each field.
    places: Vec<(usize, usize)>,
    channels: Vec<Channel>,
    notes: Vec<String>,
}

/// Reads the schema of a Parquet file.
///
/// The only channel has a field for each column of numbers, named by the path through structures, as in `state/velocity`. A
/// column of lists with the same number of elements in each row has a field for each element, as in `action[0]`.
///
/// # Errors
/// Returns a `Data` error if the file is damaged, cut off, encrypted, or has too many columns.
pub(crate) fn open(mut medium: Box<dyn Medium>) -> Result<Box<dyn Log>> {
    let Contents { length, groups, columns, rows, .. } = contents(&mut *medium)?;
    for (number, group) in groups.iter().enumerate() {
        for leaf in &columns.leaves {
            check(leaf, group, number, length)?;
        }
    }
    let mut parquet =
        Parquet { medium, length, groups, leaves: vec![], places: vec![], channels: vec![], notes: vec![] };
    parquet.find_fields(columns, rows)?;
    Ok(Box::new(parquet))
}

/// Contents of the footer of a file.
struct Contents {
    /// Length of the file \[bytes\].
    length: u64,
    nodes: Vec<Node>,
    groups: Vec<Group>,
    columns: Columns,
    /// Number of rows of all groups.
    rows: u64,
}

/// Reads the footer of a file and checks that schema and row groups fit each other.
fn contents(medium: &mut dyn Medium) -> Result<Contents> {
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
fn check(leaf: &Leaf, group: &Group, number: usize, length: u64) -> Result<()> {
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

impl Parquet {
    /// Finds the fields: the columns of numbers and the elements of lists.
    fn find_fields(&mut self, columns: Columns, rows: u64) -> Result<()> {
        let Columns { leaves, mut others, .. } = columns;
        let mut relative = Vec::new();
        let mut fields = Vec::new();
        for mut leaf in leaves {
            if leaf.is_list() {
                match self.list_length(&leaf) {
                    Ok(length) => leaf.length = Some(length),
                    Err(reason) => {
                        let name = excerpt(&format!("{}{}", leaf.before, leaf.after));
                        others.push(format!("{name}: {reason}"));
                        continue;
                    }
                }
            }
            let is_stamp = matches!(leaf.meaning, Meaning::Timestamp(_)) || leaf.physical == Physical::Int96;
            let in_seconds = is_stamp || matches!(leaf.meaning, Meaning::Clock(_));
            let unit = in_seconds.then(|| "s".to_owned());
            for element in 0..leaf.length.unwrap_or(1) {
                let path = leaf.name(element);
                if is_stamp {
                    relative.push(format!("{}: points in time, counted from the first one", excerpt(&path)));
                }
                self.places.push((self.leaves.len(), element));
                fields.push(Field { path, unit: unit.clone() });
            }
            self.leaves.push(leaf);
            if fields.len() > CHANNELS_MAX {
                let message = format!("has more than {CHANNELS_MAX} columns of numbers");
                return Err(Error::data(message, "Save the columns of one motor alone."));
            }
        }
        if !fields.is_empty() {
            self.channels.push(Channel { name: String::new(), fields, count: rows, span_s: None });
        }
        let others = others.iter().map(|other| format!("left out {other}")).collect();
        self.notes = [shortened(relative, NOTES_MAX), shortened(others, NOTES_MAX)].concat();
        Ok(())
    }

    /// Returns the number of elements of each row of a list, or the reason why it is not read.
    fn list_length(&mut self, leaf: &Leaf) -> std::result::Result<usize, String> {
        match self.source().list_length(leaf)? {
            None => Err("lists without elements".to_owned()),
            Some(length) if length > LIST_MAX => {
                Err(format!("lists of {length} elements, expected at most {LIST_MAX}"))
            }
            Some(length) => Ok(length),
        }
    }

    fn source(&mut self) -> Source<'_> {
        Source { medium: &mut *self.medium, length: self.length, groups: &self.groups, buffers: Buffers::default() }
    }

    /// Reads fields of the only channel; columns that several fields share are read once.
    fn fields(&mut self, fields: &[usize]) -> Result<Vec<Vec<f64>>> {
        let mut wanted: Vec<(usize, Vec<usize>, Vec<usize>)> = Vec::new();
        for (position, &field) in fields.iter().enumerate() {
            let Some(&(leaf, element)) = self.places.get(field) else { return Err(no_field(field)) };
            match wanted.iter_mut().find(|(other, ..)| *other == leaf) {
                Some((_, elements, positions)) => {
                    elements.push(element);
                    positions.push(position);
                }
                None => wanted.push((leaf, vec![element], vec![position])),
            }
        }
        let mut columns = vec![Vec::new(); fields.len()];
        for (leaf, elements, positions) in wanted {
            let Some(leaf) = self.leaves.get(leaf).cloned() else { continue };
            for (position, column) in positions.into_iter().zip(self.source().read(&leaf, &elements)?) {
                if let Some(place) = columns.get_mut(position) {
                    *place = column;
                }
            }
        }
        Ok(columns)
    }
}

fn no_field(field: usize) -> Error {
    Error::data(format!("has no field {field}"), "Choose one of the fields of the file.")
}

impl Log for Parquet {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&mut self, requests: &[(usize, Vec<usize>)]) -> Result<Vec<Series>> {
        let rows = self.channels.first().map_or(0, |channel| channel.count);
        let count = requests.iter().map(|(_, fields)| fields.len()).sum::<usize>();
        let values = rows.saturating_mul(count as u64);
        if values > VALUES_MAX {
            let message = format!("{} of {rows} rows have more than {VALUES_MAX} values", counted(count, "column"));
            return Err(Error::data(message, "Select fewer columns, or save a part of the rows."));
        }
        let one = |(channel, fields): &(usize, Vec<usize>)| match channel {
            0 => Ok(Series { time_s: Vec::new(), columns: self.fields(fields)? }),
            other => Err(no_field(*other)),
        };
        requests.iter().map(one).collect()
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }
}
