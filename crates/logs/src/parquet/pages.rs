//! Pages of Parquet files: their headers, compression and levels.

use super::super::log::Medium;
use super::bits::hybrid;
use super::footer::Chunk;
use super::thrift::{Thrift, kind};
use std::io::{Read as _, SeekFrom};

/// Largest size of a page header \[bytes\]. Headers of numbers have less than 200.
const HEAD_MAX: u64 = 4096;
/// Largest number of values of a page.
const PAGE_VALUES_MAX: usize = 1 << 24;
/// Decompressed size of a page that is accepted at any compression ratio \[bytes\].
const UNPACKED_FREE: u64 = 32 << 20;
/// Largest ratio of the decompressed size of a larger page to the size of the file.
const UNPACKED_RATIO: u64 = 50;
/// Largest decompressed size of a page \[bytes\].
const UNPACKED_MAX: u64 = 1 << 30;

/// Names of the compressions; those that are not read have `false`.
pub(crate) const CODECS: [(&str, bool); 8] = [
    ("UNCOMPRESSED", true),
    ("SNAPPY", true),
    ("GZIP", true),
    ("LZO", false),
    ("BROTLI", false),
    ("LZ4", false),
    ("ZSTD", true),
    ("LZ4_RAW", true),
];

/// Header of a page.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Head {
    /// Place of the page in the file \[bytes\].
    pub(crate) at: u64,
    /// True for a dictionary.
    pub(crate) is_dictionary: bool,
    /// Number of values, with those that are missing.
    pub(crate) count: usize,
    /// Number of the encoding.
    pub(crate) encoding: i32,
    /// Encodings of the definition and the repetition levels.
    level_encodings: [i32; 2],
    /// Lengths of the repetition and the definition levels in pages of version 2 \[bytes\].
    level_lengths: Option<[usize; 2]>,
    is_compressed: bool,
    size: usize,
    packed: usize,
}

/// Largest levels of a column.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Levels {
    /// True if there are repetition levels, of 0 or 1.
    pub(crate) repeats: bool,
    /// Largest definition level.
    pub(crate) present: u8,
}

/// Buffers for the pages of a file.
#[derive(Default)]
pub(crate) struct Buffers {
    packed: Vec<u8>,
    plain: Vec<u8>,
    zstd: Option<zstd::bulk::Decompressor<'static>>,
    /// Repetition levels of the page.
    pub(crate) repetitions: Vec<u8>,
    /// Definition levels of the page; empty if all values are present.
    pub(crate) definitions: Vec<u8>,
}

/// The pages of a column in a row group.
pub(crate) struct Pages<'a> {
    medium: &'a mut dyn Medium,
    buffers: &'a mut Buffers,
    at: u64,
    end: u64,
    codec: i32,
    size_max: u64,
}

impl<'a> Pages<'a> {
    /// Starts at the first page. `length` is that of the file; the chunk must lie within.
    pub(crate) fn new(medium: &'a mut dyn Medium, buffers: &'a mut Buffers, chunk: Chunk, length: u64) -> Self {
        let end = chunk.start.saturating_add(chunk.length).min(length);
        let size_max = length.saturating_mul(UNPACKED_RATIO).clamp(UNPACKED_FREE, UNPACKED_MAX);
        Self { medium, buffers, at: chunk.start, end, codec: chunk.codec, size_max }
    }

    /// Returns the part of the chunk behind the last page.
    pub(crate) fn rest(&self) -> Chunk {
        Chunk { codec: self.codec, start: self.at, length: self.end.saturating_sub(self.at) }
    }

    /// Returns the buffers, with the levels of the last page.
    pub(crate) fn buffers(&self) -> &Buffers {
        self.buffers
    }

    /// Reads the next page with values; `None` at the end.
    ///
    /// # Errors
    /// Returns a description of the damage.
    pub(crate) fn next(&mut self) -> Result<Option<Head>, String> {
        while self.at < self.end {
            let at = self.at;
            let damaged = |text: String| format!("the page at byte {at} {text}");
            let (head, kind) = self.head().map_err(damaged)?;
            if !(matches!(kind, 0 | 3) && head.count > 0 || kind == 2) {
                continue;
            }
            self.body(&head).map_err(damaged)?;
            return Ok(Some(head));
        }
        Ok(None)
    }

