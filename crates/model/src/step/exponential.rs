//! Steps with matrix exponentials: the exact map of the affine part, and the exponential Runge–Kutta method of order 4 for the rest.
//!
//! With `φ₀ = eᶻ`, `φ₁ = (eᶻ−1)/z`, `φ₂ = (φ₁−1)/z`, `φ₃ = (φ₂−½)/z` of `z = hA`, held inputs act by `h φ₁ B u`, straight lines
//! by `h (φ₁−φ₂) B u₀ + h φ₂ B u₁`. The nonlinear terms N at four stages have the weights `h (φ₁−3φ₂+4φ₃)`, `2h (φ₂−2φ₃)`
//! twice, and `h (4φ₃−φ₂)` (S. M. Cox, P. C. Matthews, J. Comput. Phys. 176, 2002, Eqs. 26 to 29).

use super::affine::Affine;
use super::coupling::StepEnd;
use super::extras::{Block, Extras, Source};
use super::map::Step;
use super::memories::{Substep, parameter};
use super::reaction::Reactions;
use super::right_hand_sides::{InputsAt, right_hand_sides};
use super::sampled;
use super::sensor::{Begin, track};
use super::settings::StepSettings;
use crate::definition::Model;
use crate::graph::{Graph, Id, Leaf};
use motorfit_core::numeric::count;

/// Inputs at the three places of a step, and the parameters of its exponentials.
struct Builder<'a> {
    graph: &'a mut Graph,
    extras: &'a Extras,
    first: usize,
    inputs: [InputsAt; 3],
}

impl Builder<'_> {
    fn column(&mut self, block: Block) -> Vec<Id> {
        column(self.graph, (self.extras, self.first), block)
    }

    /// Adds columns times factors to states.
    fn add(&mut self, x: &mut [Id], block: Block, factor: Option<Id>) {
        for (x, own) in x.iter_mut().zip(self.column(block)) {
            let change = match factor {
                Some(factor) => self.graph.multiply(own, factor),
                None => own,
            };
            *x = self.graph.add(*x, change);
        }
    }

    /// Returns `x` after a step of the affine part, or after half a step that begins at place `from` of the step.
    fn affine(&mut self, x: &[Id], is_half: bool, from: usize) -> Vec<Id> {
        let n = x.len();
        let change = self.column(if is_half { Block::HalfChange } else { Block::Change });
        let mut next = Vec::with_capacity(n);
        for row in 0..n {
            let mut sum = x[row];
            for (own, x) in change[row * n..(row + 1) * n].iter().zip(x) {
                let product = self.graph.multiply(*own, *x);
                sum = self.graph.add(sum, product);
            }
            next.push(sum);
        }
        let to = if is_half { from + 1 } else { 2 };
        for source in 0..self.extras.sources.len() {
            let (start, end) = if is_half {
                (Block::HalfStart(source), Block::HalfEnd(source))
            } else {
                (Block::Start(source), Block::End(source))
            };
            match self.extras.sources[source] {
                Source::Input(input) => {
                    let [before, after] = [from, to].map(|place| self.inputs[place].all[input]);
                    self.add(&mut next, start, Some(before));
                    if !self.extras.is_held(source) {
                        self.add(&mut next, end, Some(after));
                    }
                }
                Source::Constant => self.add(&mut next, start, None),
                Source::Reaction(_) => {}
            }
        }
        next
    }
}

/// Returns a column of the exponentials, whose parameters begin at `first`.
fn column(graph: &mut Graph, (extras, first): (&Extras, usize), block: Block) -> Vec<Id> {
    let from = first + extras.place(block);
    (from..from + extras.length(block)).map(|n| parameter(graph, n)).collect()
}

