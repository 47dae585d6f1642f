//! Laws of controllers in the equations: limited values of the difference between an input and a state.

use super::definition::{Model, SampledLaw};
use super::graph::{Binary, Id, Leaf, Node, Substitution};

impl Model {
    /// Returns true if the equations have a continuous law of a controller: a limited value (`clamp`, `min`, `max`) that feeds back the
    /// difference of an input, its reference, and a state, and is not sampled by `hold`.
    #[must_use]
    pub fn has_continuous_law(&self) -> bool {
        !continuous_laws(self).is_empty()
    }

    /// Returns the model with its continuous laws sampled with a period; `None` if it has none.
    #[must_use]
    #[doc(hidden)]
    pub fn with_sampled_laws(&self, period_s: f64) -> Option<Self> {
        let laws = continuous_laws(self);
        if laws.is_empty() {
            return None;
        }
        let mut model = self.clone();
        let mut sampled = Substitution::new(|_| None);
        for law in laws {
            let number = u16::try_from(model.delayed.len() + model.laws.len()).ok()?;
            let held = model.graph.leaf(Leaf::Memory(number));
            sampled.replace(law, held);
            model.laws.push(SampledLaw { value: law, period_s });
        }
        let Self { graph, states, outputs, reactions, .. } = &mut model;
        states.iter_mut().for_each(|state| state.derivative = sampled.apply(graph, state.derivative));
        outputs.iter_mut().for_each(|output| output.value = sampled.apply(graph, output.value));
        reactions.iter_mut().for_each(|reaction| reaction.limit = sampled.apply(graph, reaction.limit));
        Some(model)
    }
}

/// Returns the outermost limited values in the right-hand sides that are laws.
fn continuous_laws(model: &Model) -> Vec<Id> {
    let graph = &model.graph;
    let roots: Vec<Id> = model.states.iter().map(|state| state.derivative).collect();
    let is_law = |id: &Id| {
        let is_limit = matches!(graph.node(*id), Node::Binary(Binary::Min | Binary::Max, ..));
        is_limit && graph.needed(&[*id]).into_iter().any(|inner| is_control_error(model, inner))
    };
    let laws: Vec<Id> = graph.needed(&roots).into_iter().filter(is_law).collect();
    let is_inner = |id: &Id| laws.iter().any(|other| other != id && graph.needed(&[*other]).contains(id));
    laws.iter().copied().filter(|id| !is_inner(id)).collect()
}

/// Returns true for the difference of an input and a state, each up to its unit.
fn is_control_error(model: &Model, id: Id) -> bool {
    let graph = &model.graph;
    let Node::Binary(Binary::Subtract, a, b) = graph.node(id) else { return false };
    let kinds = |id: Id| {
        let leaves = graph.leaves(&[id]);
        let is_input = !leaves.is_empty()
            && leaves.iter().all(|leaf| match leaf {
                Leaf::Input(_) => true,
                Leaf::Memory(n) => usize::from(*n) < model.delayed.len(),
                _ => false,
            });
        let is_state = matches!(leaves[..], [Leaf::State(_)]);
        [is_input, is_state]
    };
    let ([a_input, a_state], [b_input, b_state]) = (kinds(a), kinds(b));
    a_input && b_state || a_state && b_input
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may stop")]

    use crate::{BuiltIn, Model};

    #[test]
    fn laws_are_recognized_and_physics_is_not() {
        for of in BuiltIn::ALL {
            let model = of.model().unwrap();
            assert_eq!(model.has_continuous_law(), of == BuiltIn::ServoPendulum, "{}", of.name());
        }
        let text = BuiltIn::ServoPendulum.model().unwrap().text().to_owned();
        let held = text.replace(
            "\"clamp(kp*(ref - q) - kd*w, -umax, umax)\"",
            "\"hold(clamp(kp*(ref - q) - kd*w, -umax, umax), period)\"",
        );
        let held = held.replace("[constants]", "[constants]\nperiod = { value = 5, unit = \"ms\" }");
        let model = Model::parse(&held).unwrap();
        assert!(!model.has_continuous_law() && model.with_sampled_laws(1e-3).is_none());
        let sampled = Model::parse(&text).unwrap().with_sampled_laws(5e-3).unwrap();
        assert_eq!(sampled.laws.len(), 1);
        assert!(!sampled.has_continuous_law());
    }
}
