//! Reactions that act on each other, such as the dry friction of two joints of an arm, over a step.
//!
//! With the unit of `reaction.rs`, in which a reaction subtracts δ from its own state, `w = v − D δ` at the end of the step, v without
//! reactions, with the diagonal 1 of D. Either |δ| is within its limit and w is zero, or δ is at the limit and opposes w. This linear
//! complementarity problem has one solution where all principal minors of D are positive, as with the inverse of a mass matrix (K. G. Murty
//! 1972; D. E. Stewart, SIAM Review 42, 2000). The first reaction without its limit is eliminated from the problem of the others; as w
//! decreases with δ, its value is that one, clipped. With it the others are solved again: 2ⁿ − 1 clips for n reactions.
//!
//! A reaction jumps where its state passes zero or comes to rest within a step, and all others then act otherwise. With uniform rates the
//! step is divided at the first such moment: up to it reactions oppose the states at the start, from it on they are those of the problem
//! above. Steps in which states pass zero at different moments are exact in the first of them, to first order in the others; they are rare.

use super::clip::clip;
use crate::graph::{Binary, Comparison, Graph, Id, Unary};

/// Reactions that act on each other, over a step; a value for each.
pub(super) struct Coupled<'a> {
    /// The own states at the start of the step.
    pub before: &'a [Id],
    /// The own states at its end without these reactions.
    pub free: &'a [Id],
    /// D: the change of each own state by each reaction, per unit of the latter's own state.
    pub matrix: &'a [Vec<Id>],
    /// Largest magnitude that each subtracts from its own state.
    pub most: &'a [Id],
}

#[cfg(test)]
mod tests;

/// Returns the sum of products, subtracted from a value.
fn less(graph: &mut Graph, value: Id, row: &[Id], by: &[Id]) -> Id {
    row.iter().zip(by).fold(value, |left, (a, b)| {
        let product = graph.multiply(*a, *b);
        graph.subtract(left, product)
    })
}

/// Returns for each reaction δ within its limit, and that without its own limit.
fn solved(graph: &mut Graph, matrix: &[Vec<Id>], free: &[Id], most: &[Id]) -> Vec<[Id; 2]> {
    let Some((first, others)) = most.split_first() else { return Vec::new() };
    let (own, free_first) = (matrix[0][0], free[0]);
    let share: Vec<Id> = matrix[1..].iter().map(|row| graph.divide(row[0], own)).collect();
    let inner: Vec<Vec<Id>> = matrix[1..]
        .iter()
        .zip(&share)
        .map(|(row, share)| {
            row[1..].iter().zip(&matrix[0][1..]).map(|(a, b)| less(graph, *a, &[*share], &[*b])).collect()
        })
        .collect();
    let left: Vec<Id> =
        free[1..].iter().zip(&share).map(|(v, share)| less(graph, *v, &[*share], &[free_first])).collect();
    let taken: Vec<Id> = solved(graph, &inner, &left, others).iter().map(|[taken, _]| *taken).collect();
    let wanted = less(graph, free_first, &matrix[0][1..], &taken);
    let wanted = graph.divide(wanted, own);
    let own = clip(graph, wanted, *first);
    let minor: Vec<Vec<Id>> = matrix[1..].iter().map(|row| row[1..].to_vec()).collect();
    let left: Vec<Id> = free[1..].iter().zip(&matrix[1..]).map(|(v, row)| less(graph, *v, &row[..1], &[own])).collect();
    let mut all = vec![[own, wanted]];
    all.extend(solved(graph, &minor, &left, others));
    all
}

impl Coupled<'_> {
    /// Returns what each reaction subtracts from its own state and the own states at the end of the step, for reactions that are constant
    /// over the step.
    pub fn constant(&self, graph: &mut Graph) -> [Vec<Id>; 2] {
        let of = solved(graph, self.matrix, self.free, self.most);
        let taken: Vec<Id> = of.iter().map(|[taken, _]| *taken).collect();
        let zero = graph.constant(0.0);
        let mut states = Vec::new();
        for (n, [_, wanted]) in of.into_iter().enumerate() {
            let state = less(graph, self.free[n], &self.matrix[n], &taken);
            let size = graph.unary(Unary::Abs, wanted);
            // A state at rest is exactly zero.
            states.push(graph.select(Comparison::LessEqual, [size, self.most[n]], [zero, state]));
        }
        [taken, states]
    }

    /// Returns the same for reactions that jump once within the step.
    pub fn divided(&self, graph: &mut Graph) -> [Vec<Id>; 2] {
        let pairs = self.before.iter().zip(self.free);
        let change: Vec<Id> = pairs.map(|(before, free)| graph.subtract(*free, *before)).collect();
        let first = self.first_reactions(graph, &change);
        let slopes: Vec<Id> =
            change.iter().zip(self.matrix).map(|(change, row)| less(graph, *change, row, &first)).collect();
        let at = self.first_zero(graph, &slopes);
        let one = graph.constant(1.0);
        let left = graph.subtract(one, at);
        let (mut free, mut most) = (Vec::new(), Vec::new());
        for n in 0..self.most.len() {
            let reached = graph.multiply(at, slopes[n]);
            let reached = graph.add(self.before[n], reached);
            let more = graph.multiply(left, change[n]);
            free.push(graph.add(reached, more));
            most.push(graph.multiply(left, self.most[n]));
        }
        let [second, states] = Coupled { free: &free, most: &most, ..*self }.constant(graph);
        let whole = first.iter().zip(second).map(|(first, second)| {
            let first = graph.multiply(at, *first);
            graph.add(first, second)
        });
        [whole.collect(), states]
    }

    /// Returns the reactions from the start of the step, as if they lasted for all of it: those of states that are not zero oppose them.
    fn first_reactions(&self, graph: &mut Graph, change: &[Id]) -> Vec<Id> {
        let two = graph.constant(2.0);
        let mut free = Vec::new();
        for (n, row) in self.matrix.iter().enumerate() {
            // More than all changes together, so that the limit holds.
            let mut all = graph.unary(Unary::Abs, change[n]);
            for (factor, most) in row.iter().zip(self.most) {
                let size = graph.unary(Unary::Abs, *factor);
                let size = graph.multiply(size, *most);
                all = graph.add(all, size);
            }
            let sign = graph.unary(Unary::Sign, self.before[n]);
            let all = graph.multiply(two, all);
            let more = graph.multiply(sign, all);
            free.push(graph.add(change[n], more));
        }
        solved(graph, self.matrix, &free, self.most).into_iter().map(|[taken, _]| taken).collect()
    }

    /// Returns the fraction of the step after which the first state reaches zero at the given slopes; 0 where none does, since reactions
    /// then are constant.
    fn first_zero(&self, graph: &mut Graph, slopes: &[Id]) -> Id {
        let [zero, one] = [0.0, 1.0].map(|value| graph.constant(value));
        let mut first = one;
        for (before, slope) in self.before.iter().zip(slopes) {
            let sign = graph.unary(Unary::Sign, *before);
            let size = graph.multiply(sign, *before);
            let along = graph.multiply(sign, *slope);
            let approach = graph.negative(along);
            let share = graph.divide(size, approach);
            let share = graph.select(Comparison::Less, [size, approach], [share, one]);
            first = graph.binary(Binary::Min, first, share);
        }
        graph.select(Comparison::Less, [first, one], [first, zero])
    }
}
