//! Data types of TDMS files and the conversion of their values.

use motorfit_core::numeric::{count_u64, real};

/// Data type of the values of an object or of a property.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    I16,
    I32,
    I64,
    U8,
    U16,
    U32,
    U64,
    F32,
    F64,
    Bool,
    Time,
    /// Strings of any length.
    Text,
    /// Complex numbers with real and imaginary parts of 4 bytes.
    Complex32,
    /// Complex numbers with real and imaginary parts of 8 bytes.
    Complex64,
    /// No values.
    Void,
    /// Raw values of an acquisition card, with a layout of their own.
    Daqmx,
}

impl Kind {
    /// Returns the data type of a code; `None` for fixed-point and extended-precision numbers and unknown codes.
    pub(super) fn of(code: u32) -> Option<Self> {
        Some(match code {
            0 => Self::Void,
            1 => Self::I8,
            2 => Self::I16,
            3 => Self::I32,
            4 => Self::I64,
            5 => Self::U8,
            6 => Self::U16,
            7 => Self::U32,
            8 => Self::U64,
            9 | 0x19 => Self::F32,
            10 | 0x1a => Self::F64,
            0x20 => Self::Text,
            0x21 => Self::Bool,
            0x44 => Self::Time,
            0x0008_000c => Self::Complex32,
            0x0010_000d => Self::Complex64,
            _ => return None,
        })
    }

    /// Returns the number of bytes of a value; 0 for types without a fixed size.
    pub(super) fn size(self) -> u8 {
        match self {
            Self::I8 | Self::U8 | Self::Bool => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 | Self::Complex32 => 8,
            Self::Time | Self::Complex64 => 16,
            Self::Text | Self::Void | Self::Daqmx => 0,
        }
    }

    /// Returns the word for values that are neither numbers nor times.
    pub(super) fn left_out(self) -> Option<&'static str> {
        match self {
            Self::Text => Some("text"),
            Self::Complex32 | Self::Complex64 => Some("complex numbers"),
            Self::Daqmx => Some("raw DAQmx data"),
            _ => None,
        }
    }
}

/// Appends numbers to a column. Times are converted by [`times`]; types that are not numbers give nothing.
pub(super) fn numbers(kind: Kind, big_endian: bool, bytes: &[u8], column: &mut Vec<f64>) {
    /// Converts values of a type that `f64` holds exactly, or rounds as `as` does.
    macro_rules! extend {
        ($type:ty, $size:literal, $convert:expr) => {{
            let (values, _) = bytes.as_chunks::<$size>();
            if big_endian {
                column.extend(values.iter().map(|value| $convert(<$type>::from_be_bytes(*value))));
            } else {
                column.extend(values.iter().map(|value| $convert(<$type>::from_le_bytes(*value))));
            }
        }};
    }
    match kind {
        Kind::I8 => extend!(i8, 1, f64::from),
        Kind::I16 => extend!(i16, 2, f64::from),
        Kind::I32 => extend!(i32, 4, f64::from),
        Kind::I64 => extend!(i64, 8, |value: i64| real(value)),
        Kind::U8 => extend!(u8, 1, f64::from),
        Kind::U16 => extend!(u16, 2, f64::from),
        Kind::U32 => extend!(u32, 4, f64::from),
        Kind::U64 => extend!(u64, 8, |value: u64| count_u64(value)),
        Kind::F32 => extend!(f32, 4, f64::from),
        Kind::F64 => extend!(f64, 8, |value: f64| value),
        Kind::Bool => column.extend(bytes.iter().map(|&value| if value == 0 { 0.0 } else { 1.0 })),
        Kind::Time | Kind::Text | Kind::Complex32 | Kind::Complex64 | Kind::Void | Kind::Daqmx => (),
    }
}

/// Returns timestamps as counts of 2⁻⁶⁴ s since the start of 1904.
pub(super) fn times(big_endian: bool, bytes: &[u8]) -> impl Iterator<Item = i128> {
    // The fraction and the seconds are the low and the high half of one number, in either byte order.
    let (values, _) = bytes.as_chunks::<16>();
    values.iter().map(move |&value| if big_endian { i128::from_be_bytes(value) } else { i128::from_le_bytes(value) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(kind: Kind, big_endian: bool, bytes: &[u8]) -> Vec<f64> {
        let mut column = Vec::new();
        numbers(kind, big_endian, bytes, &mut column);
        column
    }

    #[test]
    fn numbers_of_all_types() {
        let all = [0xff; 8];
        let expected = [
            (1, -1.0, 8),
            (2, -1.0, 4),
            (3, -1.0, 2),
            (4, -1.0, 1),
            (5, 255.0, 8),
            (6, 65535.0, 4),
            (7, 4_294_967_295.0, 2),
            (8, 18_446_744_073_709_551_615.0, 1),
            (0x21, 1.0, 8),
        ];
        for (code, value, count) in expected {
            let kind = Kind::of(code).unwrap();
            assert_eq!(column(kind, false, &all), vec![value; count]);
            assert_eq!(column(kind, true, &all), vec![value; count]);
        }
        assert_eq!(column(Kind::I16, false, &[1, 2, 3]), [513.0]);
        assert_eq!(column(Kind::I16, true, &[1, 2, 3]), [258.0]);
        for code in [9, 0x19] {
            assert_eq!(column(Kind::of(code).unwrap(), true, &0.1_f32.to_be_bytes()), [f64::from(0.1_f32)]);
        }
        for code in [10, 0x1a] {
            assert_eq!(column(Kind::of(code).unwrap(), false, &0.1_f64.to_le_bytes()), [0.1]);
        }
        for code in [0, 0x20, 0x0008_000c, 0x0010_000d] {
            assert!(column(Kind::of(code).unwrap(), false, &[0; 32]).is_empty());
        }
        assert!([11, 0x1b, 0x4f, u32::MAX].into_iter().all(|code| Kind::of(code).is_none()));
    }

    #[test]
    fn times_of_both_byte_orders() {
        let fraction_then_seconds = [[0, 0, 0, 0, 0, 0, 0, 0x80], [2, 0, 0, 0, 0, 0, 0, 0]].concat();
        let half_past_two: Vec<i128> = times(false, &fraction_then_seconds).collect();
        assert_eq!(half_past_two, [(5 << 64) / 2]);
        let reversed: Vec<u8> = fraction_then_seconds.into_iter().rev().collect();
        assert_eq!(times(true, &reversed).collect::<Vec<_>>(), half_past_two);
    }
}
