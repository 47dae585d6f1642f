//! One-step maps of a model as graphs.
//!
//! A step takes the states from one sample to the next. Where the equations are affine in states and inputs with coefficients of
//! parameters alone, exponentials of matrices give the exact map; other equations take the classical Runge–Kutta method or the
//! exponential one of S. M. Cox and P. C. Matthews (2002), which treats the affine part exactly.

mod affine;
mod affine_step;
mod clip;
mod complementarity;
mod coupling;
mod exponential;
mod extras;
mod group;
mod map;
mod memories;
mod phi;
mod reaction;
mod right_hand_sides;
mod runge_kutta;
mod sampled;
mod sensor;
mod settings;

pub use affine::Affine;
pub use affine_step::AffineStep;
pub(crate) use extras::Extras;
pub use map::Step;
pub use memories::{Memory, MemoryKind, Substep};
pub use phi::WithRate;
pub use settings::{IntegrationMethod, StepSettings};

use super::definition::{DelayedSignal, InitialState, Model};
use super::graph::{Direction, Graph, Id, Leaf, Substitution};
use memories::{memory, parameter};
use sensor::{Begin, shown};

/// Returns the numbers of the states whose initial values are not functions of the parameters.
pub fn open_states(model: &Model) -> Vec<usize> {
    let is_open = |n: &usize| !matches!(model.states[*n].initial, InitialState::Given(_));
    (0..model.states.len()).filter(is_open).collect()
}

/// Returns the delay of a signal over a whole step. A signal of another delayed signal is constant over each step.
fn delay_of(graph: &mut Graph, of: &DelayedSignal, is_first_order_hold: bool) -> Memory {
    let mut operands = vec![of.value, of.delay, of.latency];
    if !is_first_order_hold || graph.leaves(&[of.value]).iter().any(|leaf| matches!(leaf, Leaf::Memory(_))) {
        return Memory::whole(MemoryKind::Delay, operands);
    }
    let inputs: Vec<(u16, Id)> = graph
        .leaves(&[of.value])
        .into_iter()
        .filter_map(|leaf| if let Leaf::Input(n) = leaf { Some((n, graph.leaf(Leaf::NextInput(n)))) } else { None })
        .collect();
    let mut at_end = Substitution::new(|leaf| match leaf {
        Leaf::Input(n) => inputs.iter().find(|(input, _)| *input == n).map(|(_, next)| *next),
        _ => None,
    });
    operands.push(at_end.apply(graph, of.value));
    Memory::whole(MemoryKind::LinearDelay, operands)
}

/// Makes the memories of delayed signals at the instant at the start of a step, after those over the step, and returns the sampled laws
/// there, on which signals may depend.
fn at_instant(model: &Model, graph: &mut Graph, memories: &mut Vec<Memory>, settings: &StepSettings) -> Vec<Id> {
    let own = memories.len();
    let held = sampled::held_first((model, settings), graph, own);
    let mut substitution = Substitution::new(|leaf| match leaf {
        Leaf::Memory(n) => usize::from(n).checked_sub(own).and_then(|law| held.get(law)).copied(),
        _ => None,
    });
    for signal in memories.iter_mut() {
        signal.operands[0] = substitution.apply(graph, signal.operands[0]);
    }
    for number in 0..own {
        memories.push(Memory { substep: Substep::INSTANT, ..memories[number].clone() });
    }
    held
}

/// Returns the outputs of a model at the start of a step, with the delayed signals and the sampled laws there. `memories` gain those of the
/// outputs.
fn outputs_of(
    (model, settings): (&Model, &StepSettings),
    graph: &mut Graph,
    memories: &mut Vec<Memory>,
    begin: &mut Begin,
) -> Vec<Id> {
    let own = model.delayed.len();
    let mut there: Vec<Id> = (own..2 * own).map(|n| memory(graph, n)).collect();
    there.extend(&begin.held);
    let mut substitution = Substitution::new(|leaf| match leaf {
        Leaf::Memory(n) => there.get(usize::from(n)).copied(),
        _ => None,
    });
    let mut outputs = Vec::new();
    for (number, output) in model.outputs.iter().enumerate() {
        let value = substitution.apply(graph, output.value);
        let value = shown((model, settings, number), graph, value, (memories, &mut begin.sensors));
        outputs.push(match output.average {
            None => value,
            Some(window) => {
                memories.push(Memory::whole(MemoryKind::Average, vec![value, window]));
                memory(graph, memories.len() - 1)
            }
        });
    }
    outputs
}

