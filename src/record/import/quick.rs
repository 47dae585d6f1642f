//! Rows of plain numbers between single separators, which nearly all rows are, in one pass over their bytes. What is
//! anything else is left to the general way, which also says what is wrong.
//!
//! Limit: SHA-256 of the bytes (1.6 GB/s here) and one look at each byte.

/// Reads rows into values.
pub(super) struct Quick {
    separator: u8,
    /// For each cell the place of its value, if it is used.
    slots: Vec<Option<usize>>,
    /// The values of the row that was read last.
    pub row: Vec<f64>,
    /// Whether any number had a decimal point.
    pub has_point: bool,
}

impl Quick {
    /// `used`: which cell of `width` each value comes from.
    pub(super) fn new(separator: u8, width: usize, used: impl Iterator<Item = usize>) -> Self {
        let mut slots = vec![None; width];
        let mut count = 0;
        for at in used {
            slots[at] = Some(count);
            count += 1;
        }
        Self { separator, slots, row: vec![0.0; count], has_point: false }
    }

    /// Whether a line is such a row; its values are then in `row`.
    pub(super) fn read(&mut self, line: &[u8]) -> bool {
        let mut rest = line;
        let last = self.slots.len() - 1;
        for (n, slot) in self.slots.iter().enumerate() {
            let end = match slot {
                Some(slot) => number(rest, self.separator).map(|(value, end)| {
                    self.row[*slot] = value;
                    self.has_point = self.has_point || rest[..end].contains(&b'.');
                    end
                }),
                None => skipped(rest, self.separator),
            };
            match end {
                Some(end) if n < last && end < rest.len() => rest = &rest[end + 1..],
                Some(end) if n == last && end == rest.len() => {}
                _ => return false,
            }
        }
        true
    }
}

/// Where a cell without quotes and odd characters ends.
fn skipped(bytes: &[u8], separator: u8) -> Option<usize> {
    for (at, &byte) in bytes.iter().enumerate() {
        if byte == separator {
            return Some(at);
        }
        if byte == b'"' || !(0x20..0x7f).contains(&byte) {
            return None;
        }
    }
    Some(bytes.len())
}

/// Powers of ten that are exact.
const TENS: [f64; 16] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
/// Digits whose integer is exact.
const DIGITS: usize = 15;

/// The number at the start of some bytes, up to a separator or the end, and where it ends.
///
/// A decimal of at most 15 digits is an integer over a power of ten, both exact, so that one division rounds correctly
/// (W. D. Clinger 1990); any other is left to the standard library.
pub(super) fn number(bytes: &[u8], separator: u8) -> Option<(f64, usize)> {
    let negative = bytes.first() == Some(&b'-');
    let start = usize::from(negative);
    let (whole, point) = digits(bytes, start, 0);
    let (whole, end, decimals) = if bytes.get(point) == Some(&b'.') {
        let (whole, end) = digits(bytes, point + 1, whole);
        (whole, end, end - point - 1)
    } else {
        (whole, point, 0)
    };
    match bytes.get(end) {
        None => {}
        Some(&byte) if byte == separator => {}
        Some(b'e' | b'E') => return scientific(bytes, separator),
        Some(_) => return None,
    }
    match end - start - usize::from(end > point) {
        0 => None,
        1..=DIGITS => {
            #[expect(clippy::cast_precision_loss, reason = "15 digits are below 2^53")]
            let value = whole as f64 / TENS[decimals];
            Some((if negative { -value } else { value }, end))
        }
        _ => scientific(bytes, separator),
    }
}

/// Digits from `at` on behind those of `whole`, and where they end; more than fit come out wrong.
#[inline]
fn digits(bytes: &[u8], mut at: usize, mut whole: u64) -> (u64, usize) {
    while let Some(digit) = bytes.get(at).map(|byte| byte.wrapping_sub(b'0')).filter(|digit| *digit < 10) {
        whole = whole.wrapping_mul(10).wrapping_add(u64::from(digit));
        at += 1;
    }
    (whole, at)
}

/// The same for any digits and an exponent.
fn scientific(bytes: &[u8], separator: u8) -> Option<(f64, usize)> {
    let end = bytes.iter().position(|&b| b == separator).unwrap_or(bytes.len());
    let cell = &bytes[..end];
    let plain = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+' | b'e' | b'E');
    let text = std::str::from_utf8(cell).ok().filter(|_| cell.iter().all(plain))?;
    text.parse::<f64>().ok().filter(|value| value.is_finite()).map(|value| (value, end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_standard_library() {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state >> 33
        };
        for _ in 0..200_000 {
            let width = usize::try_from(1 + next() % 19).unwrap();
            let digits = format!("{:0>width$}", (next() << 31 | next()) % 10_u64.pow(u32::try_from(width).unwrap()));
            let point = usize::try_from(next()).unwrap() % (width + 1);
            let sign = ["", "-"][usize::try_from(next() % 2).unwrap()];
            let exponent = ["", "e-3", "E5", "e+300"][usize::try_from((next() % 16).saturating_sub(12)).unwrap()];
            let text = format!("{sign}{}.{}{exponent}", &digits[..point], &digits[point..]);
            let expected: f64 = text.parse().unwrap();
            let cells = format!("{text},7");
            let found = number(cells.as_bytes(), b',').map(|(value, end)| (value.to_bits(), end));
            assert_eq!(found, expected.is_finite().then_some((expected.to_bits(), text.len())), "{text}");
        }
        for none in ["", "-", ".", "-.", "+1", "1.2.3", "nan", "inf", "--1", "1 ", "1e", "1e400", "1,5", "\"1\""] {
            assert_eq!(number(none.as_bytes(), b';'), None, "{none}");
        }
    }

    #[test]
    fn a_row_is_read_or_left_to_others() {
        let mut quick = Quick::new(b',', 4, [0, 2, 3].into_iter());
        assert!(quick.read(b"0.5,some text,-3,4e-1"));
        assert_eq!(quick.row, [0.5, -3.0, 0.4]);
        for other in
            ["0.5,x,3", "0.5,x,3,4,", "0.5,x,3,4,5", "0.5,\"x\",3,4", "0.5,\u{1},3,4", " 1,x,3,4", "1,x,,4", ""]
        {
            assert!(!quick.read(other.as_bytes()), "{other}");
        }
    }
}
