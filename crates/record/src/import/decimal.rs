//! Parsing of decimal numbers in one pass over their bytes, with the correct rounding of the standard library.

use motorfit_core::numeric::real;

/// A parsed number in a line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Number {
    pub value: f64,
    /// Index one past its last byte.
    pub end: usize,
    /// True if it has a decimal point.
    pub has_point: bool,
}

/// Largest number of decimal digits of which any integer fits 64 bits.
const DIGITS: usize = 19;
/// Largest number of digits of an exponent that is parsed here.
const EXPONENT: usize = 3;

/// Parses the number at byte `start` of a line; `None` if there is no finite plain decimal.
#[inline(always)]
pub(super) fn number(line: &[u8], start: usize) -> Option<Number> {
    let negative = line.get(start) == Some(&b'-');
    let first = start + usize::from(negative);
    let (whole, point) = digits(line, first, 0);
    let has_point = line.get(point) == Some(&b'.');
    let (whole, after) = if has_point { many_digits(line, point + 1, whole) } else { (whole, point) };
    let decimals = after - point - usize::from(has_point);
    let count = point - first + decimals;
    let (places, end) = match line.get(after) {
        Some(b'e' | b'E') => match exponent(line, after + 1) {
            Some((exponent, end)) => (usize::try_from(decimals as i64 - exponent).ok(), end),
            None => return any(line, start),
        },
        _ => (Some(decimals), after),
    };
    if count == 0 {
        return None;
    }
    let fits = count <= DIGITS || count - zeros(&line[first..after]) <= DIGITS;
    match places.filter(|_| fits).and_then(|places| quotient(whole, places)) {
        // The sign of noisy signals is random, so that a branch would often be mispredicted.
        Some(value) => {
            Some(Number { value: f64::from_bits(value.to_bits() | u64::from(negative) << 63), end, has_point })
        }
        None => any(line, start),
    }
}

/// Parses a number with the standard library, for the cases that [`number`] does not handle.
#[cold]
fn any(line: &[u8], start: usize) -> Option<Number> {
    let plain = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+' | b'e' | b'E');
    let size = line[start..].iter().take_while(|b| plain(b)).count();
    let cell = &line[start..start + size];
    let value = std::str::from_utf8(cell).ok()?.parse::<f64>().ok().filter(|value| value.is_finite())?;
    Some(Number { value, end: start + size, has_point: cell.contains(&b'.') })
}

/// Parses the exponent at byte `at`; returns it and its end, or `None` if it has no digits or more than [`EXPONENT`].
fn exponent(line: &[u8], at: usize) -> Option<(i64, usize)> {
    let negative = line.get(at) == Some(&b'-');
    let first = at + usize::from(negative || line.get(at) == Some(&b'+'));
    let (size, end) = digits(line, first, 0);
    (1..=EXPONENT).contains(&(end - first)).then_some((if negative { -(size as i64) } else { size as i64 }, end))
}

/// Returns the number of leading zeros of a decimal number.
#[cold]
fn zeros(digits: &[u8]) -> usize {
    digits.iter().take_while(|b| matches!(b, b'0' | b'.')).filter(|b| **b == b'0').count()
}

/// Appends the digits from byte `at` on to the integer `whole`; returns it and their end. It wraps around if the digits exceed
/// 64 bits.
#[inline(always)]
fn digits(line: &[u8], mut at: usize, mut whole: u64) -> (u64, usize) {
    while let Some(digit) = line.get(at).map(|byte| byte.wrapping_sub(b'0')).filter(|digit| *digit < 10) {
        whole = whole.wrapping_mul(10).wrapping_add(u64::from(digit));
        at += 1;
    }
    (whole, at)
}

/// Appends digits like [`digits`], eight at a time by pairwise sums (D. Lemire, simdjson), which is faster for many digits.
#[inline(always)]
fn many_digits(line: &[u8], mut at: usize, mut whole: u64) -> (u64, usize) {
    while let Some(eight) = line.get(at..).and_then(|rest| rest.first_chunk()) {
        let eight = u64::from_le_bytes(*eight) ^ 0x3030_3030_3030_3030;
        // Detects a byte above nine. A carry into the next byte does not change the result.
        if (eight.wrapping_add(0x7676_7676_7676_7676) | eight) & 0x8080_8080_8080_8080 != 0 {
            break;
        }
        let pairs = eight.wrapping_mul(10).wrapping_add(eight >> 8);
        let (even, odd) = (pairs & 0x0000_00ff_0000_00ff, (pairs >> 16) & 0x0000_00ff_0000_00ff);
        let value = even.wrapping_mul(0x000f_4240_0000_0064).wrapping_add(odd.wrapping_mul(0x0000_2710_0000_0001));
        whole = whole.wrapping_mul(100_000_000).wrapping_add(value >> 32);
        at += 8;
    }
    digits(line, at, whole)
}

