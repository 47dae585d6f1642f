//! Columns of Parquet files as numbers, row group by row group.

use super::super::log::Medium;
use super::decode::Decoder;
use super::footer::{Chunk, Group};
use super::pages::{Buffers, Head, Levels, Pages};
use super::schema::Leaf;
use motorfit_core::text::quoted;
use motorfit_core::{Error, Result};

const AGAIN: &str = "Copy the file again, or save it anew with pandas or Polars.";
const EVEN: &str = "Save lists of the same length in all rows, or a column for each element.";
/// Largest number of elements of a row of a list.
pub(crate) const LIST_MAX: usize = 1024;

/// A file whose columns are read.
pub(crate) struct Source<'a> {
    /// The file.
    pub(crate) medium: &'a mut dyn Medium,
    /// Length of the file \[bytes\].
    pub(crate) length: u64,
    /// Row groups.
    pub(crate) groups: &'a [Group],
    /// Buffers for the pages.
    pub(crate) buffers: Buffers,
}

/// Rows of a list whose elements are collected.
struct Rows<'a> {
    leaf: &'a Leaf,
    /// Elements that are wanted.
    elements: &'a [usize],
    columns: Vec<Vec<f64>>,
    /// Number of complete rows.
    count: u64,
    /// Elements of the current row, with their number; `None` before the first one.
    found: Option<usize>,
    is_null: bool,
    row: Vec<f64>,
    /// True if a row has another number of elements than the first one.
    is_uneven: bool,
}

impl Source<'_> {
    /// Reads the elements of a column; a column without lists has the only element 0.
    ///
    /// # Errors
    /// Returns a `Data` error if the file is damaged or cannot be read, or if a row of a list has another length.
    pub(crate) fn read(&mut self, leaf: &Leaf, elements: &[usize]) -> Result<Vec<Vec<f64>>> {
        let mut decoder = Decoder::new(leaf.physical, leaf.meaning);
        let mut flat = Vec::new();
        let mut rows = Rows {
            leaf,
            elements,
            columns: vec![Vec::new(); elements.len()],
            count: 0,
            found: None,
            is_null: false,
            row: Vec::new(),
            is_uneven: false,
        };
        let mut expected: u64 = 0;
        for number in 0..self.groups.len() {
            let (chunk, count) = self.chunk(leaf, number)?;
            expected = expected.saturating_add(count);
            decoder.start_group();
            let mut pages = Pages::new(self.medium, &mut self.buffers, chunk, self.length);
            let mut pages_of_column = || {
                while page(&mut pages, &mut decoder, leaf, &mut flat, (0, expected))? {}
                Ok(())
            };
            let read = if leaf.is_list() { rows.group(&mut pages, &mut decoder, expected) } else { pages_of_column() };
            let found = if leaf.is_list() { rows.count } else { flat.len() as u64 };
            let read = read.and_then(|()| match found == expected {
                true => Ok(()),
                false => Err(format!("it has {found} rows up to here, expected {expected}")),
            });
            let hint = if rows.is_uneven { EVEN } else { AGAIN };
            read.map_err(|text| Error::data(format!("{}, row group {number}: {text}", named(leaf)), hint))?;
        }
        if leaf.is_list() {
            return Ok(rows.columns);
        }
        let mut columns = vec![flat; elements.len().min(1)];
        columns.extend((1..elements.len()).filter_map(|_| columns.first().cloned()).collect::<Vec<_>>());
        Ok(columns)
    }

    /// Returns the place of a column in a row group and the number of rows.
    fn chunk(&self, leaf: &Leaf, number: usize) -> Result<(Chunk, u64)> {
        let group = self.groups.get(number);
        let place = group.and_then(|group| Some((*group.chunks.get(leaf.column)?, group.rows)));
        place.ok_or_else(|| Error::data(format!("{} is missing in row group {number}", named(leaf)), AGAIN))
    }

    /// Returns the number of elements of the first row of a list that has any; `None` if no row of the first row group with
    /// rows has.
    ///
    /// # Errors
    /// Returns a description of the damage.
    pub(crate) fn list_length(&mut self, leaf: &Leaf) -> std::result::Result<Option<usize>, String> {
        let Some(group) = self.groups.iter().find(|group| group.rows > 0) else { return Ok(None) };
        let Some(&chunk) = group.chunks.get(leaf.column) else { return Ok(None) };
        let mut pages = Pages::new(self.medium, &mut self.buffers, chunk, self.length);
        let mut found = 0;
        while let Some(head) = pages.next()? {
            if head.is_dictionary {
                continue;
            }
            pages.levels(&head, levels(leaf)).ok_or_else(|| format!("the page at byte {} is damaged", head.at))?;
            let Buffers { repetitions, definitions, .. } = pages.buffers();
            for (&repetition, &definition) in repetitions.iter().zip(definitions) {
                if repetition == 0 && found > 0 {
                    return Ok(Some(found));
                }
                found += usize::from(definition >= leaf.exists);
            }
        }
        Ok((found > 0).then_some(found))
    }
}

