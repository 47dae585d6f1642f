//! Parameters of DC motors from recordings of voltage, current and speed.
//!
//! A [`Record`](record::Record) goes in; R, L, K, B and J of the linear motor `L di/dt = v − R i − K ω`,
//! `J dω/dt = K i − B ω − T` come out of [`identify`](identify::identify) with their standard errors: found by
//! Steiglitz–McBride or a population search, whose generations are simulated at once, refined to the maximum-likelihood
//! estimate, and held against a search of the whole box.
//!
//! Data flow one way: record → motor → criterion → evaluate → optimize → estimate → identify → study → report. A module uses those
//! before it only.
//!
//! ```
//! use motorfit::identify::{IdentifySpec, identify};
//! use motorfit::motor::{Discretization, Parameters};
//! use motorfit::experiment::{Excitation, simulated};
//!
//! let step = Excitation::step(10.5, 1.0, 3.0, 0.001)?;
//! let record = simulated(&Parameters::M2, &step, Discretization::Zoh)?;
//! let found = identify(&[record], &IdentifySpec::default())?;
//! assert!((found.parameters.r - Parameters::M2.r).abs() < 1e-6);
//! # Ok::<(), motorfit::Error>(())
//! ```

// Conversions of counts are those of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

pub mod analysis;
pub mod candidates;
pub mod channels;
pub mod criterion;
pub mod device;
pub mod error;
pub mod estimate;
pub mod evaluate;
pub mod experiment;
pub mod file;
pub mod identify;
pub mod limit;
pub mod motor;
pub mod named;
pub mod numeric;
pub mod optimize;
pub mod record;
pub mod report;
pub mod setting;
pub mod settings;
pub mod study;
pub mod text;
pub mod warning;

pub use error::{Error, ErrorKind, Result};
