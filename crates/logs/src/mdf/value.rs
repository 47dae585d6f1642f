//! Numbers in the records of MDF files, and their conversion to physical values.

use super::block::Block;
use motorfit_core::numeric::{count_u64, real};

/// Type of a number in a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Kind {
    Unsigned,
    Signed,
    Real,
}

/// Place and type of a number in a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    pub(crate) kind: Kind,
    pub(crate) big_endian: bool,
    /// First byte in the record.
    pub(crate) byte: usize,
    /// First bit in the first byte, counted from the least significant one.
    pub(crate) bit: u32,
    /// Number of bits.
    pub(crate) bits: u32,
    /// Byte and mask of the bit that is set if the value is invalid.
    pub(crate) invalid: Option<(usize, u8)>,
}

/// Records of equal length, one after the other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Records<'a> {
    pub(crate) bytes: &'a [u8],
    /// Length of a record \[bytes\].
    pub(crate) stride: usize,
    /// Number of bytes before the data of a record.
    pub(crate) skip: usize,
}

impl<'a> Records<'a> {
    /// Returns the data of each record.
    pub(crate) fn each(self) -> impl Iterator<Item = &'a [u8]> {
        self.bytes.chunks_exact(self.stride.max(1)).map(move |record| record.get(self.skip..).unwrap_or_default())
    }
}

impl Place {
    /// Returns the number of bytes that the number touches.
    pub(crate) fn length(&self) -> usize {
        usize::try_from((self.bit.saturating_add(self.bits)).div_ceil(8)).unwrap_or(usize::MAX)
    }

    /// Returns true if numbers of this kind are read.
    pub(crate) fn is_read(&self) -> bool {
        match self.kind {
            Kind::Real => self.bit == 0 && matches!(self.bits, 16 | 32 | 64),
            _ => self.bit < 8 && (1..=64).contains(&self.bits),
        }
    }

    /// Returns the bits of the number.
    fn bits_of(&self, record: &[u8]) -> u64 {
        let bytes = record.get(self.byte..self.byte.saturating_add(self.length())).unwrap_or_default();
        let all = match (bytes, self.big_endian) {
            (&[a], _) => u128::from(a),
            (&[a, b], false) => u128::from(u16::from_le_bytes([a, b])),
            (&[a, b, c, d], false) => u128::from(u32::from_le_bytes([a, b, c, d])),
            (&[a, b, c, d, e, f, g, h], false) => u128::from(u64::from_le_bytes([a, b, c, d, e, f, g, h])),
            (bytes, true) => bytes.iter().fold(0, |value, &byte| value << 8 | u128::from(byte)),
            (bytes, false) => bytes.iter().rev().fold(0, |value, &byte| value << 8 | u128::from(byte)),
        };
        let mask = if self.bits >= 64 { u64::MAX } else { (1 << self.bits) - 1 };
        u64::try_from(all >> self.bit & u128::from(mask)).unwrap_or(0)
    }

    /// Returns a whole number, with its sign.
    pub(crate) fn whole(&self, record: &[u8]) -> i128 {
        let bits = self.bits_of(record);
        if self.kind == Kind::Signed {
            let unused = 64_u32.saturating_sub(self.bits);
            return i128::from((bits << unused.min(63)).cast_signed() >> unused.min(63));
        }
        i128::from(bits)
    }

    /// Returns the number.
    pub(crate) fn real(&self, record: &[u8]) -> f64 {
        let bits = self.bits_of(record);
        match (self.kind, self.bits) {
            (Kind::Unsigned, _) => count_u64(bits),
            (Kind::Signed, _) => {
                let unused = 64_u32.saturating_sub(self.bits).min(63);
                real((bits << unused).cast_signed() >> unused)
            }
            (Kind::Real, 64) => f64::from_bits(bits),
            (Kind::Real, 32) => f64::from(f32::from_bits(u32::try_from(bits).unwrap_or(0))),
            (Kind::Real, _) => half(bits),
        }
    }

    /// Appends the numbers of all records, with NaN for those that are invalid.
    pub(crate) fn append(&self, records: Records, out: &mut Vec<f64>) {
        let start = out.len();
        let is_aligned = self.kind == Kind::Real && self.bits == 64 && !self.big_endian;
        if is_aligned {
            let eight = |record: &[u8]| record.get(self.byte..).and_then(|bytes| bytes.first_chunk().copied());
            out.extend(records.each().map(|record| eight(record).map_or(f64::NAN, f64::from_le_bytes)));
        } else {
            out.extend(records.each().map(|record| self.real(record)));
        }
        if let Some((byte, mask)) = self.invalid {
            for (value, record) in out.iter_mut().skip(start).zip(records.each()) {
                if record.get(byte).is_none_or(|bits| bits & mask != 0) {
                    *value = f64::NAN;
                }
            }
        }
    }
}

/// Returns a real number of 16 bits.
fn half(bits: u64) -> f64 {
    let (exponent, fraction) = ((bits >> 10 & 31) as i32, count_u64(bits & 1023));
    let magnitude = match exponent {
        0 => fraction * 2_f64.powi(-24),
        31 if fraction > 0.0 => f64::NAN,
        31 => f64::INFINITY,
        _ => (1024.0 + fraction) * 2_f64.powi(exponent - 25),
    };
    if bits >> 15 & 1 == 1 { -magnitude } else { magnitude }
}

