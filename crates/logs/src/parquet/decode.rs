//! Encodings of numbers and levels in the pages of Parquet files.

use super::bits::{differences, hybrid, join};
use super::footer::Meaning;
use super::schema::Physical;
use motorfit_core::numeric::{count_u64, real, wide};

/// Day of 1 January 1970, counted as in times of 96 bits.
const EPOCH_DAY: i64 = 2_440_588;
/// Largest whole number up to which all whole numbers are exact in 64-bit reals.
const EXACT_MAX: u64 = 1 << 53;
/// Largest power of ten that is exact in 64-bit reals.
const EXACT_POWER_MAX: i32 = 22;

/// Numbers of encodings.
pub(crate) mod encoding {
    pub(crate) const PLAIN: i32 = 0;
    pub(crate) const PLAIN_DICTIONARY: i32 = 2;
    pub(crate) const RLE: i32 = 3;
    pub(crate) const DELTA_BINARY_PACKED: i32 = 5;
    pub(crate) const RLE_DICTIONARY: i32 = 8;
    pub(crate) const BYTE_STREAM_SPLIT: i32 = 9;

    /// Names of all encodings.
    pub(crate) const NAMES: [&str; 10] = [
        "PLAIN",
        "GROUP_VAR_INT",
        "PLAIN_DICTIONARY",
        "RLE",
        "BIT_PACKED",
        "DELTA_BINARY_PACKED",
        "DELTA_LENGTH_BYTE_ARRAY",
        "DELTA_BYTE_ARRAY",
        "RLE_DICTIONARY",
        "BYTE_STREAM_SPLIT",
    ];
}

/// Decoder of the values of a column.
#[derive(Debug)]
pub(crate) struct Decoder {
    physical: Physical,
    meaning: Meaning,
    /// First point in time of the column, from which all are counted.
    first: Option<i64>,
    /// Values of the dictionary, as whole or as real numbers.
    dictionary: Option<(Vec<i64>, Vec<f64>)>,
    whole: Vec<i64>,
    joined: Vec<u8>,
}

impl Decoder {
    /// Returns a decoder of values of a type and a meaning.
    pub(crate) fn new(physical: Physical, meaning: Meaning) -> Self {
        Self { physical, meaning, first: None, dictionary: None, whole: Vec::new(), joined: Vec::new() }
    }

    /// Returns the number of bytes of a plain value; 0 for booleans.
    fn width(&self) -> usize {
        match self.physical {
            Physical::Bool => 0,
            Physical::Int32 | Physical::Float => 4,
            Physical::Int64 | Physical::Double => 8,
            Physical::Int96 => 12,
            Physical::Fixed(length) => length,
        }
    }

    fn is_whole(&self) -> bool {
        matches!(self.physical, Physical::Int32 | Physical::Int64 | Physical::Int96)
    }

    /// Forgets the dictionary at the start of a row group.
    pub(crate) fn start_group(&mut self) {
        self.dictionary = None;
    }

    /// Reads a dictionary; the function returns `None` if the bytes end before.
    pub(crate) fn read_dictionary(&mut self, bytes: &[u8], count: usize) -> Option<()> {
        let (mut whole, mut real) = (Vec::new(), Vec::new());
        if self.is_whole() {
            self.plain_whole(bytes, count, &mut whole)?;
        } else {
            self.plain_real(bytes, count, &mut real)?;
        }
        self.dictionary = Some((whole, real));
        Some(())
    }

    /// Appends `count` values of a page to `out`.
    ///
    /// # Errors
    /// Returns a description of the damage or of an encoding that is not supported.
    pub(crate) fn values(
        &mut self,
        encoding: i32,
        bytes: &[u8],
        count: usize,
        out: &mut Vec<f64>,
    ) -> Result<(), String> {
        let short = || format!("has less than {count} values or is damaged");
        if !self.is_whole() {
            return self.real(encoding, bytes, count, out)?.ok_or_else(short);
        }
        let mut whole = std::mem::take(&mut self.whole);
        whole.clear();
        let read = self.wholes(encoding, bytes, count, &mut whole);
        if matches!(read, Ok(Some(()))) {
            self.convert(&whole, out);
        }
        self.whole = whole;
        read?.ok_or_else(short)
    }

