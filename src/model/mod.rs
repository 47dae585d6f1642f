//! Models of users: the differential equations of a machine as text.

mod definition;
mod expression;
mod file;
mod formula;
pub(crate) mod graph;
mod library;
pub(crate) mod program;
#[cfg(test)]
pub(crate) mod reference;
mod role;
pub(crate) mod step;
mod valued;
pub(crate) mod wgsl;

pub use definition::{
    Equation, InitialState, LIMITS, Model, ModelConstant, ModelInput, ModelOutput, ModelParameter, ModelState, NodeId,
    WrittenUnit,
};
pub use expression::Function;
pub use formula::{Formula, FormulaKind};
pub use library::BuiltIn;
pub use role::Role;
pub use step::IntegrationMethod;
pub use wgsl::ShaderPrecision;
