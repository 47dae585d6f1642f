//! The compact protocol of Thrift, as far as footers and page headers of Parquet files use it.

/// Largest depth of nested structures and lists.
const DEPTH_MAX: u32 = 32;

/// Types of fields and of elements of lists.
pub(crate) mod kind {
    pub(crate) const TRUE: u8 = 1;
    pub(crate) const FALSE: u8 = 2;
    pub(crate) const BYTE: u8 = 3;
    pub(crate) const I16: u8 = 4;
    pub(crate) const I32: u8 = 5;
    pub(crate) const I64: u8 = 6;
    pub(crate) const DOUBLE: u8 = 7;
    pub(crate) const BINARY: u8 = 8;
    pub(crate) const LIST: u8 = 9;
    pub(crate) const SET: u8 = 10;
    pub(crate) const MAP: u8 = 11;
    pub(crate) const STRUCT: u8 = 12;
    pub(crate) const UUID: u8 = 13;
}

/// Bytes in the compact protocol and the place up to which they are read.
///
/// Functions return `None` where the bytes end or do not follow the protocol.
pub(crate) struct Thrift<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Thrift<'a> {
    /// Starts at the first byte.
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Returns the number of bytes read.
    pub(crate) fn at(&self) -> usize {
        self.at
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let end = self.at.checked_add(count)?;
        let bytes = self.bytes.get(self.at..end)?;
        self.at = end;
        Some(bytes)
    }

    /// Reads one byte.
    pub(crate) fn byte(&mut self) -> Option<u8> {
        self.take(1)?.first().copied()
    }

    /// Reads an unsigned number of at most 64 bits, 7 bits per byte.
    fn varint(&mut self) -> Option<u64> {
        let (value, length) = varint(self.bytes.get(self.at..)?)?;
        self.at += length;
        Some(value)
    }

    /// Reads a signed number.
    pub(crate) fn whole(&mut self) -> Option<i64> {
        self.varint().map(unzigzag)
    }

    /// Reads a signed number of 32 bits.
    pub(crate) fn small(&mut self) -> Option<i32> {
        self.whole().and_then(|value| i32::try_from(value).ok())
    }

    /// Reads bytes that follow their number.
    pub(crate) fn binary(&mut self) -> Option<&'a [u8]> {
        let count = usize::try_from(self.varint()?).ok()?;
        self.take(count)
    }

    /// Reads the type and the number of elements of a list. Each element has at least one byte, so that a wrong number ends with
    /// the bytes.
    fn list(&mut self) -> Option<(u8, usize)> {
        let head = self.byte()?;
        let count = match head >> 4 {
            15 => usize::try_from(self.varint()?).ok()?,
            count => usize::from(count),
        };
        Some((head & 15, count))
    }

    /// Reads a list of structures: calls `element` for each.
    pub(crate) fn structures<T>(&mut self, mut element: impl FnMut(&mut Self) -> Option<T>) -> Option<Vec<T>> {
        let (kind, count) = self.list()?;
        if kind != kind::STRUCT && count > 0 {
            return None;
        }
        (0..count).map(|_| element(self)).collect()
    }

    /// Reads a structure: calls `field` with the number and the type of each field. It reads the field and returns true, or
    /// returns false to leave it out.
    pub(crate) fn structure(&mut self, mut field: impl FnMut(&mut Self, i16, u8) -> Option<bool>) -> Option<()> {
        let mut number: i16 = 0;
        loop {
            let head = self.byte()?;
            let kind = head & 15;
            if kind == 0 {
                return Some(());
            }
            number = match head >> 4 {
                0 => i16::try_from(self.whole()?).ok()?,
                step => number.checked_add(i16::from(step))?,
            };
            if !field(self, number, kind)? {
                self.skip(kind, DEPTH_MAX)?;
            }
        }
    }

    /// Skips a value of a type.
    fn skip(&mut self, kind: u8, depth: u32) -> Option<()> {
        let depth = depth.checked_sub(1)?;
        match kind {
            kind::TRUE | kind::FALSE => Some(()),
            kind::BYTE => self.byte().map(drop),
            kind::I16 | kind::I32 | kind::I64 => self.varint().map(drop),
            kind::DOUBLE => self.take(8).map(drop),
            kind::BINARY => self.binary().map(drop),
            kind::UUID => self.take(16).map(drop),
            kind::LIST | kind::SET => {
                let (kind, count) = self.list()?;
                (0..count).try_for_each(|_| self.skip_element(kind, depth))
            }
            kind::MAP => {
                let count = usize::try_from(self.varint()?).ok()?;
                let kinds = if count == 0 { 0 } else { self.byte()? };
                (0..count).try_for_each(|_| {
                    self.skip_element(kinds >> 4, depth)?;
                    self.skip_element(kinds & 15, depth)
                })
            }
            kind::STRUCT => loop {
                let head = self.byte()?;
                if head & 15 == 0 {
                    return Some(());
                }
                if head >> 4 == 0 {
                    self.varint()?;
                }
                self.skip(head & 15, depth)?;
            },
            _ => None,
        }
    }

    /// Skips an element of a list; unlike a field, a boolean has a byte of its own there.
    fn skip_element(&mut self, kind: u8, depth: u32) -> Option<()> {
        match kind {
            kind::TRUE | kind::FALSE => self.byte().map(drop),
            kind => self.skip(kind, depth),
        }
    }
}

/// Returns an unsigned number of at most 64 bits and the number of its bytes.
pub(crate) fn varint(bytes: &[u8]) -> Option<(u64, usize)> {
    let mut value = 0;
    for (n, &byte) in bytes.iter().take(10).enumerate() {
        value |= u64::from(byte & 0x7f) << (7 * n);
        if byte & 0x80 == 0 {
            return Some((value, n + 1));
        }
    }
    None
}

/// Returns the signed number that is stored as an unsigned one: 0, -1, 1, -2 and so on.
pub(crate) fn unzigzag(value: u64) -> i64 {
    (value >> 1).cast_signed() ^ -((value & 1).cast_signed())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn structures_are_read_and_other_fields_skipped() {
        // Field 1: -3; field 2, left out: a list of two structures with a boolean each; field 18: two bytes.
        let bytes = [0x15, 5, 0x19, 0x2c, 0x11, 0, 0x12, 0, 0x08, 36, 2, 7, 8, 0, 99];
        let (mut number, mut binary) = (0, &[][..]);
        let mut thrift = Thrift::new(&bytes);
        let read = thrift.structure(|t, n, kind| {
            match (n, kind) {
                (1, kind::I32) => number = t.small()?,
                (18, kind::BINARY) => binary = t.binary()?,
                _ => return Some(false),
            }
            Some(true)
        });
        assert_eq!((read, thrift.at(), number, binary), (Some(()), 14, -3, &[7, 8][..]));
    }

    #[test]
    fn damaged_bytes_are_refused() {
        let read = |bytes: &[u8]| Thrift::new(bytes).structure(|_, _, _| Some(false));
        // A list of 2^34 booleans, an endless number, lists within lists, and nothing.
        assert_eq!(read(&[0x19, 0xf1, 0x80, 0x80, 0x80, 0x80, 0x40, 0, 0]), None);
        assert_eq!(read(&[0x16, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 1, 0]), None);
        assert_eq!(read(&[[0x19].as_slice(), &[0x19; 40], &[0x13, 7], &[0]].concat()), None);
        assert_eq!(read(&[[0x19].as_slice(), &[0x19; 30], &[0x13, 7], &[0]].concat()), Some(()));
        assert_eq!(read(&[]), None);
    }
}
