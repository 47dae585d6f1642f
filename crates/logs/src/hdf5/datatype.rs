//! Types of the elements of HDF5 datasets, read from the bytes of their datatype messages.
//!
//! The decoder's own description of a type lacks positions of bits, which numbers of 12 bits or of 16-bit floating point
//! need.

use super::number::{Bits, Number};

/// Largest depth of nested types.
const DEPTH_MAX: usize = 8;
/// Largest number of elements of an array inside an element.
const ARRAY_MAX: u64 = 64;
/// Largest number of numbers inside an element.
const NUMBERS_MAX: usize = 10_000;

/// A number inside an element.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Leaf {
    /// Path inside the element, such as `/member[2]`; empty if the element is a number.
    pub path: String,
    /// Position inside the element \[bytes\].
    pub offset: usize,
    pub number: Number,
}

/// Numbers of an element, and paths of its other parts with a description.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Parts {
    pub leaves: Vec<Leaf>,
    pub others: Vec<(String, &'static str)>,
    /// Size of an element \[bytes\].
    pub size: usize,
}

/// Reads the datatype message of a dataset. `separator` is between the names of an element and its members.
pub(super) fn parts(message: &[u8], separator: &str) -> Option<Parts> {
    let tree = Message { bytes: message }.tree(0)?;
    let mut parts = Parts { size: tree.size, ..Parts::default() };
    tree.collect(String::new(), 0, separator, &mut parts)?;
    Some(parts)
}

/// A type and the types that it consists of.
struct Tree {
    size: usize,
    kind: Kind,
}

enum Kind {
    Number(Number),
    Compound(Vec<(String, usize, Tree)>),
    Array(u64, Box<Tree>),
    Other(&'static str),
}

impl Tree {
    /// Adds the numbers of a type at byte `offset` of an element. Returns `None` if they exceed a limit or their element.
    fn collect(&self, path: String, offset: usize, separator: &str, parts: &mut Parts) -> Option<()> {
        if parts.leaves.len() + parts.others.len() >= NUMBERS_MAX || offset.checked_add(self.size)? > parts.size {
            return None;
        }
        match &self.kind {
            Kind::Number(number) => parts.leaves.push(Leaf { path, offset, number: *number }),
            Kind::Other(what) => parts.others.push((path, what)),
            Kind::Compound(members) if is_complex(members) => parts.others.push((path, "complex numbers")),
            Kind::Compound(members) => {
                for (name, at, member) in members {
                    member.collect(format!("{path}{separator}{name}"), offset.checked_add(*at)?, separator, parts)?;
                }
            }
            Kind::Array(count, _) if *count > ARRAY_MAX => {
                parts.others.push((path, "arrays of more than 64 elements"));
            }
            Kind::Array(count, element) => {
                for (index, at) in (0..*count).zip((offset..).step_by(element.size.max(1))) {
                    element.collect(format!("{path}[{index}]"), at, separator, parts)?;
                }
            }
        }
        Some(())
    }
}

/// Returns true for the members that MATLAB and h5py give complex numbers.
fn is_complex(members: &[(String, usize, Tree)]) -> bool {
    matches!(members, [(real, ..), (imaginary, ..)]
        if matches!((real.as_str(), imaginary.as_str()), ("real", "imag") | ("r", "i")))
}

/// Bytes of a datatype message that are still to be read.
struct Message<'a> {
    bytes: &'a [u8],
}

