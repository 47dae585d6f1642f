//! Tables of Parquet files in batches of rows: of each column one page is in memory.

use super::super::log::Medium;
use super::column::{named, page};
use super::contents::{AGAIN, Contents, check, contents};
use super::decode::Decoder;
use super::footer::{Chunk, Group, Meaning, Node};
use super::pages::{Buffers, Pages};
use super::schema::{Leaf, Physical};
use motorfit_core::numeric::index;
use motorfit_core::{Error, Result};
use std::ops::Range;

/// Names of the physical types, by their numbers.
const PHYSICAL: [&str; 8] =
    ["BOOLEAN", "INT32", "INT64", "INT96", "FLOAT", "DOUBLE", "BYTE_ARRAY", "FIXED_LEN_BYTE_ARRAY"];
/// Names of the converted types, by their numbers.
const CONVERTED: [&str; 22] = [
    "UTF8",
    "MAP",
    "MAP_KEY_VALUE",
    "LIST",
    "ENUM",
    "DECIMAL",
    "DATE",
    "TIME_MILLIS",
    "TIME_MICROS",
    "TIMESTAMP_MILLIS",
    "TIMESTAMP_MICROS",
    "UINT_8",
    "UINT_16",
    "UINT_32",
    "UINT_64",
    "INT_8",
    "INT_16",
    "INT_32",
    "INT_64",
    "JSON",
    "BSON",
    "INTERVAL",
];

/// A column of a table.
#[derive(Debug)]
pub struct Column {
    /// Names from the outermost group to the column, joined by points.
    pub path: String,
    /// Physical and converted type, as in `BYTE_ARRAY UTF8`.
    pub kind: String,
    /// The column, if it is one of real or signed whole numbers, one in each row.
    leaf: Option<Leaf>,
}

impl Column {
    /// Returns true for a column of real or signed whole numbers, one in each row or none.
    #[must_use]
    pub fn is_of_numbers(&self) -> bool {
        self.leaf.is_some()
    }
}

/// A table, and the position up to which its chosen columns were read.
pub struct Table {
    medium: Box<dyn Medium>,
    /// Length of the file \[bytes\].
    length: u64,
    groups: Vec<Group>,
    columns: Vec<Column>,
    rows: u64,
    buffers: Buffers,
    streams: Vec<Stream>,
    /// Row groups that were begun, and their rows.
    begun: usize,
    begun_rows: u64,
    /// Unread rows of the current row group.
    left: u64,
}

/// A column that is read page by page.
struct Stream {
    leaf: Leaf,
    decoder: Decoder,
    /// Unread part of the current row group.
    rest: Chunk,
    /// Values of the pages that were read, and the range of those that were read last.
    values: Vec<f64>,
    last: Range<usize>,
    /// Number of rows before those of `values`.
    before: u64,
}

impl Table {
    /// Reads the footer of a Parquet file.
    ///
    /// # Errors
    /// Returns a `Data` error if the file cannot be read, is damaged, cut off or encrypted.
    pub fn open(mut medium: Box<dyn Medium>) -> Result<Self> {
        let Contents { length, nodes, groups, columns: known, rows } = contents(&mut *medium)?;
        let mut columns = columns(&nodes);
        let is_number = |leaf: &Leaf| {
            let is_wide =
                matches!(leaf.physical, Physical::Double | Physical::Float | Physical::Int32 | Physical::Int64);
            is_wide && leaf.meaning == Meaning::Plain && !leaf.is_list()
        };
        for leaf in known.leaves.into_iter().filter(is_number) {
            if let Some(column) = columns.get_mut(leaf.column) {
                column.leaf = Some(leaf);
            }
        }
        let (buffers, streams) = (Buffers::default(), Vec::new());
        Ok(Self { medium, length, groups, columns, rows, buffers, streams, begun: 0, begun_rows: 0, left: 0 })
    }

    /// Returns the columns in the order of the file.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Returns the number of rows.
    #[must_use]
    pub const fn rows(&self) -> u64 {
        self.rows
    }

    /// Chooses the columns of numbers, by their indices, that are read from the first row on.
    ///
    /// # Errors
    /// Returns a `Data` error if a column is not one of numbers, has a compression that is not read, or exceeds the file.
    pub fn choose(&mut self, columns: &[usize]) -> Result<()> {
        self.streams.clear();
        (self.begun, self.begun_rows, self.left) = (0, 0, 0);
        for &column in columns {
            let Some(leaf) = self.columns.get(column).and_then(|column| column.leaf.clone()) else {
                return Err(Error::data(
                    format!("column {column} is not one of numbers"),
                    "Choose a column of numbers.",
                ));
            };
            for (number, group) in self.groups.iter().enumerate() {
                check(&leaf, group, number, self.length)?;
            }
            let decoder = Decoder::new(leaf.physical, leaf.meaning);
            let rest = Chunk::default();
            self.streams.push(Stream { leaf, decoder, rest, values: Vec::new(), last: 0..0, before: 0 });
        }
        Ok(())
    }

