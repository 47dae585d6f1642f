//! Footers of Parquet files: the schema and the places of the columns.

use super::thrift::{Thrift, kind};

/// A node of the schema, in the order of a depth-first traversal.
#[derive(Debug, Default)]
pub(crate) struct Node {
    /// Name of the node.
    pub(crate) name: String,
    /// Number of the physical type; `None` for a group.
    pub(crate) physical: Option<i32>,
    /// Number of bytes of a value of fixed length.
    pub(crate) length: i32,
    /// Repetition: required (0), optional (1) or repeated (2).
    pub(crate) repetition: i32,
    /// Number of children.
    pub(crate) children: usize,
    /// Meaning of the values.
    pub(crate) meaning: Meaning,
    /// Number of the converted type, which older files have for the meaning.
    pub(crate) converted: Option<i32>,
}

/// Meaning of the values of a node.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) enum Meaning {
    /// Numbers as they are.
    #[default]
    Plain,
    /// Whole numbers without sign.
    Unsigned,
    /// Whole numbers over a power of ten.
    Decimal(i32),
    /// Points in time, with the number of counts per second.
    Timestamp(f64),
    /// Times of day, with the number of counts per second.
    Clock(f64),
    /// Numbers of 16 bits.
    Half,
    /// Lists.
    List,
    /// Maps.
    Map,
    /// Values that are not numbers, with their name in the plural.
    Other(&'static str),
}

/// A part of the rows.
#[derive(Debug, Default)]
pub(crate) struct Group {
    /// Number of rows.
    pub(crate) rows: u64,
    /// The columns, as many as the schema has leaves.
    pub(crate) chunks: Vec<Chunk>,
}

/// The pages of a column in a row group.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Chunk {
    /// Number of the compression.
    pub(crate) codec: i32,
    /// Place of the first page \[bytes\].
    pub(crate) start: u64,
    /// Length of all pages \[bytes\].
    pub(crate) length: u64,
}

/// Contents of a footer.
#[derive(Debug, Default)]
pub(crate) struct Footer {
    /// Nodes of the schema; the first one is the root.
    pub(crate) nodes: Vec<Node>,
    /// Row groups.
    pub(crate) groups: Vec<Group>,
}

impl Footer {
    /// Reads a footer; `Err` has the place of the damage.
    pub(crate) fn read(bytes: &[u8]) -> Result<Self, usize> {
        let mut thrift = Thrift::new(bytes);
        let mut footer = Self::default();
        let read = thrift.structure(|t, number, kind| {
            match (number, kind) {
                (2, kind::LIST) => footer.nodes = t.structures(node)?,
                (4, kind::LIST) => footer.groups = t.structures(group)?,
                _ => return Some(false),
            }
            Some(true)
        });
        read.map(|()| footer).ok_or(thrift.at())
    }
}

fn node(thrift: &mut Thrift) -> Option<Node> {
    let mut node = Node::default();
    let (mut logical, mut scale) = (None, 0);
    thrift.structure(|t, number, kind| {
        match (number, kind) {
            (1, kind::I32) => node.physical = Some(t.small()?),
            (2, kind::I32) => node.length = t.small()?,
            (3, kind::I32) => node.repetition = t.small()?,
            (4, kind::BINARY) => node.name = String::from_utf8_lossy(t.binary()?).into_owned(),
            (5, kind::I32) => node.children = usize::try_from(t.small()?).ok()?,
            (6, kind::I32) => node.converted = Some(t.small()?),
            (7, kind::I32) => scale = t.small()?,
            (10, kind::STRUCT) => logical = logical_type(t)?,
            _ => return Some(false),
        }
        Some(true)
    })?;
    let converted = node.converted.map_or(Meaning::Plain, |number| converted_type(number, scale));
    node.meaning = logical.unwrap_or(converted);
    Some(node)
}

