//! The formats, as a table.

use super::cells::Cells;
use super::foreign;
use super::log::{IsTime, Log, Medium};
use super::{records, sysid, wpilog, wpilog_records};
#[cfg(not(all(
    feature = "formats",
    feature = "hdf5",
    feature = "mcap",
    feature = "mdf",
    feature = "parquet",
    feature = "tdms",
    feature = "ulog"
)))]
use motorfit_core::Error;
use motorfit_core::Result;

/// A format other than CSV, as a row of the table [`FORMATS`].
pub struct Format {
    /// Name of the format.
    pub name: &'static str,
    /// Description as a sentence.
    pub text: &'static str,
    /// Function that returns true if the first bytes of a file are those of this format.
    is: fn(&[u8]) -> bool,
    /// Function that reads a file.
    #[doc(hidden)]
    pub read: Reader,
}

/// Function that opens a log.
pub type Open = fn(Box<dyn Medium>, IsTime) -> Result<Box<dyn Log>>;

/// Function that reads a file of a format.
#[derive(Clone, Copy)]
pub enum Reader {
    /// Reads the tables of a file; the name selects a sheet or a list.
    Tables {
        /// Size of the largest accepted file \[bytes\].
        bytes_max: u64,
        /// Reads the tables from the bytes of a file.
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
            tables: |bytes, sheet| super::xlsx::xlsx(bytes, sheet).map(|cells| vec![cells]),
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
        read: Reader::Log(|medium, _| super::hdf5::open(medium)),
        #[cfg(not(feature = "hdf5"))]
        read: Reader::Log(|_, _| not_built("an HDF5 file or a MAT-file of version 7.3", "hdf5")),
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
            tables: |bytes, _| super::mat::mat(bytes).map(|cells| vec![cells]),
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
        read: Reader::Log(|medium, _| wpilog::open(medium)),
    },
    Format {
        name: "MCAP",
        text: "A recording of ROS 2 (CDR), or of JSON messages: numeric fields by topic and path, joints by name.",
        is: |head| head.starts_with(b"\x89MCAP0\r\n"),
        #[cfg(feature = "mcap")]
        read: Reader::Log(|medium, _| super::mcap::open(medium)),
        #[cfg(not(feature = "mcap"))]
        read: Reader::Log(|_, _| not_built("an MCAP file", "mcap")),
    },
    Format {
        name: "PARQUET",
        text: "A table of Parquet, as of pandas or LeRobot: columns of numbers, elements of lists by their index.",
        is: |head| head.starts_with(b"PAR1"),
        #[cfg(feature = "parquet")]
        read: Reader::Log(|medium, _| super::parquet::open(medium)),
        #[cfg(not(feature = "parquet"))]
        read: Reader::Log(|_, _| not_built("a Parquet file", "parquet")),
    },
    Format {
        name: "TDMS",
        text: "A file of LabVIEW: channels by group, with their waveform times.",
        is: |head| head.starts_with(b"TDSm"),
        #[cfg(feature = "tdms")]
        read: Reader::Log(super::tdms::open),
        #[cfg(not(feature = "tdms"))]
        read: Reader::Log(|_, _| not_built("a TDMS file", "tdms")),
    },
    Format {
        name: "ULOG",
        text: "A log of PX4: numeric fields by topic.",
        is: |head| head.starts_with(b"ULog\x01\x12\x35"),
        #[cfg(feature = "ulog")]
        read: Reader::Log(|medium, _| super::ulog::open(medium)),
        #[cfg(not(feature = "ulog"))]
        read: Reader::Log(|_, _| not_built("a ULog file", "ulog")),
    },
    Format {
        name: "MDF",
        text: "A measurement of version 4 (.mf4): channel groups with their clocks.",
        is: |head| head.starts_with(b"MDF     ") || head.starts_with(b"UnFinMF "),
        #[cfg(feature = "mdf")]
        read: Reader::Log(|medium, _| super::mdf::open(medium)),
        #[cfg(not(feature = "mdf"))]
        read: Reader::Log(|_, _| not_built("an MDF file", "mdf")),
    },
];

/// Number of bytes at the start of a file from which its format is detected.
pub const HEAD: usize = 4096;

impl Format {
    /// Detects the format from the first bytes of a file; `None` for CSV.
    ///
    /// # Errors
    /// Returns `Data` if the format is one that is not read; the hint names a converter.
    #[doc(hidden)]
    pub fn of(head: &[u8]) -> Result<Option<&'static Self>> {
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
    Err(Error::data(message, hint))
}

#[cfg(not(feature = "formats"))]
fn left_out(_: &[u8], _: Option<&str>) -> Result<Vec<Cells>> {
    let message = "is a workbook or MAT-file, which this build does not read";
    Err(Error::data(message, "Build with the feature formats, or save the recording as CSV."))
}