    /// Reads the next rows of the chosen columns, at most `most` and those of one row group; returns their number, 0 at the end.
    ///
    /// # Errors
    /// Returns a `Data` error if the file is damaged or cannot be read.
    pub fn next(&mut self, most: usize) -> Result<usize> {
        while self.left == 0 {
            let Some(group) = self.groups.get(self.begun) else {
                self.streams.iter_mut().for_each(|stream| stream.last.start = stream.last.end);
                return Ok(0);
            };
            for stream in &mut self.streams {
                stream.begin(group);
            }
            self.left = group.rows;
            self.begun += 1;
            self.begun_rows = self.begun_rows.saturating_add(group.rows);
        }
        let count = most.min(index(self.left));
        for stream in &mut self.streams {
            let read = stream.read(&mut *self.medium, &mut self.buffers, self.length, (count, self.begun_rows));
            read.map_err(|text| {
                Error::data(format!("{}, row group {}: {text}", named(&stream.leaf), self.begun - 1), AGAIN)
            })?;
        }
        self.left -= count as u64;
        Ok(count)
    }

    /// Returns the values of the rows that were read last, of a column by its index among the chosen, with NaN for those that
    /// are missing.
    #[must_use]
    pub fn values(&self, chosen: usize) -> &[f64] {
        self.streams.get(chosen).and_then(|stream| stream.values.get(stream.last.clone())).unwrap_or_default()
    }
}

impl Stream {
    /// Starts at the first row of a row group.
    fn begin(&mut self, group: &Group) {
        self.decoder.start_group();
        self.rest = group.chunks.get(self.leaf.column).copied().unwrap_or_default();
    }

    /// Reads the next `count` values; `rows` are expected with those of this row group.
    fn read(
        &mut self,
        medium: &mut dyn Medium,
        buffers: &mut Buffers,
        length: u64,
        (count, rows): (usize, u64),
    ) -> std::result::Result<(), String> {
        self.last.start = self.last.end;
        while self.values.len() - self.last.start < count {
            self.values.drain(..self.last.start);
            self.before += self.last.start as u64;
            self.last.start = 0;
            let mut pages = Pages::new(medium, buffers, self.rest, length);
            let range = (self.before, rows);
            if !page(&mut pages, &mut self.decoder, &self.leaf, &mut self.values, range)? {
                let found = self.before + self.values.len() as u64;
                return Err(format!("it has {found} rows up to here, expected {rows}"));
            }
            self.rest = pages.rest();
        }
        self.last.end = self.last.start + count;
        Ok(())
    }
}

/// Returns all columns of a schema, which is a tree.
fn columns(nodes: &[Node]) -> Vec<Column> {
    let mut columns = Vec::new();
    // Name and remaining children of each group around the node.
    let mut around: Vec<(&str, usize)> = Vec::new();
    for node in nodes.iter().skip(1) {
        if let Some((_, children)) = around.last_mut() {
            *children -= 1;
        }
        if node.children > 0 {
            around.push((&node.name, node.children));
            continue;
        }
        let names = around.iter().map(|(name, _)| *name).chain([node.name.as_str()]);
        let path = names.collect::<Vec<_>>().join(".");
        columns.push(Column { path, kind: kind(node), leaf: None });
        while around.pop_if(|(_, children)| *children == 0).is_some() {}
    }
    columns
}

/// Returns the names of the types of a column. The converted type of a file that has only the newer kind of meaning is derived.
fn kind(node: &Node) -> String {
    let name = |names: &[&'static str], number: Option<i32>| {
        number.and_then(|number| names.get(usize::try_from(number).ok()?).copied()).unwrap_or("NONE")
    };
    let derived = match node.meaning {
        Meaning::Other("texts") => Some(0),
        Meaning::Decimal(_) => Some(5),
        Meaning::Other("dates") => Some(6),
        Meaning::Clock(1e3) => Some(7),
        Meaning::Clock(1e6) => Some(8),
        Meaning::Timestamp(1e3) => Some(9),
        Meaning::Timestamp(1e6) => Some(10),
        _ => None,
    };
    format!("{} {}", name(&PHYSICAL, node.physical), name(&CONVERTED, node.converted.or(derived)))
}
