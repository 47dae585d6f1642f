//! Parquet files, as pandas, Polars and LeRobot write them: one table, whose columns are read on request.

mod bits;
mod column;
mod contents;
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
use contents::{Contents, check, contents};
use footer::{Group, Meaning};
use motorfit_core::text::{counted, excerpt};
use motorfit_core::{Error, Result};
use pages::Buffers;
use schema::{Columns, Leaf, Physical};
pub use table::{Column, Table};

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
