//! Fast path for rows of plain numbers between single separators, as nearly all rows are: one pass over their bytes. Any
//! other row is left to the general parser, which also words the errors.
//!
//! The throughput is bounded by the SHA-256 digest of the bytes (1.6 GB/s measured) and one pass over them.

use super::decimal::number;
use super::text::LINE_MAX;

/// Parser of rows of plain numbers.
pub(super) struct Quick {
    separator: u8,
    /// Index in `row` of the value of each cell; `None` if the cell is not used.
    slots: Vec<Option<usize>>,
    /// Values of the last row, in the order of the used cells.
    pub row: Vec<f64>,
    /// True if any number up to now had a decimal point.
    pub has_point: bool,
}

impl Quick {
    /// Creates a parser of rows of `width` cells; `used` are the indices of the cells whose values are kept.
    pub(super) fn new(separator: u8, width: usize, used: impl Iterator<Item = usize>) -> Self {
        let mut slots = vec![None; width];
        let mut count = 0;
        for at in used {
            slots[at] = Some(count);
            count += 1;
        }
        Self { separator, slots, row: vec![0.0; count], has_point: false }
    }

    /// Parses the line at byte `start` into `row` and returns the start of the next line; `None` if it is not a complete line
    /// of plain numbers.
    pub(super) fn read_at(&mut self, lines: &[u8], start: usize) -> Option<usize> {
        let end = self.row_at(lines, start).filter(|end| end - start <= LINE_MAX)?;
        match lines.get(end)? {
            b'\n' => Some(end + 1),
            b'\r' if lines.get(end + 1) == Some(&b'\n') => Some(end + 2),
            _ => None,
        }
    }

    /// Parses the cells from byte `at` and returns the end of the last one.
    #[inline]
    fn row_at(&mut self, lines: &[u8], mut at: usize) -> Option<usize> {
        let last = self.slots.len() - 1;
        for (n, slot) in self.slots.iter().enumerate() {
            let end = match slot {
                Some(slot) => {
                    let number = number(lines, at)?;
                    self.row[*slot] = number.value;
                    self.has_point |= number.has_point;
                    number.end
                }
                None => skipped(lines, at, self.separator)?,
            };
            if n == last {
                return Some(end);
            }
            if lines.get(end) != Some(&self.separator) {
                return None;
            }
            at = end + 1;
        }
        None
    }
}

/// Returns the end of an unused cell; `None` if it has quotes or characters other than printable ASCII.
fn skipped(lines: &[u8], start: usize, separator: u8) -> Option<usize> {
    let is_end = |byte: u8| byte == separator || byte == b'"' || !(0x20..0x7f).contains(&byte);
    let end = lines[start..].iter().position(|&byte| is_end(byte)).map_or(lines.len(), |size| start + size);
    lines.get(end).is_none_or(|byte| *byte == separator || matches!(byte, b'\r' | b'\n')).then_some(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_parsed_or_left_to_the_general_parser() {
        let mut quick = Quick::new(b',', 4, [0, 2, 3].into_iter());
        let read = |quick: &mut Quick, line: &str| quick.row_at(line.as_bytes(), 0) == Some(line.len());
        assert!(read(&mut quick, "0.5,some text,-3,4e-1"));
        assert_eq!(quick.row, [0.5, -3.0, 0.4]);
        for other in
            ["0.5,x,3", "0.5,x,3,4,", "0.5,x,3,4,5", "0.5,\"x\",3,4", "0.5,\u{1},3,4", " 1,x,3,4", "1,x,,4", ""]
        {
            assert!(!read(&mut quick, other), "{other}");
        }
        let lines = b"1,a,2,3\r\n4,,5,6\n7,,8,9\r0,,1,2";
        assert_eq!(quick.read_at(lines, 0), Some(9));
        assert_eq!(quick.read_at(lines, 9), Some(16));
        assert_eq!(quick.row, [4.0, 5.0, 6.0]);
        assert_eq!(quick.read_at(lines, 16), None, "a carriage return alone");
        assert_eq!(quick.read_at(lines, 24), None, "a line without its end");
    }
}
