//! The definition of a model: what its text declares, checked, with its equations as a graph.

mod check;
mod document;
mod draft;
mod generic;
mod inputs;
mod lower;
mod model;
mod names;
mod parts;
mod reactions;
mod read;
mod sections;
mod terms;

pub(crate) use document::TEXT_MAX;
pub use generic::GenericTerm;
pub use model::Model;
pub(crate) use parts::{DelayedSignal, SampledLaw};
pub use parts::{
    DerivedQuantity, Equation, InitialState, ModelConstant, ModelInput, ModelOutput, ModelParameter, ModelState,
    ModelTerm, NodeId, WrittenUnit,
};
pub(crate) use reactions::{coupled, factors_of};

use motorfit_core::limit::{Limit, limit_of};

/// Size limits of models.
pub const LIMITS: [Limit; 5] = [
    limit_of("bytes of a model", document::TEXT_MAX, "refused"),
    limit_of("bytes of an expression of a model", document::EXPRESSION_MAX, "refused, with line and column"),
    limit_of("items of a section of a model", read::DECLARED_MAX, "refused, with line and column"),
    limit_of("operations of a model", lower::NODES_MAX, "refused, with line and column"),
    limit_of("levels of brackets of an expression", crate::expression::DEPTH_MAX, "refused, with line and column"),
];