impl Step {
    /// Makes the step of a model.
    pub fn new(model: &Model, settings: &StepSettings) -> Self {
        let mut graph = model.graph.clone();
        let own = model.parameters.len();
        let open = open_states(model);
        let initial = model.states.iter().enumerate().map(|(n, state)| match &state.initial {
            InitialState::Given(id) => id.0,
            _ => {
                let place = open.iter().position(|state| *state == n).unwrap_or(0);
                let value = parameter(&mut graph, own + place);
                let factor = graph.constant(state.unit.unit.factor);
                graph.multiply(factor, value)
            }
        });
        let mut initial: Vec<Id> = initial.collect();
        // The first sample is an instant of every law.
        initial.extend(model.laws.iter().map(|_| graph.constant(0.0)));
        let mut memories: Vec<Memory> = Vec::new();
        for of in &model.delayed {
            memories.push(delay_of(&mut graph, of, settings.is_first_order_hold));
        }
        let held = at_instant(model, &mut graph, &mut memories, settings);
        let mut begin = Begin { held, sensors: Vec::new() };
        let outputs = outputs_of((model, settings), &mut graph, &mut memories, &mut begin);
        let parameters = own + open.len();
        let affine = Affine::of(model, &mut graph);
        let (next, milestones) = (Vec::new(), Vec::new());
        let mut step = Self { graph, next, milestones, outputs, memories, initial, extras: None, parameters };
        match (settings.method, settings.step_s) {
            (IntegrationMethod::Exponential, Some(step_s)) => {
                step.exponential(model, &affine, (step_s, settings), &begin);
            }
            _ => step.runge_kutta(model, &affine, settings, &begin),
        }
        step
    }

    /// Returns the delayed signals of a model, their means over a substep.
    fn delayed(&mut self, model: &Model, substep: Substep) -> Vec<Id> {
        let own = model.delayed.len();
        if substep == Substep::WHOLE {
            return (0..own).map(|number| memory(&mut self.graph, number)).collect();
        }
        let part = |number: usize| {
            self.memories.push(Memory { substep, ..self.memories[number].clone() });
            memory(&mut self.graph, self.memories.len() - 1)
        };
        (0..own).map(part).collect()
    }

    /// Returns the derivatives of nodes of parameters alone in the direction of [`Self::with_tangents`].
    pub fn rates_of(&mut self, roots: &[Id]) -> Vec<Id> {
        let all = self.all_parameters();
        let rates: Vec<Id> = (0..all).map(|n| parameter(&mut self.graph, all + n)).collect();
        let mut direction = Direction::new(|leaf| match leaf {
            Leaf::Parameter(n) => rates.get(usize::from(n)).copied(),
            _ => None,
        });
        roots.iter().map(|root| direction.derivative(&mut self.graph, *root)).collect()
    }

    /// Returns the number of all parameters: those of the model, free initial states, those computed from exponentials.
    pub fn all_parameters(&self) -> usize {
        self.parameters + self.extras.as_ref().map_or(0, Extras::count)
    }

    /// Returns the step with the derivatives of states and outputs, each after the values, in a direction whose rates are parameters
    /// and states after the others: parameter `n` changes at the rate of parameter `parameters + n` (extras included), state `n` has
    /// the derivative `states + n`.
    pub fn with_tangents(&self) -> Self {
        let mut step = self.clone();
        let (states, all) = (self.next.len(), self.all_parameters());
        let graph = &mut step.graph;
        let rates: Vec<Id> = (0..all).map(|n| parameter(graph, all + n)).collect();
        let slopes: Vec<Id> =
            (states..2 * states).map(|n| graph.leaf(Leaf::State(u16::try_from(n).unwrap_or(u16::MAX)))).collect();
        let own = step.memories.len();
        let of_memories: Vec<Id> = (own..2 * own).map(|n| memory(graph, n)).collect();
        let mut direction = Direction::new(|leaf| match leaf {
            Leaf::Parameter(n) => rates.get(usize::from(n)).copied(),
            Leaf::State(n) => slopes.get(usize::from(n)).copied(),
            Leaf::Memory(n) => of_memories.get(usize::from(n)).copied(),
            _ => None,
        });
        for number in 0..own {
            let Memory { operands, shared, .. } = &step.memories[number];
            let (operands, shared) = (operands.clone(), shared.map(|other| own + other));
            let operands = operands.iter().flat_map(|id| [*id, direction.derivative(graph, *id)]).collect();
            step.memories.push(Memory { is_rate: true, operands, shared, ..step.memories[number].clone() });
        }
        for list in [&mut step.next, &mut step.outputs, &mut step.initial] {
            let derivatives: Vec<Id> = list.iter().map(|id| direction.derivative(graph, *id)).collect();
            list.extend(derivatives);
        }
        let mut milestones = Vec::new();
        for id in &self.milestones {
            milestones.extend([*id, direction.derivative(graph, *id)]);
        }
        step.milestones = milestones;
        step
    }
}
