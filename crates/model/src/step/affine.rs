//! The affine part of the equations: `dx/dt = A x + B u + c + Γ r + rest`, with coefficients of parameters alone. Γ may depend on
//! inputs and states.

use crate::definition::{Model, coupled, factors_of};
use crate::graph::{Graph, Id, Leaf, Node, Substitution};

/// The equations of a model, separated; matrices row by row.
#[derive(Debug, Clone)]
pub struct Affine {
    /// A, shape `[states, states]`.
    pub states: Vec<Vec<Id>>,
    /// B, shape `[states, inputs]`, delayed signals and sampled laws after the inputs.
    pub inputs: Vec<Vec<Id>>,
    /// c, a value for each state.
    pub constant: Vec<Id>,
    /// Γ, shape `[reactions, states]`.
    pub reactions: Vec<Vec<Id>>,
    /// The numbers of the reactions in the order in which they act, those that act on each other together.
    pub groups: Vec<Vec<usize>>,
    /// The other terms of each state, without reactions.
    pub rest: Vec<Id>,
    /// The right-hand sides without reactions.
    pub right: Vec<Id>,
}

impl Affine {
    /// Separates the equations of a model.
    pub fn of(model: &Model, graph: &mut Graph) -> Self {
        let (states, inputs) = (model.states.len(), model.inputs.len() + model.delayed.len() + model.laws.len());
        let zero = graph.constant(0.0);
        let derivatives: Vec<Id> = model.states.iter().map(|state| state.derivative).collect();
        let numbers = (0_u16..).take(model.reactions.len());
        let reactions: Vec<Vec<Id>> = numbers.map(|number| factors_of(graph, model, number)).collect();
        let groups = coupled(graph, &model.reactions, &reactions);
        let mut without = Substitution::new(|leaf| matches!(leaf, Leaf::Reaction(_)).then_some(zero));
        let right: Vec<Id> = derivatives.iter().map(|derivative| without.apply(graph, *derivative)).collect();
        let right = graph.with_collected_terms(&right);
        let mut affine = Self {
            states: vec![vec![zero; states]; states],
            inputs: vec![vec![zero; inputs]; states],
            constant: vec![zero; states],
            reactions,
            groups,
            rest: vec![zero; states],
            right,
        };
        for row in 0..states {
            // All sums are opened. Nonlinear terms remain shared, because each is a node.
            for term in graph.terms(affine.right[row], &|_| true) {
                let leaf = term.rest.map(|rest| graph.node(rest));
                let place = match leaf {
                    None => &mut affine.constant[row],
                    Some(Node::Leaf(Leaf::State(n))) => &mut affine.states[row][usize::from(n)],
                    Some(Node::Leaf(Leaf::Input(n))) => &mut affine.inputs[row][usize::from(n)],
                    Some(Node::Leaf(Leaf::Memory(n))) => &mut affine.inputs[row][model.inputs.len() + usize::from(n)],
                    Some(_) => &mut affine.rest[row],
                };
                let value = match (leaf, term.rest) {
                    (Some(Node::Leaf(Leaf::State(_) | Leaf::Input(_) | Leaf::Memory(_))) | None, _) | (_, None) => {
                        term.factor
                    }
                    (_, Some(rest)) => graph.multiply(term.factor, rest),
                };
                *place = graph.add(*place, value);
            }
        }
        affine
    }

    /// Returns true if there are no other terms, and reactions act by factors of parameters alone.
    pub fn is_complete(&self, graph: &Graph) -> bool {
        self.nonlinear_rows(graph).is_empty() && (0..self.reactions.len()).all(|n| !self.varies(graph, n))
    }

    /// Returns true for a reaction whose factors depend on inputs or states.
    pub(super) fn varies(&self, graph: &Graph, reaction: usize) -> bool {
        self.reactions[reaction].iter().any(|factor| !graph.is_fixed(*factor))
    }

    /// Returns the rows with terms that are not affine.
    pub fn nonlinear_rows(&self, graph: &Graph) -> Vec<usize> {
        (0..self.rest.len()).filter(|row| !graph.is_constant(self.rest[*row], 0.0)).collect()
    }
}

impl Model {
    /// Returns true if the equations are affine in states and inputs, with coefficients of parameters alone.
    #[must_use]
    pub fn is_affine(&self) -> bool {
        let mut graph = self.graph.clone();
        Affine::of(self, &mut graph).is_complete(&graph)
    }
}
