//! Sampled laws (`hold`): values that are computed at their own instants and held between them.
//!
//! The held value of a law is a further state of the step, which the law replaces at the start of each substep that is nearest to one of its
//! instants, the multiples of its period from the start of the recording. In the equations it is constant over a substep.

use super::memories::memory;
use super::right_hand_sides::{InputsAt, right_hand_sides};
use super::settings::StepSettings;
use crate::definition::Model;
use crate::graph::{Comparison, Graph, Id, Leaf};
use motorfit_core::numeric::{count, whole};

/// Largest deviation from a whole number of substeps at which a period has that number.
const WHOLE: f64 = 1e-9;

/// When a substep begins at an instant of a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Instants {
    Always,
    Never,
    /// As an input says, because it differs between samples.
    Some,
}

impl Instants {
    /// Returns when the substep with a place is an instant of a law with a period.
    fn of(period_s: f64, settings: &StepSettings, place: usize) -> Self {
        let substeps = settings.substeps.max(1);
        let Some(step_s) = settings.step_s else { return Self::Some };
        let ratio = period_s * count(substeps) / step_s;
        if ratio.round() < 1.0 || (ratio / ratio.round() - 1.0).abs() > WHOLE || ratio > 1e9 {
            return Self::Some;
        }
        let ratio = whole(ratio.round());
        match (substeps.is_multiple_of(ratio), place % greatest_common_divisor(ratio, substeps)) {
            (true, 0) => Self::Always,
            (false, 0) => Self::Some,
            _ => Self::Never,
        }
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// Returns the held values at the start of the step, before its laws.
pub(super) fn held_before(model: &Model, graph: &mut Graph) -> Vec<Id> {
    let first = model.states.len();
    let state = |n: usize| Leaf::State(u16::try_from(first + n).unwrap_or(u16::MAX));
    (0..model.laws.len()).map(|n| graph.leaf(state(n))).collect()
}

/// Returns the held values after the laws at the start of a substep. `inputs` are those there with the delayed signals.
pub(super) fn held(
    (model, settings): (&Model, &StepSettings),
    graph: &mut Graph,
    place: usize,
    (states, inputs): (&[Id], &InputsAt),
    before: &[Id],
) -> Vec<Id> {
    let substeps = settings.substeps.max(1);
    let mut inputs = inputs.clone();
    let mut held = Vec::new();
    for (n, law) in model.laws.iter().enumerate() {
        let instants = Instants::of(law.period_s, settings, place);
        let value = match instants {
            Instants::Never => before[n],
            _ => {
                let new = right_hand_sides(graph, &[law.value], states, &inputs)[0];
                match instants {
                    Instants::Always => new,
                    _ => {
                        let number = model.inputs.len() + 1 + n * substeps + place;
                        let flag = graph.leaf(Leaf::Input(u16::try_from(number).unwrap_or(u16::MAX)));
                        let half = graph.constant(0.5);
                        graph.select(Comparison::Less, [half, flag], [new, before[n]])
                    }
                }
            }
        };
        // Laws use those before them.
        inputs.all.push(value);
        held.push(value);
    }
    held
}

/// Returns the held values of the first substep, from the states, inputs and delayed signals at the start of the step; `instants` are
/// the numbers of the memories of the delayed signals there.
pub(super) fn held_first(
    (model, settings): (&Model, &StepSettings),
    graph: &mut Graph,
    first_instant: usize,
) -> Vec<Id> {
    let before = held_before(model, graph);
    let number = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
    let states: Vec<Id> = (0..model.states.len()).map(|n| graph.leaf(Leaf::State(number(n)))).collect();
    let own = model.inputs.len();
    let mut all: Vec<Id> = (0..own).map(|n| graph.leaf(Leaf::Input(number(n)))).collect();
    all.extend((0..model.delayed.len()).map(|n| memory(graph, first_instant + n)));
    held((model, settings), graph, 0, (&states, &InputsAt { all, inputs: own }), &before)
}