    fn real(&mut self, encoding: i32, bytes: &[u8], count: usize, out: &mut Vec<f64>) -> Result<Option<()>, String> {
        match encoding {
            encoding::PLAIN => Ok(self.plain_real(bytes, count, out)),
            encoding::PLAIN_DICTIONARY | encoding::RLE_DICTIONARY => match &self.dictionary {
                Some((_, real)) => Ok(look_up(real, bytes, count, out)),
                None => Err("needs a dictionary, which is missing".to_owned()),
            },
            encoding::RLE if self.physical == Physical::Bool => {
                // The runs follow their length.
                let runs = bytes.get(4..).unwrap_or_default();
                let mut push = |value: u32, n: usize| {
                    out.extend(std::iter::repeat_n(f64::from(value), n));
                    Some(())
                };
                Ok(hybrid(runs, 1, count, &mut push))
            }
            encoding::BYTE_STREAM_SPLIT if self.width() > 0 => {
                let mut joined = std::mem::take(&mut self.joined);
                let read = join(bytes, self.width(), count, &mut joined);
                let read = read.and_then(|()| self.plain_real(&joined, count, out));
                self.joined = joined;
                Ok(read)
            }
            other => Err(unsupported(other)),
        }
    }

    fn wholes(&mut self, encoding: i32, bytes: &[u8], count: usize, out: &mut Vec<i64>) -> Result<Option<()>, String> {
        match encoding {
            encoding::PLAIN => Ok(self.plain_whole(bytes, count, out)),
            encoding::PLAIN_DICTIONARY | encoding::RLE_DICTIONARY => match &self.dictionary {
                Some((whole, _)) => Ok(look_up(whole, bytes, count, out)),
                None => Err("needs a dictionary, which is missing".to_owned()),
            },
            encoding::DELTA_BINARY_PACKED if self.physical != Physical::Int96 => {
                let read = differences(bytes, count, out);
                if self.physical == Physical::Int32 {
                    #[allow(clippy::cast_possible_truncation, reason = "differences of 32 bits wrap")]
                    out.iter_mut().for_each(|value| *value = i64::from(*value as i32));
                }
                Ok(read)
            }
            encoding::BYTE_STREAM_SPLIT => {
                let mut joined = std::mem::take(&mut self.joined);
                let read = join(bytes, self.width(), count, &mut joined);
                let read = read.and_then(|()| self.plain_whole(&joined, count, out));
                self.joined = joined;
                Ok(read)
            }
            other => Err(unsupported(other)),
        }
    }

    /// Appends plain values of a type of real numbers.
    fn plain_real(&self, bytes: &[u8], count: usize, out: &mut Vec<f64>) -> Option<()> {
        if self.physical == Physical::Bool {
            let bytes = bytes.get(..count.div_ceil(8))?;
            let bits = bytes.iter().flat_map(|byte| (0..8).map(move |n| f64::from(byte >> n & 1)));
            out.extend(bits.take(count));
            return Some(());
        }
        let bytes = bytes.get(..count.checked_mul(self.width())?)?;
        match (self.physical, self.meaning) {
            (Physical::Double, _) => out.extend(bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b))),
            (Physical::Float, _) => out.extend(bytes.as_chunks().0.iter().map(|b| f64::from(f32::from_le_bytes(*b)))),
            (Physical::Fixed(length), Meaning::Decimal(scale)) => {
                out.extend(bytes.chunks_exact(length).map(|b| decimal(big_endian(b), scale)));
            }
            _ => out.extend(bytes.as_chunks().0.iter().map(|b| half(u16::from_le_bytes(*b)))),
        }
        Some(())
    }

    /// Appends plain values of a type of whole numbers.
    fn plain_whole(&self, bytes: &[u8], count: usize, out: &mut Vec<i64>) -> Option<()> {
        let bytes = bytes.get(..count.checked_mul(self.width())?)?;
        match self.physical {
            Physical::Int32 => out.extend(bytes.as_chunks().0.iter().map(|b| i64::from(i32::from_le_bytes(*b)))),
            Physical::Int64 => out.extend(bytes.as_chunks().0.iter().map(|b| i64::from_le_bytes(*b))),
            _ => out.extend(bytes.as_chunks().0.iter().map(|b: &[u8; 12]| {
                let &[n0, n1, n2, n3, n4, n5, n6, n7, d0, d1, d2, d3] = b;
                let day = i64::from(u32::from_le_bytes([d0, d1, d2, d3])) - EPOCH_DAY;
                let nanoseconds = i64::from_le_bytes([n0, n1, n2, n3, n4, n5, n6, n7]);
                day.wrapping_mul(86_400_000_000_000).wrapping_add(nanoseconds)
            })),
        }
        Some(())
    }

    /// Appends whole numbers as their meaning.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the bits of 32-bit numbers without sign"
    )]
    fn convert(&mut self, whole: &[i64], out: &mut Vec<f64>) {
        let per_second = match (self.physical, self.meaning) {
            (Physical::Int96, _) => Some(1e9),
            (_, Meaning::Timestamp(per_second)) => Some(per_second),
            _ => None,
        };
        match self.meaning {
            _ if per_second.is_some() => {
                let per_second = per_second.unwrap_or(1.0);
                let Some(&first) = whole.first() else { return };
                let first = *self.first.get_or_insert(first);
                out.extend(whole.iter().map(|value| real(value.wrapping_sub(first)) / per_second));
            }
            Meaning::Unsigned if self.physical == Physical::Int32 => {
                out.extend(whole.iter().map(|&value| f64::from(value as u32)));
            }
            Meaning::Unsigned => out.extend(whole.iter().map(|&value| count_u64(value.cast_unsigned()))),
            Meaning::Decimal(scale) => out.extend(whole.iter().map(|&value| decimal(i128::from(value), scale))),
            Meaning::Clock(per_second) => out.extend(whole.iter().map(|&value| real(value) / per_second)),
            _ => out.extend(whole.iter().map(|&value| real(value))),
        }
    }
}

