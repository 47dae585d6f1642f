//! Parameters of DC motors from recordings of voltage, current and speed.
//!
//! Five uses:
//!
//! - **Identify a motor.** [`identify`](identify::identify) takes [`Record`](record::Record)s and returns R, L, K, B and J of the linear
//!   motor `L di/dt = v − R i − K ω`, `J dω/dt = K i − B ω − T` (Eqs. 6 and 7), and parameters of its extensions, with standard
//!   errors, a comparison with a search of the whole box, and a level of trust.
//! - **Evaluate candidates.** [`evaluate::Evaluator`] computes the costs of a batch of candidate motors, shape `[candidates]`, by SIMD or
//!   on a GPU, for an optimizer of your own.
//! - **Optimize.** [`optimize::Optimizer`] (ask and tell) has the Grey Wolf Optimizer, Jaya, a genetic algorithm, a particle swarm and
//!   random search, for a cost of your own.
//! - **Estimate directly.** [`estimate`] has Steiglitz–McBride and the output-error refinement with its covariance.
//! - **Compare and sweep.** [`study`] compares methods with statistics, and runs studies and production lines as one batch.
//!
//! The motor, the experiment and the methods come from D. M. Munciño, E. A. Damian-Ramírez, M. Cruz-Fernández, L. A. Montoya-Santiyanes
//! and J. Rodríguez-Reséndiz, "Metaheuristic and Heuristic Algorithms-Based Identification Parameters of a Direct Current Motor",
//! *Algorithms* 17(5), 209, 2024, "the paper" in these pages. Everything is in SI units.
//!
//! Data flow one way: record → motor → criterion → optimize → evaluate → estimate → device → analysis → identify → study → report. A
//! module uses those before it only.
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
