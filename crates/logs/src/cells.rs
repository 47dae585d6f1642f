//! Tables of text cells, as read from files of other formats than CSV, and the limits of their sizes.

/// A table of a file as rows of text cells.
///
/// All rows have the same length. Empty cells are empty strings.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cells {
    /// Name of the sheet or of the test; empty if the file has only one table.
    pub name: String,
    /// Row numbers and cells; the numbers are those that the spreadsheet shows, or count from 1 with the heading.
    pub rows: Vec<(u64, Vec<String>)>,
    /// Notes on data that were left out or changed.
    pub notes: Vec<String>,
    /// Names and values of constants beside the rows.
    pub constants: Vec<(String, f64)>,
}

/// Largest number of cells of a table.
#[cfg(feature = "formats")]
pub(crate) const CELLS_MAX: usize = 20_000_000;
/// Largest number of columns of a table.
#[cfg(feature = "formats")]
pub(crate) const COLUMNS_MAX: usize = 1000;
/// Largest decompressed size of any file \[bytes\].
#[cfg(feature = "formats")]
pub(crate) const UNPACKED_MAX: u64 = 1 << 30;
/// Largest compression ratio of a file whose decompressed size exceeds [`UNPACKED_FREE`]. Recordings have a ratio of about 5
/// to 10.
#[cfg(feature = "formats")]
pub(crate) const UNPACKED_RATIO: u64 = 50;
/// Decompressed size that is accepted at any compression ratio \[bytes\].
#[cfg(feature = "formats")]
pub(crate) const UNPACKED_FREE: u64 = 32 << 20;
/// Number of cells that is accepted for files of any size; a larger table must have at most one cell per byte of the
/// compressed file.
#[cfg(feature = "formats")]
pub(crate) const CELLS_FREE: usize = 4_000_000;

/// Returns the largest decompressed size \[bytes\] and the largest number of cells for a compressed file.
#[cfg(feature = "formats")]
pub(crate) fn unpacked_limits(bytes: &[u8]) -> (u64, usize) {
    let size = bytes.len();
    let unpacked = (size as u64).saturating_mul(UNPACKED_RATIO).clamp(UNPACKED_FREE, UNPACKED_MAX);
    (unpacked, size.clamp(CELLS_FREE, CELLS_MAX))
}

/// Returns the shortest text that parses to the same number, with an exponent for very small and very large numbers.
pub(crate) fn number(value: f64) -> String {
    let plain = value == 0.0 || value.is_infinite() || (1e-6..1e17).contains(&value.abs());
    match value.is_nan() {
        true => "nan".to_owned(),
        false if plain => value.to_string(),
        false => format!("{value:e}"),
    }
}

/// Returns the first `max` notes; if there are more, a last note has their count.
#[cfg(any(feature = "formats", feature = "hdf5", feature = "mdf", feature = "parquet"))]
pub(crate) fn shortened(mut notes: Vec<String>, max: usize) -> Vec<String> {
    if notes.len() > max {
        let more = notes.len() - max;
        notes.truncate(max);
        notes.push(format!("{more} more of this kind"));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_parse_to_the_same_value() {
        for value in [0.1, -1e-300, 1.0 / 3.0, 5e-324, f64::MAX, 3.0, 1e-6, 123_456_789e9, 1e17] {
            assert_eq!(number(value).parse(), Ok(value));
            assert!(number(value).len() < 25);
        }
        assert_eq!([3.0, -0.001, 1e20, -2.5e-9].map(number), ["3", "-0.001", "1e20", "-2.5e-9"]);
        assert_eq!([f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(number), ["nan", "inf", "-inf"]);
    }
}
