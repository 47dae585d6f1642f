//! Numbers of HDF5 files.

use motorfit_core::numeric::{count_u64, real};

/// Largest bias of the exponent of a floating-point number; powers of two of the exponents stay exact below it.
const BIAS_MAX: u32 = 511;

/// Format of a number of at most 8 bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Number {
    size: usize,
    big_endian: bool,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Integer {
        bits: Bits,
        signed: bool,
    },
    /// IEEE 754 with 64 bits.
    Double,
    /// IEEE 754 with 32 bits.
    Single,
    /// Floating-point number of another format, such as 16 bits.
    Float {
        sign: Bits,
        exponent: Bits,
        mantissa: Bits,
        bias: i32,
    },
}

/// Position and width of a part of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bits {
    at: u32,
    width: u32,
}

impl Bits {
    /// Returns a part of a number of `size` bytes; `None` if it exceeds the number.
    pub fn new(at: u32, width: u32, size: usize) -> Option<Self> {
        let end = usize::try_from(at.checked_add(width)?).ok()?;
        (width > 0 && size <= 8 && end <= 8 * size).then_some(Self { at, width })
    }

    /// Returns the part of a number.
    fn of(self, number: u64) -> u64 {
        (number >> self.at) & (u64::MAX >> (64 - self.width))
    }
}

impl Number {
    /// Returns true for an integer.
    pub fn is_integer(self) -> bool {
        matches!(self.kind, Kind::Integer { .. })
    }

    /// Returns the format of an integer.
    pub fn integer(size: usize, big_endian: bool, bits: Bits, signed: bool) -> Self {
        Self { size, big_endian, kind: Kind::Integer { bits, signed } }
    }

    /// Returns the format of a floating-point number from its sign, exponent and mantissa; `None` if `f64` cannot hold it.
    pub fn float(size: usize, big_endian: bool, [sign, exponent, mantissa]: [Bits; 3], bias: u32) -> Option<Self> {
        let part = |bits: Bits| (bits.at, bits.width);
        let kind = match (size, part(sign), part(exponent), part(mantissa), bias) {
            (8, (63, 1), (52, 11), (0, 52), 1023) => Kind::Double,
            (4, (31, 1), (23, 8), (0, 23), 127) => Kind::Single,
            (_, _, (_, 1..=8), (_, 1..=52), 0..=BIAS_MAX) => {
                Kind::Float { sign, exponent, mantissa, bias: i32::try_from(bias).ok()? }
            }
            _ => return None,
        };
        Some(Self { size, big_endian, kind })
    }

    /// Returns the number at the start of `bytes`; `None` if there are too few.
    pub fn value(self, bytes: &[u8]) -> Option<f64> {
        let mut ordered = [0; 8];
        ordered.get_mut(..self.size)?.copy_from_slice(bytes.get(..self.size)?);
        if self.big_endian {
            ordered.get_mut(..self.size)?.reverse();
        }
        let number = u64::from_le_bytes(ordered);
        Some(match self.kind {
            Kind::Double => f64::from_bits(number),
            Kind::Single => f32::from_bits(u32::try_from(number).ok()?).into(),
            Kind::Integer { bits, signed: false } => count_u64(bits.of(number)),
            Kind::Integer { bits, signed: true } => {
                let unused = 64 - bits.width;
                real((bits.of(number) << unused).cast_signed() >> unused)
            }
            Kind::Float { sign, exponent, mantissa, bias } => float(
                sign.of(number),
                (exponent.of(number), exponent.width),
                (mantissa.of(number), mantissa.width),
                bias,
            ),
        })
    }
}

/// Returns a floating-point number from its sign and from its exponent and mantissa with their widths.
fn float(sign: u64, (exponent, wide): (u64, u32), (mantissa, digits): (u64, u32), bias: i32) -> f64 {
    let power = |exponent: u64| {
        let exponent = i32::try_from(exponent).unwrap_or_default();
        2f64.powi(exponent - bias - i32::try_from(digits).unwrap_or_default())
    };
    let magnitude = match exponent {
        _ if exponent == u64::MAX >> (64 - wide) => {
            if mantissa == 0 {
                f64::INFINITY
            } else {
                f64::NAN
            }
        }
        0 => count_u64(mantissa) * power(1),
        _ => count_u64(mantissa | 1 << digits) * power(exponent),
    };
    if sign == 0 { magnitude } else { -magnitude }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bits<const N: usize>(parts: [(u32, u32); N], size: usize) -> [Bits; N] {
        parts.map(|(at, width)| Bits::new(at, width, size).unwrap())
    }

    #[test]
    fn integers_of_any_width() {
        let [all, twelve] = bits([(0, 16), (4, 12)], 2);
        let value = |big_endian, bits, signed, bytes| Number::integer(2, big_endian, bits, signed).value(bytes);
        assert_eq!(value(false, all, true, &[0xfe, 0xff]), Some(-2.0));
        assert_eq!(value(true, all, true, &[0xff, 0xfe]), Some(-2.0));
        assert_eq!(value(false, all, false, &[0xfe, 0xff]), Some(65534.0));
        assert_eq!(value(false, twelve, true, &[0x0f, 0x80]), Some(-2048.0));
        assert_eq!(value(false, twelve, false, &[0x1f, 0x80]), Some(2049.0));
        assert_eq!(value(false, all, true, &[0xfe]), None);
        assert_eq!((Bits::new(4, 13, 2), Bits::new(0, 0, 2), Bits::new(0, 65, 9)), (None, None, None));
        let [whole] = bits([(0, 64)], 8);
        assert_eq!(Number::integer(8, false, whole, true).value(&i64::MIN.to_le_bytes()), Some(i64::MIN as f64));
        assert_eq!(Number::integer(8, false, whole, false).value(&u64::MAX.to_le_bytes()), Some(u64::MAX as f64));
    }

    #[test]
    fn numbers_of_16_bits() {
        let half = Number::float(2, false, bits([(15, 1), (10, 5), (0, 10)], 2), 15).unwrap();
        let value = |bits: u16| half.value(&bits.to_le_bytes()).unwrap();
        let expected = [1.0, -2.0, 65504.0, 5.960_464_477_539_063e-8, 0.333_251_953_125, f64::INFINITY];
        assert!([0x3c00, 0xc000, 0x7bff, 1, 0x3555, 0x7c00].into_iter().map(value).eq(expected));
        assert!(value(0x7e00).is_nan());
        assert!(value(0x8000).is_sign_negative());
        let brain = Number::float(2, true, bits([(15, 1), (7, 8), (0, 7)], 2), 127).unwrap();
        assert_eq!(brain.value(&[0x40, 0x49]), Some(3.140_625));
        assert_eq!(brain.value(&[0, 1]), Some(2f64.powi(-133)));
    }

    #[test]
    fn other_formats_than_double_and_single_are_converted_alike() {
        let parts = bits([(31, 1), (23, 8), (0, 23)], 4);
        let single = Number::float(4, false, parts, 127).unwrap();
        let [sign, exponent, mantissa] = parts;
        let kind = Kind::Float { sign, exponent, mantissa, bias: 127 };
        for number in [1.0f32, -0.1, 1e-45, f32::MAX, f32::MIN_POSITIVE, -f32::INFINITY] {
            let bytes = number.to_le_bytes();
            assert_eq!(single.value(&bytes), Some(number.into()));
            assert_eq!(Number { kind, ..single }.value(&bytes), Some(number.into()));
        }
        assert!(Number::float(8, false, bits([(63, 1), (52, 11), (0, 52)], 8), 1000).is_none());
    }
}
