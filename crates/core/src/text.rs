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

/// SI prefixes with their powers of ten.
const PREFIXES: [(&str, i32); 10] =
    [("T", 12), ("G", 9), ("M", 6), ("k", 3), ("", 0), ("m", -3), ("µ", -6), ("n", -9), ("p", -12), ("f", -15)];

/// Returns a number with `digits` significant digits and an SI prefix: `0.00776` with the unit `H` gives `7.76 mH`.
#[must_use]
pub fn engineering(value: f64, unit: &str, digits: usize) -> String {
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

/// A unit with an SI prefix that suits the size of values, or with a power of ten if the unit takes no prefix: mH, 10⁻⁶ kg m².
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SuitableUnit {
    exponent: i32,
    /// Spelling of the unit; empty for numbers without one.
    pub text: String,
}

impl SuitableUnit {
    /// Chooses the unit for values of a size: numbers from 0.1 to 10⁴ stay as they are. Counts and percentages take no prefix.
    #[must_use]
    pub fn of(size: f64, unit: &str) -> Self {
        let spelled = unit.replace("ohm", "Ω").replace('*', " ").replace("^2", "²");
        let size = size.abs();
        let is_count = ["", "1", "%", "samples"].contains(&unit);
        let small = (-4..0).rev().map(|n| 3 * n).find(|exponent| size >= 10.0_f64.powi(*exponent));
        let large = (1..4).rev().map(|n| 3 * n).find(|exponent| size >= 10.0_f64.powi(exponent + 1));
        let exponent = match size {
            _ if is_count || !size.is_finite() || (0.1..1e4).contains(&size) => None,
            _ if size < 0.1 => small,
            _ => large,
        };
        let exponent = exponent.unwrap_or(0);
        let prefix = PREFIXES.iter().find(|(_, of)| *of == exponent).map_or("", |(prefix, _)| *prefix);
        let text = match exponent {
            0 if unit == "1" => String::new(),
            0 => spelled,
            _ if spelled.starts_with("kg") => format!("10{} {spelled}", raised(exponent)),
            _ => format!("{prefix}{spelled}"),
        };
        Self { exponent, text }
    }

    /// Converts a value to the unit.
    #[must_use]
    pub fn scale(&self, value: f64) -> f64 {
        value * 10.0_f64.powi(-self.exponent)
    }
}

/// Returns a value with its standard error, and the unit that suits its size: `["7.7622 ± 0.0071", "mH"]`. The error has two
/// significant digits and the value its decimals; without an error the value has five significant digits.
#[must_use]
pub fn in_suitable_unit(value: f64, std_error: Option<f64>, unit: &str) -> [String; 2] {
    let unit = SuitableUnit::of(value.abs().max(std_error.unwrap_or(0.0)), unit);
    [with_digits_of(unit.scale(value), std_error.map(|error| unit.scale(error))), unit.text]
}

/// Returns `value ± error` with two significant digits of the error; the value alone with five without an error.
fn with_digits_of(value: f64, std_error: Option<f64>) -> String {
    match std_error.filter(|error| *error > 0.0 && error.is_finite()) {
        Some(error) => {
            // An error of 0.0996 is 0.10: digits are counted after rounding to two.
            let exponent = format!("{error:.1e}").split_once('e').and_then(|(_, e)| e.parse::<i32>().ok()).unwrap_or(0);
            let places = usize::try_from(1 - exponent).unwrap_or(0).min(12);
            format!(
                "{value:.places$} ± {}",
                if exponent > 1 { format!("{error:.0}") } else { format!("{error:.places$}") }
            )
        }
        None => significant(value, 5),
    }
}

/// Returns a whole number in superscript digits.
#[doc(hidden)]
pub fn raised(exponent: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digit = |c: char| c.to_digit(10).and_then(|n| DIGITS.get(n as usize)).copied().unwrap_or('⁻');
    exponent.to_string().chars().map(digit).collect()
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

    #[test]
    fn values_have_the_digits_of_their_errors() {
        let cases = [
            ((0.007_762_2, Some(7.1e-6), "H"), ["7.7622 ± 0.0071", "mH"]),
            ((0.000_135_986, Some(8.7e-8), "kg*m^2"), ["135.986 ± 0.087", "10⁻⁶ kg m²"]),
            ((0.921_083, Some(0.000_46), "ohm"), ["0.92108 ± 0.00046", "Ω"]),
            ((0.073_457_3, Some(1.4e-5), "V*s/rad"), ["73.457 ± 0.014", "mV s/rad"]),
            ((0.000_677_673, Some(2.9e-7), "N*m*s/rad"), ["677.67 ± 0.29", "µN m s/rad"]),
            ((1.4, None, "ohm"), ["1.4000", "Ω"]),
            ((0.97, Some(0.0099), "1"), ["0.9700 ± 0.0099", ""]),
            ((32.0, None, "samples"), ["32.000", "samples"]),
            ((1234.5, Some(560.0), "ohm"), ["1234 ± 560", "Ω"]),
            ((23_456.0, Some(560.0), "ohm"), ["23.46 ± 0.56", "kΩ"]),
            ((2.0, Some(345.0), "A"), ["2 ± 345", "A"]),
            ((0.0, None, "s"), ["0", "s"]),
            ((5.0, Some(0.0996), "V"), ["5.00 ± 0.10", "V"]),
            ((2e-5, None, "1"), ["0.000020000", ""]),
            ((3e-14, None, "H"), ["3.0000e-14", "H"]),
        ];
        for ((value, error, unit), expected) in cases {
            assert_eq!(in_suitable_unit(value, error, unit), expected, "{value} {error:?} {unit}");
        }
        for value in [f64::NAN, f64::INFINITY, 5e-324, -1e308] {
            let _ = in_suitable_unit(value, Some(value), "kg*m^2");
        }
    }
}
