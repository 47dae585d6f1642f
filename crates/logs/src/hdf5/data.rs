//! Values of HDF5 datasets.

use super::number::Number;
use hdf5_reader::error::{Error, Result};
use hdf5_reader::io::Cursor;
use hdf5_reader::messages::HdfMessage;
use hdf5_reader::messages::layout::DataLayout;
use hdf5_reader::{Dataset, Hdf5File};
use std::ops::Range;

/// Number of bytes that are read at once where a dataset is not in chunks; few in tests, whose files are small.
const BLOCK: usize = if cfg!(test) { 40 } else { 1 << 20 };

/// A dataset as a table of elements.
pub(super) struct Table {
    pub dataset: Dataset,
    /// Dimension that counts the rows; `None` if there is only one element.
    pub row: Option<usize>,
    /// Dimension that counts the columns of a matrix.
    pub column: Option<usize>,
    /// Size of an element \[bytes\].
    pub size: usize,
}

/// A number in each row of a table.
#[derive(Clone, Copy)]
pub(super) struct Part {
    /// Column of the matrix, else 0.
    pub column: usize,
    /// Position inside the element \[bytes\].
    pub offset: usize,
    pub number: Number,
}

/// Bytes of some elements of a table.
struct Elements<'a> {
    bytes: &'a [u8],
    /// Rows of the elements.
    rows: Range<usize>,
    /// Position of the element of the first row.
    first: usize,
    /// Distance between the elements of successive rows.
    step: usize,
}

