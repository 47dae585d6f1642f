//! Expressions of models: the tokens, functions and messages of the parser in `motorfit_core::expression`. Conditions are a type
//! of their own: only `select(condition, a, b)` takes one.

mod fault;
mod functions;
mod lexer;
mod parser;
mod tree;

pub(crate) use fault::Fault;
pub use functions::Function;
pub(crate) use parser::{DEPTH_MAX, parse};
pub(crate) use tree::{Expression, Kind, Operator};
