//! Formats other than CSV. Workbooks, MAT-files and JSON are converted to rows of text cells, which are then read like those of
//! a CSV file; logs give the numbers of the channels that are used. A new format is a file that returns `Cells` or a `Log`, and a
//! row of `FORMATS`.

#[cfg(feature = "formats")]
mod archive;
mod cells;
mod foreign;
#[cfg(feature = "hdf5")]
mod hdf5;
#[cfg(feature = "formats")]
mod limits;
mod log;
#[cfg(all(test, feature = "tdms", feature = "ulog"))]
mod log_tests;
#[cfg(feature = "formats")]
mod mat;
#[cfg(feature = "formats")]
mod mat_element;
#[cfg(feature = "formats")]
mod mat_file;
#[cfg(feature = "mcap")]
mod mcap;
#[cfg(feature = "mdf")]
mod mdf;
#[cfg(feature = "parquet")]
mod parquet;
mod records;
mod sysid;
#[cfg(feature = "tdms")]
mod tdms;
#[cfg(all(test, feature = "formats"))]
mod tests;
#[cfg(feature = "ulog")]
mod ulog;
#[cfg(any(feature = "tdms", feature = "ulog"))]
mod window;
mod wpilib_units;
mod wpilog;
mod wpilog_records;
#[cfg(feature = "formats")]
mod xlsx;

use super::parse::Separator;
use super::text::{Line, Lines};
use crate::Result;
pub(super) use cells::Cells;
pub(super) use foreign::refused_name;
#[cfg(feature = "formats")]
pub(super) use limits::LIMITS;
pub(super) use log::{Channel, Field, Log, Medium, Series, States};
pub(super) use wpilib_units::split;
pub use wpilog::TESTS;
pub(super) use wpilog::{ARRAY_MAX, ENTRIES_MAX, NO_TEST};
pub(super) use wpilog_records::PAYLOAD_MAX;
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
    /// Function that reads a file.
    pub(super) read: Reader,
}

/// Function that opens a log.
pub(super) type Open = fn(Box<dyn Medium>) -> Result<Box<dyn Log>>;

/// Function that reads a file of a format.
#[derive(Clone, Copy)]
pub(super) enum Reader {
    /// Reads the tables of a file; the name selects a sheet or a list.
    Tables {
        /// Size of the largest accepted file \[bytes\].
        bytes_max: u64,
        tables: fn(&[u8], Option<&str>) -> Result<Vec<Cells>>,
    },
    /// Opens a log of any size, whose channels are columns.
    Log(Open),
}