impl Table {
    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.extent(self.row)
    }

    /// Returns the number of columns of the matrix.
    pub fn columns(&self) -> usize {
        self.extent(self.column)
    }

    fn extent(&self, dimension: Option<usize>) -> usize {
        let extent = dimension.and_then(|dimension| self.dataset.shape().get(dimension));
        extent.map_or(1, |&extent| usize::try_from(extent).unwrap_or(usize::MAX))
    }

    /// Reads the first `rows` rows of some parts. Elements that the file does not hold have the fill value.
    ///
    /// # Errors
    /// Returns an error if the file is damaged; if it `is_cut`, lost elements have the fill value.
    pub fn read(&self, file: &Hdf5File, parts: &[Part], rows: usize, is_cut: bool) -> Result<Vec<Vec<f64>>> {
        let fill = self.dataset.fill_value().and_then(|fill| fill.value.as_deref()).unwrap_or_default();
        let empty = |part: &Part| vec![fill.get(part.offset..).and_then(|b| part.number.value(b)).unwrap_or(0.0); rows];
        let mut columns: Vec<Vec<f64>> = parts.iter().map(empty).collect();
        let total = self.rows().saturating_mul(self.columns());
        let needed = total.saturating_mul(self.size) as u64;
        let short = |bytes| Error::InvalidData(format!("{bytes} bytes, expected {needed}"));
        match layout(file, &self.dataset)? {
            DataLayout::Compact { data } if (data.len() as u64) < needed => return Err(short(data.len() as u64)),
            DataLayout::Compact { data } => self.place(&data, 0, parts, &mut columns),
            DataLayout::Contiguous { address, size } if size == 0 || is_undefined(file, address) => {}
            DataLayout::Contiguous { size, .. } if size < needed => return Err(short(size)),
            DataLayout::Contiguous { address, .. } => {
                let total = if is_cut { total.min(self.stored(file, address)) } else { total };
                self.contiguous(file, address, total, |bytes, at| self.place(bytes, at, parts, &mut columns))?;
            }
            DataLayout::Chunked { address, .. } if is_undefined(file, address) => {}
            DataLayout::Chunked { .. } => {
                for (chunk, number) in self.dataset.iter_chunks()?.zip(1..) {
                    if number > self.chunks() {
                        return Err(Error::InvalidData(format!("more than {} chunks", self.chunks())));
                    }
                    match chunk {
                        Ok(chunk) => self.place_chunk(&chunk, parts, &mut columns),
                        Err(_) if is_cut => {}
                        Err(error) => return Err(error),
                    }
                }
            }
        }
        Ok(columns)
    }

    /// Returns the number of chunks that cover the dataset.
    fn chunks(&self) -> u64 {
        let sizes = self.dataset.chunks().unwrap_or_default();
        let counts =
            self.dataset.shape().iter().zip(sizes).map(|(size, of_chunk)| size.div_ceil(u64::from(of_chunk).max(1)));
        counts.fold(1, u64::saturating_mul)
    }

    /// Returns the number of elements from `address` to the end of the file.
    fn stored(&self, file: &Hdf5File, address: u64) -> usize {
        let bytes = file.storage().len().saturating_sub(address);
        usize::try_from(bytes).unwrap_or(usize::MAX) / self.size.max(1)
    }

    /// Reads `total` elements at `address` in blocks; `place` takes bytes and the number of their first element.
    fn contiguous(
        &self,
        file: &Hdf5File,
        address: u64,
        total: usize,
        mut place: impl FnMut(&[u8], usize),
    ) -> Result<()> {
        let block = (BLOCK / self.size.max(1)).max(1);
        let mut at = 0;
        while at < total {
            let count = block.min(total - at);
            let start = (at as u64).checked_mul(self.size as u64).and_then(|bytes| bytes.checked_add(address));
            let start = start.ok_or(Error::OffsetOutOfBounds(address))?;
            place(&file.storage().read_range(start, count * self.size)?, at);
            at += count;
        }
        Ok(())
    }

    /// Returns the distances between the elements of successive rows and of successive columns.
    fn steps(&self) -> (usize, usize) {
        if self.row < self.column { (self.columns(), 1) } else { (1, self.rows()) }
    }

    /// Takes values from the bytes of successive elements; `at` is the number of the first one.
    fn place(&self, bytes: &[u8], at: usize, parts: &[Part], columns: &mut [Vec<f64>]) {
        let (row_step, column_step) = self.steps();
        let end = at + bytes.len() / self.size.max(1);
        for (part, values) in parts.iter().zip(columns) {
            let start = part.column * column_step;
            let row = |element: usize| element.saturating_sub(start).div_ceil(row_step.max(1));
            let rows = row(at)..row(end).min(self.rows());
            let first = (start + rows.start * row_step).saturating_sub(at);
            self.take(&Elements { bytes, rows, first, step: row_step }, part, values);
        }
    }

    /// Takes values from a chunk of the dataset.
    fn place_chunk(&self, chunk: &hdf5_reader::DatasetChunk, parts: &[Part], columns: &mut [Vec<f64>]) {
        let extent = |sizes: &[u64], dimension: Option<usize>, absent| {
            let size = dimension.and_then(|dimension| sizes.get(dimension)).copied();
            size.map_or(absent, |size| usize::try_from(size).unwrap_or(usize::MAX))
        };
        let step = |dimension: Option<usize>| {
            let inner = dimension.and_then(|dimension| chunk.shape().get(dimension + 1..)).unwrap_or_default();
            inner.iter().fold(1, |step: usize, &size| step.saturating_mul(usize::try_from(size).unwrap_or(usize::MAX)))
        };
        let start = extent(chunk.offsets(), self.row, 0);
        let rows = start..start.saturating_add(extent(chunk.shape(), self.row, 1)).min(self.rows());
        let left = extent(chunk.offsets(), self.column, 0);
        let across = left..left.saturating_add(extent(chunk.shape(), self.column, 1));
        for (part, values) in parts.iter().zip(columns) {
            if across.contains(&part.column) {
                let first = (part.column - left).saturating_mul(step(self.column));
                let rows = rows.clone();
                self.take(&Elements { bytes: chunk.bytes(), rows, first, step: step(self.row) }, part, values);
            }
        }
    }

    /// Takes the values of a part in the rows of some elements.
    fn take(&self, elements: &Elements<'_>, part: &Part, values: &mut [f64]) {
        let range = elements.rows.start..elements.rows.end.min(values.len());
        let Some(values) = values.get_mut(range) else { return };
        let start = elements.first.saturating_mul(self.size).saturating_add(part.offset);
        let step = elements.step.saturating_mul(self.size).max(1);
        let places = elements.bytes.get(start..).unwrap_or_default().chunks(step);
        for (value, bytes) in values.iter_mut().zip(places) {
            *value = part.number.value(bytes).unwrap_or(*value);
        }
    }

    /// Returns the number of rows of a file that is cut off whose elements are complete.
    pub fn complete_rows(&self, file: &Hdf5File) -> usize {
        match layout(file, &self.dataset) {
            Ok(DataLayout::Compact { .. }) => self.rows(),
            Ok(DataLayout::Contiguous { address, .. } | DataLayout::Chunked { address, .. })
                if is_undefined(file, address) =>
            {
                self.rows()
            }
            Ok(DataLayout::Contiguous { address, .. }) => {
                let elements = self.stored(file, address);
                let (row_step, column_step) = self.steps();
                let last = (self.columns() - 1).saturating_mul(column_step);
                self.rows().min(elements.saturating_sub(last).div_ceil(row_step.max(1)))
            }
            Ok(DataLayout::Chunked { .. }) => self.complete_chunks(),
            Err(_) => 0,
        }
    }

    /// Returns the number of rows before the first that has a lost chunk.
    fn complete_chunks(&self) -> usize {
        let (Some(shape), Ok(chunks)) = (self.dataset.chunks(), self.dataset.iter_chunks()) else { return 0 };
        let size = |dimension: Option<usize>| {
            let size = dimension.and_then(|dimension| shape.get(dimension));
            size.map_or(1, |&size| usize::try_from(size).unwrap_or(usize::MAX).max(1))
        };
        let (height, width) = (size(self.row), self.columns().div_ceil(size(self.column)));
        let mut found = vec![0; self.rows().div_ceil(height)];
        for chunk in chunks.flatten() {
            let start = self.row.and_then(|row| chunk.offsets().get(row)).copied().unwrap_or(0);
            if let Some(count) = found.get_mut(usize::try_from(start).unwrap_or(usize::MAX) / height) {
                *count += 1;
            }
        }
        self.rows().min(found.iter().take_while(|&&count| count >= width).count().saturating_mul(height))
    }
}

fn is_undefined(file: &Hdf5File, address: u64) -> bool {
    Cursor::is_undefined_offset(address, file.superblock().offset_size)
}

/// Returns where a dataset is stored.
fn layout(file: &Hdf5File, dataset: &Dataset) -> Result<DataLayout> {
    let header = file.get_or_parse_header(dataset.address())?;
    let layout = header.messages.iter().find_map(|message| match message {
        HdfMessage::DataLayout(layout) => Some(layout.layout.clone()),
        _ => None,
    });
    layout.ok_or_else(|| Error::InvalidData("no layout of the data".into()))
}
