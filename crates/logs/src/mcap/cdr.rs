//! Messages in the Common Data Representation (CDR), the encoding of ROS 2.
//!
//! Four bytes of encapsulation name byte order and variant. In the data after them, a number is aligned to a multiple of its
//! size, but in variant 2 (XCDR2) to at most 4 bytes. A text starts with its length and ends with a zero; a sequence starts
//! with its number of elements.

use super::limits::ELEMENTS_MAX;
use super::schema::{Kind, Member, Number, Schema, Shape};
use super::tree::{At, Tree};
use std::fmt;

/// Reason for which the rest of a message cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    /// The message ends within a member.
    Short,
    /// Encapsulation that is not supported.
    Encapsulation(u16),
    /// The text is not a JSON value.
    Json,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Short => f.write_str("shorter than the definition"),
            Self::Encapsulation(kind) => {
                write!(f, "encapsulation {kind:#06x}, expected 0x0000, 0x0001, 0x0006 or 0x0007")
            }
            Self::Json => f.write_str("not valid JSON"),
        }
    }
}

/// End of the part of a message that can be read.
enum End {
    Fault(Fault),
    /// Everything after a wide string is passed over.
    WideText,
}

/// Data of a message after its encapsulation.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
    align_max: usize,
}

impl<'a> Cursor<'a> {
    fn new(message: &'a [u8]) -> Result<Self, Fault> {
        let Some((&[high, low, _, _], bytes)) = message.split_first_chunk::<4>() else { return Err(Fault::Short) };
        let (big_endian, align_max) = match (high, low) {
            (0, 0) => (true, 8),
            (0, 1) => (false, 8),
            // 0x10 and 0x11 are numbers of early versions of XCDR2.
            (0, 6 | 0x10) => (true, 4),
            (0, 7 | 0x11) => (false, 4),
            _ => return Err(Fault::Encapsulation(u16::from_be_bytes([high, low]))),
        };
        Ok(Self { bytes, at: 0, big_endian, align_max })
    }

    fn align(&mut self, size: usize) {
        self.at = self.at.next_multiple_of(size.clamp(1, self.align_max));
    }

    /// Returns the next `count` bytes.
    fn bytes(&mut self, count: usize) -> Result<&'a [u8], End> {
        let found = self.bytes.get(self.at..).and_then(|rest| rest.get(..count)).ok_or(End::Fault(Fault::Short))?;
        self.at += count;
        Ok(found)
    }

    fn chunk<const N: usize>(&mut self) -> Result<[u8; N], End> {
        self.align(N);
        let mut chunk = *self.bytes(N)?.first_chunk::<N>().ok_or(End::Fault(Fault::Short))?;
        if self.big_endian {
            chunk.reverse();
        }
        Ok(chunk)
    }

    fn count(&mut self) -> Result<usize, End> {
        self.chunk().map(|chunk| u32::from_le_bytes(chunk) as usize)
    }

    fn text(&mut self) -> Result<&'a [u8], End> {
        let length = self.count()?;
        let text = self.bytes(length)?;
        Ok(text.strip_suffix(&[0]).unwrap_or(text))
    }

    #[expect(clippy::cast_precision_loss, reason = "a column has numbers of 64 bits")]
    fn number(&mut self, number: Number) -> Result<f64, End> {
        Ok(match number {
            Number::Bool => f64::from(u8::from(self.chunk::<1>()? != [0])),
            Number::I8 => i8::from_le_bytes(self.chunk()?).into(),
            Number::U8 => u8::from_le_bytes(self.chunk()?).into(),
            Number::I16 => i16::from_le_bytes(self.chunk()?).into(),
            Number::U16 => u16::from_le_bytes(self.chunk()?).into(),
            Number::I32 => i32::from_le_bytes(self.chunk()?).into(),
            Number::U32 => u32::from_le_bytes(self.chunk()?).into(),
            Number::I64 => i64::from_le_bytes(self.chunk()?) as f64,
            Number::U64 => u64::from_le_bytes(self.chunk()?) as f64,
            Number::F32 => f32::from_le_bytes(self.chunk()?).into(),
            Number::F64 => f64::from_le_bytes(self.chunk()?),
        })
    }

    /// Passes over the size that XCDR2 writes before an array of texts or structures.
    fn delimiter(&mut self) -> Result<(), End> {
        if self.align_max == 4 { self.count().map(|_| ()) } else { Ok(()) }
    }

    /// Passes over `count` numbers.
    fn skip(&mut self, number: Number, count: usize) -> Result<(), End> {
        if count > 0 {
            self.align(number.size());
            self.bytes(count.saturating_mul(number.size()))?;
        }
        Ok(())
    }
}

