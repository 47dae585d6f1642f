//! A step of affine equations in the layout of a kernel.

use super::affine::Affine;
use super::extras::{Block, Source};
use super::map::Step;
use crate::definition::Model;
use crate::graph::{Id, Leaf, Node};

/// Largest number of states of an affine step with a kernel: with more, whose coefficients do not stay in registers, a kernel was no
/// faster than the program.
const STATES_MAX: usize = 2;

/// A step `x⁺ = x + D x + g₀ + Σ g u`, then reactions, repeated for each substep. Coefficients are parameters that
/// `Extras::compute` gives: their numbers are the places here. Rows and columns are in the order of the model.
#[derive(Debug, Clone)]
pub struct AffineStep {
    /// Number of substeps.
    pub substeps: usize,
    /// The states in the order of the kernel: those of the outputs, then the others.
    pub states: Vec<usize>,
    /// The output of each state of an output, in the order of the kernel.
    pub outputs: Vec<usize>,
    /// Place of D, row by row.
    pub change: usize,
    /// Place of g₀, if there is one.
    pub constant: Option<usize>,
    /// The inputs that act on the states.
    pub taps: Vec<Tap>,
    /// Reactions in the order in which they act; their own states increase in the order of the kernel.
    pub reactions: Vec<AffineReaction>,
    /// Initial states in the order of the model, then the limit of each reaction: of parameters alone.
    pub roots: Vec<Id>,
}

/// An input that acts on the states.
#[derive(Debug, Clone, Copy)]
pub struct Tap {
    /// Number of the input.
    pub input: usize,
    /// True for its value at the end of the substep, false for that at the start.
    pub is_end: bool,
    /// Place of its gain on each state.
    pub place: usize,
}

/// A reaction with a limit of parameters alone.
#[derive(Debug, Clone, Copy)]
pub struct AffineReaction {
    /// The state that it brings to zero, as a number in the order of the kernel.
    pub own: usize,
    /// Place of its gain on each state.
    pub place: usize,
}

impl Step {
    /// Returns the layout for a kernel; `None` for a step with nonlinear terms, memories, sampled laws, limits that vary, reactions that act on
    /// each other, outputs that are not states, or too many states.
    pub fn affine_step(&self, model: &Model, substeps: usize) -> Option<AffineStep> {
        let extras = self.extras.as_ref().filter(|extras| extras.is_affine())?;
        let outputs = self.output_states()?;
        let number = model.states.len();
        let are_coupled = || Affine::of(model, &mut self.graph.clone()).groups.iter().any(|group| group.len() > 1);
        if model.reactions.len() > 1 && are_coupled() {
            return None;
        }
        if !self.memories.is_empty() || !model.laws.is_empty() || number > STATES_MAX {
            return None;
        }
        let is_output = |state: &usize| outputs.contains(state);
        let mut states: Vec<usize> = (0..number).filter(is_output).collect();
        states.extend((0..number).filter(|state| !is_output(state)));
        let kernel = |state: usize| states.iter().position(|own| *own == state);
        let place = |block: Block| self.parameters + extras.place(block);
        let (mut taps, mut constant, mut gains) = (Vec::new(), None, vec![0; model.reactions.len()]);
        for (number, source) in extras.sources.iter().enumerate() {
            let start = place(Block::Start(number));
            match *source {
                Source::Constant => constant = Some(start),
                Source::Reaction(n) => gains[n] = start,
                Source::Input(input) => {
                    taps.push(Tap { input, is_end: false, place: start });
                    if !extras.is_held(number) {
                        taps.push(Tap { input, is_end: true, place: place(Block::End(number)) });
                    }
                }
            }
        }
        let mut acting: Vec<usize> = (0..model.reactions.len()).collect();
        acting.sort_by_key(|n| model.reactions[*n].state);
        let mut reactions: Vec<AffineReaction> = Vec::new();
        for n in &acting {
            let own = kernel(model.reactions[*n].state)?;
            if reactions.last().is_some_and(|last| last.own >= own) {
                return None;
            }
            reactions.push(AffineReaction { own, place: gains[*n] });
        }
        let limits = acting.iter().map(|n| model.reactions[*n].limit);
        let roots: Vec<Id> = self.initial.iter().copied().chain(limits).collect();
        let outputs = states[..outputs.len()].iter().filter_map(|state| outputs.iter().position(|own| own == state));
        let outputs = outputs.collect();
        let is_fixed = roots.iter().all(|root| self.graph.is_fixed(*root));
        let change = place(Block::Change);
        is_fixed.then_some(AffineStep { substeps, states, outputs, change, constant, taps, reactions, roots })
    }

    /// Returns the state that each output is; `None` unless they are different ones.
    fn output_states(&self) -> Option<Vec<usize>> {
        let mut states: Vec<usize> = Vec::new();
        for output in &self.outputs {
            let Node::Leaf(Leaf::State(state)) = self.graph.node(*output) else { return None };
            if states.contains(&usize::from(state)) {
                return None;
            }
            states.push(usize::from(state));
        }
        Some(states)
    }
}