/// Returns the change of the states over a step by a unit of a reaction with factors Γ: `h φ₁ Γ`.
fn gain(graph: &mut Graph, of: (&Extras, usize), reaction: usize, factors: &[Id]) -> Vec<Id> {
    let (extras, _) = of;
    if let Some(source) = extras.sources.iter().position(|source| *source == Source::Reaction(reaction)) {
        return column(graph, of, Block::Start(source));
    }
    let mut gain = vec![graph.constant(0.0); factors.len()];
    for (place, row) in extras.acted.iter().enumerate() {
        for (gain, own) in gain.iter_mut().zip(column(graph, of, Block::Acted(place))) {
            let change = graph.multiply(own, factors[*row]);
            *gain = graph.add(*gain, change);
        }
    }
    gain
}

impl Step {
    /// Makes the step with matrix exponentials; `begin` is what is known at its start.
    pub(super) fn exponential(
        &mut self,
        model: &Model,
        affine: &Affine,
        (step_s, settings): (f64, &StepSettings),
        begin: &Begin,
    ) {
        let extras = extras_of(model, affine, &self.graph, (step_s, settings));
        let substeps = settings.substeps.max(1);
        let delayed: Vec<Vec<Id>> =
            (0..substeps).map(|substep| self.delayed(model, Substep::new(substep, substeps))).collect();
        let (first, graph) = (self.parameters, &mut self.graph);
        let leaf =
            |graph: &mut Graph, of: fn(u16) -> Leaf, n: usize| graph.leaf(of(u16::try_from(n).unwrap_or(u16::MAX)));
        let own = model.inputs.len();
        let start: Vec<Id> = (0..own).map(|n| leaf(graph, Leaf::Input, n)).collect();
        let is_line = settings.is_first_order_hold;
        let end: Vec<Id> = (0..own).map(|n| if is_line { leaf(graph, Leaf::NextInput, n) } else { start[n] }).collect();
        let mut x: Vec<Id> = (0..model.states.len()).map(|n| leaf(graph, Leaf::State, n)).collect();
        let (mut milestones, mut held) = (Vec::new(), begin.held.clone());
        for (substep, delayed) in delayed.iter().enumerate() {
            let at = |graph: &mut Graph, fraction: f64, held: &[Id]| {
                let mut all = between(graph, &start, &end, (count(substep) + fraction) / count(substeps));
                all.extend(delayed.iter().chain(held));
                InputsAt { all, inputs: own }
            };
            if substep > 0 {
                let inputs = at(graph, 0.0, &[]);
                held = sampled::held((model, settings), graph, substep, (&x, &inputs), &held);
            }
            milestones.extend(&held);
            let inputs = [0.0, 0.5, 1.0].map(|fraction| at(graph, fraction, &held));
            let mut builder = Builder { graph, extras: &extras, first, inputs };
            let mut next = builder.affine(&x, false, 0);
            if !extras.rows.is_empty() {
                let rest: Vec<Id> = extras.rows.iter().map(|row| affine.rest[*row]).collect();
                milestones.extend(builder.nonlinear(&x, &rest, &mut next));
            }
            if !model.reactions.is_empty() {
                milestones.extend(&next);
                let [start, _, last] = &builder.inputs;
                let [start, end] = [(&x, start), (&next, last)].map(|(states, inputs)| StepEnd { states, inputs });
                let step = builder.graph.constant(extras.step_s);
                let gain = |graph: &mut Graph, n: usize, factors: &[Id]| gain(graph, (&extras, first), n, factors);
                next = Reactions { model, affine, step, gain: &gain }.react(builder.graph, start, end);
            }
            if substep + 1 < substeps || !begin.sensors.is_empty() {
                milestones.extend(&next);
            }
            let [first, _, last] = &builder.inputs;
            let ends = [(&x, first), (&next, last)].map(|(states, inputs)| StepEnd { states, inputs });
            let sensors = (&begin.sensors[..], &mut self.memories);
            milestones.extend(track((model, affine, settings), builder.graph, sensors, ends, substep));
            x = next;
        }
        x.extend(held);
        self.next = x;
        self.milestones = milestones;
        self.extras = Some(extras);
    }
}

