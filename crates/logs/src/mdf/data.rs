//! Data of MDF files: blocks in lists, compressed or not, as one sequence of bytes.

use super::block::{AGAIN, Blocks, HEADER, size};
use motorfit_core::{Error, Result};
use std::collections::HashSet;
use std::io::Read as _;

/// Number of bytes that are read at once from a block that is not compressed.
const PIECE: u64 = 1 << 18;
/// Decompressed size of a data group that is accepted at any compression ratio \[bytes\].
const UNPACKED_FREE: u64 = 32 << 20;
/// Largest ratio of the decompressed size of a larger data group to the size of the file.
const UNPACKED_RATIO: u64 = 50;
/// Largest decompressed size of a block \[bytes\].
const UNPACKED_MAX: u64 = 1 << 30;

/// State in which the logger left a file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Closing {
    /// True if the file was not closed.
    pub(crate) is_open: bool,
    /// True if the last data block has no length yet.
    pub(crate) lacks_length: bool,
}

/// A data block.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    /// Place of the data in the file \[bytes\].
    at: u64,
    /// Length in the file \[bytes\].
    length: u64,
    /// Length of the data \[bytes\].
    size: u64,
    packing: Packing,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Packing {
    Plain,
    Deflate,
    /// Compressed after the columns of a matrix of records were joined, with the length of a record.
    Transposed(usize),
}

/// The data blocks of a data group.
#[derive(Debug, Default)]
pub(crate) struct Data {
    parts: Vec<Part>,
    /// Length of all data \[bytes\].
    pub(crate) size: u64,
    /// True if the file ends before the data.
    pub(crate) is_cut: bool,
    /// Reason why the data are not read.
    pub(crate) unsupported: Option<&'static str>,
}

impl Data {
    /// Finds the data blocks from a link on.
    ///
    /// # Errors
    /// Returns a `Data` error if a block is damaged, or if the data are too large.
    pub(crate) fn find(blocks: &mut Blocks, link: u64, closing: Closing) -> Result<Self> {
        let mut data = Self::default();
        let mut seen = HashSet::new();
        let mut next = link;
        while next != 0 && data.unsupported.is_none() && !data.is_cut {
            if next >= blocks.length || closing.is_open && blocks.head(next).is_err() {
                data.is_cut = true;
                break;
            }
            if !seen.insert(next) {
                return Err(Error::data(format!("the list of data at byte {next} repeats itself"), AGAIN));
            }
            match &blocks.head(next)?.kind {
                b"HL" => next = blocks.block(next, &[b"HL"])?.link(0),
                b"DL" => {
                    let list = blocks.block(next, &[b"DL"])?;
                    for &link in list.links.get(1..).unwrap_or_default().iter().filter(|&&link| link != 0) {
                        data.add(blocks, link, closing)?;
                        if data.is_cut || data.unsupported.is_some() {
                            break;
                        }
                    }
                    next = list.link(0);
                }
                b"LD" | b"DV" | b"DI" => data.unsupported = Some("stored by columns"),
                _ => {
                    data.add(blocks, next, closing)?;
                    break;
                }
            }
        }
        Ok(data)
    }

    /// Adds a data block.
    fn add(&mut self, blocks: &mut Blocks, at: u64, closing: Closing) -> Result<()> {
        let start = at.saturating_add(HEADER);
        if start > blocks.length || closing.is_open && blocks.head(at).is_err() {
            self.is_cut = true;
            return Ok(());
        }
        let head = blocks.head(at)?;
        let left = blocks.length - start;
        let damaged = |what: &str| Error::data(format!("the data block at byte {at} {what}"), AGAIN);
        // A block that was being written has no length yet.
        let is_last = closing.lacks_length && head.length <= HEADER && &head.kind == b"DT";
        let length = if is_last { Some(left) } else { head.length.checked_sub(HEADER) };
        let Some(length) = length else { return Err(damaged("has no length")) };
        let part = match &head.kind {
            b"DT" => {
                self.is_cut = length > left;
                let length = length.min(left);
                Part { at: start, length, size: length, packing: Packing::Plain }
            }
            b"DZ" if length > left => {
                self.is_cut = true;
                return Ok(());
            }
            b"DZ" => packed(blocks, start, length)?.ok_or_else(|| damaged("is compressed in an unknown way"))?,
            b"DV" | b"DI" => {
                self.unsupported = Some("stored by columns");
                return Ok(());
            }
            _ => return Err(damaged("has an unknown type")),
        };
        self.size = self.size.saturating_add(part.size);
        let size_max = blocks.length.saturating_mul(UNPACKED_RATIO).max(UNPACKED_FREE);
        if self.size > size_max || part.packing != Packing::Plain && part.size > UNPACKED_MAX {
            return Err(damaged("decompresses to too much"));
        }
        self.parts.push(part);
        Ok(())
    }

