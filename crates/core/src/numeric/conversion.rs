//! Conversions between counts, integers and real numbers.

/// Returns a count as a real number: exact up to 2^53, the nearest number beyond.
#[inline]
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
pub const fn count(n: usize) -> f64 {
    n as f64
}

/// Returns a count of 64 bits as a real number, as [`count`] does.
#[inline]
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
pub const fn count_u64(n: u64) -> f64 {
    n as f64
}

/// Returns a signed integer as a real number: exact up to ±2^53, the nearest number beyond. The conversion is one instruction;
/// that of an unsigned integer takes several.
#[inline]
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "the nearest number is meant")]
pub const fn real(n: i64) -> f64 {
    n as f64
}

/// Returns a signed integer of 128 bits as the nearest real number.
#[inline]
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "the nearest number is meant")]
pub const fn wide(n: i128) -> f64 {
    n as f64
}

/// Returns the integer part of `x`: 0 if `x` is negative or NaN, the largest integer if `x` exceeds it.
#[inline]
#[must_use]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturation is meant")]
pub const fn whole(x: f64) -> usize {
    x as usize
}

/// Returns the integer part of `x` in 64 bits, as [`whole`] does.
#[inline]
#[must_use]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturation is meant")]
pub const fn whole_u64(x: f64) -> u64 {
    x as u64
}

/// Returns `n` as an index: the largest index if `n` exceeds it, which no slice has.
#[inline]
#[must_use]
pub fn index(n: u64) -> usize {
    usize::try_from(n).unwrap_or(usize::MAX)
}

/// Returns the single-precision number nearest to `x`.
#[inline]
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "rounding is meant")]
pub const fn single(x: f64) -> f32 {
    x as f32
}

/// Returns `value` rounded to a number of significant digits.
#[must_use]
pub fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integer_parts_saturate() {
        assert_eq!([2.9, -1.0, f64::NAN, f64::INFINITY].map(whole), [2, 0, 0, usize::MAX]);
        assert_eq!([2.9, -1.0, f64::NAN, f64::INFINITY].map(whole_u64), [2, 0, 0, u64::MAX]);
    }

    #[test]
    fn counts_are_exact_up_to_their_limit() {
        let limit = 9_007_199_254_740_992_u64;
        for n in [0, 1, limit - 1, limit] {
            assert_eq!(whole_u64(count_u64(n)), n);
            assert_eq!(whole(count(index(n))), index(n));
            assert_eq!(real(n.cast_signed()).to_bits(), count_u64(n).to_bits());
        }
    }
}
