//! Equations as trees for those who show them.

use super::definition::Equation;
use super::expression::{Expression, Kind, Operator, parse};

/// An expression of an equation.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula(Expression);

/// The outermost operation of a formula.
#[derive(Debug, Clone, PartialEq)]
pub enum FormulaKind<'a> {
    /// A number.
    Number(f64),
    /// A name.
    Name(&'a str),
    /// The negative of a value.
    Negative(Formula),
    /// The negation of a condition.
    Not(Formula),
    /// A quotient.
    Fraction(Formula, Formula),
    /// A power.
    Power(Formula, Formula),
    /// Another operator, by its sign, with its precedence from 1 (loosest) and its operands.
    Binary(&'static str, u8, Formula, Formula),
    /// A call of a function by its name.
    Call(&'static str, Vec<Formula>),
}

impl Equation {
    /// Returns the right side as a tree; `None` if the text is not an expression.
    #[must_use]
    pub fn formula(&self) -> Option<Formula> {
        parse(&self.text).ok().map(Formula)
    }
}

impl Formula {
    /// Returns the outermost operation.
    #[must_use]
    pub fn kind(&self) -> FormulaKind<'_> {
        let of = |inner: &Expression| Self(inner.clone());
        match &self.0.kind {
            Kind::Number(value) => FormulaKind::Number(*value),
            Kind::Name(name) => FormulaKind::Name(name),
            Kind::Negative(inner) => FormulaKind::Negative(of(inner)),
            Kind::Not(inner) => FormulaKind::Not(of(inner)),
            Kind::Call(function, arguments) => FormulaKind::Call(function.name(), arguments.iter().map(of).collect()),
            Kind::Binary(operator, left, right) => {
                let (left, right) = (of(left), of(right));
                match operator {
                    Operator::Divide => FormulaKind::Fraction(left, right),
                    Operator::Power => FormulaKind::Power(left, right),
                    _ => FormulaKind::Binary(operator.name(), operator.precedence(), left, right),
                }
            }
        }
    }
}