    /// Reads the header of a page and its bytes into the buffer of packed bytes. Returns the type of the page too.
    fn head(&mut self) -> Result<(Head, i32), String> {
        let at = self.at;
        let unreadable = |error: std::io::Error| format!("cannot be read: {error}");
        self.medium.seek(SeekFrom::Start(at)).map_err(unreadable)?;
        let packed = &mut self.buffers.packed;
        packed.clear();
        (&mut *self.medium).take(HEAD_MAX.min(self.end - at)).read_to_end(packed).map_err(unreadable)?;
        let damaged = || "has a damaged header".to_owned();
        let (mut head, kind, length) = head(packed).ok_or_else(damaged)?;
        head.at = at;
        let body = at + length as u64;
        if head.packed as u64 > self.end.saturating_sub(body) {
            return Err(format!("has {} bytes, more than the {} left", head.packed, self.end.saturating_sub(body)));
        }
        if head.size as u64 > self.size_max || head.count > PAGE_VALUES_MAX {
            return Err(format!(
                "has {} values in {} bytes, expected at most {PAGE_VALUES_MAX} in {}",
                head.count, head.size, self.size_max
            ));
        }
        self.at = body + head.packed as u64;
        // The bytes behind the header are kept, those that are missing are added.
        packed.drain(..length);
        packed.truncate(head.packed);
        let missing = (head.packed - packed.len()) as u64;
        packed.reserve_exact(head.packed - packed.len());
        (&mut *self.medium).take(missing).read_to_end(packed).map_err(unreadable)?;
        if packed.len() < head.packed {
            return Err("is cut off".to_owned());
        }
        Ok((head, kind))
    }

    /// Decompresses the page into the buffer of plain bytes, unless it is not compressed.
    fn body(&mut self, head: &Head) -> Result<(), String> {
        let buffers = &mut *self.buffers;
        if self.codec == 0 || !head.is_compressed {
            std::mem::swap(&mut buffers.packed, &mut buffers.plain);
            return Ok(());
        }
        // The levels of version 2 are never compressed.
        let levels = head.level_lengths.map_or(0, |[r, d]| r.saturating_add(d));
        let damaged = || "cannot be decompressed".to_owned();
        let (Some((raw, packed)), true) = (buffers.packed.split_at_checked(levels), levels <= head.size) else {
            return Err(damaged());
        };
        let plain = &mut buffers.plain;
        plain.resize(head.size, 0);
        let Some((start, rest)) = plain.split_at_mut_checked(levels) else { return Err(damaged()) };
        start.copy_from_slice(raw);
        let count = match self.codec {
            _ if rest.is_empty() => Some(0),
            1 => snappy(packed, rest),
            2 => gzip(packed, rest),
            7 => lz4_flex::block::decompress_into(packed, rest).ok(),
            _ => {
                if buffers.zstd.is_none() {
                    buffers.zstd = zstd::bulk::Decompressor::new().ok();
                }
                buffers.zstd.as_mut().and_then(|zstd| zstd.decompress_to_buffer(packed, rest).ok())
            }
        };
        (count == Some(rest.len())).then_some(()).ok_or_else(damaged)
    }

    /// Returns the bytes of the last page, if it is a dictionary.
    pub(crate) fn dictionary(&self) -> &[u8] {
        &self.buffers.plain
    }

    /// Reads the levels of the last page. Returns the number of values that are present, and the place of their bytes in the
    /// buffer of [`Pages::dictionary`]; `None` if the page is damaged.
    pub(crate) fn levels(&mut self, head: &Head, levels: Levels) -> Option<(usize, usize)> {
        let Buffers { plain, repetitions, definitions, .. } = &mut *self.buffers;
        let mut rest = &plain[..];
        repetitions.clear();
        definitions.clear();
        let places = head.level_lengths.map_or([None, None], |lengths| lengths.map(Some));
        let [repetition_place, definition_place] = places;
        if levels.repeats || repetition_place.is_some_and(|length| length > 0) {
            let bytes = level_bytes(&mut rest, repetition_place, head.level_encodings[1])?;
            if levels.repeats {
                read_levels(bytes, 1, head.count, repetitions)?;
            }
        }
        let mut present = head.count;
        if levels.present > 0 || definition_place.is_some_and(|length| length > 0) {
            let bytes = level_bytes(&mut rest, definition_place, head.level_encodings[0])?;
            if levels.present > 0 {
                read_levels(bytes, levels.present, head.count, definitions)?;
                present = definitions.iter().filter(|&&level| level == levels.present).count();
                if present == head.count && !levels.repeats {
                    definitions.clear();
                }
            }
        }
        Some((present, plain.len() - rest.len()))
    }
}

