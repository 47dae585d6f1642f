//! Set-valued reactions at the end of a step.
//!
//! A unit of a reaction that is constant over a step changes the states by its gain g (`coupling.rs`). The reaction takes the value within ±limit
//! that brings its own state to zero: it subtracts δ from its own state and `(g_other/g_own) δ` from the others, where δ is that
//! state, clipped to ±limit |g_own|, so that a state at rest is exactly zero. Where a state passes zero within the step the reaction
//! changes its sign there; formulas: `motor/friction.rs`. Reactions act in the order of their states, those that act on each other's
//! states together (`complementarity.rs`).
//!
//! A limit that varies is the mean of those at both ends of the step, and so are factors Γ that depend on inputs or states: reactions with
//! those at its start lead to the states at its end, at which they are computed again.

use super::affine::Affine;
use super::coupling::{StepEnd, add_coupling};
use super::group::Together;
use super::right_hand_sides::right_hand_sides;
use crate::definition::Model;
use crate::graph::{Comparison, Graph, Id, Unary};

/// Returns the change of the states over a step, by the affine part, by a unit of a reaction that acts with given factors.
type Gain<'a> = dyn Fn(&mut Graph, usize, &[Id]) -> Vec<Id> + 'a;

/// The reactions of a model over a step of a given length.
pub(super) struct Reactions<'a> {
    pub model: &'a Model,
    pub affine: &'a Affine,
    pub step: Id,
    pub gain: &'a Gain<'a>,
}

/// Limits of reactions, and their factors on each state.
struct Acting {
    limits: Vec<Id>,
    factors: Vec<Vec<Id>>,
}

impl Reactions<'_> {
    /// Returns the states after the reactions. `begin` are states and inputs at the start of the step, `end` those at its end without
    /// reactions.
    pub fn react(&self, graph: &mut Graph, begin: StepEnd<'_>, end: StepEnd<'_>) -> Vec<Id> {
        let first = self.acting(graph, begin);
        let varies = first.limits.iter().chain(first.factors.iter().flatten()).any(|id| !graph.is_fixed(*id));
        let after = self.after(graph, [begin, end], &first, varies);
        if !varies {
            return after;
        }
        let last = self.acting(graph, StepEnd { states: &after, ..end });
        let mut mean = |a: &[Id], b: &[Id]| a.iter().zip(b).map(|(a, b)| mean(graph, *a, *b)).collect::<Vec<Id>>();
        let limits = mean(&first.limits, &last.limits);
        let factors = first.factors.iter().zip(&last.factors).map(|(a, b)| mean(a, b)).collect();
        self.after(graph, [begin, end], &Acting { limits, factors }, false)
    }

    /// Returns limits and factors at one end of a step.
    fn acting(&self, graph: &mut Graph, at: StepEnd<'_>) -> Acting {
        let limits: Vec<Id> = self.model.reactions.iter().map(|reaction| reaction.limit).collect();
        let limits = right_hand_sides(graph, &limits, at.states, at.inputs);
        let all = self.affine.reactions.iter().enumerate();
        let factors = all.map(|(n, factors)| match self.affine.varies(graph, n) {
            true => right_hand_sides(graph, factors, at.states, at.inputs),
            false => factors.clone(),
        });
        Acting { limits, factors: factors.collect() }
    }

    /// Returns the states after reactions with given limits and factors; a prediction, for what varies, has fewer operations.
    fn after(
        &self,
        graph: &mut Graph,
        [begin, end]: [StepEnd<'_>; 2],
        acting: &Acting,
        is_prediction: bool,
    ) -> Vec<Id> {
        let factors = acting.factors.iter().enumerate();
        let mut gains: Vec<Vec<Id>> = factors.map(|(n, factors)| (self.gain)(graph, n, factors)).collect();
        add_coupling(graph, self.affine, begin, self.step, &mut gains);
        let mut free = end.states.to_vec();
        for group in &self.affine.groups {
            let together = self.together(graph, group, acting, &gains);
            let [before, x] = [begin.states, &free].map(|states| together.of_own(states));
            let [taken, own] = together.solved(graph, &before, &x, is_prediction);
            together.act(graph, &taken, &own, &mut free);
        }
        free
    }

    /// Returns reactions that act together.
    fn together(&self, graph: &mut Graph, group: &[usize], acting: &Acting, gains: &[Vec<Id>]) -> Together {
        let mut together = Together { own: Vec::new(), most: Vec::new(), shares: Vec::new() };
        for n in group {
            let own = self.model.reactions[*n].state;
            let size = graph.unary(Unary::Abs, gains[*n][own]);
            together.own.push(own);
            together.most.push(graph.multiply(acting.limits[*n], size));
        }
        let own = group.iter().zip(&together.own);
        together.shares = own.map(|(n, own)| self.shares(graph, *n, &gains[*n], *own)).collect();
        together
    }

    /// Returns the change of each state by a reaction per unit of that of its own state. A factor that depends on states may vanish.
    fn shares(&self, graph: &mut Graph, number: usize, gain: &[Id], own: usize) -> Vec<Id> {
        let varies = self.affine.varies(graph, number);
        let [zero, one] = [0.0, 1.0].map(|value| graph.constant(value));
        let mut share = |(state, change): (usize, &Id)| {
            if state == own {
                return one;
            }
            let ratio = graph.divide(*change, gain[own]);
            if !varies {
                return ratio;
            }
            let size = graph.unary(Unary::Abs, gain[own]);
            graph.select(Comparison::Less, [zero, size], [ratio, zero])
        };
        gain.iter().enumerate().map(&mut share).collect()
    }
}

/// Returns the mean of two nodes.
fn mean(graph: &mut Graph, a: Id, b: Id) -> Id {
    if a == b {
        return a;
    }
    let half = graph.constant(0.5);
    let sum = graph.add(a, b);
    graph.multiply(half, sum)
}
