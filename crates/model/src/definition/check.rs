//! Checks of a complete model: outputs and states exist, every parameter has an effect.

use super::document::{Document, Entry};
use super::model::Model;
use super::names::{Names, undelayed};
use super::parts::InitialState;
use super::reactions::reactions;
use crate::graph::{Id, Leaf};
use motorfit_core::Result;
use motorfit_core::text::{listed, quoted};
use std::collections::HashSet;

/// Checks that a signal does not depend on states but by sampled laws, and that a delayed one does not depend on delayed ones.
pub(super) fn signal(names: &Names<'_>, section: &str, entry: &Entry<'_>) -> Result<()> {
    let scope = &names.scope;
    let without_delay = scope.names.get(&undelayed(entry.key));
    let own = without_delay.or_else(|| scope.names.get(entry.key));
    let leaves = own.filter(|_| section == "signals").map_or(Vec::new(), |own| scope.graph.leaves(&[own.id]));
    if leaves.iter().any(|leaf| matches!(leaf, Leaf::State(_) | Leaf::Reaction(_))) {
        let message = format!("the signal {} depends on states", quoted(entry.key));
        let hint = "Signals are functions of inputs, parameters and sampled laws (hold). Write what depends on states in [let].";
        return Err(names.document.error(entry.at, message, hint));
    }
    let is_delayed = |leaf: &Leaf| matches!(leaf, Leaf::Memory(n) if usize::from(*n) < scope.delayed);
    if without_delay.is_some() && leaves.iter().any(is_delayed) {
        let message = format!("the delayed signal {} depends on a delayed one", quoted(entry.key));
        return Err(names.document.error(entry.at, message, "Add the delays, and delay the signal once."));
    }
    Ok(())
}

/// Checks a complete model.
pub(super) fn model(document: &Document<'_>, model: &Model) -> Result<()> {
    for (section, count) in
        [("states", model.states.len()), ("outputs", model.outputs.len()), ("parameters", model.parameters.len())]
    {
        if count == 0 {
            let hint = format!("Add a section [{section}].");
            return Err(document.error(0, format!("the model has no {section}"), hint));
        }
    }
    reactions(document, model)?;
    effects(document, model)
}

/// Checks that every parameter has an effect on an output.
fn effects(document: &Document<'_>, model: &Model) -> Result<()> {
    let mut seen: HashSet<Leaf> = HashSet::new();
    let mut open: Vec<Id> = Vec::new();
    for output in &model.outputs {
        open.extend(output.roots());
    }
    while let Some(root) = open.pop() {
        for leaf in model.graph.leaves(&[root]) {
            if !seen.insert(leaf) {
                continue;
            }
            match leaf {
                Leaf::State(n) => {
                    let state = &model.states[usize::from(n)];
                    open.push(state.derivative);
                    if let InitialState::Given(initial) = state.initial {
                        open.push(initial.0);
                    }
                }
                Leaf::Reaction(n) => {
                    let reaction = &model.reactions[usize::from(n)];
                    open.push(reaction.limit);
                }
                Leaf::Memory(n) => {
                    let delayed = model.delayed.get(usize::from(n));
                    open.extend(delayed.iter().flat_map(|of| [of.value, of.delay, of.latency]));
                    let law = usize::from(n).checked_sub(model.delayed.len()).and_then(|n| model.laws.get(n));
                    open.extend(law.map(|law| law.value));
                }
                Leaf::Input(_) | Leaf::NextInput(_) => {}
                Leaf::Parameter(_) => {}
            }
        }
    }
    let has_effect = |n: usize| seen.contains(&Leaf::Parameter(u16::try_from(n).unwrap_or(u16::MAX)));
    let idle = (0..model.parameters.len()).find(|n| !has_effect(*n));
    let Some(idle) = idle else { return Ok(()) };
    let at = document.section("parameters")?.get(idle).map_or(0, |entry| entry.at);
    let outputs: Vec<&str> = model.outputs.iter().map(|output| output.name.as_str()).collect();
    let message = format!("{} has no effect on {}", quoted(&model.parameters[idle].name), listed(&outputs, "or"));
    Err(document.error(at, message, "Use it in an equation that the outputs depend on, or leave it out."))
}
