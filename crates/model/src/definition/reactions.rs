//! Reactions (`stick`): checks that they act as they can be computed, and which of them act on each other.

use super::document::Document;
use super::model::Model;
use super::parts::Reaction;
use crate::graph::{Direction, Graph, Id, Leaf};
use motorfit_core::Result;

/// Largest number of reactions that act on each other: the work doubles with each.
const COUPLED_MAX: usize = 6;

/// Checks that reactions act linearly, by factors without reactions, on their own states, and that limits need no reactions.
pub(super) fn reactions(document: &Document<'_>, model: &Model) -> Result<()> {
    let mut graph = model.graph.clone();
    let states = document.section("states")?;
    let at = |state: usize| states.get(state).map_or(0, |entry| entry.at);
    let has_reaction = |graph: &Graph, id: Id| graph.leaves(&[id]).iter().any(|leaf| matches!(leaf, Leaf::Reaction(_)));
    let mut factors = Vec::new();
    for (number, reaction) in (0_u16..).zip(&model.reactions) {
        let name = &model.states[reaction.state].name;
        if has_reaction(&model.graph, reaction.limit) {
            let message = format!("the limit of stick({name}, …) depends on another stick");
            return Err(document.error(at(reaction.state), message, "Give a limit of inputs, parameters and states."));
        }
        let own = factors_of(&mut graph, model, number);
        for (state, (of, factor)) in model.states.iter().zip(&own).enumerate() {
            if has_reaction(&graph, *factor) {
                let message = format!("stick({name}, …) acts on {} by more than a factor", of.name);
                let hint = "Add or subtract the reaction, multiplied or divided by what depends on no stick.";
                return Err(document.error(at(state), message, hint));
            }
            if state == reaction.state && graph.is_constant(*factor, 0.0) {
                let message = format!("stick({name}, …) does not act on {name}");
                let hint = format!("Subtract it in the derivative of {name}.");
                return Err(document.error(at(state), message, hint));
            }
        }
        factors.push(own);
    }
    for group in coupled(&graph, &model.reactions, &factors) {
        let state = |n: usize| model.reactions[n].state;
        if let Some(pair) = group.windows(2).find(|pair| state(pair[0]) == state(pair[1])) {
            let name = &model.states[state(pair[0])].name;
            let message = format!("two stick functions of {name} and one of another state act on each other");
            return Err(document.error(at(state(pair[0])), message, "Add the limits of both in one."));
        }
        if group.len() > COUPLED_MAX {
            let message = format!("more than {COUPLED_MAX} stick functions act on each other");
            let hint =
                "A stick acts on another where it stands in the derivative of its state. Leave some of them out.";
            return Err(document.error(at(state(group[COUPLED_MAX])), message, hint));
        }
    }
    Ok(())
}

/// Returns the factor with which a reaction acts on the derivative of each state.
pub(crate) fn factors_of(graph: &mut Graph, model: &Model, number: u16) -> Vec<Id> {
    let one = graph.constant(1.0);
    let mut direction = Direction::new(|leaf| (leaf == Leaf::Reaction(number)).then_some(one));
    model.states.iter().map(|state| direction.derivative(graph, state.derivative)).collect()
}

/// Returns the reactions in the order of their states, those together of which one acts on the derivative of the other's state. `factors`
/// have the shape `[reactions, states]`.
pub(crate) fn coupled(graph: &Graph, reactions: &[Reaction], factors: &[Vec<Id>]) -> Vec<Vec<usize>> {
    let acts = |a: usize, b: usize| !graph.is_constant(factors[a][reactions[b].state], 0.0);
    let are_coupled = |a: usize, b: usize| reactions[a].state != reactions[b].state && (acts(a, b) || acts(b, a));
    let mut order: Vec<usize> = (0..reactions.len()).collect();
    order.sort_by_key(|n| reactions[*n].state);
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for n in order {
        let joins = |group: &Vec<usize>| group.iter().any(|other| are_coupled(*other, n));
        let Some(first) = groups.iter().position(joins) else {
            groups.push(vec![n]);
            continue;
        };
        let (mut joined, mut apart) = (Vec::new(), Vec::new());
        for group in groups.split_off(first) {
            if joins(&group) { joined.extend(group) } else { apart.push(group) }
        }
        joined.push(n);
        joined.sort_by_key(|n| reactions[*n].state);
        groups.push(joined);
        groups.extend(apart);
    }
    groups
}