/// Returns the name of a column for a message.
pub(crate) fn named(leaf: &Leaf) -> String {
    format!("column {}", quoted(&format!("{}{}", leaf.before, leaf.after)))
}

fn levels(leaf: &Leaf) -> Levels {
    Levels { repeats: leaf.is_list(), present: leaf.present }
}

/// Appends the values of a page to `out`; returns false for a dictionary.
fn values(
    pages: &mut Pages,
    head: &Head,
    decoder: &mut Decoder,
    leaf: &Leaf,
    out: &mut Vec<f64>,
) -> std::result::Result<bool, String> {
    let at = |text: &str| format!("the page at byte {} {text}", head.at);
    if head.is_dictionary {
        let read = decoder.read_dictionary(pages.dictionary(), head.count);
        return read.map(|()| false).ok_or_else(|| at("has a damaged dictionary"));
    }
    let (present, start) = pages.levels(head, levels(leaf)).ok_or_else(|| at("has damaged levels"))?;
    let bytes = pages.dictionary().get(start..).unwrap_or_default();
    decoder.values(head.encoding, bytes, present, out).map_err(|text| at(&text))?;
    Ok(true)
}

/// Appends the values of the next page of a column without lists to `out`, with NaN for those that are missing; returns false
/// if there is no other page. `before` rows precede those in `out`, and `rows` are expected with those of this row group.
pub(crate) fn page(
    pages: &mut Pages,
    decoder: &mut Decoder,
    leaf: &Leaf,
    out: &mut Vec<f64>,
    (before, rows): (u64, u64),
) -> std::result::Result<bool, String> {
    let Some(head) = pages.next()? else { return Ok(false) };
    let start = out.len();
    let found = before + (start + head.count) as u64;
    if !head.is_dictionary && found > rows {
        return Err(format!("it has {found} rows up to here, expected {rows}"));
    }
    if !values(pages, &head, decoder, leaf, out)? {
        return Ok(true);
    }
    let definitions = &pages.buffers().definitions;
    if definitions.is_empty() {
        return Ok(true);
    }
    // The values are moved to their rows from the last one on.
    let mut from = out.len();
    out.resize(start + definitions.len(), f64::NAN);
    for (row, &level) in definitions.iter().enumerate().rev() {
        let mut value = f64::NAN;
        if level == leaf.present {
            from -= 1;
            value = out.get(from).copied().unwrap_or(f64::NAN);
        }
        if let Some(place) = out.get_mut(start + row) {
            *place = value;
        }
    }
    Ok(true)
}

impl Rows<'_> {
    /// Collects the rows of a row group, up to a number of rows in all.
    fn group(&mut self, pages: &mut Pages, decoder: &mut Decoder, rows: u64) -> std::result::Result<(), String> {
        let mut all = Vec::new();
        while let Some(head) = pages.next()? {
            all.clear();
            if self.count > rows {
                return Err(format!("it has more than the expected {rows} rows up to here"));
            }
            if !values(pages, &head, decoder, self.leaf, &mut all)? {
                continue;
            }
            let mut all = all.iter().copied();
            let Buffers { repetitions, definitions, .. } = pages.buffers();
            for (&repetition, &definition) in repetitions.iter().zip(definitions) {
                if repetition == 0 {
                    self.end_row()?;
                    self.row.clear();
                    self.found = Some(0);
                    // A level below that of an empty list is that of a list that is missing.
                    self.is_null = definition + 1 < self.leaf.exists;
                }
                if definition >= self.leaf.exists {
                    let value = if definition == self.leaf.present { all.next() } else { None };
                    if self.row.len() < LIST_MAX {
                        self.row.push(value.unwrap_or(f64::NAN));
                    }
                    self.found = self.found.map(|n| n + 1);
                }
            }
        }
        self.end_row()
    }

    /// Ends the current row, if there is one.
    fn end_row(&mut self) -> std::result::Result<(), String> {
        let Some(found) = self.found.take() else { return Ok(()) };
        let length = self.leaf.length.unwrap_or(0);
        if found != length && !self.is_null {
            self.is_uneven = true;
            return Err(format!("row {} has {found} elements, expected {length} as before", self.count));
        }
        for (&element, column) in self.elements.iter().zip(&mut self.columns) {
            column.push(self.row.get(element).copied().unwrap_or(f64::NAN));
        }
        self.count += 1;
        Ok(())
    }
}
