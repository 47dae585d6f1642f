//! Tables as their files hold them, before anything is understood of them.

/// A table as a file holds it: rows of cells as text.
///
/// All rows are equally long. Empty cells are empty texts.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cells {
    /// The name of the sheet or of the test; empty where a file has just one table.
    pub name: String,
    /// Rows with their numbers as a person counts them: those of the spreadsheet, or from 1 with the heading.
    pub rows: Vec<(u64, Vec<String>)>,
    /// Notes on what was left out or changed.
    pub notes: Vec<String>,
    /// Numbers that stand beside the rows, with their names.
    pub constants: Vec<(String, f64)>,
}

/// The most cells of a table.
#[cfg(feature = "formats")]
pub(crate) const CELLS_MAX: usize = 20_000_000;
/// The most columns of a table.
#[cfg(feature = "formats")]
pub(crate) const COLUMNS_MAX: usize = 1000;
/// The most bytes that a compressed file may unpack to.
#[cfg(feature = "formats")]
pub(crate) const UNPACKED_MAX: u64 = 1 << 30;
/// The largest ratio of a file's decompressed size to its own, beyond [`UNPACKED_FREE`]: recordings decompress to
/// some five to ten times their size.
#[cfg(feature = "formats")]
pub(crate) const UNPACKED_RATIO: u64 = 50;
/// The bytes that any compressed file may unpack to.
#[cfg(feature = "formats")]
pub(crate) const UNPACKED_FREE: u64 = 32 << 20;
/// The cells that a table of any compressed file may have, and bytes of a larger file for each more.
#[cfg(feature = "formats")]
pub(crate) const CELLS_FREE: usize = 4_000_000;

/// Returns the most bytes that a compressed file may unpack to, and the most cells of its table.
#[cfg(feature = "formats")]
pub(super) fn unpacked_limits(bytes: &[u8]) -> (u64, usize) {
    let size = bytes.len();
    let unpacked = (size as u64).saturating_mul(UNPACKED_RATIO).clamp(UNPACKED_FREE, UNPACKED_MAX);
    (unpacked, size.clamp(CELLS_FREE, CELLS_MAX))
}

/// A number as the shortest text that gives the same number again; with an exponent where that avoids many zeros.
pub(super) fn number(value: f64) -> String {
    let plain = value == 0.0 || value.is_infinite() || (1e-6..1e17).contains(&value.abs());
    match value.is_nan() {
        true => "nan".to_owned(),
        false if plain => value.to_string(),
        false => format!("{value:e}"),
    }
}

/// At most `max` of the notes; how many more there are is the last one.
#[cfg(feature = "formats")]
pub(super) fn shortened(mut notes: Vec<String>, max: usize) -> Vec<String> {
    if notes.len() > max {
        let more = notes.len() - max;
        notes.truncate(max);
        notes.push(format!("{more} more of this sort"));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_give_themselves_again() {
        for value in [0.1, -1e-300, 1.0 / 3.0, 5e-324, f64::MAX, 3.0, 1e-6, 123_456_789e9, 1e17] {
            assert_eq!(number(value).parse(), Ok(value));
            assert!(number(value).len() < 25);
        }
        assert_eq!([3.0, -0.001, 1e20, -2.5e-9].map(number), ["3", "-0.001", "1e20", "-2.5e-9"]);
        assert_eq!([f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(number), ["nan", "inf", "-inf"]);
    }
}
