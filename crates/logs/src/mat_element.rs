//! Data elements of a MAT-file of level 5.
//!
//! After its header of 128 bytes, a file consists of elements: a tag with type and length, then the data, padded to a multiple
//! of 8 bytes. In a short element up to 4 bytes of data are inside the tag.

use flate2::read::ZlibDecoder;
use motorfit_core::numeric::{count_u64, real};
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use std::io::Read as _;

const CUT_OFF: &str = "Copy the file again, or save it again: save('file.mat','-v7').";

/// Type of a compressed element.
pub(crate) const COMPRESSED: u32 = 15;
/// Type of an element with an array.
pub(crate) const MATRIX: u32 = 14;

/// Returns the error for a damaged file.
pub(crate) fn damaged(what: impl Into<String>) -> Error {
    Error::data(format!("the file is damaged: {}", what.into()), CUT_OFF)
}

/// Decompresses an element; `left` is the remaining number of bytes of `unpacked_max`, from which its size is subtracted.
///
/// # Errors
/// Returns a `Data` error if the data are damaged or exceed `left`.
pub(crate) fn unpacked(data: &[u8], left: &mut u64, unpacked_max: u64) -> Result<Vec<u8>> {
    let mut unpacked = Vec::new();
    let read = ZlibDecoder::new(data).take(*left + 1).read_to_end(&mut unpacked);
    let count = unpacked.len() as u64;
    *left = left.checked_sub(count).ok_or_else(|| {
        let message = format!("the variables unpack to more than {unpacked_max} bytes");
        Error::data(message, "Save fewer variables, or cut the recording.")
    })?;
    read.map_err(|e| damaged(format!("a compressed variable cannot be decompressed: {e}")))?;
    Ok(unpacked)
}

/// The elements of a file or of an array.
#[derive(Clone, Copy)]
pub(crate) struct Elements<'a> {
    pub bytes: &'a [u8],
    pub big_endian: bool,
}

impl<'a> Elements<'a> {
    /// Returns the 32-bit word at byte `at`.
    pub fn word(&self, at: usize) -> Option<u32> {
        let word = self.bytes.get(at..)?.first_chunk::<4>()?;
        Some(if self.big_endian { u32::from_be_bytes(*word) } else { u32::from_le_bytes(*word) })
    }

    /// Returns type and data of the next element; `None` at the end.
    ///
    /// # Errors
    /// Returns a `Data` error if the element is incomplete.
    pub fn next(&mut self) -> Result<Option<(u32, &'a [u8])>> {
        if self.bytes.is_empty() {
            return Ok(None);
        }
        let cut = |expected: usize, found: usize| {
            damaged(format!("found {found} bytes, expected {expected}; was it cut off?"))
        };
        let (Some(first), Some(second)) = (self.word(0), self.word(4)) else { return Err(cut(8, self.bytes.len())) };
        let (kind, start, length) =
            if first >> 16 == 0 { (first, 8, second) } else { (first & 0xffff, 4, first >> 16) };
        let length = length as usize;
        if start == 4 && length > 4 {
            return Err(damaged(format!("a short element has {length} bytes, expected at most 4")));
        }
        let inside = &self.bytes[start..];
        let data = inside.get(..length).ok_or_else(|| cut(length, inside.len()))?;
        let filled = if start == 4 || kind == COMPRESSED { length } else { length.next_multiple_of(8) };
        let next = if start == 4 { 8 } else { filled.saturating_add(8) };
        self.bytes = self.bytes.get(next..).unwrap_or_default();
        Ok(Some((kind, data)))
    }

    /// Returns type and data of the next element.
    ///
    /// # Errors
    /// Returns a `Data` error if there is none or it is incomplete; `what` is the missing part of the variable `name`.
    pub fn part(&mut self, name: &str, what: &str) -> Result<(u32, &'a [u8])> {
        self.next()?.ok_or_else(|| damaged(format!("variable \"{}\" has no {what}", excerpt(name))))
    }

    /// Returns the numbers of an element as `f64`; `None` if there are not exactly `count` or the type is not numeric.
    pub fn numbers(&self, kind: u32, data: &[u8], count: usize) -> Option<Vec<f64>> {
        type Of<'a> = (&'a [u8], usize, bool);
        fn all<const N: usize>((data, count, big): Of<'_>, value: impl Fn([u8; N]) -> f64) -> Option<Vec<f64>> {
            let (chunks, rest) = data.as_chunks::<N>();
            let ordered = |chunk: &[u8; N]| {
                let mut chunk = *chunk;
                if big {
                    chunk.reverse();
                }
                value(chunk)
            };
            (rest.is_empty() && chunks.len() == count).then(|| chunks.iter().map(ordered).collect())
        }
        let data = (data, count, self.big_endian);
        match kind {
            1 => all(data, |b| i8::from_le_bytes(b).into()),
            2 => all(data, |b| u8::from_le_bytes(b).into()),
            3 => all(data, |b| i16::from_le_bytes(b).into()),
            4 => all(data, |b| u16::from_le_bytes(b).into()),
            5 => all(data, |b| i32::from_le_bytes(b).into()),
            6 => all(data, |b| u32::from_le_bytes(b).into()),
            7 => all(data, |b| f32::from_le_bytes(b).into()),
            9 => all(data, f64::from_le_bytes),
            12 => all(data, |b| real(i64::from_le_bytes(b))),
            13 => all(data, |b| count_u64(u64::from_le_bytes(b))),
            _ => None,
        }
    }
}

/// Returns the text of an element without zeros at its end.
pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim_end_matches('\0').to_owned()
}