/// Takes the bytes of levels: `length` in version 2, a length of 4 bytes and as many bytes in version 1.
fn level_bytes<'a>(rest: &mut &'a [u8], length: Option<usize>, encoding: i32) -> Option<&'a [u8]> {
    let length = match length {
        Some(length) => length,
        None => {
            let (length, after) = rest.split_first_chunk()?;
            *rest = after;
            // Levels of version 1 in the old encoding of packed bits have no length.
            (encoding == 3).then_some(())?;
            usize::try_from(u32::from_le_bytes(*length)).ok()?
        }
    };
    let (bytes, after) = rest.split_at_checked(length)?;
    *rest = after;
    Some(bytes)
}

fn read_levels(bytes: &[u8], largest: u8, count: usize, out: &mut Vec<u8>) -> Option<()> {
    let mut push = |level: u32, n: usize| {
        let level = u8::try_from(level).ok().filter(|&level| level <= largest)?;
        out.extend(std::iter::repeat_n(level, n));
        Some(())
    };
    hybrid(bytes, u8::BITS - largest.leading_zeros(), count, &mut push)
}

fn snappy(packed: &[u8], out: &mut [u8]) -> Option<usize> {
    snap::raw::Decoder::new().decompress(packed, out).ok()
}

fn gzip(packed: &[u8], mut out: &mut [u8]) -> Option<usize> {
    let mut reader = flate2::read::MultiGzDecoder::new(packed);
    let mut count = 0;
    while !out.is_empty() {
        let n = reader.read(out).ok().filter(|&n| n > 0)?;
        count += n;
        out = out.get_mut(n..)?;
    }
    Some(count)
}

/// Reads the header of a page. Returns its type and its length too.
fn head(bytes: &[u8]) -> Option<(Head, i32, usize)> {
    let mut head = Head { is_compressed: true, ..Head::default() };
    let (mut page, mut size, mut packed) = (None, None, None);
    let unsigned = |t: &mut Thrift| usize::try_from(t.small()?).ok();
    let mut thrift = Thrift::new(bytes);
    thrift.structure(|t, number, kind| {
        match (number, kind) {
            (1, kind::I32) => page = Some(t.small()?),
            (2, kind::I32) => size = Some(unsigned(t)?),
            (3, kind::I32) => packed = Some(unsigned(t)?),
            (5 | 7, kind::STRUCT) => t.structure(|t, number, kind| {
                match (number, kind) {
                    (1, kind::I32) => head.count = unsigned(t)?,
                    (2, kind::I32) => head.encoding = t.small()?,
                    (3, kind::I32) => head.level_encodings[0] = t.small()?,
                    (4, kind::I32) => head.level_encodings[1] = t.small()?,
                    _ => return Some(false),
                }
                Some(true)
            })?,
            (8, kind::STRUCT) => {
                let mut lengths = [0; 2];
                t.structure(|t, number, kind| {
                    match (number, kind) {
                        (1, kind::I32) => head.count = unsigned(t)?,
                        (4, kind::I32) => head.encoding = t.small()?,
                        (5, kind::I32) => lengths[1] = unsigned(t)?,
                        (6, kind::I32) => lengths[0] = unsigned(t)?,
                        (7, kind::FALSE) => head.is_compressed = false,
                        _ => return Some(false),
                    }
                    Some(kind != kind::FALSE)
                })?;
                head.level_lengths = Some(lengths);
            }
            _ => return Some(false),
        }
        Some(true)
    })?;
    let page = page?;
    (head.size, head.packed, head.is_dictionary) = (size?, packed?, page == 2);
    Some((head, page, thrift.at()))
}
