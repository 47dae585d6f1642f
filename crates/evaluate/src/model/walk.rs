//! Steps of one candidate by evaluation of the graph, node by node: the reference of shaders.

use super::problem::ModelProblem;
use crate::interpreter::{Loss, Memory, Register};
use motorfit_model::graph::{Leaf, evaluate};
use motorfit_model::step::{MemoryKind, Step};

impl ModelProblem {
    /// Returns the sum of the losses of each output of a candidate over the first `samples` samples of a recording.
    #[doc(hidden)]
    pub fn walk(&self, free: &[f64], recording: usize, samples: usize) -> Vec<f64> {
        let (programs, prepared) = self.prepared(recording);
        let (step, rows) = (&programs.step, &prepared.rows);
        let parameters: Vec<f64> = self.lanes(&[free], recording).iter().map(|of| of[0]).collect();
        let mut memories: Vec<Memory<1>> = step.memories.iter().map(|_| Memory::new()).collect();
        let order = order_of(step);
        let mut values = Vec::new();
        let mut states: Vec<f64> = Vec::new();
        let mut sums = vec![0.0; step.outputs.len()];
        for n in 0..samples.min(rows.samples) {
            let mut remembered = vec![0.0; step.memories.len()];
            let mut of = |ids: &[_], states: &[f64], remembered: &[f64]| {
                evaluate(&step.graph, ids, &mut values, &|leaf| match leaf {
                    Leaf::Parameter(number) => parameters.get(usize::from(number)).copied().unwrap_or(0.0),
                    Leaf::State(number) => states.get(usize::from(number)).copied().unwrap_or(0.0),
                    Leaf::Memory(number) => remembered.get(usize::from(number)).copied().unwrap_or(0.0),
                    Leaf::Input(_) | Leaf::NextInput(_) | Leaf::Reaction(_) => self.input(recording, n, leaf),
                })
            };
            if n == 0 {
                states = of(&step.initial, &[], &[]);
            }
            for number in &order {
                let (memory, own) = (&step.memories[*number], &mut memories[*number]);
                let operands: Vec<Register<1>> =
                    of(&memory.operands, &states, &remembered).into_iter().map(Register::of).collect();
                let zero = Register::ZERO;
                let operand = |n: usize| [operands.get(n).unwrap_or(&zero), &zero];
                let [value, _] = match memory.kind {
                    MemoryKind::Delay => {
                        own.delayed((&rows.clock, memory.substep), [operand(0), operand(1), operand(2)], None)
                    }
                    MemoryKind::LinearDelay => {
                        let next = Some(operand(3));
                        own.delayed((&rows.clock, memory.substep), [operand(0), operand(1), operand(2)], next)
                    }
                    MemoryKind::Average => own.averaged(&rows.clock, [operand(0), operand(1)]),
                    // No shader has the filter or the delay of a sensor.
                    MemoryKind::Sensor | MemoryKind::Track | MemoryKind::SmoothTrack => [Register::of(f64::NAN); 2],
                };
                remembered[*number] = value.lane(0);
            }
            for (output, value) in of(&step.outputs, &states, &remembered).into_iter().enumerate() {
                let at = n * sums.len() + output;
                let (error, weight) = (rows.measured[at] - value, rows.weights.get(at).copied().unwrap_or(1.0));
                let size = if prepared.loss == Loss::WeightedMagnitudes { error.abs() } else { error * error };
                sums[output] += weight * size;
            }
            states = of(&step.next, &states, &remembered);
        }
        sums
    }
}

/// Returns the memories of a step in an order in which each follows those that it depends on.
fn order_of(step: &Step) -> Vec<usize> {
    let mut order: Vec<usize> = Vec::new();
    let needs = |memory: usize| -> Vec<usize> {
        let leaves = step.graph.leaves(&step.memories[memory].operands);
        leaves
            .into_iter()
            .filter_map(|leaf| if let Leaf::Memory(n) = leaf { Some(usize::from(n)) } else { None })
            .collect()
    };
    while order.len() < step.memories.len() {
        let before = order.len();
        for memory in 0..step.memories.len() {
            if !order.contains(&memory) && needs(memory).iter().all(|other| order.contains(other)) {
                order.push(memory);
            }
        }
        if order.len() == before {
            break;
        }
    }
    order
}
