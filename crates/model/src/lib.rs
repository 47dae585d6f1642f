//! Models of users: the differential equations of a machine as text.

#![forbid(unsafe_code)]
// Counts are converted by the functions of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

mod definition;
mod expression;
mod file;
mod formula;
pub mod graph;
mod law;
mod library;
pub mod program;
#[doc(hidden)]
pub mod reference;
mod role;
pub mod step;
mod valued;
pub mod wgsl;

pub use definition::{
    DerivedQuantity, Equation, GenericTerm, InitialState, LIMITS, Model, ModelConstant, ModelInput, ModelOutput,
    ModelParameter, ModelState, ModelTerm, NodeId, WrittenUnit,
};
pub use expression::Function;
pub use formula::{Formula, FormulaKind};
pub use library::BuiltIn;
pub use role::Role;
pub use step::IntegrationMethod;
pub use wgsl::ShaderPrecision;

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
