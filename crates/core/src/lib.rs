//! The base of motorfit: errors, settings and texts that refer to them, enums as tables, units, limits, atomic files and
//! numerics. No crate of the workspace is below it.

#![forbid(unsafe_code)]
// Counts are converted by the functions of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

pub mod candidates;
pub mod channels;
pub mod clock;
pub mod coordinate;
pub mod error;
pub mod expression;
pub mod file;
pub mod limit;
pub mod named;
pub mod numeric;
pub mod setting;
pub mod text;
pub mod units;

pub use error::{Error, ErrorKind, Result};

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
