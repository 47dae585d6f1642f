//! A plain simulation of the equations of a model with fine steps, one candidate at a time: the oracle of the tests.
//!
//! It evaluates the right-hand sides as they are written, without the separation of affine parts, and needs many steps where the
//! evaluators need one.

use super::Model;
use super::definition::InitialState;
use super::graph::{Id, Leaf, evaluate};
use motorfit_core::numeric::count;

/// Returns the outputs at each sample, shape `[outputs][samples]`, in their units. `inputs` have the shape `[inputs][samples]` and are
/// held over each step of `step_s` seconds, which is divided by `substeps`. `open` are the initial values of states that
/// are measured or free, in their units.
#[expect(
    clippy::too_many_arguments,
    clippy::too_many_lines,
    clippy::float_cmp,
    reason = "an oracle in one piece; held inputs are equal"
)]
pub(crate) fn simulate(
    model: &Model,
    values: &[f64],
    open: &[f64],
    inputs: &[Vec<f64>],
    step_s: f64,
    substeps: usize,
) -> Vec<Vec<f64>> {
    let samples = inputs.first().map_or(0, Vec::len);
    let mut memory = Vec::new();
    // Delayed signals at a time: the signal of the sample that was present then, piecewise constant.
    let signals: Vec<[Id; 3]> = model.delayed.iter().map(|of| [of.value, of.delay, of.latency]).collect();
    let changed = (1..samples).find(|n| inputs.iter().any(|input| input[*n] != input[0]));
    let first_change = changed.map_or(f64::INFINITY, |n| count(n) * step_s);
    let delayed = |time: f64, memory: &mut Vec<f64>| -> Vec<f64> {
        let of = |[value, delay, latency]: &[Id; 3]| {
            let mut at = |n: usize, ids: &[Id]| {
                evaluate(&model.graph, ids, memory, &|leaf| match leaf {
                    Leaf::Parameter(k) => values[usize::from(k)],
                    Leaf::Input(k) => inputs[usize::from(k)][n],
                    _ => 0.0,
                })
            };
            let times = at(0, &[*delay, *latency]);
            let from = time - times[0];
            let held = times[1] > 0.0 && from < first_change + times[1];
            let n = if held || from < 0.0 { 0 } else { motorfit_core::numeric::whole((from / step_s + 1e-9).floor()) };
            at(n.min(samples - 1), &[*value])[0]
        };
        signals.iter().map(of).collect()
    };
    let mut memory_of_signals = Vec::new();
    let mut of = |ids: &[Id], x: &[f64], u: &[f64], reactions: &[f64], now: &[f64]| {
        evaluate(&model.graph, ids, &mut memory, &|leaf| match leaf {
            Leaf::Parameter(n) => values[usize::from(n)],
            Leaf::Input(n) | Leaf::NextInput(n) => u.get(usize::from(n)).copied().unwrap_or(0.0),
            Leaf::State(n) => x[usize::from(n)],
            Leaf::Reaction(n) => reactions[usize::from(n)],
            Leaf::Memory(n) => now.get(usize::from(n)).copied().unwrap_or(0.0),
        })
    };
    let zeros = vec![0.0; model.reactions.len()];
    let mut open = open.iter();
    let mut x: Vec<f64> = Vec::new();
    for state in &model.states {
        x.push(match &state.initial {
            InitialState::Given(id) => of(&[id.0], &[], &[], &[], &[])[0],
            _ => open.next().copied().unwrap_or(0.0) * state.unit.unit.factor,
        });
    }
    let right: Vec<Id> = model.states.iter().map(|state| state.derivative).collect();
    let outputs: Vec<Id> = model.outputs.iter().map(|output| output.value).collect();
    let h = step_s / count(substeps);
    let mut seen = vec![Vec::new(); outputs.len()];
    for n in 0..samples {
        let u: Vec<f64> = inputs.iter().map(|input| input[n]).collect();
        for (seen, value) in seen.iter_mut().zip(of(&outputs, &x, &u, &zeros, &[])) {
            seen.push(value);
        }
        for substep in 0..substeps {
            let now = delayed(count(n) * step_s + count(substep) * h, &mut memory_of_signals);
            let moved = |k: &[f64], by: f64| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + by * k).collect() };
            let k1 = of(&right, &x, &u, &zeros, &now);
            let k2 = of(&right, &moved(&k1, h / 2.0), &u, &zeros, &now);
            let k3 = of(&right, &moved(&k2, h / 2.0), &u, &zeros, &now);
            let k4 = of(&right, &moved(&k3, h), &u, &zeros, &now);
            let mut next: Vec<f64> =
                (0..x.len()).map(|s| x[s] + h / 6.0 * (k1[s] + 2.0 * (k2[s] + k3[s]) + k4[s])).collect();
            let mut order: Vec<usize> = (0..zeros.len()).collect();
            order.sort_by_key(|r| model.reactions[*r].state);
            for r in order {
                let axis = model.reactions[r].state;
                let limit = of(&[model.reactions[r].limit], &x, &u, &zeros, &now)[0];
                // Reactions act linearly: their gain is the difference that a unit makes.
                let mut unit = zeros.clone();
                unit[r] = 1.0;
                let (with, without) = (of(&right, &x, &u, &unit, &now), of(&right, &x, &u, &zeros, &now));
                let gain: Vec<f64> = with.iter().zip(&without).map(|(a, b)| h * (a - b)).collect();
                let value = (-next[axis] / gain[axis]).clamp(-limit, limit);
                next.iter_mut().zip(&gain).for_each(|(x, gain)| *x += gain * value);
            }
            x = next;
        }
    }
    seen
}
