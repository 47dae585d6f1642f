//! Recordings of one motor: sampled voltage, load torque, current and speed in SI units.
//!
//! A [`Record`] is checked when it is created: at least two samples, finite values, increasing time.

#![forbid(unsafe_code)]
// Counts are converted by the functions of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

mod assumed;
mod diagnose;
mod head;
mod heading;
mod import;
mod limits;
mod lines;
mod measured;
mod measured_at;
mod position;
mod prepare;
mod reading;
mod record;
mod requests;
mod samples;
mod source;
mod stored;
mod time;
pub mod warning;

pub use assumed::{AssumedUnits, PERIOD_DOUBTED_S, agreeing_units};
pub use diagnose::{FINDINGS, Finding, Severity, can_cause_poor_fit, diagnose};
pub use heading::Quantity;
pub use import::{
    BadRows, ChannelFacts, ColumnPreview, ColumnUse, FORMATS, Format, ReadOptions, SignalRequest, TESTS, TablePreview,
    channels, parse_number, preview, read, read_bytes, read_inputs, read_joined, read_recording, read_signal_inputs,
    test_of, write_csv,
};
pub use limits::limits;
pub use lines::Lines;
pub use position::{position_disagrees, position_ratio};
pub use prepare::{FilterKind, LowPass, Mask, Offset, Preparation, parse_masks};
pub use reading::{Reading, parse_crop, parse_offset};
pub use record::{Excluded, Record, check_of_motor, driver, is_driven_by_current};
pub use requests::{ColumnRequest, joined_columns, parse_columns, parse_signal_columns};
pub use samples::{NamedSignal, SAMPLES_MAX, Samples, VALUE_MAX};
pub use source::{Column, Source};
pub use time::{Gaps, Steps, TIME_JITTER_UNIFORM, step_lengths};

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