/// Reads the numbers of a message into the row of a tree.
///
/// # Errors
/// Returns the reason if the message ends early or is not understood; the numbers before that are in the row.
pub(super) fn read(schema: &Schema, message: &[u8], tree: &mut Tree) -> Result<(), Fault> {
    finished(Reader { schema, cursor: Cursor::new(message)?, tree }.structure(0, Some(0)))
}

/// Reads a message of `sensor_msgs/msg/JointState`, in which the elements of arrays belong to named joints.
///
/// # Errors
/// Returns the reason if the message ends early or is not understood.
pub(super) fn read_joints(schema: &Schema, message: &[u8], tree: &mut Tree) -> Result<(), Fault> {
    finished(Reader { schema, cursor: Cursor::new(message)?, tree }.joints())
}

fn finished(read: Result<(), End>) -> Result<(), Fault> {
    match read {
        Ok(()) | Err(End::WideText) => Ok(()),
        Err(End::Fault(fault)) => Err(fault),
    }
}

/// Returns the time in the header at the start of a message \[ns\]; `None` if it is zero or not a time.
pub(super) fn stamp(message: &[u8]) -> Option<u64> {
    let mut cursor = Cursor::new(message).ok()?;
    let seconds = i32::from_le_bytes(cursor.chunk().ok()?);
    let nanoseconds = u32::from_le_bytes(cursor.chunk().ok()?);
    let stamp = u64::try_from(seconds).ok()? * 1_000_000_000 + u64::from(nanoseconds);
    (nanoseconds < 1_000_000_000 && stamp > 0).then_some(stamp)
}

struct Reader<'a> {
    schema: &'a Schema,
    cursor: Cursor<'a>,
    tree: &'a mut Tree,
}

impl Reader<'_> {
    /// Reads a structure. The definition has no recursion, so that the depth is limited.
    fn structure(&mut self, structure: usize, at: At) -> Result<(), End> {
        let schema = self.schema;
        let members = schema.members(structure);
        if members.is_empty() {
            // ROS 2 gives an empty structure one byte.
            self.cursor.bytes(1)?;
        }
        for (index, member) in members.iter().enumerate() {
            let at = self.tree.member(at, index, &member.name);
            self.member(member, at)?;
        }
        Ok(())
    }

    fn member(&mut self, member: &Member, at: At) -> Result<(), End> {
        if member.shape != Shape::One && !matches!(member.kind, Kind::Number(_)) {
            self.cursor.delimiter()?;
        }
        let count = match member.shape {
            Shape::One => return self.value(member.kind, at),
            Shape::Fixed(count) => count,
            Shape::Sequence => self.cursor.count()?,
        };
        let is_text = matches!(member.kind, Kind::Text | Kind::WideText);
        let at = if is_text { None } else { self.tree.array(at, count) };
        if let (Kind::Number(number), None) = (member.kind, at) {
            return self.cursor.skip(number, count);
        }
        for index in 0..count {
            let element = self.tree.element(at, index);
            self.value(member.kind, element)?;
        }
        Ok(())
    }

    fn value(&mut self, kind: Kind, at: At) -> Result<(), End> {
        match kind {
            Kind::Number(number) => {
                let value = self.cursor.number(number)?;
                self.tree.number(at, value);
                Ok(())
            }
            Kind::Text => self.cursor.text().map(|_| ()),
            Kind::WideText => Err(End::WideText),
            Kind::Structure(structure) => self.structure(structure, at),
        }
    }

    fn joints(&mut self) -> Result<(), End> {
        let schema = self.schema;
        let [header, name, numbers @ ..] = schema.members(0) else { return Ok(()) };
        let at = self.tree.member(Some(0), 0, &header.name);
        self.member(header, at)?;
        self.tree.member(Some(0), 1, &name.name);
        self.cursor.delimiter()?;
        let count = self.cursor.count()?;
        let mut names = Vec::new();
        for index in 0..count {
            let name = self.cursor.text()?;
            if index < ELEMENTS_MAX {
                names.push(std::str::from_utf8(name).unwrap_or_default());
            }
        }
        for (index, member) in numbers.iter().enumerate() {
            let at = self.tree.member(Some(0), index + 2, &member.name);
            let count = self.cursor.count()?;
            let at = self.tree.array(at, count);
            if at.is_none() {
                self.cursor.skip(Number::F64, count)?;
                continue;
            }
            for index in 0..count {
                let value = self.cursor.number(Number::F64)?;
                // A joint without a name has its number.
                let joint = match names.get(index) {
                    Some(name) if !name.is_empty() => self.tree.joint(at, name),
                    _ => self.tree.joint(at, &index.to_string()),
                };
                self.tree.number(joint, value);
            }
        }
        Ok(())
    }
}