/// Returns the matrices of the affine part over a substep, with the inputs that act on it.
fn extras_of(model: &Model, affine: &Affine, graph: &Graph, (step_s, settings): (f64, &StepSettings)) -> Extras {
    let is_zero = |graph: &Graph, ids: &[Id]| ids.iter().all(|id| graph.is_constant(*id, 0.0));
    let inputs = model.inputs.len() + model.delayed.len() + model.laws.len();
    let mut sources: Vec<(Source, Vec<Id>)> = (0..inputs)
        .map(|input| (Source::Input(input), affine.inputs.iter().map(|row| row[input]).collect()))
        .chain([(Source::Constant, affine.constant.clone())])
        .collect();
    sources.retain(|(_, column)| !is_zero(graph, column));
    let reactions = affine.reactions.iter().enumerate();
    let (varying, constant): (Vec<_>, Vec<_>) = reactions.partition(|(n, _)| affine.varies(graph, *n));
    sources.extend(constant.into_iter().map(|(n, column)| (Source::Reaction(n), column.clone())));
    let is_acted = |row: &usize| varying.iter().any(|(_, column)| !graph.is_constant(column[*row], 0.0));
    Extras {
        roots: affine
            .states
            .concat()
            .into_iter()
            .chain(sources.iter().flat_map(|(_, column)| column.clone()))
            .collect(),
        step_s: step_s / count(settings.substeps.max(1)),
        states: model.states.len(),
        sources: sources.into_iter().map(|(source, _)| source).collect(),
        is_first_order_hold: settings.is_first_order_hold,
        rows: affine.nonlinear_rows(graph),
        acted: (0..model.states.len()).filter(is_acted).collect(),
    }
}

/// Returns inputs at a fraction of the step.
fn between(graph: &mut Graph, start: &[Id], end: &[Id], fraction: f64) -> Vec<Id> {
    let [before, after] = [1.0 - fraction, fraction].map(|weight| graph.constant(weight));
    let value = |(&a, &b): (&Id, &Id)| {
        if a == b {
            return a;
        }
        let (a, b) = (graph.multiply(before, a), graph.multiply(after, b));
        graph.add(a, b)
    };
    start.iter().zip(end).map(value).collect()
}

impl Builder<'_> {
    /// Adds the effect of nonlinear terms over a step to `next`, the states after the affine part; returns the states of the stages.
    fn nonlinear(&mut self, x: &[Id], rest: &[Id], next: &mut [Id]) -> Vec<Id> {
        let [start, middle, end] = self.inputs.clone();
        let half_step = self.affine(x, true, 0);
        let n0 = right_hand_sides(self.graph, rest, x, &start);
        let mut a = half_step.clone();
        self.add_stages(&mut a, Block::HalfStage, &n0);
        let na = right_hand_sides(self.graph, rest, &a, &middle);
        let mut b = half_step;
        self.add_stages(&mut b, Block::HalfStage, &na);
        let nb = right_hand_sides(self.graph, rest, &b, &middle);
        let two = self.graph.constant(2.0);
        let mut bent = Vec::new();
        for (&b, &a) in nb.iter().zip(&n0) {
            let twice = self.graph.multiply(two, b);
            bent.push(self.graph.subtract(twice, a));
        }
        let mut c = self.affine(&a, true, 1);
        self.add_stages(&mut c, Block::HalfStage, &bent);
        let nc = right_hand_sides(self.graph, rest, &c, &end);
        let middle_sum: Vec<Id> = na.iter().zip(&nb).map(|(&a, &b)| self.graph.add(a, b)).collect();
        for (weight, values) in [n0, middle_sum, nc].iter().enumerate() {
            for (row, value) in values.iter().enumerate() {
                self.add(next, Block::Weight(row, weight), Some(*value));
            }
        }
        a.into_iter().chain(b).chain(c).collect()
    }

    /// Adds the nonlinear terms of a stage to states.
    fn add_stages(&mut self, x: &mut [Id], block: fn(usize) -> Block, values: &[Id]) {
        for (row, value) in values.iter().enumerate() {
            self.add(x, block(row), Some(*value));
        }
    }
}
