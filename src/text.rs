//! Formatting of text and numbers for messages; text of files and arguments is made safe to print on a terminal.

use std::fmt::Write as _;

/// Returns true for control characters and for characters that change the reading direction or end lines.
#[must_use]
pub fn is_unsafe(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
}

/// Returns `text` with every character of [`is_unsafe`] written as an escape such as `\u{1b}`.
#[must_use]
pub fn printable(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if is_unsafe(c) { shown.extend(c.escape_unicode()) } else { shown.push(c) }
    }
    shown
}

/// Returns the first 40 characters of `text` as [`printable`], with an ellipsis if more follow.
#[must_use]
pub fn excerpt(text: &str) -> String {
    const SHOWN: usize = 40;
    let mut shown = printable(&text.chars().take(SHOWN).collect::<String>());
    if text.chars().nth(SHOWN).is_some() {
        shown.push('…');
    }
    shown
}

/// Returns a word quoted for a POSIX shell if it needs quotes, free of control characters.
#[must_use]
pub fn shell_quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=+@%".contains(c);
    let word = printable(word);
    if !word.is_empty() && word.chars().all(plain) { word } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

/// Returns the [`excerpt`] of `text` in quotation marks.
#[must_use]
pub fn quoted(text: &str) -> String {
    format!("\"{}\"", excerpt(text))
}

/// Returns a count with its noun, with a plural `s` unless the count is one: `1 row`, `2 rows`.
#[must_use]
pub fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Returns a number with `digits` significant digits and an SI prefix: `0.00776` with the unit `H` gives `7.76 mH`.
#[must_use]
pub fn engineering(value: f64, unit: &str, digits: usize) -> String {
    const PREFIXES: [(&str, i32); 9] =
        [("G", 9), ("M", 6), ("k", 3), ("", 0), ("m", -3), ("µ", -6), ("n", -9), ("p", -12), ("f", -15)];
    if value == 0.0 || !value.is_finite() {
        return format!("{value} {unit}");
    }
    let (prefix, exponent) =
        PREFIXES.into_iter().find(|&(_, e)| value.abs() >= 0.999_999_5 * 10f64.powi(e)).unwrap_or(("f", -15));
    format!("{} {prefix}{unit}", significant(value / 10f64.powi(exponent), digits))
}

/// Largest number of significant digits that are written: no `f64` has more significant decimal digits.
const DIGITS_MAX: usize = 767;

/// Returns a number with `digits` significant digits (from 1 to 767), as a plain decimal from 1e-5 up to 1e7 and with an
/// exponent otherwise.
#[must_use]
pub fn significant(value: f64, digits: usize) -> String {
    let digits = digits.clamp(1, DIGITS_MAX);
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    let exponent = scientific.split_once('e').and_then(|(_, e)| e.parse::<i32>().ok()).unwrap_or(0);
    match usize::try_from(exponent) {
        Ok(whole) if whole < 7 => format!("{value:.*}", digits.saturating_sub(whole + 1)),
        Err(_) if exponent >= -5 => format!("{value:.*}", digits + exponent.unsigned_abs() as usize - 1),
        _ => scientific,
    }
}

/// Magnitude from which numbers in tables are written with an exponent.
const LARGE: f64 = 1e7;

/// Returns a number with `places` decimals (at most 767); with an exponent from 1e7, so that it fits a cell of a table.
#[must_use]
pub fn decimals(value: f64, places: usize) -> String {
    let places = places.min(DIGITS_MAX);
    if value.is_finite() && value.abs() >= LARGE { significant(value, places + 1) } else { format!("{value:.places$}") }
}

/// Formats a number as the shortest decimal that parses to the same value, with an exponent if it is very small or large.
#[derive(Debug, Clone, Copy)]
pub struct Shortest(pub f64);

/// Range of the magnitudes that are written without an exponent.
const PLAIN: std::ops::Range<f64> = 1e-7..1e16;

impl std::fmt::Display for Shortest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self(value) = *self;
        let is_plain = value == 0.0 || !value.is_finite() || PLAIN.contains(&value.abs());
        if is_plain { std::fmt::Display::fmt(&value, f) } else { std::fmt::LowerExp::fmt(&value, f) }
    }
}

/// Returns bytes as lower-case hexadecimal digits.
#[must_use]
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::with_capacity(2 * bytes.len()), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// Returns a JSON text with all characters of [`is_unsafe`] but line feeds escaped; JSON allows some of them unescaped.
#[must_use]
pub fn printable_json(json: &str) -> String {
    let mut shown = String::with_capacity(json.len());
    for c in json.chars() {
        if is_unsafe(c) && c != '\n' {
            let mut units = [0; 2];
            for unit in c.encode_utf16(&mut units) {
                let _ = write!(shown, "\\u{unit:04x}");
            }
        } else {
            shown.push(c);
        }
    }
    shown
}

/// Joins words to a list in a sentence: `a, b or c`.
#[must_use]
pub fn alternatives(words: &[&str]) -> String {
    listed(words, "or")
}

/// Joins words to a list in a sentence, with a conjunction before the last: `a, b and c`.
#[must_use]
pub fn listed(words: &[&str], conjunction: &str) -> String {
    match words {
        [some @ .., one, last] => [some, &[&format!("{one} {conjunction} {last}")]].concat().join(", "),
        _ => words.concat(),
    }
}

/// Length of the longest word for which an edit distance is computed \[bytes\]; the time is proportional to the product of
/// both lengths.
const COMPARED_MAX: usize = 256;

/// Returns the one of `words` with the smallest edit distance to `word` (optimal string alignment, regardless of the case of
/// `word`) if that is at most 2, or a third of the length of the word found. Words of more than 256 bytes are not compared.
#[must_use]
pub fn nearest<'a>(word: &str, words: &[&'a str]) -> Option<&'a str> {
    if word.len() > COMPARED_MAX {
        return None;
    }
    let word = word.to_lowercase();
    let distance = |known: &&str| strsim::osa_distance(&word, known);
    let short = words.iter().copied().filter(|known| known.len() <= COMPARED_MAX);
    let near = short.min_by_key(|known| distance(known))?;
    (distance(&near) <= 2.max(near.chars().count() / 3)).then_some(near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terminal_sequences_are_escaped() {
        assert_eq!(printable("a\u{1b}[31mb\u{9b}\u{202e}"), "a\\u{1b}[31mb\\u{9b}\\u{202e}");
        assert_eq!(excerpt(&"x".repeat(50)).chars().count(), 41);
    }

    #[test]
    fn numbers_read_as_an_engineer_writes_them() {
        assert_eq!(engineering(0.007_759, "H", 4), "7.759 mH");
        assert_eq!(engineering(-1234.0, "V", 3), "-1.23 kV");
        assert_eq!(engineering(0.0, "A", 3), "0 A");
        assert_eq!(significant(0.000_678, 3), "0.000678");
        assert_eq!(significant(0.000_000_678, 3), "6.78e-7");
        assert_eq!(significant(128.0935, 5), "128.09");
        assert_eq!(significant(f64::INFINITY, 5), "inf");
        assert_eq!(
            [1e307, -2.5e7, 2.5e6, -0.125].map(|v| decimals(v, 2)),
            ["1.00e307", "-2.50e7", "2500000.00", "-0.12"]
        );
        assert_eq!(
            [1e16, 1e15, -1e307, 1e-7, 5e-324, 0.0].map(|v| Shortest(v).to_string()),
            ["1e16", "1000000000000000", "-1e307", "0.0000001", "5e-324", "0"]
        );
        assert_eq!(alternatives(&["a", "b", "c"]), "a, b or c");
    }
}
