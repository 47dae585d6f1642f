//! A plain simulation of the equations of a model with fine steps, one candidate at a time: the oracle of the tests.
//!
//! It evaluates the right-hand sides as they are written, without the separation of affine parts, and needs many steps where the
//! evaluators need one.

use super::definition::{InitialState, Model, ModelState};
use super::graph::{Id, Leaf, evaluate};
use motorfit_core::numeric::{count, whole};

/// Sweeps over reactions at most.
const SWEEPS_MAX: usize = 200;

/// A simulation of a model with values of its parameters and inputs of the shape `[inputs][samples]`, held over each step.
struct Simulation<'a> {
    model: &'a Model,
    values: &'a [f64],
    inputs: &'a [Vec<f64>],
    step_s: f64,
    /// Held values of the sampled laws.
    held: Vec<f64>,
    /// Working memory.
    memory: Vec<f64>,
}

/// Values at which nodes are evaluated; missing ones are zero.
#[derive(Clone, Copy, Default)]
struct Point<'a> {
    states: &'a [f64],
    inputs: &'a [f64],
    reactions: &'a [f64],
    delayed: &'a [f64],
}

impl Simulation<'_> {
    /// Returns the values of nodes at a point.
    fn of(&mut self, ids: &[Id], at: Point<'_>) -> Vec<f64> {
        let value = |of: &[f64], n: u16| of.get(usize::from(n)).copied().unwrap_or(0.0);
        evaluate(&self.model.graph, ids, &mut self.memory, &|leaf| match leaf {
            Leaf::Parameter(n) => self.values[usize::from(n)],
            Leaf::Input(n) | Leaf::NextInput(n) => value(at.inputs, n),
            Leaf::State(n) => value(at.states, n),
            Leaf::Reaction(n) => value(at.reactions, n),
            Leaf::Memory(n) => value(at.delayed, n),
        })
    }

    /// Returns the inputs of a sample.
    fn inputs(&self, sample: usize) -> Vec<f64> {
        self.inputs.iter().map(|input| input[sample]).collect()
    }

    /// Returns the initial states; `open` are those that are measured or free, in their units.
    fn initial(&mut self, open: &[f64]) -> Vec<f64> {
        let (model, mut open) = (self.model, open.iter());
        let state = |state: &ModelState| match &state.initial {
            InitialState::Given(id) => self.of(&[id.0], Point::default())[0],
            _ => open.next().copied().unwrap_or(0.0) * state.unit.unit.factor,
        };
        model.states.iter().map(state).collect()
    }

    /// Returns the delayed signals at a time: each is that of the sample that was present then, piecewise constant.
    #[expect(clippy::float_cmp, reason = "held inputs are equal")]
    fn delayed(&mut self, time: f64) -> Vec<f64> {
        let (model, samples) = (self.model, self.inputs.first().map_or(0, Vec::len));
        let changed = (1..samples).find(|n| self.inputs.iter().any(|input| input[*n] != input[0]));
        let first_change = changed.map_or(f64::INFINITY, |n| count(n) * self.step_s);
        let mut delayed = Vec::new();
        for signal in &model.delayed {
            let first = self.inputs(0);
            let times = self.of(&[signal.delay, signal.latency], Point { inputs: &first, ..Point::default() });
            let from = time - times[0];
            let is_first = times[1] > 0.0 && from < first_change + times[1];
            let n = if is_first || from < 0.0 { 0 } else { whole((from / self.step_s + 1e-9).floor()) };
            let then = self.inputs(n.min(samples - 1));
            delayed.extend(self.of(&[signal.value], Point { inputs: &then, ..Point::default() }));
        }
        delayed
    }

    /// Computes the sampled laws that have an instant nearest to the start of a fine step.
    fn sample(&mut self, at: Point<'_>, delayed: &[f64], step: usize, h: f64) {
        let model = self.model;
        for (n, law) in model.laws.iter().enumerate() {
            let instant = (count(step) * h / law.period_s).round() * law.period_s;
            if (instant - count(step) * h).abs() < 0.499 * h {
                let known = [delayed, &self.held].concat();
                self.held[n] = self.of(&[law.value], Point { delayed: &known, ..at })[0];
            }
        }
    }

    /// Returns the states after a substep of `h` seconds by the classical Runge–Kutta method, with the reactions.
    fn stepped(&mut self, at: Point<'_>, h: f64) -> Vec<f64> {
        let right: Vec<Id> = self.model.states.iter().map(|state| state.derivative).collect();
        let x = at.states;
        let moved = |k: &[f64], by: f64| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + by * k).collect() };
        let k1 = self.of(&right, at);
        let k2 = self.of(&right, Point { states: &moved(&k1, h / 2.0), ..at });
        let k3 = self.of(&right, Point { states: &moved(&k2, h / 2.0), ..at });
        let k4 = self.of(&right, Point { states: &moved(&k3, h), ..at });
        let mut next: Vec<f64> =
            (0..x.len()).map(|s| x[s] + h / 6.0 * (k1[s] + 2.0 * (k2[s] + k3[s]) + k4[s])).collect();
        self.react(&right, at, h, &mut next);
        next
    }

    /// Adds the reactions over a substep of `h` seconds to the states at its end. In sweeps each reaction in turn takes the value that brings
    /// its state to zero with the others as they are, until those that act on each other agree.
    fn react(&mut self, right: &[Id], at: Point<'_>, h: f64, next: &mut [f64]) {
        let number = self.model.reactions.len();
        let limits: Vec<Id> = self.model.reactions.iter().map(|reaction| reaction.limit).collect();
        let limits = self.of(&limits, at);
        let without = self.of(right, at);
        // Reactions act linearly: their gain is the difference that a unit makes.
        let gain = |r: usize| {
            let mut unit = vec![0.0; number];
            unit[r] = 1.0;
            let with = self.of(right, Point { reactions: &unit, ..at });
            with.iter().zip(&without).map(|(a, b)| h * (a - b)).collect()
        };
        let gains: Vec<Vec<f64>> = (0..number).map(gain).collect();
        let mut order: Vec<usize> = (0..number).collect();
        order.sort_by_key(|r| self.model.reactions[*r].state);
        let mut values = vec![0.0; number];
        let enough = 1e-14 * limits.iter().copied().fold(0.0, f64::max);
        for _ in 0..SWEEPS_MAX {
            let mut change: f64 = 0.0;
            for r in &order {
                let own = self.model.reactions[*r].state;
                let value = (values[*r] - next[own] / gains[*r][own]).clamp(-limits[*r], limits[*r]);
                let by = value - values[*r];
                next.iter_mut().zip(&gains[*r]).for_each(|(x, gain)| *x += gain * by);
                values[*r] = value;
                change = change.max(by.abs());
            }
            if number < 2 || change <= enough {
                break;
            }
        }
    }
}

