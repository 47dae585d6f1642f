//! The classical Runge–Kutta method of order 4.

use super::affine::Affine;
use super::coupling::StepEnd;
use super::map::Step;
use super::memories::Substep;
use super::reaction::Reactions;
use super::right_hand_sides::{InputsAt, right_hand_sides};
use super::sampled;
use super::sensor::{Begin, track};
use super::settings::StepSettings;
use crate::definition::Model;
use crate::graph::{Graph, Id, Leaf};

/// Inputs of a step: values at its start and at its end, and its length.
struct Inputs {
    start: Vec<Id>,
    end: Vec<Id>,
}

impl Inputs {
    fn new(model: &Model, graph: &mut Graph, is_first_order_hold: bool) -> Self {
        let count = model.inputs.len();
        let leaves = |graph: &mut Graph, of: fn(u16) -> Leaf| {
            (0..count).map(|n| graph.leaf(of(u16::try_from(n).unwrap_or(u16::MAX)))).collect::<Vec<Id>>()
        };
        let start = leaves(graph, Leaf::Input);
        let end = if is_first_order_hold { leaves(graph, Leaf::NextInput) } else { start.clone() };
        Self { start, end }
    }

    /// Returns the inputs at a fraction of the step with the delayed signals.
    fn at(&self, graph: &mut Graph, fraction: f64, delayed: &[Id]) -> InputsAt {
        let [before, after] = [1.0 - fraction, fraction].map(|weight| graph.constant(weight));
        let value = |(&start, &end): (&Id, &Id)| match start == end {
            true => start,
            false => {
                let (a, b) = (graph.multiply(before, start), graph.multiply(after, end));
                graph.add(a, b)
            }
        };
        let mut all: Vec<Id> = self.start.iter().zip(&self.end).map(value).collect();
        all.extend(delayed);
        InputsAt { all, inputs: self.start.len() }
    }
}

/// Returns `x + factor k` for each state.
fn moved(graph: &mut Graph, x: &[Id], factor: Id, k: &[Id]) -> Vec<Id> {
    let one = |(&x, &k): (&Id, &Id)| {
        let change = graph.multiply(factor, k);
        graph.add(x, change)
    };
    x.iter().zip(k).map(one).collect()
}

impl Step {
    /// Makes the step by the Runge–Kutta method; `start` is what is known at its start.
    pub(super) fn runge_kutta(&mut self, model: &Model, affine: &Affine, settings: &StepSettings, start: &Begin) {
        let substeps = settings.substeps.max(1);
        let delayed: Vec<Vec<Id>> =
            (0..substeps).map(|substep| self.delayed(model, Substep::new(substep, substeps))).collect();
        let graph = &mut self.graph;
        let inputs = Inputs::new(model, graph, settings.is_first_order_hold);
        let step = match settings.step_s {
            Some(step) => graph.constant(step),
            None => graph.leaf(Leaf::Input(u16::try_from(inputs.start.len()).unwrap_or(u16::MAX))),
        };
        let share = graph.constant(1.0 / motorfit_core::numeric::count(substeps));
        let step = graph.multiply(share, step);
        let mut x: Vec<Id> =
            (0..model.states.len()).map(|n| graph.leaf(Leaf::State(u16::try_from(n).unwrap_or(u16::MAX)))).collect();
        let (mut milestones, mut held) = (Vec::new(), start.held.clone());
        for (substep, delayed) in delayed.iter().enumerate() {
            let before = x.clone();
            let at = |fraction: f64| {
                (motorfit_core::numeric::count(substep) + fraction) / motorfit_core::numeric::count(substeps)
            };
            if substep > 0 {
                let inputs = inputs.at(graph, at(0.0), delayed);
                held = sampled::held((model, settings), graph, substep, (&x, &inputs), &held);
            }
            milestones.extend(&held);
            let remembered: Vec<Id> = delayed.iter().chain(&held).copied().collect();
            let [first, middle, last] = [0.0, 0.5, 1.0].map(|fraction| inputs.at(graph, at(fraction), &remembered));
            let [half, sixth, third] = [0.5, 1.0 / 6.0, 1.0 / 3.0].map(|share| {
                let share = graph.constant(share);
                graph.multiply(share, step)
            });
            let k1 = right_hand_sides(graph, &affine.right, &x, &first);
            let second = moved(graph, &x, half, &k1);
            let k2 = right_hand_sides(graph, &affine.right, &second, &middle);
            let third_state = moved(graph, &x, half, &k2);
            let k3 = right_hand_sides(graph, &affine.right, &third_state, &middle);
            let fourth = moved(graph, &x, step, &k3);
            let k4 = right_hand_sides(graph, &affine.right, &fourth, &last);
            for (factor, k) in [(sixth, &k1), (third, &k2), (third, &k3), (sixth, &k4)] {
                x = moved(graph, &x, factor, k);
            }
            milestones.extend(second.into_iter().chain(third_state).chain(fourth));
            if !model.reactions.is_empty() {
                milestones.extend(&x);
                let gain = |graph: &mut Graph, _: usize, factors: &[Id]| series_gain(graph, affine, step, factors);
                let [begin, end] = [(&before, &first), (&x, &last)].map(|(states, inputs)| StepEnd { states, inputs });
                x = Reactions { model, affine, step, gain: &gain }.react(graph, begin, end);
            }
            if substep + 1 < substeps || !start.sensors.is_empty() {
                milestones.extend(&x);
            }
            let ends = [(&before, &first), (&x, &last)].map(|(states, inputs)| StepEnd { states, inputs });
            let sensors = (&start.sensors[..], &mut self.memories);
            milestones.extend(track((model, affine, settings), graph, sensors, ends, substep));
        }
        x.extend(held);
        self.next = x;
        self.milestones = milestones;
    }
}

/// Returns the change of the states over a step by a unit of a reaction with factors Γ: the terms of the Runge–Kutta method,
/// `h Σ (hA)ⁿ/(n+1)! Γ` with n < 4.
fn series_gain(graph: &mut Graph, affine: &Affine, step: Id, factors: &[Id]) -> Vec<Id> {
    let mut term: Vec<Id> = factors.iter().map(|own| graph.multiply(step, *own)).collect();
    let mut gain = term.clone();
    for divisor in [2.0, 3.0, 4.0] {
        let share = graph.constant(1.0 / divisor);
        let share = graph.multiply(share, step);
        let zero = graph.constant(0.0);
        let row = |row: &Vec<Id>| {
            let products: Vec<Id> = row.iter().zip(&term).map(|(a, t)| graph.multiply(*a, *t)).collect();
            let sum = products.into_iter().fold(zero, |sum, product| graph.add(sum, product));
            graph.multiply(share, sum)
        };
        term = affine.states.iter().map(row).collect();
        gain = gain.iter().zip(&term).map(|(sum, more)| graph.add(*sum, *more)).collect();
    }
    gain
}
