//! Other formats than CSV: a file becomes rows of cells as text, which then are read like those of a CSV.

#[cfg(feature = "formats")]
mod archive;
mod cells;
#[cfg(feature = "formats")]
mod mat;
#[cfg(feature = "formats")]
mod mat_element;
#[cfg(feature = "formats")]
mod mat_file;
mod sysid;
#[cfg(all(test, feature = "formats"))]
mod tests;
#[cfg(feature = "formats")]
mod xlsx;

use super::layout::Separator;
use super::text::{Line, Lines};
use crate::{Error, Result};
pub(super) use cells::Cells;

/// What a file is, by its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    Csv,
    Workbook,
    Mat,
    Json,
}

/// How many first bytes tell the format.
pub(super) const HEAD: usize = 4096;

impl Format {
    pub(super) fn of(head: &[u8]) -> Self {
        let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
        let old_workbook = head.starts_with(&[0xd0, 0xcf, 0x11, 0xe0]);
        let mat = head.starts_with(b"MATLAB 5.0 MAT-file") || matches!(head.get(126..128), Some(b"IM" | b"MI"));
        if head.starts_with(b"PK\x03\x04") || old_workbook {
            Self::Workbook
        } else if mat || head.starts_with(b"MATLAB 7.3") || head.starts_with(b"\x89HDF") {
            Self::Mat
        } else if text.starts_with(b"{") || text.starts_with(b"[") {
            Self::Json
        } else {
            Self::Csv
        }
    }

    /// The largest file that is read.
    pub(super) fn bytes_max(self) -> u64 {
        match self {
            Self::Csv => u64::MAX,
            Self::Workbook | Self::Mat => 512 << 20,
            Self::Json => 32 << 20,
        }
    }
}

/// The tables of a file that is no CSV.
pub(super) fn tables(format: Format, bytes: &[u8], sheet: Option<&str>) -> Result<Vec<Cells>> {
    match format {
        Format::Csv => Ok(Vec::new()),
        Format::Json if sysid::is_sysid(bytes) => sysid::sysid(bytes),
        Format::Json => Err(Error::data(
            "is JSON, but not of SysId or frc-characterization",
            "Save the recording as CSV with a heading such as time_s,voltage_V,current_A,speed_rad_s.",
        )),
        #[cfg(feature = "formats")]
        Format::Workbook => xlsx::xlsx(bytes, sheet).map(|cells| vec![cells]),
        #[cfg(feature = "formats")]
        Format::Mat => mat::mat(bytes).map(|cells| vec![cells]),
        #[cfg(not(feature = "formats"))]
        Format::Workbook | Format::Mat => {
            let _ = sheet;
            Err(Error::data(
                "is a workbook or MAT-file, which this build does not read",
                "Build with the feature formats, or save the recording as CSV.",
            ))
        }
    }
}

/// Rows of cells as lines.
pub(super) struct CellLines<'a> {
    rows: std::slice::Iter<'a, (u64, Vec<String>)>,
    text: String,
}

impl<'a> CellLines<'a> {
    /// What stands between their cells.
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

    fn is_open(&self) -> bool {
        false
    }
}
