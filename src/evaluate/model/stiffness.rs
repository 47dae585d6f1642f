//! Largest eigenvalue of the Jacobian of a model over the bounds of its parameters and along trajectories.

use super::recording::{ModelRecording, open_initial};
use super::space::ModelSpace;
use crate::model::Model;
use crate::model::graph::{Direction, Graph, Id, Leaf, evaluate};
use crate::model::step::open_states;
use crate::numeric::count;
use nalgebra::{DMatrix, DVector, Schur};
use rand::{RngExt as _, SeedableRng as _};

/// Largest `h|λ|` of the Runge–Kutta method.
pub(super) const STIFFNESS_MAX: f64 = 0.7;
/// Iterations of the eigenvalues at most.
const ITERATIONS_MAX: usize = 500;
/// Number of candidates in the bounds at which the Jacobian is evaluated, and of samples along the trajectory of each.
const CANDIDATES: usize = 24;
const SAMPLES: usize = 30;
/// Squarings of a matrix whose norm then bounds its eigenvalues.
const SQUARINGS: u32 = 8;

/// Returns about the largest magnitude of an eigenvalue of the Jacobian over candidates in the bounds and along their trajectories.
pub(super) fn largest_rate(model: &Model, space: &ModelSpace, recordings: &[ModelRecording], step: f64) -> f64 {
    let mut graph = model.graph.clone();
    let mut roots = jacobian(model, &mut graph);
    let entries = roots.len();
    roots.extend(model.states.iter().map(|state| state.derivative));
    let mut numbers = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
    let mut memory = Vec::new();
    let mut largest: f64 = 0.0;
    for candidate in 0..CANDIDATES {
        let recording = &recordings[candidate % recordings.len()];
        let free: Vec<f64> =
            space.free.iter().map(|axis| axis.at(if candidate == 0 { 0.5 } else { numbers.random::<f64>() })).collect();
        let values = space.values(&free, candidate % recordings.len());
        let mut walk = Walk { model, graph: &graph, values: &values, memory: &mut memory };
        let mut x = walk.initial(recording);
        let stride = (recording.len() / SAMPLES).max(1);
        // The Jacobian with the largest bound along the trajectory; eigenvalues themselves take ten times as long.
        let (mut rate, mut stiffest): (f64, Vec<f64>) = (0.0, Vec::new());
        for n in (0..recording.len()).step_by(stride) {
            let inputs: Vec<f64> = recording.inputs.iter().map(|input| input[n]).collect();
            let found = walk.at(&roots, &x, &inputs);
            let (jacobian, right) = found.split_at(entries);
            if !found.iter().all(|entry| entry.is_finite()) {
                break;
            }
            let own = bound(jacobian, x.len());
            if own > rate {
                (rate, stiffest) = (own, jacobian.to_vec());
            }
            let Some(next) = semi_implicit(&x, jacobian, right, step * count(stride)) else { break };
            x = next;
        }
        if rate > largest {
            largest = largest.max(spectral_radius(&stiffest, x.len()));
        }
    }
    largest
}

/// Returns the state after a step of the linearly implicit Euler method, `x + h (I − h J)⁻¹ f`, which is stable for any step (H. H.
/// Rosenbrock 1963); `None` if the state grows without limit.
fn semi_implicit(x: &[f64], jacobian: &[f64], right: &[f64], h: f64) -> Option<Vec<f64>> {
    let size = x.len();
    let entry = |row: usize, column: usize| f64::from(u8::from(row == column)) - h * jacobian[row * size + column];
    let mut rate = DVector::from_column_slice(right);
    if !DMatrix::from_fn(size, size, entry).lu().solve_mut(&mut rate) {
        return None;
    }
    let next: Vec<f64> = x.iter().zip(&rate).map(|(x, rate)| x + h * rate).collect();
    next.iter().all(|value| value.abs() < 1e9).then_some(next)
}

/// Returns the Jacobian of the right-hand sides, row by row.
fn jacobian(model: &Model, graph: &mut Graph) -> Vec<Id> {
    let one = graph.constant(1.0);
    let mut columns = Vec::new();
    for state in 0..model.states.len() {
        let mut direction =
            Direction::new(|leaf| matches!(leaf, Leaf::State(n) if usize::from(n) == state).then_some(one));
        columns.push(model.states.iter().map(|of| direction.derivative(graph, of.derivative)).collect::<Vec<Id>>());
    }
    (0..model.states.len()).flat_map(|row| columns.iter().map(move |column| column[row])).collect()
}

