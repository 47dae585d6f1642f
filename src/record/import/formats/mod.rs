//! Other formats than CSV: a file becomes rows of cells as text, which then are read like those of a CSV.

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

/// A format other than CSV: a row of the table.
pub struct Format {
    /// Its name.
    pub name: &'static str,
    /// A sentence that describes it.
    pub text: &'static str,
    /// True if a file is of this format, by its first bytes.
    is: fn(&[u8]) -> bool,
    /// The largest file that is read.
    pub(super) bytes_max: u64,
    /// The tables of a file, of a workbook those of the sheet of a name.
    pub(super) tables: fn(&[u8], Option<&str>) -> Result<Vec<Cells>>,
}

/// The formats, in the order in which they are tried. What is none of them is CSV.
pub static FORMATS: [Format; 3] = [
    Format {
        name: "XLSX",
        text: "A workbook; the first sheet with numbers, or the one that is named.",
        is: |head| head.starts_with(b"PK\x03\x04") || head.starts_with(&[0xd0, 0xcf, 0x11, 0xe0]),
        bytes_max: 512 << 20,
        #[cfg(feature = "formats")]
        tables: |bytes, sheet| xlsx::xlsx(bytes, sheet).map(|cells| vec![cells]),
        #[cfg(not(feature = "formats"))]
        tables: left_out,
    },
    Format {
        name: "MAT",
        text: "A MAT-file of version 4, 6 or 7: vectors, matrices and structures of signals.",
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
        text: "A list of objects with numbers, one for each sample, with constants beside it; or a file of SysId or \
               frc-characterization, each of whose tests is a recording.",
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

/// Bytes by which the format is recognized.
pub(super) const HEAD: usize = 4096;

impl Format {
    /// Returns the format that the first bytes of a file tell; none for CSV.
    pub(super) fn of(head: &[u8]) -> Option<&'static Self> {
        FORMATS.iter().find(|format| (format.is)(head))
    }
}

#[cfg(not(feature = "formats"))]
fn left_out(_: &[u8], _: Option<&str>) -> Result<Vec<Cells>> {
    let message = "is a workbook or MAT-file, which this build does not read";
    Err(crate::Error::data(message, "Build with the feature formats, or save the recording as CSV."))
}

/// Rows of cells as lines.
pub(super) struct CellLines<'a> {
    rows: std::slice::Iter<'a, (u64, Vec<String>)>,
    text: String,
}

impl<'a> CellLines<'a> {
    /// The separator of their cells.
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
            // What would end a cell or a line is none of its content.
            self.text.extend(cell.chars().map(|c| if c.is_control() || c == '"' { ' ' } else { c }));
        }
        Ok(Some(Line { number: *number, bytes: self.text.as_bytes() }))
    }
}