/// Returns the outputs at each sample, shape `[outputs][samples]`, in their units. `inputs` have the shape `[inputs][samples]` and are
/// held over each step of `step_s` seconds, which is divided by `substeps`. `open` are the initial values of states that
/// are measured or free, in their units.
#[expect(clippy::too_many_arguments, reason = "the arguments of an oracle, of different types")]
pub fn simulate(
    model: &Model,
    values: &[f64],
    open: &[f64],
    inputs: &[Vec<f64>],
    step_s: f64,
    substeps: usize,
) -> Vec<Vec<f64>> {
    let mut simulation =
        Simulation { model, values, inputs, step_s, held: vec![0.0; model.laws.len()], memory: Vec::new() };
    let outputs: Vec<Id> = model.outputs.iter().map(|output| output.value).collect();
    let mut x = simulation.initial(open);
    let h = step_s / count(substeps);
    let mut seen = vec![Vec::new(); outputs.len()];
    for n in 0..inputs.first().map_or(0, Vec::len) {
        let u = simulation.inputs(n);
        let mut delayed = simulation.delayed(count(n) * step_s);
        let at = Point { states: &x, inputs: &u, ..Point::default() };
        simulation.sample(at, &delayed, n * substeps, h);
        delayed.extend(&simulation.held);
        let now = simulation.of(&outputs, Point { states: &x, inputs: &u, delayed: &delayed, ..Point::default() });
        seen.iter_mut().zip(now).for_each(|(seen, value)| seen.push(value));
        for substep in 0..substeps {
            let mut delayed = simulation.delayed(count(n) * step_s + count(substep) * h);
            let at = Point { states: &x, inputs: &u, ..Point::default() };
            simulation.sample(at, &delayed, n * substeps + substep, h);
            delayed.extend(&simulation.held);
            x = simulation.stepped(Point { states: &x, inputs: &u, delayed: &delayed, ..Point::default() }, h);
        }
    }
    seen
}
