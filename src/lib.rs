//! Identification of the parameters of DC motors from recordings of voltage, current and speed.
//!
//! The model is the linear motor `L di/dt = v − R i − K ω`, `J dω/dt = K i − B ω − T` (Eqs. 6 and 7), optionally with
//! extensions such as Coulomb friction, dead time and drive nonlinearities ([`motor::Extension`]). All quantities are in SI
//! units.
//!
//! # Five uses
//!
//! 1. **Identify one motor.** [`identify::identify`] takes one or more [`record::Record`]s and returns R, L, K, B, J and the
//!    parameters of extensions with standard errors, a comparison with a global search, and a level of trust.
//!    [`estimate`] has its estimators: Steiglitz–McBride and the output-error refinement with its covariance.
//! 2. **Identify many motors.** [`study::sweep`] runs a study, or the recordings of a production line, as one batch that can be
//!    interrupted and resumed. [`device::BatchSearchEvaluator`] evaluates any number of searches, each on its own recordings, in
//!    one batch.
//! 3. **Simulate populations.** [`evaluate::Evaluator`] simulates a batch of candidate motors and returns their costs, shape
//!    `[candidates]`: by SIMD on all cores ([`evaluate::Simd`]) or by WGSL compute shaders on a GPU (`evaluate::gpu::Gpu`).
//!    [`experiment`] simulates recordings.
//! 4. **Compare methods.** [`study::compare`] runs the Grey Wolf Optimizer, Jaya, a genetic algorithm, a particle swarm, random
//!    search and Steiglitz–McBride under equal budgets and compares them with statistics. [`study::throughput()`] measures the
//!    evaluation rates of CPU and GPU.
//! 5. **Write extensions.** [`optimize::Optimizer`] is the ask/tell interface for optimizers, [`optimize::minimize()`] drives
//!    them on any cost function ([`optimize::Evaluate`]), and [`evaluate::Evaluator`] can be implemented for other devices. New
//!    effects, criteria, file formats and rules are rows of tables (`docs/extending.md`).
//!
//! # Source
//!
//! The motor, the experiment and the methods are those of D. M. Munciño, E. A. Damian-Ramírez, M. Cruz-Fernández, L. A.
//! Montoya-Santiyanes and J. Rodríguez-Reséndiz, "Metaheuristic and Heuristic Algorithms-Based Identification Parameters of a
//! Direct Current Motor", *Algorithms* 17(5), 209, 2024, called "the paper" in these pages.
//!
//! # Modules
//!
//! Data flow one way: record → motor → model → criterion → optimize → experiment → evaluate → estimate → device → analysis →
//! identify → settings → study → report. A module uses only those before it. All may use the base modules: errors, limits, tables
//! of names, names of settings, texts, units, files, numerics, candidates and channels. [`model`] has the equations of other
//! machines than the DC motor.
//!
//! # Example
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

// Counts are converted by the functions of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

pub mod analysis;
pub mod candidates;
pub mod channels;
mod clock;
pub mod criterion;
pub mod device;
pub mod error;
pub mod estimate;
pub mod evaluate;
pub mod experiment;
pub mod file;
pub mod identify;
pub mod limit;
pub mod model;
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
pub mod units;
pub mod warning;

pub use error::{Error, ErrorKind, Result};