/// Conversion of stored numbers to physical values.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Conversion {
    /// The stored number is the physical value, or the number of a state with a name.
    None,
    /// Offset and factor.
    Linear(f64, f64),
    /// Coefficients of x², x and 1 of the numerator and the denominator.
    Rational([f64; 6]),
    /// Stored numbers in ascending order with their physical values.
    Table { rows: Vec<[f64; 2]>, interpolates: bool },
}

impl Conversion {
    /// Returns the conversion of a block; `Err` has the kind of a conversion that is not read.
    pub(crate) fn of(block: &Block) -> std::result::Result<Self, &'static str> {
        let count = usize::from(block.number16(6));
        let values: Vec<f64> =
            (0..count.min(block.data.len() / 8)).map(|n| f64::from_bits(block.number64(24 + 8 * n))).collect();
        match (block.byte(0), &values[..]) {
            (0 | 7 | 8 | 11, _) => Ok(Self::None),
            (1, &[offset, factor, ..]) => Ok(Self::Linear(offset, factor)),
            (2, &[a, b, c, d, e, f, ..]) => Ok(Self::Rational([a, b, c, d, e, f])),
            (kind @ (4 | 5), values) => {
                let rows = values.as_chunks().0.to_vec();
                let ascends = rows.is_sorted_by(|[a, _]: &[f64; 2], [b, _]| a < b);
                match ascends && !rows.is_empty() {
                    true => Ok(Self::Table { rows, interpolates: kind == 4 }),
                    false => Err("a table that does not ascend"),
                }
            }
            (1 | 2, _) => Err("too few coefficients"),
            (3, _) => Err("a formula"),
            (6, _) => Err("a table of ranges"),
            (9 | 10, _) => Err("texts"),
            _ => Err("an unknown conversion"),
        }
    }

    /// Converts stored numbers in place.
    pub(crate) fn apply(&self, values: &mut [f64]) {
        match self {
            Self::None => {}
            Self::Linear(offset, factor) => values.iter_mut().for_each(|x| *x = *x * factor + offset),
            Self::Rational([a, b, c, d, e, f]) => values.iter_mut().for_each(|x| {
                *x = (a * *x * *x + b * *x + c) / (d * *x * *x + e * *x + f);
            }),
            Self::Table { rows, interpolates } => values.iter_mut().for_each(|x| *x = look_up(rows, *interpolates, *x)),
        }
    }
}

fn look_up(rows: &[[f64; 2]], interpolates: bool, x: f64) -> f64 {
    let above = rows.partition_point(|[key, _]| *key <= x);
    let (lower, upper) = (above.checked_sub(1).and_then(|n| rows.get(n)), rows.get(above));
    match (lower, upper) {
        _ if x.is_nan() => x,
        (Some([x0, y0]), Some([x1, y1])) if interpolates => (y1 - y0) / (x1 - x0) * (x - x0) + y0,
        (Some([x0, y0]), Some([x1, y1])) => {
            if x - x0 > x1 - x {
                *y1
            } else {
                *y0
            }
        }
        (Some([_, y]), None) | (None, Some([_, y])) => *y,
        (None, None) => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACE: Place = Place { kind: Kind::Unsigned, big_endian: false, byte: 0, bit: 0, bits: 12, invalid: None };

    #[test]
    fn numbers_of_any_width_are_read() {
        let record = [0xff, 0x0a, 0x80, 1, 2, 3, 4, 5, 6];
        assert_eq!(PLACE.whole(&record), 0xaff);
        assert_eq!(Place { bit: 4, kind: Kind::Signed, ..PLACE }.whole(&record), 0xaf);
        assert_eq!(Place { bit: 4, bits: 8, kind: Kind::Signed, ..PLACE }.whole(&record), 0xaf - 256);
        let all = record.iter().rev().fold(0, |value, &byte| value << 8 | i128::from(byte));
        assert_eq!(Place { bit: 7, bits: 64, ..PLACE }.whole(&record), all >> 7 & i128::from(u64::MAX));
        let big = Place { big_endian: true, bit: 4, ..PLACE };
        assert_eq!(big.whole(&record), 0xff0);
        assert_eq!(Place { bits: 64, kind: Kind::Signed, byte: 8, ..PLACE }.whole(&record), 0);
        let halves = [(0x3555, 0.333_251_953_125), (0xc000, -2.0), (1, 2f64.powi(-24)), (0x7bff, 65504.0)];
        assert!(halves.into_iter().all(|(bits, value)| half(bits).total_cmp(&value).is_eq()));
        assert!(half(0x7e00).is_nan() && half(0xfc00) < -1e300);
    }

    #[test]
    fn conversions_follow_their_definitions() {
        let apply = |conversion: Conversion| {
            let mut values = [-1.0, 2.0, 5.5, 99.0, f64::NAN];
            conversion.apply(&mut values);
            values.map(|value| if value.is_nan() { "nan".to_owned() } else { value.to_string() })
        };
        assert_eq!(apply(Conversion::Linear(1.0, -2.0)), ["3", "-3", "-10", "-197", "nan"]);
        assert_eq!(
            apply(Conversion::Rational([0.0, 1.0, 0.0, 1.0, 0.0, 0.0])),
            ["-1", "0.5", "0.18181818181818182", "0.010101010101010102", "nan"]
        );
        let rows = vec![[0.0, 0.0], [4.0, 8.0], [7.0, -7.0]];
        assert_eq!(apply(Conversion::Table { rows: rows.clone(), interpolates: true }), ["0", "4", "0.5", "-7", "nan"]);
        assert_eq!(apply(Conversion::Table { rows, interpolates: false }), ["0", "0", "8", "-7", "nan"]);
    }
}