    /// Reads the data from a place on and calls `each` with consecutive bytes, until it returns false.
    ///
    /// # Errors
    /// Returns a `Data` error if a block is damaged, and those of `each`.
    pub(crate) fn read(
        &self,
        blocks: &mut Blocks,
        from: u64,
        each: &mut dyn FnMut(&[u8]) -> Result<bool>,
    ) -> Result<()> {
        let (mut packed, mut plain) = (Vec::new(), Vec::new());
        let mut skip = from;
        for part in &self.parts {
            if skip >= part.size {
                skip -= part.size;
                continue;
            }
            if part.packing == Packing::Plain {
                let (mut at, end) = (part.at + skip, part.at + part.length);
                while at < end {
                    let count = PIECE.min(end - at);
                    blocks.bytes(at, size(count), &mut packed)?;
                    at += count;
                    if !each(&packed)? {
                        return Ok(());
                    }
                }
            } else {
                blocks.bytes(part.at, size(part.length), &mut packed)?;
                part.unpack(&packed, &mut plain).ok_or_else(|| {
                    Error::data(format!("the data at byte {} cannot be decompressed", part.at), AGAIN)
                })?;
                if !each(plain.get(size(skip)..).unwrap_or_default())? {
                    return Ok(());
                }
            }
            skip = 0;
        }
        Ok(())
    }
}

/// Reads the header of a compressed block; `None` if the compression is unknown.
fn packed(blocks: &mut Blocks, at: u64, length: u64) -> Result<Option<Part>> {
    let mut head = Vec::new();
    if length < 24 {
        return Ok(None);
    }
    blocks.bytes(at, 24, &mut head)?;
    let &[b'D', b'T', packing, _, c0, c1, c2, c3, s0, s1, s2, s3, s4, s5, s6, s7, l0, l1, l2, l3, l4, l5, l6, l7] =
        &head[..]
    else {
        return Ok(None);
    };
    let columns = usize::try_from(u32::from_le_bytes([c0, c1, c2, c3])).unwrap_or(0);
    let size = u64::from_le_bytes([s0, s1, s2, s3, s4, s5, s6, s7]);
    let packed = u64::from_le_bytes([l0, l1, l2, l3, l4, l5, l6, l7]);
    let packing = match packing {
        0 => Packing::Deflate,
        1 if columns > 0 => Packing::Transposed(columns),
        _ => return Ok(None),
    };
    Ok((packed <= length - 24).then_some(Part { at: at + 24, length: packed, size, packing }))
}

impl Part {
    fn unpack(&self, packed: &[u8], plain: &mut Vec<u8>) -> Option<()> {
        plain.clear();
        let mut reader = flate2::read::ZlibDecoder::new(packed).take(self.size);
        reader.read_to_end(plain).ok()?;
        if plain.len() as u64 != self.size {
            return None;
        }
        if let Packing::Transposed(columns) = self.packing {
            *plain = separated(plain, columns);
        }
        Some(())
    }
}

/// Returns records of the length `columns` from bytes that have the first bytes of all records first, then the second ones and
/// so on. Bytes of an incomplete last record remain behind.
fn separated(joined: &[u8], columns: usize) -> Vec<u8> {
    /// Records that are written together, so that they stay in the cache.
    const TILE: usize = 64;
    let rows = joined.len() / columns;
    let mut records = joined.to_vec();
    if rows == 0 {
        // Data of less than one record have nothing to separate, and the number of columns may be any.
        return records;
    }
    for (n, tile) in records.chunks_mut(TILE.saturating_mul(columns)).enumerate() {
        let first = n * TILE;
        let count = TILE.min(rows.saturating_sub(first));
        for column in 0..columns {
            let start = column * rows + first;
            let values = joined.get(start..start + count).unwrap_or_default();
            for (row, &byte) in tile.chunks_exact_mut(columns).zip(values) {
                if let Some(place) = row.get_mut(column) {
                    *place = byte;
                }
            }
        }
    }
    records
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::ZlibEncoder};
    use std::io::Write as _;

    #[test]
    fn transposed_data_are_read_with_an_incomplete_last_record() {
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
        packed.write_all(&[1, 4, 2, 5, 3, 6, 7, 8]).unwrap();
        let packed = packed.finish().unwrap();
        let mut part = Part { at: 0, length: packed.len() as u64, size: 8, packing: Packing::Transposed(3) };
        let mut plain = Vec::new();
        assert_eq!(part.unpack(&packed, &mut plain), Some(()));
        assert_eq!(plain, [1, 2, 3, 4, 5, 6, 7, 8]);
        part.size = 9;
        assert_eq!(part.unpack(&packed, &mut plain), None);
        // A damaged number of columns takes no time.
        part = Part { size: 8, packing: Packing::Transposed(usize::MAX / 128), ..part };
        assert_eq!((part.unpack(&packed, &mut plain), plain.len()), (Some(()), 8));
        // More than the stated size is not read.
        part.size = 3;
        assert_eq!((part.unpack(&packed, &mut plain), plain.len()), (Some(()), 3));
    }
}
