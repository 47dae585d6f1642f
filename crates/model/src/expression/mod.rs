//! Expressions: text, tokens, syntax trees.
//!
//! Precedence, from the loosest: `||`, `&&`, comparison, `+ -`, `* /`, unary `- !`, `^` (right-associative). Conditions are a type
//! of their own: only `select(condition, a, b)` takes one.

mod functions;
mod lexer;
mod parser;

pub use functions::Function;
pub(crate) use parser::{DEPTH_MAX, parse};

/// Error in an expression: the byte at which it is, the message and a hint.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Fault {
    pub at: usize,
    pub message: String,
    pub hint: String,
}

impl Fault {
    pub fn new(at: usize, message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { at, message: message.into(), hint: hint.into() }
    }
}

/// An operator with two operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Operator {
    Or,
    And,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
}

/// A node of a syntax tree, with the byte at which it begins (for an operator, the byte of the operator).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Expression {
    pub at: usize,
    pub kind: Kind,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Kind {
    Number(f64),
    Name(String),
    Negative(Box<Expression>),
    Not(Box<Expression>),
    Binary(Operator, Box<Expression>, Box<Expression>),
    Call(Function, Vec<Expression>),
}

impl Expression {
    /// Calls `visit` with each name and its position, from left to right.
    pub fn names<'a>(&'a self, visit: &mut impl FnMut(&'a str, usize)) {
        match &self.kind {
            Kind::Number(_) => {}
            Kind::Name(name) => visit(name, self.at),
            Kind::Negative(inner) | Kind::Not(inner) => inner.names(visit),
            Kind::Binary(_, left, right) => {
                left.names(visit);
                right.names(visit);
            }
            Kind::Call(_, arguments) => arguments.iter().for_each(|argument| argument.names(visit)),
        }
    }
}