/// Reads a logical type; `None` within if it is unknown.
fn logical_type(thrift: &mut Thrift) -> Option<Option<Meaning>> {
    let mut meaning = None;
    thrift.structure(|t, number, kind| {
        meaning = match (number, kind) {
            (1, _) => Some(Meaning::Other("texts")),
            (2, _) => Some(Meaning::Map),
            (3, _) => Some(Meaning::List),
            (4, _) => Some(Meaning::Other("names of categories")),
            (5, kind::STRUCT) => {
                let mut scale = 0;
                t.structure(|t, number, kind| {
                    let is_scale = (number, kind) == (1, kind::I32);
                    if is_scale {
                        scale = t.small()?;
                    }
                    Some(is_scale)
                })?;
                meaning = Some(Meaning::Decimal(scale));
                return Some(true);
            }
            (6, _) => Some(Meaning::Other("dates")),
            (7 | 8, kind::STRUCT) => {
                let per_second = time_unit(t)?;
                meaning = Some(if number == 7 { Meaning::Clock(per_second) } else { Meaning::Timestamp(per_second) });
                return Some(true);
            }
            (10, kind::STRUCT) => {
                let mut signed = true;
                t.structure(|_, number, kind| {
                    if number == 2 {
                        signed = kind == kind::TRUE;
                    }
                    Some(false)
                })?;
                meaning = Some(if signed { Meaning::Plain } else { Meaning::Unsigned });
                return Some(true);
            }
            (11, _) => Some(Meaning::Plain),
            (12 | 13, _) => Some(Meaning::Other("documents")),
            (14, _) => Some(Meaning::Other("identifiers")),
            (15, _) => Some(Meaning::Half),
            _ => Some(Meaning::Other("values of an unknown type")),
        };
        Some(false)
    })?;
    Some(meaning)
}

/// Reads the type of a time and returns the number of its counts per second.
fn time_unit(thrift: &mut Thrift) -> Option<f64> {
    let mut per_second = None;
    thrift.structure(|t, number, kind| {
        if (number, kind) != (2, kind::STRUCT) {
            return Some(false);
        }
        t.structure(|_, number, _| {
            per_second = match number {
                1 => Some(1e3),
                2 => Some(1e6),
                3 => Some(1e9),
                _ => None,
            };
            Some(false)
        })?;
        Some(true)
    })?;
    per_second
}

/// Returns the meaning of a converted type, which files before logical types have.
fn converted_type(number: i32, scale: i32) -> Meaning {
    match number {
        1 | 2 => Meaning::Map,
        3 => Meaning::List,
        5 => Meaning::Decimal(scale),
        6 => Meaning::Other("dates"),
        7 => Meaning::Clock(1e3),
        8 => Meaning::Clock(1e6),
        9 => Meaning::Timestamp(1e3),
        10 => Meaning::Timestamp(1e6),
        11..=14 => Meaning::Unsigned,
        15..=18 => Meaning::Plain,
        0 | 4 => Meaning::Other("texts"),
        21 => Meaning::Other("durations in months, days and milliseconds"),
        _ => Meaning::Other("documents"),
    }
}

fn group(thrift: &mut Thrift) -> Option<Group> {
    let mut group = Group::default();
    thrift.structure(|t, number, kind| {
        match (number, kind) {
            (1, kind::LIST) => group.chunks = t.structures(chunk)?,
            (3, kind::I64) => group.rows = u64::try_from(t.whole()?).ok()?,
            _ => return Some(false),
        }
        Some(true)
    })?;
    Some(group)
}

fn chunk(thrift: &mut Thrift) -> Option<Chunk> {
    let (mut chunk, mut first, mut dictionary) = (Chunk::default(), None, None);
    thrift.structure(|t, number, kind| {
        if (number, kind) != (3, kind::STRUCT) {
            return Some(false);
        }
        t.structure(|t, number, kind| {
            match (number, kind) {
                (4, kind::I32) => chunk.codec = t.small()?,
                (7, kind::I64) => chunk.length = u64::try_from(t.whole()?).ok()?,
                (9, kind::I64) => first = Some(u64::try_from(t.whole()?).ok()?),
                (11, kind::I64) => dictionary = Some(t.whole()?),
                _ => return Some(false),
            }
            Some(true)
        })?;
        Some(true)
    })?;
    let first = first?;
    // Some writers give 0 as the place of a dictionary that does not exist.
    let dictionary = dictionary.and_then(|at| u64::try_from(at).ok()).filter(|&at| at > 0);
    chunk.start = dictionary.map_or(first, |at| at.min(first));
    Some(chunk)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn older_types_have_the_same_meaning() {
        let meanings = [5, 8, 9, 13, 17, 0].map(|number| converted_type(number, 3));
        let expected = [
            Meaning::Decimal(3),
            Meaning::Clock(1e6),
            Meaning::Timestamp(1e3),
            Meaning::Unsigned,
            Meaning::Plain,
            Meaning::Other("texts"),
        ];
        assert_eq!(meanings, expected);
    }
}