/// Returns an upper bound of the magnitudes of the eigenvalues, a few percent above the largest: ‖A^m‖^(1/m) with m = 256
/// (I. M. Gelfand 1941).
fn bound(entries: &[f64], size: usize) -> f64 {
    let (mut power, mut next) = (entries.to_vec(), vec![0.0; entries.len()]);
    let mut logarithm = 0.0;
    for _ in 0..SQUARINGS {
        let norm = norm(&power, size);
        if norm == 0.0 || !norm.is_finite() {
            return norm;
        }
        power.iter_mut().for_each(|entry| *entry /= norm);
        logarithm = 2.0 * (logarithm + norm.ln());
        for (row, to) in power.chunks(size).zip(next.chunks_mut(size)) {
            to.fill(0.0);
            for (factor, other) in row.iter().zip(power.chunks(size)) {
                to.iter_mut().zip(other).for_each(|(sum, entry)| *sum += factor * entry);
            }
        }
        std::mem::swap(&mut power, &mut next);
    }
    let norm = norm(&power, size);
    if norm == 0.0 { 0.0 } else { ((logarithm + norm.ln()) / f64::from(1 << SQUARINGS)).exp() }
}

/// Returns the largest sum of magnitudes of a row.
fn norm(entries: &[f64], size: usize) -> f64 {
    entries.chunks(size.max(1)).map(|row| row.iter().map(|entry| entry.abs()).sum()).fold(0.0, f64::max)
}

/// Returns the largest magnitude of an eigenvalue, or the norm where the eigenvalues do not converge.
fn spectral_radius(entries: &[f64], size: usize) -> f64 {
    let norm = norm(entries, size);
    let matrix = DMatrix::from_row_slice(size, size, entries);
    let schur = if norm < 1e100 { Schur::try_new(matrix, f64::EPSILON, ITERATIONS_MAX) } else { None };
    let largest = |schur: Schur<f64, nalgebra::Dyn>| {
        schur.complex_eigenvalues().iter().map(|value| value.re.hypot(value.im)).fold(0.0, f64::max)
    };
    schur.map_or(norm, largest)
}

/// A model at fixed parameters, walked without reactions.
struct Walk<'a> {
    model: &'a Model,
    graph: &'a Graph,
    values: &'a [f64],
    memory: &'a mut Vec<f64>,
}

impl Walk<'_> {
    fn at(&mut self, roots: &[Id], x: &[f64], inputs: &[f64]) -> Vec<f64> {
        let signals: Vec<Id> = self.model.delayed.iter().map(|of| of.value).collect();
        let delayed =
            if signals.is_empty() || inputs.is_empty() { Vec::new() } else { self.with(&signals, x, inputs, &[]) };
        self.with(roots, x, inputs, &delayed)
    }

    fn with(&mut self, roots: &[Id], x: &[f64], inputs: &[f64], delayed: &[f64]) -> Vec<f64> {
        evaluate(self.graph, roots, self.memory, &|leaf| match leaf {
            Leaf::Parameter(n) => self.values.get(usize::from(n)).copied().unwrap_or(0.0),
            Leaf::Input(n) | Leaf::NextInput(n) => inputs.get(usize::from(n)).copied().unwrap_or(0.0),
            Leaf::State(n) => x.get(usize::from(n)).copied().unwrap_or(0.0),
            // The signal in place of its delayed values.
            Leaf::Memory(n) => delayed.get(usize::from(n)).copied().unwrap_or(0.0),
            Leaf::Reaction(_) => 0.0,
        })
    }

    fn initial(&mut self, recording: &ModelRecording) -> Vec<f64> {
        let open = open_initial(self.model, recording);
        let states = open_states(self.model);
        let mut x = vec![0.0; self.model.states.len()];
        for (n, state) in self.model.states.iter().enumerate() {
            x[n] = match (&state.initial, states.iter().position(|open| *open == n)) {
                (_, Some(place)) => open[place] * state.unit.unit.factor,
                (crate::model::InitialState::Given(id), _) => self.at(&[id.0], &[], &[])[0],
                _ => 0.0,
            };
        }
        x
    }
}
