//! Reactions that act together at the end of a step: one by itself, or those that act on each other.

use super::clip::taken;
use super::complementarity::Coupled;
use crate::graph::{Graph, Id};

/// Reactions that act on each other, or one.
pub(super) struct Together {
    /// The state of each.
    pub own: Vec<usize>,
    /// The largest magnitude that each subtracts from its own state.
    pub most: Vec<Id>,
    /// The change of each state by each reaction, per unit of that of its own state.
    pub shares: Vec<Vec<Id>>,
}

impl Together {
    /// Returns their own states among all.
    pub fn of_own(&self, states: &[Id]) -> Vec<Id> {
        self.own.iter().map(|own| states[*own]).collect()
    }

    /// Returns what the reactions subtract from their own states, and these at the end of the step.
    pub fn solved(&self, graph: &mut Graph, before: &[Id], free: &[Id], is_prediction: bool) -> [Vec<Id>; 2] {
        if let ([before], [free], [most]) = (before, free, &self.most[..]) {
            let taken = taken(graph, *before, *free, *most);
            return [vec![taken], vec![graph.subtract(*free, taken)]];
        }
        let row = |own: &usize| self.shares.iter().map(|of| of[*own]).collect::<Vec<Id>>();
        let matrix: Vec<Vec<Id>> = self.own.iter().map(row).collect();
        let coupled = Coupled { before, free, matrix: &matrix, most: &self.most };
        if is_prediction { coupled.constant(graph) } else { coupled.divided(graph) }
    }

    /// Subtracts what the reactions take; their own states are given.
    pub fn act(&self, graph: &mut Graph, taken: &[Id], own: &[Id], states: &mut [Id]) {
        for (state, x) in states.iter_mut().enumerate() {
            if let Some(place) = self.own.iter().position(|own| *own == state) {
                *x = own[place];
                continue;
            }
            for (shares, taken) in self.shares.iter().zip(taken) {
                let part = graph.multiply(shares[state], *taken);
                *x = graph.subtract(*x, part);
            }
        }
    }
}
