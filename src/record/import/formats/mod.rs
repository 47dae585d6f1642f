//! Formats other than CSV: workbooks, MAT-files and JSON. A file is converted to rows of text cells, which are then read like
//! those of a CSV file. A new format is a file that returns `Cells`, and a row of `FORMATS`.

#[cfg(feature = "formats")]
mod archive;
mod cells;
#[cfg(feature = "formats")]
mod limits;
#[cfg(feature = "formats")]
mod mat;
#[cfg(feature = "formats")]
mod mat_element;
#[cfg(feature = "formats")]
mod mat_file;
mod records;
mod sysid;
#[cfg(all(test, feature = "formats"))]
mod tests;
#[cfg(feature = "formats")]
mod xlsx;

use super::parse::Separator;
use super::text::{Line, Lines};
use crate::Result;
pub(super) use cells::Cells;
#[cfg(feature = "formats")]
pub(super) use limits::LIMITS;
#[cfg(not(feature = "formats"))]
pub(super) const LIMITS: [crate::limit::Limit; 0] = [];

/// A format other than CSV, as a row of the table [`FORMATS`].
pub struct Format {
    /// Name of the format.
    pub name: &'static str,
    /// Description as a sentence.
    pub text: &'static str,
    /// Function that returns true if the first bytes of a file are those of this format.
    is: fn(&[u8]) -> bool,
    /// Size of the largest accepted file \[bytes\].
    pub(super) bytes_max: u64,
    /// Function that reads the tables of a file; the name selects a sheet or a list.
    pub(super) tables: fn(&[u8], Option<&str>) -> Result<Vec<Cells>>,
}

/// Formats in the order in which they are tried. A file of none of them is read as CSV.
pub static FORMATS: [Format; 3] = [
    Format {
        name: "XLSX",
        text: "A workbook: the first sheet with numbers, or the named one.",
        is: |head| head.starts_with(b"PK\x03\x04") || head.starts_with(&[0xd0, 0xcf, 0x11, 0xe0]),
        bytes_max: 512 << 20,
        #[cfg(feature = "formats")]
        tables: |bytes, sheet| xlsx::xlsx(bytes, sheet).map(|cells| vec![cells]),
        #[cfg(not(feature = "formats"))]
        tables: left_out,
    },
    Format {
        name: "MAT",
        text: "A MAT-file of version 6 or 7: vectors, matrices and structures of signals.",
        is: |head| {
            let mat = head.starts_with(b"MATLAB 5.0 MAT-file") || matches!(head.get(126..128), Some(b"IM" | b"MI"));
            mat || head.starts_with(b"MATLAB 7.3") || head.starts_with(b"\x89HDF")
        },
        bytes_max: 512 << 20,
        #[cfg(feature = "formats")]
        tables: |bytes, _| mat::mat(bytes).map(|cells| vec![cells]),
        #[cfg(not(feature = "formats"))]
        tables: left_out,
    },
    Format {
        name: "JSON",
        text: "A list of objects with numbers, one for each sample, optionally with constants beside it; or a file of SysId \
               or frc-characterization, each test of which is a recording.",
        is: |head| {
            let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
            text.starts_with(b"{") || text.starts_with(b"[")
        },
        bytes_max: 64 << 20,
        tables: |bytes, name| match sysid::is_sysid(bytes) {
            true => sysid::sysid(bytes),
            false => records::records(bytes, name),
        },
    },
];

/// Number of bytes at the start of a file from which its format is detected.
pub(super) const HEAD: usize = 4096;

impl Format {
    /// Detects the format from the first bytes of a file; `None` for CSV.
    pub(super) fn of(head: &[u8]) -> Option<&'static Self> {
        FORMATS.iter().find(|format| (format.is)(head))
    }
}

#[cfg(not(feature = "formats"))]
fn left_out(_: &[u8], _: Option<&str>) -> Result<Vec<Cells>> {
    let message = "is a workbook or MAT-file, which this build does not read";
    Err(crate::Error::data(message, "Build with the feature formats, or save the recording as CSV."))
}

/// Rows of cells as lines of text.
pub(super) struct CellLines<'a> {
    rows: std::slice::Iter<'a, (u64, Vec<String>)>,
    text: String,
}

impl<'a> CellLines<'a> {
    /// Separator of the cells.
    pub(super) const SEPARATOR: Separator = Separator::Sign(b'\t');

    pub(super) fn new(cells: &'a Cells) -> Self {
        Self { rows: cells.rows.iter(), text: String::new() }
    }
}

impl Lines for CellLines<'_> {
    fn next_line(&mut self) -> Result<Option<Line<'_>>> {
        let Some((number, row)) = self.rows.next() else { return Ok(None) };
        self.text.clear();
        for (n, cell) in row.iter().enumerate() {
            if n > 0 {
                self.text.push('\t');
            }
            // Characters that would end a cell or a line are replaced by blanks.
            self.text.extend(cell.chars().map(|c| if c.is_control() || c == '"' { ' ' } else { c }));
        }
        Ok(Some(Line { number: *number, bytes: self.text.as_bytes() }))
    }
}