fn unsupported(encoding: i32) -> String {
    let name = usize::try_from(encoding).ok().and_then(|n| encoding::NAMES.get(n));
    let name = name.map_or_else(|| format!("number {encoding}"), |name| (*name).to_owned());
    format!("has the encoding {name}, which is not read for this type")
}

/// Appends the values of a dictionary at `count` indices.
fn look_up<T: Copy>(dictionary: &[T], bytes: &[u8], count: usize, out: &mut Vec<T>) -> Option<()> {
    if count == 0 {
        return Some(());
    }
    let (&width, runs) = bytes.split_first()?;
    let mut push = |index: u32, n: usize| {
        let value = *dictionary.get(index as usize)?;
        if n == 1 {
            out.push(value)
        } else {
            out.extend(std::iter::repeat_n(value, n))
        }
        Some(())
    };
    hybrid(runs, u32::from(width), count, &mut push)
}

/// Returns a big-endian number in two's complement of at most 16 bytes.
fn big_endian(bytes: &[u8]) -> i128 {
    let sign = if bytes.first().is_some_and(|byte| byte & 0x80 != 0) { -1 } else { 0 };
    bytes.iter().fold(sign, |value, &byte| value << 8 | i128::from(byte))
}

/// Returns the real number nearest to `value` / 10^`scale`.
fn decimal(value: i128, scale: i32) -> f64 {
    if value.unsigned_abs() <= u128::from(EXACT_MAX) && scale <= EXACT_POWER_MAX {
        return wide(value) / 10_f64.powi(scale);
    }
    format!("{value}e-{scale}").parse().unwrap_or(f64::NAN)
}

/// Returns a real number of 16 bits.
fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    let magnitude = match exponent {
        0 => fraction * 2_f64.powi(-24),
        31 if fraction > 0.0 => f64::NAN,
        31 => f64::INFINITY,
        _ => (1024.0 + fraction) * 2_f64.powi(exponent - 25),
    };
    if bits >> 15 == 1 { -magnitude } else { magnitude }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_other_widths_are_exact() {
        let halves = [(0x3555, 0.333_251_953_125), (0xc000, -2.0), (1, 2f64.powi(-24)), (0x7bff, 65504.0)];
        assert!(halves.into_iter().all(|(bits, value)| half(bits).total_cmp(&value).is_eq()));
        assert!(half(0x7e00).is_nan() && half(0xfc00) < -1e300);
        assert_eq!([big_endian(&[0xff, 0x38]), big_endian(&[0, 200])], [-200, 200]);
        let decimals = [(-12345, 2, -123.45), (10_i128.pow(30) + 1, 20, 1e10)];
        assert!(decimals.into_iter().all(|(n, scale, value)| decimal(n, scale).total_cmp(&value).is_eq()));
    }
}
