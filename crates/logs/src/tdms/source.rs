//! Metadata of the segments of TDMS files.

use super::super::window::Window;
use super::kind::{Kind, numbers, times};
use motorfit_core::{Error, Result};

/// Length of the longest text of a property that is kept \[bytes\].
const TEXT_MAX: u32 = 256;
pub(super) const COPY_AGAIN: &str = "Copy the file again, or save it again in LabVIEW.";

/// Value of a property.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Number(f64),
    Text(String),
    /// Counts of 2⁻⁶⁴ s since the start of 1904.
    Time(i128),
}

/// Layout of the raw data of an object in each chunk of a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Index {
    pub kind: Kind,
    /// Number of values.
    pub count: u64,
    /// Length of the values \[bytes\].
    pub bytes: u64,
}

/// Metadata of a segment.
pub(super) struct Source<'w> {
    pub window: &'w mut Window,
    /// Position of the next byte.
    pub at: u64,
    /// Position after the last byte.
    pub end: u64,
    pub big_endian: bool,
    /// Position of the segment, for messages.
    pub segment: u64,
}

impl Source<'_> {
    /// Returns the error for damaged metadata.
    pub(super) fn damaged(&self, what: &str) -> Error {
        Error::data(format!("the segment at byte {} {what}", self.segment), COPY_AGAIN)
    }

    /// Advances by a number of bytes and returns their position.
    pub(super) fn skip(&mut self, count: u64) -> Result<u64> {
        let at = self.at;
        self.at = at.checked_add(count).filter(|end| *end <= self.end).ok_or_else(|| {
            self.damaged(&format!("has metadata of more than the {} bytes that it declares", self.end - self.segment))
        })?;
        Ok(at)
    }

    pub(super) fn bytes(&mut self, count: u32) -> Result<&[u8]> {
        let at = self.skip(u64::from(count))?;
        self.window.get(at, usize::try_from(count).unwrap_or(usize::MAX))
    }

    pub(super) fn u32(&mut self) -> Result<u32> {
        let big_endian = self.big_endian;
        let bytes = self.bytes(4)?.first_chunk().copied().unwrap_or_default();
        Ok(if big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    fn u64(&mut self) -> Result<u64> {
        let big_endian = self.big_endian;
        let bytes = self.bytes(8)?.first_chunk().copied().unwrap_or_default();
        Ok(if big_endian { u64::from_be_bytes(bytes) } else { u64::from_le_bytes(bytes) })
    }

    /// Reads the value of a property; `None` for a type that is not used, or a long text.
    pub(super) fn value(&mut self, kind: Kind) -> Result<Option<Value>> {
        let big_endian = self.big_endian;
        if kind == Kind::Text {
            let length = self.u32()?;
            if length > TEXT_MAX {
                return self.skip(u64::from(length)).map(|_| None);
            }
            let text = String::from_utf8_lossy(self.bytes(length)?).into_owned();
            return Ok(Some(Value::Text(text)));
        }
        let bytes = self.bytes(u32::from(kind.size()))?;
        if kind == Kind::Time {
            return Ok(times(big_endian, bytes).next().map(Value::Time));
        }
        let mut number = Vec::new();
        numbers(kind, big_endian, bytes, &mut number);
        Ok(number.pop().map(Value::Number))
    }

    /// Reads a layout with its type, dimension and number of values.
    pub(super) fn index(&mut self) -> Result<Index> {
        let code = self.u32()?;
        let dimension = self.u32()?;
        let count = self.u64()?;
        if dimension != 1 {
            return Err(self.damaged(&format!("holds values of {dimension} dimensions, expected 1")));
        }
        let kind = match Kind::of(code) {
            Some(kind) => kind,
            None if count == 0 => Kind::Void,
            None => {
                let what = format!("holds values of the type {code:#x}, which is not supported");
                return Err(Error::data(self.damaged(&what).to_string(), "Save the channels as DBL in LabVIEW."));
            }
        };
        let count = if kind == Kind::Void { 0 } else { count };
        let bytes = match kind {
            Kind::Text => self.u64()?,
            kind => count
                .checked_mul(u64::from(kind.size()))
                .ok_or_else(|| self.damaged(&format!("declares {count} values, which is impossible")))?,
        };
        Ok(Index { kind, count, bytes })
    }

    /// Reads a layout of an acquisition card, whose data are left out.
    pub(super) fn daqmx_index(&mut self, header: u32) -> Result<Index> {
        self.skip(8)?;
        let count = self.u64()?;
        let scalers = u64::from(self.u32()?);
        self.skip(scalers * if header == 0x1269 { 20 } else { 17 })?;
        let widths = u64::from(self.u32()?);
        self.skip(widths * 4)?;
        Ok(Index { kind: Kind::Daqmx, count, bytes: 0 })
    }
}
