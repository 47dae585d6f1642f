//! Sums as lists of terms: factors of parameters alone times other nodes.

use super::node::{Binary, Id, Node, Unary};
use super::store::Graph;
use std::collections::BTreeMap;

/// A term of a sum: `factor` depends on parameters at most; `rest` is `None` if the term is the factor alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Term {
    pub factor: Id,
    pub rest: Option<Id>,
}

impl Graph {
    /// Returns the terms of a node that is a sum, equal rests together. Sums for which `opens` is false remain one term, so that a sum
    /// that is used several times stays shared.
    pub(crate) fn terms(&mut self, root: Id, opens: &impl Fn(Id) -> bool) -> Vec<Term> {
        let one = self.constant(1.0);
        let mut terms: Vec<Term> = Vec::new();
        // Users of a node have higher numbers: from the highest down, the factor of each node is complete when it is taken.
        let mut open = BTreeMap::from([(root, one)]);
        while let Some((id, factor)) = open.pop_last() {
            if self.is_fixed(id) {
                let factor = self.multiply(factor, id);
                self.collect(&mut terms, Term { factor, rest: None });
                continue;
            }
            let may_open = id == root || opens(id);
            let parts = match self.node(id) {
                Node::Binary(Binary::Add, a, b) if may_open => [Some((a, factor)), Some((b, factor))],
                Node::Binary(Binary::Subtract, a, b) if may_open => {
                    [Some((a, factor)), Some((b, self.negative(factor)))]
                }
                Node::Unary(Unary::Negative, a) => [Some((a, self.negative(factor))), None],
                Node::Binary(Binary::Multiply, a, b) if self.is_fixed(a) || self.is_fixed(b) => {
                    let (own, rest) = if self.is_fixed(a) { (a, b) } else { (b, a) };
                    [Some((rest, self.multiply(factor, own))), None]
                }
                _ => {
                    terms.push(Term { factor, rest: Some(id) });
                    [None; 2]
                }
            };
            for (part, factor) in parts.into_iter().flatten() {
                let sum = match open.get(&part) {
                    Some(known) => self.add(*known, factor),
                    None => factor,
                };
                open.insert(part, sum);
            }
        }
        terms.reverse();
        terms
    }

    /// Adds a term without a rest.
    fn collect(&mut self, terms: &mut Vec<Term>, term: Term) {
        match terms.iter_mut().find(|known| known.rest.is_none()) {
            Some(known) => known.factor = self.add(known.factor, term.factor),
            None => terms.push(term),
        }
    }

    /// Returns the sum of terms.
    pub(crate) fn sum(&mut self, terms: &[Term]) -> Id {
        let mut sum = self.constant(0.0);
        for term in terms {
            let value = match term.rest {
                Some(rest) => self.multiply(term.factor, rest),
                None => term.factor,
            };
            sum = self.add(sum, value);
        }
        sum
    }

    /// Rewrites sums as sums of parameter factors times other nodes, equal ones together; sums that several nodes use stay shared.
    pub fn with_collected_terms(&mut self, roots: &[Id]) -> Vec<Id> {
        let uses = self.uses(roots);
        let is_used_once = |id: Id| uses.get(id as usize).is_none_or(|uses| *uses <= 1);
        roots
            .iter()
            .map(|root| {
                let terms = self.terms(*root, &is_used_once);
                self.sum(&terms)
            })
            .collect()
    }
}
