//! Identification of R, L, K, B and J with their standard errors from recordings of one motor.
//!
//! [`identify()`] is the entry point. A method finds a first optimum: Steiglitz–McBride (1965), or a population search that
//! minimizes the criterion over the search space, one batch per generation. The polish, Levenberg–Marquardt, refines it to the
//! maximum-likelihood estimate of the output-error model ([`motorfit_estimate`]) with its standard errors. If the extensions are
//! not given, forward selection by BIC chooses them. The refined fit is compared with a global search, its residuals are
//! tested ([`crate::analysis`]), and the result gets a level of trust ([`Trust`]).
//!
//! `pipeline.rs` calls the stages in their order: prepare, start, select, refine, verify, analyse, result.

#![forbid(unsafe_code)]
// Counts are converted by the functions of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

pub mod analysis;
mod automatic;
mod batch_costs;
mod bic;
mod checks;
mod current_driven;
mod dc_motor;
pub mod device;
mod estimates;
mod extension_bounds;
mod fit;
mod forward_selection;
mod hull;
mod identifiability;
mod lacking;
mod late_voltage;
mod likelihood;
mod machine;
pub mod mechanism;
mod method;
mod missing_channel;
pub mod model;
mod model_selection;
mod models;
mod motor_likelihood;
mod motor_result;
mod normalized;
mod null_space;
mod open_groups;
mod pipeline;
mod prepare;
mod profile;
mod refine;
mod repeated;
mod result;
mod result_warnings;
mod search;
mod serialize;
mod shared_reference;
mod spec;
mod start;
mod trust;
mod trust_level;
mod unidentified;
mod verify;
mod warnings;

pub use analysis::Output;
pub use batch_costs::{BatchCosts, estimated_space, search_problem};
pub use current_driven::needs_voltage;
pub use dc_motor::DcMotor;
pub use estimates::{Combination, ParameterEstimate, side};
pub use fit::{Diagnosed, PreparedSearch, SearchRun, fit_on, has_all_channels, with_cost_on};
pub use forward_selection::{Alternative, SelectionStep};
pub use identifiability::{Identifiability, Inspection};
pub use likelihood::{LikelihoodPoint, LikelihoodProfile};
pub use machine::{Keys, Machine};
pub use method::{Method, Polish};
pub use motor_likelihood::likelihood_profiles;
pub use motor_result::{add_validation, hold_out, validate};
pub use pipeline::{identify, identify_with};
pub use profile::LIMIT as LIKELIHOOD_LIMIT;
pub use result::{Identification, LeftOut, SearchOutcome};
pub use spec::IdentifySpec;
pub use trust_level::{REASONS, Trust, TrustLevel, TrustReason};
pub use verify::{Status, Verification, verify_at};

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
