//! Limits of imported files.

use super::{FORMATS, expression, formats, layout, text};
use crate::limit::{Limit, limit, limit_of};

const TEXT: [Limit; 4] = [
    limit_of("bytes of a line of a CSV file", text::LINE_MAX, "refused, with the line"),
    limit_of("columns of a CSV file", layout::COLUMNS_MAX, "refused, with the line"),
    limit_of("bytes of an expression over columns", expression::LENGTH_MAX, "refused"),
    limit_of("levels of parentheses, signs and powers of an expression", expression::DEPTH_MAX, "refused"),
];

/// Returns the limits of imported files.
pub(in crate::record) fn limits() -> impl Iterator<Item = Limit> {
    let size = |name: &str| FORMATS.iter().find(|format| format.name == name).map_or(0, |format| format.bytes_max);
    let sizes = [
        limit("bytes of a workbook", size("XLSX"), "refused before it is read"),
        limit("bytes of a MAT-file", size("MAT"), "refused before it is read"),
        limit("bytes of a JSON file", size("JSON"), "refused before it is read"),
    ];
    TEXT.into_iter().chain(sizes).chain(formats::LIMITS.iter().copied())
}