/// Powers of ten that are exact in an `f64`.
const EXACT: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// For each q the leading 64 bits of 5⁻ᑫ, truncated, and their exponent in an `f64` of `w · 10⁻ᑫ`.
const FIFTHS: [(u64, u64); 28] = {
    let mut table = [(0, 0); 28];
    let (mut q, mut power) = (1, 5_u64);
    while q < table.len() {
        let bits = 64 - power.leading_zeros();
        #[expect(clippy::cast_possible_truncation, reason = "2^(63 + bits) over more than 2^(bits - 1)")]
        let fifth = ((1_u128 << (63 + bits)) / power as u128) as u64;
        table[q] = (fifth, 1024 - bits as u64 - q as u64);
        power = power.saturating_mul(5);
        q += 1;
    }
    table
};

/// Returns `whole / 10^places` rounded to nearest; `None` if the rounding is not certain.
#[inline(always)]
fn quotient(whole: u64, places: usize) -> Option<f64> {
    // Both operands are exact, so that one division rounds correctly (W. D. Clinger 1990).
    match EXACT.get(places) {
        Some(ten) if whole < 1 << 53 => Some(real(whole.cast_signed()) / ten),
        _ => long_quotient(whole, places),
    }
}

/// Returns the quotient for more digits: `whole`, shifted to the left, is multiplied by the leading bits of 5⁻ᑫ. These are
/// truncated, with an error of less than one unit, and never exact. The upper half of the product is therefore less than
/// one unit too small and rounds like the exact quotient, unless it is just below the midpoint of two numbers (`None`).
fn long_quotient(whole: u64, places: usize) -> Option<f64> {
    let &(fifth, exponent) = FIFTHS.get(places).filter(|_| whole > 0 && places > 0)?;
    let shift = whole.leading_zeros();
    let product = ((u128::from(whole << shift) * u128::from(fifth)) >> 64) as u64;
    // Number of bits below the 53 of the mantissa; their value just below the midpoint.
    let spare = 10 + (product >> 63);
    let rest = product & ((1 << spare) - 1);
    let below = (1 << (spare - 1)) - 1;
    let mantissa = real(((product >> spare) + u64::from(rest > below)).cast_signed());
    let power = f64::from_bits((exponent + spare - u64::from(shift)) << 52);
    (rest != below).then_some(mantissa * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str) {
        let expected: f64 = text.parse().unwrap();
        for (before, after) in [("", ""), ("9,", ",7"), ("", "\r\n1234567890")] {
            let line = format!("{before}{text}{after}");
            let found = number(line.as_bytes(), before.len()).map(|n| (n.value.to_bits(), n.end - before.len()));
            assert_eq!(found, expected.is_finite().then_some((expected.to_bits(), text.len())), "{line}");
        }
    }

    #[test]
    fn numbers_equal_those_of_the_standard_library() {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state >> 33
        };
        for _ in 0..400_000 {
            let (width, most) = (1 + next() % 26, 1 + next() % 20);
            let (width, most) = (usize::try_from(width).unwrap(), u32::try_from(most.min(width)).unwrap());
            let whole = (u128::from(next()) << 62 | u128::from(next() << 31 | next())) % 10_u128.pow(most);
            let digits = format!("{whole:0>width$}");
            let point = usize::try_from(next()).unwrap() % (width + 1);
            let sign = ["", "-"][usize::try_from(next() % 2).unwrap()];
            let exponents = ["", "e-3", "E5", "e+300", "e-17", "e+0002"];
            let exponent = exponents[usize::try_from((next() % 24).saturating_sub(18)).unwrap()];
            check(&format!("{sign}{}.{}{exponent}", &digits[..point], &digits[point..]));
            // The shortest representation that parses to the same number, as programs write it.
            let value = f64::from_bits(((next() << 31 | next()) % (1 << 52)) | ((1023 - next() % 64) << 52));
            check(&format!("{value}"));
            check(&format!("{value:.18e}"));
        }
    }

    #[test]
    fn midpoints_between_two_numbers_are_rounded_to_even() {
        for odd in (0..2_000_u64).map(|n| (1 << 53) + 1 + 2 * n * 1_234_567) {
            for places in 1..=4_usize {
                let whole = (odd * 5_u64.pow(u32::try_from(places).unwrap())).to_string();
                for near in ["", "0001", "00000000000000001"] {
                    let at = whole.len() - places;
                    check(&format!("{}.{}{near}", &whole[..at], &whole[at..]));
                }
            }
        }
    }

    #[test]
    fn other_texts_are_left_to_the_general_parser() {
        for none in
            ["", "-", ".", "-.", "+1", "1.2.3", "nan", "inf", "--1", "1 ", "1e", "1e400", "1,5", "\"1\"", "1e5e"]
        {
            assert!(number(none.as_bytes(), 0).is_none_or(|n| n.end < none.len()), "{none}");
        }
    }
}
