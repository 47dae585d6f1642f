//! Types of the numbers of ULog files.

use motorfit_core::numeric::{count_u64, real};

/// Type of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
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
}

impl Number {
    pub(super) fn of(name: &str) -> Option<Self> {
        Some(match name {
            "int8_t" => Self::I8,
            "int16_t" => Self::I16,
            "int32_t" => Self::I32,
            "int64_t" => Self::I64,
            "uint8_t" => Self::U8,
            "uint16_t" => Self::U16,
            "uint32_t" => Self::U32,
            "uint64_t" => Self::U64,
            "float" => Self::F32,
            "double" => Self::F64,
            "bool" => Self::Bool,
            _ => return None,
        })
    }

    /// Returns the number of bytes of a value.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 | Self::Bool => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Returns the value at the beginning of `bytes`; NaN if there are too few.
    pub(super) fn value(self, bytes: &[u8]) -> f64 {
        let value = match self {
            Self::I8 => bytes.first_chunk().map(|b| f64::from(i8::from_le_bytes(*b))),
            Self::I16 => bytes.first_chunk().map(|b| f64::from(i16::from_le_bytes(*b))),
            Self::I32 => bytes.first_chunk().map(|b| f64::from(i32::from_le_bytes(*b))),
            Self::I64 => bytes.first_chunk().map(|b| real(i64::from_le_bytes(*b))),
            Self::U8 => bytes.first().map(|b| f64::from(*b)),
            Self::U16 => bytes.first_chunk().map(|b| f64::from(u16::from_le_bytes(*b))),
            Self::U32 => bytes.first_chunk().map(|b| f64::from(u32::from_le_bytes(*b))),
            Self::U64 => bytes.first_chunk().map(|b| count_u64(u64::from_le_bytes(*b))),
            Self::F32 => bytes.first_chunk().map(|b| f64::from(f32::from_le_bytes(*b))),
            Self::F64 => bytes.first_chunk().map(|b| f64::from_le_bytes(*b)),
            Self::Bool => bytes.first().map(|b| f64::from(u8::from(*b != 0))),
        };
        value.unwrap_or(f64::NAN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_numbers() {
        let all = [0xff; 8];
        let sizes = [("int8_t", -1.0), ("int16_t", -1.0), ("int32_t", -1.0), ("int64_t", -1.0), ("uint8_t", 255.0)];
        let more = [("uint16_t", 65535.0), ("uint32_t", 4_294_967_295.0), ("uint64_t", 18_446_744_073_709_551_615.0)];
        for (name, value) in sizes.into_iter().chain(more).chain([("bool", 1.0)]) {
            let number = Number::of(name).unwrap();
            assert!(number.value(&all).total_cmp(&value).is_eq(), "{name}");
            assert!(number.value(&all[..number.size() - 1]).is_nan(), "{name}");
        }
        assert!(Number::F32.value(&0.1_f32.to_le_bytes()).total_cmp(&f64::from(0.1_f32)).is_eq());
        assert!(Number::F64.value(&0.1_f64.to_le_bytes()).total_cmp(&0.1).is_eq());
    }
}