impl<'a> Message<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.bytes.split_at_checked(count)?;
        self.bytes = rest;
        Some(taken)
    }

    /// Reads an unsigned little-endian integer of at most 4 bytes.
    fn integer(&mut self, size: usize) -> Option<u32> {
        let bytes = self.take(size)?;
        Some(bytes.iter().rev().fold(0, |number, &byte| number << 8 | u32::from(byte)))
    }

    /// Reads a name that ends with a zero, with zeros up to a multiple of 8 bytes if it is `padded`.
    fn name(&mut self, padded: bool) -> Option<String> {
        let length = self.bytes.iter().position(|&byte| byte == 0)?;
        let name = String::from_utf8_lossy(self.bytes.get(..length)?).into_owned();
        self.take(if padded { (length + 1).next_multiple_of(8) } else { length + 1 })?;
        Some(name)
    }

    /// Reads a type. `depth` is the number of types that it is part of.
    fn tree(&mut self, depth: usize) -> Option<Tree> {
        if depth == DEPTH_MAX {
            return None;
        }
        let (class, flags) = (self.integer(1)?, self.integer(3)?);
        let (class, version) = (class & 15, class >> 4);
        let size = usize::try_from(self.integer(4)?).ok().filter(|&size| size > 0)?;
        let big_endian = flags & 1 != 0;
        let kind = match class {
            0 | 4 => {
                let (at, width) = (self.integer(2)?, self.integer(2)?);
                let signed = class == 0 && flags & 8 != 0;
                let number = Bits::new(at, width, size).map(|bits| Number::integer(size, big_endian, bits, signed));
                number.map_or(Kind::Other("integers of more than 64 bits"), Kind::Number)
            }
            1 => self.float(flags, size)?,
            2 => {
                self.take(2)?;
                Kind::Other("times")
            }
            3 => Kind::Other("text"),
            5 => {
                self.take(usize::try_from(flags & 0xff).ok()?.next_multiple_of(8))?;
                Kind::Other("opaque data")
            }
            6 => Kind::Compound(self.members(version, (flags & 0xffff, size), depth)?),
            7 => Kind::Other("references"),
            8 => self.enumeration(version, (flags & 0xffff, size), depth)?,
            9 => {
                self.tree(depth + 1)?;
                Kind::Other(if flags & 15 == 1 { "text" } else { "lists of variable length" })
            }
            10 => self.array(version, depth)?,
            11 => {
                self.tree(depth + 1)?;
                Kind::Other("complex numbers")
            }
            _ => return None,
        };
        Some(Tree { size, kind })
    }

    fn float(&mut self, flags: u32, size: usize) -> Option<Kind> {
        self.take(4)?;
        let mut part = || Bits::new(self.integer(1)?, self.integer(1)?, size);
        let (exponent, mantissa) = (part(), part());
        let bias = self.integer(4)?;
        let sign = Bits::new(flags >> 8 & 0xff, 1, size);
        // Bit 6 marks the byte order of the VAX; bits 4 and 5 are 2 if the first bit of the mantissa is implied.
        let parts = sign.zip(exponent).zip(mantissa).filter(|_| flags & 0x70 == 0x20);
        let number = parts.and_then(|((sign, exponent), mantissa)| {
            Number::float(size, flags & 1 != 0, [sign, exponent, mantissa], bias)
        });
        Some(number.map_or(Kind::Other("floating-point numbers of an unusual format"), Kind::Number))
    }

    /// Reads the members of a compound type with their positions.
    fn members(
        &mut self,
        version: u32,
        (count, size): (u32, usize),
        depth: usize,
    ) -> Option<Vec<(String, usize, Tree)>> {
        // The positions have as few bytes as the size of the type needs.
        let width = if version < 3 { 4 } else { usize::try_from(size.ilog2() / 8 + 1).ok()? };
        let mut members = Vec::new();
        for _ in 0..count {
            let name = self.name(version < 3)?;
            let offset = usize::try_from(self.integer(width)?).ok()?;
            let dimensions = if version == 1 { self.old_dimensions()? } else { 1 };
            let mut member = self.tree(depth + 1)?;
            if dimensions != 1 {
                let size = member.size.checked_mul(usize::try_from(dimensions).ok()?)?;
                member = Tree { size, kind: Kind::Array(dimensions, Box::new(member)) };
            }
            members.push((name, offset, member));
        }
        Some(members)
    }

    /// Reads the dimensions of a member in the first version of compound types; returns their product.
    fn old_dimensions(&mut self) -> Option<u64> {
        let rank = self.integer(1)?;
        self.take(11)?;
        let mut sizes = [0; 4];
        for size in &mut sizes {
            *size = u64::from(self.integer(4)?);
        }
        sizes.get(..usize::try_from(rank).ok()?)?.iter().try_fold(1, |product: u64, &size| product.checked_mul(size))
    }

    /// Reads an enumeration, whose values are those of its base type.
    fn enumeration(&mut self, version: u32, (count, size): (u32, usize), depth: usize) -> Option<Kind> {
        let base = self.tree(depth + 1).filter(|base| base.size == size)?;
        for _ in 0..count {
            self.name(version < 3)?;
        }
        self.take(size.checked_mul(usize::try_from(count).ok()?)?)?;
        Some(base.kind)
    }

    fn array(&mut self, version: u32, depth: usize) -> Option<Kind> {
        let rank = self.integer(1)?;
        let mut count: u64 = 1;
        if version < 3 {
            self.take(3)?;
        }
        for _ in 0..rank {
            count = count.checked_mul(self.integer(4)?.into())?;
        }
        if version < 3 {
            self.take(usize::try_from(rank).ok()?.checked_mul(4)?)?;
        }
        Some(Kind::Array(count, Box::new(self.tree(depth + 1)?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the message of an integer of `size` bytes.
    fn integer(size: u8) -> Vec<u8> {
        [&[0x10, 8, 0, 0, size, 0, 0, 0, 0, 0][..], &[8 * size, 0]].concat()
    }

    /// Returns the message of a compound of the first version with one member, which has 2 × 3 elements.
    fn old_compound() -> Vec<u8> {
        let mut message = vec![0x16, 1, 0, 0, 12, 0, 0, 0];
        message.extend(b"values\0\0\0\0\0\0");
        message.extend([2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        message.extend(integer(2));
        message
    }

    #[test]
    fn members_with_dimensions_are_arrays() {
        let parts = parts(&old_compound(), "/").unwrap();
        let found: Vec<_> = parts.leaves.iter().map(|leaf| (leaf.path.as_str(), leaf.offset)).collect();
        let paths = ["/values[0]", "/values[1]", "/values[2]", "/values[3]", "/values[4]", "/values[5]"];
        assert_eq!(found, paths.into_iter().zip([0, 2, 4, 6, 8, 10]).collect::<Vec<_>>());
        assert_eq!(parts.size, 12);
    }

    #[test]
    fn every_cut_message_is_refused() {
        for message in [old_compound(), integer(4)] {
            assert!((0..message.len()).all(|length| parts(&message[..length], "/").is_none()));
        }
    }

    #[test]
    fn members_outside_their_element_are_refused() {
        let mut message = old_compound();
        message[4] = 11;
        assert_eq!(parts(&message, "/"), None);
    }

    #[test]
    fn nested_types_are_limited() {
        // Arrays of one element inside each other.
        let nested = |depth| [[0x3a, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 0].repeat(depth), integer(1)].concat();
        assert_eq!(parts(&nested(DEPTH_MAX - 1), "/").unwrap().leaves.len(), 1);
        assert_eq!(parts(&nested(DEPTH_MAX), "/"), None);
        let large = [&[0x3a, 0, 0, 0, 65, 0, 0, 0, 1, 65, 0, 0, 0][..], &integer(1)].concat();
        assert_eq!(parts(&large, "/").unwrap().others, [(String::new(), "arrays of more than 64 elements")]);
    }
}