/// Formats in the order in which they are tried. A file of none of them is read as CSV.
pub static FORMATS: [Format; 10] = [
    Format {
        name: "XLSX",
        text: "A workbook: the first sheet with numbers, or the named one.",
        is: |head| head.starts_with(b"PK\x03\x04") || head.starts_with(&[0xd0, 0xcf, 0x11, 0xe0]),
        read: Reader::Tables {
            bytes_max: 512 << 20,
            #[cfg(feature = "formats")]
            tables: |bytes, sheet| xlsx::xlsx(bytes, sheet).map(|cells| vec![cells]),
            #[cfg(not(feature = "formats"))]
            tables: left_out,
        },
    },
    Format {
        name: "HDF5",
        text: "An HDF5 file, or a MAT-file of version 7.3: vectors and matrices of numbers, members of compounds.",
        is: |head| {
            [0, 512, 1024, 2048]
                .iter()
                .any(|at| head.get(*at..).is_some_and(|rest| rest.starts_with(b"\x89HDF\r\n\x1a\n")))
        },
        #[cfg(feature = "hdf5")]
        read: Reader::Log(hdf5::open),
        #[cfg(not(feature = "hdf5"))]
        read: Reader::Log(|_| not_built("an HDF5 file or a MAT-file of version 7.3", "hdf5")),
    },
    Format {
        name: "MAT",
        text: "A MAT-file of version 6 or 7: vectors, matrices and structures of signals.",
        is: |head| {
            let mat = head.starts_with(b"MATLAB 5.0 MAT-file") || matches!(head.get(126..128), Some(b"IM" | b"MI"));
            mat || head.starts_with(b"MATLAB 7.3") || head.starts_with(b"\x89HDF")
        },
        read: Reader::Tables {
            bytes_max: 512 << 20,
            #[cfg(feature = "formats")]
            tables: |bytes, _| mat::mat(bytes).map(|cells| vec![cells]),
            #[cfg(not(feature = "formats"))]
            tables: left_out,
        },
    },
    Format {
        name: "JSON",
        text: "A list of objects with numbers, one for each sample, optionally with constants beside it; or a file of SysId \
               or frc-characterization, each test of which is a recording.",
        is: |head| {
            let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
            text.starts_with(b"{") || text.starts_with(b"[")
        },
        read: Reader::Tables {
            bytes_max: 64 << 20,
            tables: |bytes, name| match sysid::is_sysid(bytes) {
                true => sysid::sysid(bytes),
                false => records::records(bytes, name),
            },
        },
    },
    Format {
        name: "WPILOG",
        text: "A WPILib data log: numeric entries by name. The tests of SysId are recordings.",
        is: |head| head.starts_with(wpilog_records::MAGIC),
        read: Reader::Log(wpilog::open),
    },
    Format {
        name: "MCAP",
        text: "A recording of ROS 2 (CDR), or of JSON messages: numeric fields by topic and path, joints by name.",
        is: |head| head.starts_with(b"\x89MCAP0\r\n"),
        #[cfg(feature = "mcap")]
        read: Reader::Log(mcap::open),
        #[cfg(not(feature = "mcap"))]
        read: Reader::Log(|_| not_built("an MCAP file", "mcap")),
    },
    Format {
        name: "PARQUET",
        text: "A table of Parquet, as of pandas or LeRobot: columns of numbers, elements of lists by their index.",
        is: |head| head.starts_with(b"PAR1"),
        #[cfg(feature = "parquet")]
        read: Reader::Log(parquet::open),
        #[cfg(not(feature = "parquet"))]
        read: Reader::Log(|_| not_built("a Parquet file", "parquet")),
    },
    Format {
        name: "TDMS",
        text: "A file of LabVIEW: channels by group, with their waveform times.",
        is: |head| head.starts_with(b"TDSm"),
        #[cfg(feature = "tdms")]
        read: Reader::Log(tdms::open),
        #[cfg(not(feature = "tdms"))]
        read: Reader::Log(|_| not_built("a TDMS file", "tdms")),
    },
    Format {
        name: "ULOG",
        text: "A log of PX4: numeric fields by topic.",
        is: |head| head.starts_with(b"ULog\x01\x12\x35"),
        #[cfg(feature = "ulog")]
        read: Reader::Log(ulog::open),
        #[cfg(not(feature = "ulog"))]
        read: Reader::Log(|_| not_built("a ULog file", "ulog")),
    },
    Format {
        name: "MDF",
        text: "A measurement of version 4 (.mf4): channel groups with their clocks.",
        is: |head| head.starts_with(b"MDF     ") || head.starts_with(b"UnFinMF "),
        #[cfg(feature = "mdf")]
        read: Reader::Log(mdf::open),
        #[cfg(not(feature = "mdf"))]
        read: Reader::Log(|_| not_built("an MDF file", "mdf")),
    },
];

/// Number of bytes at the start of a file from which its format is detected.
pub(super) const HEAD: usize = 4096;

impl Format {
    /// Detects the format from the first bytes of a file; `None` for CSV.
    ///
    /// # Errors
    /// Returns `Data` if the format is one that is not read; the hint names a converter.
    pub(super) fn of(head: &[u8]) -> Result<Option<&'static Self>> {
        foreign::refused(head)?;
        Ok(FORMATS.iter().find(|format| (format.is)(head)))
    }
}

/// Returns the error for a log of a format that this build does not read.
#[cfg(not(all(
    feature = "hdf5",
    feature = "mcap",
    feature = "mdf",
    feature = "parquet",
    feature = "tdms",
    feature = "ulog"
)))]
fn not_built(what: &str, feature: &str) -> Result<Box<dyn Log>> {
    let message = format!("is {what}, which this build does not read");
    let hint = format!("Build with the feature {feature}, take the prebuilt program, or save the recording as CSV.");
    Err(crate::Error::data(message, hint))
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
