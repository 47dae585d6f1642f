//! Outputs that a sensor shows with a filter and a delay: the past of the signal is kept substep by substep.

use super::affine::Affine;
use super::coupling::StepEnd;
use super::memories::{Memory, MemoryKind, Substep, memory};
use super::right_hand_sides::right_hand_sides;
use super::settings::StepSettings;
use crate::definition::Model;
use crate::graph::{Direction, Graph, Id, Leaf};

/// Start of a step: the held values of the sampled laws, and the sensors.
pub(super) struct Begin {
    pub held: Vec<Id>,
    pub sensors: Vec<Sensor>,
}

/// A sensor with a filter or a delay.
pub(super) struct Sensor {
    /// The signal, in the unit of its output.
    value: Id,
    /// Number of its memory.
    memory: usize,
    /// Time constant \[s\].
    filter: Id,
}

/// Adds the sensor of an output, whose value at the start of the step is `now`, and returns what it shows there; `now` itself without
/// a filter and a delay.
pub(super) fn shown(
    (model, settings, output): (&Model, &StepSettings, usize),
    graph: &mut Graph,
    now: Id,
    (memories, sensors): (&mut Vec<Memory>, &mut Vec<Sensor>),
) -> Id {
    let of = &model.outputs[output];
    if of.filter.is_none() && of.delay.is_none() {
        return now;
    }
    let zero = graph.constant(0.0);
    let [filter, delay] = [of.filter, of.delay].map(|time| time.unwrap_or(zero));
    let substep = Substep::new(0, settings.substeps.max(1));
    memories.push(Memory { substep, ..Memory::whole(MemoryKind::Sensor, vec![now, filter, delay]) });
    sensors.push(Sensor { value: of.value, memory: memories.len() - 1, filter });
    memory(graph, memories.len() - 1)
}

/// Adds a substep to the past of each sensor and returns the operations that do so. The slope of a signal on which friction that sticks
/// or a first-order hold acts directly is not known at the start; it is taken to be linear over the substep.
pub(super) fn track(
    (model, affine, settings): (&Model, &Affine, &StepSettings),
    graph: &mut Graph,
    (sensors, memories): (&[Sensor], &mut Vec<Memory>),
    [begin, end]: [StepEnd<'_>; 2],
    place: usize,
) -> Vec<Id> {
    let mut operations = Vec::new();
    for sensor in sensors {
        let at = |graph: &mut Graph, of: Id, at: StepEnd<'_>| right_hand_sides(graph, &[of], at.states, at.inputs)[0];
        let (first, last) = (at(graph, sensor.value, begin), at(graph, sensor.value, end));
        let (kind, operands) = match slope((model, affine, settings), graph, sensor.value) {
            None => (MemoryKind::Track, vec![first, last, sensor.filter]),
            Some(slope) => {
                let slope = at(graph, slope, begin);
                (MemoryKind::SmoothTrack, vec![first, slope, last, sensor.filter])
            }
        };
        let substep = Substep::new(place, settings.substeps.max(1));
        memories.push(Memory { substep, shared: Some(sensor.memory), ..Memory::whole(kind, operands) });
        operations.push(memory(graph, memories.len() - 1));
    }
    operations
}

/// Returns the derivative of a signal with respect to time; `None` if it depends on more than states and held inputs.
fn slope((model, affine, settings): (&Model, &Affine, &StepSettings), graph: &mut Graph, value: Id) -> Option<Id> {
    let along = |graph: &mut Graph, rates: &[Id]| {
        let mut direction = Direction::new(|leaf| match leaf {
            Leaf::State(n) => rates.get(usize::from(n)).copied(),
            _ => None,
        });
        direction.derivative(graph, value)
    };
    let rates: Vec<Id> = model.states.iter().map(|state| state.derivative).collect();
    let whole = along(graph, &rates);
    let has_reaction = graph.leaves(&[whole]).iter().any(|leaf| matches!(leaf, Leaf::Reaction(_)));
    let is_of_input = |leaf: &Leaf| matches!(leaf, Leaf::Input(_) | Leaf::Memory(_));
    let has_line = settings.is_first_order_hold && graph.leaves(&[value]).iter().any(is_of_input);
    (!has_reaction && !has_line).then(|| along(graph, &affine.right))
}
