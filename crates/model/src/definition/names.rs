//! Names: those that are declared directly, and those that are defined by expressions and resolved when they are used.

use super::document::{Document, Entry, Place};
use super::lower::{Quantity, Scope};
use crate::expression::{Expression, Function, parse};
use crate::graph::{Graph, Id, Leaf};
use motorfit_core::Result;
use motorfit_core::text::quoted;
use motorfit_core::units::{Dimension, Unit};
use std::collections::HashMap;

/// A name that an expression defines, not resolved yet.
pub(super) struct Definition {
    pub expression: Expression,
    pub place: Place,
    /// Dimension that the value must have.
    pub dimension: Option<Dimension>,
    /// True for signals, which depend on inputs and parameters only.
    pub is_signal: bool,
    /// Number of the delayed signal that the name stands for.
    pub delayed: Option<u16>,
}

/// The names of a model while it is read.
pub(super) struct Names<'d> {
    pub document: &'d Document<'d>,
    pub scope: Scope,
    /// Byte of the declaration of each name.
    declared: HashMap<String, usize>,
    definitions: HashMap<String, Definition>,
    /// Names that are being resolved.
    open: Vec<String>,
}

/// Returns the node of a leaf in SI units.
pub(super) fn in_si(graph: &mut Graph, leaf: Leaf, unit: &Unit) -> Id {
    let (value, factor, offset) = (graph.leaf(leaf), graph.constant(unit.factor), graph.constant(unit.offset));
    let scaled = graph.multiply(factor, value);
    graph.add(scaled, offset)
}

impl<'d> Names<'d> {
    pub fn new(document: &'d Document<'d>) -> Self {
        Self {
            document,
            scope: Scope::default(),
            declared: HashMap::new(),
            definitions: HashMap::new(),
            open: Vec::new(),
        }
    }

    /// Reserves a name.
    pub fn declare(&mut self, entry: &Entry<'_>) -> Result<()> {
        let error = |message: String, hint: &str| Err(self.document.error(entry.at, message, hint));
        let name = entry.key;
        let is_name = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !is_name || name.len() > 64 {
            let hint = "Use ASCII letters, digits and _, a letter first, at most 64 characters.";
            return error(format!("{} cannot be a name in an equation", quoted(name)), hint);
        }
        if name == "pi" || Function::ALL.iter().any(|function| function.name() == name) {
            return error(format!("{} is the name of a function or a number", quoted(name)), "Choose another name.");
        }
        if let Some(before) = self.declared.get(name) {
            let line = self.document.error(*before, "", "").line().unwrap_or(0);
            return error(
                format!("{} is declared twice", quoted(name)),
                &format!("It is declared in line {line} already."),
            );
        }
        self.declared.insert(name.to_owned(), entry.at);
        Ok(())
    }

    /// Gives a name a value.
    pub fn set(&mut self, name: &str, id: Id, dimension: Dimension) {
        self.scope.names.insert(name.to_owned(), Quantity { id, dimension: Some(dimension) });
    }

    /// Adds a name that an expression defines.
    pub fn define(&mut self, name: &str, definition: Definition) {
        self.definitions.insert(name.to_owned(), definition);
    }

    /// Parses the expression of an entry.
    pub fn parse(&self, entry: &Entry<'_>) -> Result<(Expression, Place)> {
        let (text, place) = self.document.expression(entry)?;
        Ok((parse(text).map_err(|fault| self.document.fault(place, &fault))?, place))
    }

    /// Resolves a name and the names that it uses.
    pub fn resolve(&mut self, name: &str) -> Result<()> {
        let Some(definition) = self.definitions.remove(name) else { return Ok(()) };
        self.open.push(name.to_owned());
        self.resolve_names(&definition.expression, definition.place)?;
        self.open.pop();
        self.scope.has_reactions = !definition.is_signal;
        let quantity = match definition.dimension {
            None => self.scope.quantity(&definition.expression),
            Some(dimension) => {
                let id = self.scope.quantity_of(&definition.expression, dimension, name);
                id.map(|id| Quantity { id, dimension: Some(dimension) })
            }
        };
        let quantity = quantity.map_err(|fault| self.document.fault(definition.place, &fault))?;
        if let Some(number) = definition.delayed {
            // The equations use the delayed signal, which is an input of theirs; the signal itself has another name.
            self.scope.names.insert(undelayed(name), quantity);
            let id = self.scope.graph.leaf(Leaf::Memory(number));
            self.scope.names.insert(name.to_owned(), Quantity { id, ..quantity });
        } else {
            self.scope.names.insert(name.to_owned(), quantity);
        }
        Ok(())
    }

    /// Resolves the names that an expression uses.
    fn resolve_names(&mut self, expression: &Expression, place: Place) -> Result<()> {
        let mut used: Vec<(String, usize)> = Vec::new();
        expression.names(&mut |name, at| used.push((name.clone(), at)));
        for (name, at) in used {
            if let Some(start) = self.open.iter().position(|open| *open == name) {
                let mut cycle = self.open[start..].to_vec();
                cycle.push(name.clone());
                let message = format!("{} depends on itself: {}", quoted(&name), cycle.join(" → "));
                let fault = crate::expression::Fault::new(at, message, "Remove one of these uses.");
                return Err(self.document.fault(place, &fault));
            }
            self.resolve(&name)?;
        }
        Ok(())
    }

    /// Returns the value of the expression of an entry, of the given dimension if there is one.
    pub fn value(
        &mut self,
        entry: &Entry<'_>,
        dimension: Option<Dimension>,
        what: &str,
        has_reactions: bool,
    ) -> Result<Quantity> {
        let (expression, place) = self.parse(entry)?;
        self.resolve_names(&expression, place)?;
        self.scope.has_reactions = has_reactions;
        let quantity = match dimension {
            None => self.scope.quantity(&expression),
            Some(dimension) => self
                .scope
                .quantity_of(&expression, dimension, what)
                .map(|id| Quantity { id, dimension: Some(dimension) }),
        };
        quantity.map_err(|fault| self.document.fault(place, &fault))
    }
}

/// Returns the name of a signal without its delay, which no expression can use.
pub(super) fn undelayed(name: &str) -> String {
    format!("{name} without delay")
}
