//! Right-hand sides of the equations at given states and inputs.

use crate::graph::{Graph, Id, Leaf, Substitution};

/// Inputs at a time within a step, then delayed signals over the substep.
#[derive(Debug, Clone)]
pub(super) struct InputsAt {
    pub all: Vec<Id>,
    /// Number of inputs.
    pub inputs: usize,
}

/// Returns the right-hand sides at states and inputs.
pub(super) fn right_hand_sides(graph: &mut Graph, of: &[Id], states: &[Id], inputs: &InputsAt) -> Vec<Id> {
    let (inputs, delayed) = inputs.all.split_at(inputs.inputs);
    let mut substitution = Substitution::new(|leaf| match leaf {
        Leaf::State(n) => states.get(usize::from(n)).copied(),
        Leaf::Input(n) => inputs.get(usize::from(n)).copied(),
        Leaf::Memory(n) => delayed.get(usize::from(n)).copied(),
        _ => None,
    });
    of.iter().map(|id| substitution.apply(graph, *id)).collect()
}
