//! Limits of imported files.

use super::{expression, layout, logs, text};
use motorfit_core::limit::{Limit, limit, limit_of};
use motorfit_logs::{FORMATS, Reader};

const TEXT: [Limit; 4] = [
    limit_of("bytes of a line of a CSV file", text::LINE_MAX, "refused, with the line"),
    limit_of("columns of a CSV file", layout::COLUMNS_MAX, "refused, with the line"),
    limit_of("bytes of an expression over columns", expression::LENGTH_MAX, "refused"),
    limit_of("levels of parentheses, signs and powers of an expression", expression::DEPTH_MAX, "refused"),
];

/// Returns the limits of imported files.
pub(crate) fn limits() -> impl Iterator<Item = Limit> {
    let size = |name: &str| match FORMATS.iter().find(|format| format.name == name).map(|format| format.read) {
        Some(Reader::Tables { bytes_max, .. }) => bytes_max,
        _ => 0,
    };
    let sizes = [
        limit("bytes of a workbook", size("XLSX"), "refused before it is read"),
        limit("bytes of a MAT-file", size("MAT"), "refused before it is read"),
        limit("bytes of a JSON file", size("JSON"), "refused before it is read"),
    ];
    let logs = [
        limit("values that are read from a log", logs::VALUES_MAX, "refused: cut the log"),
        limit_of("entries of a WPILib data log", motorfit_logs::ENTRIES_MAX, "further entries are left out"),
        limit_of(
            "values of an array entry of a WPILib data log",
            motorfit_logs::ARRAY_MAX,
            "further values are left out",
        ),
        limit_of("bytes of a record of a WPILib data log", motorfit_logs::PAYLOAD_MAX, "the record is left out"),
    ];
    TEXT.into_iter().chain(sizes).chain(logs).chain(motorfit_logs::LIMITS.iter().copied())
}
