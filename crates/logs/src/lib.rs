//! Formats other than CSV. Workbooks, MAT-files and JSON are converted to rows of text cells, which are then read like those of
//! a CSV file; logs give the numbers of the channels that are used. A new format is a file that returns `Cells` or a `Log`, and a
//! row of `FORMATS`.

#![forbid(unsafe_code)]
// Counts are converted by the functions of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

#[cfg(feature = "formats")]
mod archive;
mod cells;
mod foreign;
mod format;
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
mod unreadable;
#[cfg(any(feature = "tdms", feature = "ulog"))]
mod window;
mod wpilib_units;
mod wpilog;
mod wpilog_records;
#[cfg(feature = "formats")]
mod xlsx;

pub use cells::Cells;
pub use foreign::refused_name;
pub use format::{FORMATS, Format, HEAD, Open, Reader};
#[cfg(feature = "formats")]
pub use limits::LIMITS;
pub use log::{Channel, Field, Log, Medium, Series, States};
#[cfg(feature = "parquet")]
pub use parquet::{Column, Table};
pub use unreadable::unreadable;
pub use wpilib_units::split;
pub use wpilog::{ARRAY_MAX, ENTRIES_MAX, NO_TEST, TESTS};
pub use wpilog_records::PAYLOAD_MAX;
/// Limits of workbooks and MAT-files: none, as this build does not read them.
#[cfg(not(feature = "formats"))]
pub const LIMITS: [motorfit_core::limit::Limit; 0] = [];

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
