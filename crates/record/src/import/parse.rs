//! Splitting of lines into cells, and parsing of cells as numbers.

use super::decimal::number;
use motorfit_core::text::excerpt;
use std::ops::Range;

/// The separator of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Separator {
    /// A comma, a semicolon or a tab.
    Sign(u8),
    /// One or more blanks.
    Blanks,
}

impl Separator {
    /// Detects the separator of a line; separators at its end do not count. A line of numbers has `;` if there is one, else
    /// tab, else `,`, which may be a decimal comma. Any other line has the most frequent of them, `;` before tab before `,` in
    /// case of a tie. Without any of them, blanks separate the cells.
    pub(super) fn of(line: &str) -> Self {
        let inside = line.trim().trim_end_matches([';', '\t', ',']);
        let count = |sign: u8| inside.bytes().filter(|b| *b == sign).count();
        let numeric = inside.split([';', '\t', ',', ' ']).filter(|c| !c.is_empty()).all(is_number);
        let signs = [b',', b'\t', b';'];
        let best = if numeric {
            signs.into_iter().rev().find(|&c| count(c) > 0)
        } else {
            signs.into_iter().max_by_key(|&c| count(c)).filter(|&c| count(c) > 0)
        };
        match best {
            Some(sign) => Self::Sign(sign),
            None if inside.split_whitespace().nth(1).is_some() => Self::Blanks,
            None => Self::Sign(b','),
        }
    }

    /// Replaces `into` by the byte ranges of the cells of a line.
    pub(super) fn split(self, line: &str, into: &mut Vec<Range<usize>>) {
        match self {
            // Some loggers end lines with a semicolon although their separator is another one.
            Self::Sign(b';') => cells(line, b';', into),
            Self::Sign(sign) if line.ends_with([' ', ';', '\r']) => {
                cells(line.trim_end_matches([' ', ';', '\r']), sign, into);
            }
            Self::Sign(sign) => cells(line, sign, into),
            Self::Blanks => words(line.trim_end_matches([' ', ';']), into),
        }
    }

    /// Returns true if numbers may have a decimal comma, because the separator is not a comma.
    pub(super) fn allows_decimal_comma(self) -> bool {
        self != Self::Sign(b',')
    }

    /// Returns the cells of a line, without an empty last one.
    pub(super) fn row(self, line: &str) -> Vec<&str> {
        let mut places = Vec::new();
        self.split(line, &mut places);
        let mut row: Vec<&str> = places.into_iter().map(|cell| &line[cell]).collect();
        if row.len() > 1 && row.last().is_some_and(|cell| cell.is_empty()) {
            row.pop();
        }
        row
    }
}

/// Returns true if a cell is a finite number or NaN.
pub(super) fn is_number(cell: &str) -> bool {
    parse_number(cell, true).is_ok() || cell.trim().eq_ignore_ascii_case("nan")
}

/// Replaces `into` by the byte ranges of the cells of a line, without blanks and quotes around them. A cell in double quotes
/// may contain the separator.
fn cells(line: &str, separator: u8, into: &mut Vec<Range<usize>>) {
    into.clear();
    let bytes = line.as_bytes();
    let (mut start, mut quoted) = (0, false);
    for (at, &byte) in bytes.iter().enumerate() {
        if byte == separator && !quoted {
            into.push(bare(line, start..at));
            start = at + 1;
        } else if byte == b'"' {
            quoted = !quoted;
        }
    }
    into.push(bare(line, start..bytes.len()));
}

/// Replaces `into` by the byte ranges of the words of a line, for cells that are separated by blanks.
fn words(line: &str, into: &mut Vec<Range<usize>>) {
    into.clear();
    into.extend(line.split_whitespace().map(|word| place(line, word)));
}

/// Returns the byte range of a cell without blanks and quotes around it.
fn bare(line: &str, cell: Range<usize>) -> Range<usize> {
    let blank = [' ', '\t', '\r', '\u{c}'];
    let cell = line[cell].trim_matches(blank);
    let inner = cell.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
    place(line, inner.map_or(cell, |inner| inner.trim_matches(blank)))
}

/// Returns the byte range of `part`, a subslice of `line`.
fn place(line: &str, part: &str) -> Range<usize> {
    let start = part.as_ptr() as usize - line.as_ptr() as usize;
    start..start + part.len()
}

/// Returns the length of the number at the start of a text \[bytes\], with leading blanks.
pub(super) fn number_length(text: &str) -> usize {
    let number = text.trim_start().as_bytes();
    let is_sign = |n: usize| matches!(number[n], b'+' | b'-') && (n == 0 || matches!(number[n - 1], b'e' | b'E'));
    let is_inside = |n: &usize| matches!(number[*n], b'0'..=b'9' | b'.' | b'e' | b'E') || is_sign(*n);
    text.len() - number.len() + (0..number.len()).take_while(is_inside).count()
}

/// Parses a cell as a finite number; with `decimal_comma` both `1,5` and `1.5` are 1.5.
///
/// # Errors
/// Returns a message of what was found and what was expected if the cell is empty, not a number or not finite.
pub fn parse_number(cell: &str, decimal_comma: bool) -> Result<f64, String> {
    match number(cell.as_bytes(), 0) {
        Some(number) if number.end == cell.len() => Ok(number.value),
        _ => parse_any(cell, decimal_comma),
    }
}

/// Parses a cell with the standard library, or returns the message of [`parse_number`].
fn parse_any(cell: &str, decimal_comma: bool) -> Result<f64, String> {
    let cell = cell.trim();
    if cell.is_empty() {
        return Err("found an empty cell, expected a number".to_owned());
    }
    let swapped;
    let text = if decimal_comma && cell.contains(',') {
        if cell.contains('.') {
            return Err(format!("found \"{}\" with both comma and point, expected a number", excerpt(cell)));
        }
        swapped = cell.replacen(',', ".", 1);
        swapped.as_str()
    } else {
        cell
    };
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(value) if value.is_nan() => Err(format!("found \"{}\", not a number", excerpt(cell))),
        Ok(_) => Err(format!("found \"{}\", infinite or too large, expected a finite number", excerpt(cell))),
        Err(_) => Err(format!("found \"{}\", expected a number", excerpt(cell))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_cells_may_contain_separators() {
        let mut row = Vec::new();
        let mut split = |line: &'static str, separator| -> Vec<&'static str> {
            cells(line, separator, &mut row);
            row.iter().map(|cell| &line[cell.clone()]).collect()
        };
        assert_eq!(split("\"0,5\", 2 ,\"\",x", b','), ["0,5", "2", "", "x"]);
        assert_eq!(split("a;b;", b';'), ["a", "b", ""]);
        assert_eq!(split("\";ü", b';'), ["\";ü"]);
        words("  1.5   x\t3 ", &mut row);
        assert_eq!(row, [2..5, 8..9, 10..11]);
    }

    #[test]
    fn numbers_and_other_cells() {
        assert_eq!(parse_number(" 1,5e-3 ", true), Ok(0.0015));
        assert_eq!(parse_number("-2.5", true), Ok(-2.5));
        for (cell, comma) in
            [("", true), ("abc", true), ("1,5", false), ("1.000,5", true), ("NaN", true), ("inf", true)]
        {
            assert!(parse_number(cell, comma).is_err(), "{cell}");
        }
        assert!(parse_number("1e400", false).is_err_and(|e| e.contains("too large")));
    }
}
