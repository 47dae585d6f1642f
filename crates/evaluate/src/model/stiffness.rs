//! Largest eigenvalue of the Jacobian of a model over the bounds of its parameters and along trajectories.

use super::recording::{ModelRecording, open_initial};
use super::space::ModelSpace;
use motorfit_model::Model;
use motorfit_model::graph::{Direction, Graph, Id, Leaf, evaluate};
use motorfit_model::step::open_states;
use nalgebra::{DMatrix, DVector, Schur};
use rand::{RngExt as _, SeedableRng as _};

/// Largest `h|λ|` of the Runge–Kutta method.
pub(super) const STIFFNESS_MAX: f64 = 0.7;
/// Iterations of the eigenvalues at most.
const ITERATIONS_MAX: usize = 500;
/// Number of candidates in the bounds at which the Jacobian is evaluated, and of samples along the trajectory of each.
const CANDIDATES: usize = 24;
const SAMPLES: usize = 12;
/// Evaluations of a candidate at most from one of these samples to the next.
const EVALUATIONS: usize = 10;
/// Squarings of a matrix whose norm then bounds its eigenvalues.
const SQUARINGS: u32 = 8;

/// Returns about the largest magnitude of an eigenvalue of the Jacobian over candidates in the bounds and along their trajectories.
pub(super) fn largest_rate(model: &Model, space: &ModelSpace, recordings: &[ModelRecording]) -> f64 {
    let mut graph = model.graph.clone();
    let mut roots = jacobian(model, &mut graph);
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
        let (rate, stiffest) = walk.stiffest(&roots, recording);
        if rate > largest {
            largest = largest.max(spectral_radius(&stiffest, model.states.len()));
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

/// Returns the bound of the Jacobian before the right-hand sides of `size` states; +∞ if one of them is not finite.
fn rate_of(found: &[f64], size: usize) -> f64 {
    if found.iter().all(|entry| entry.is_finite()) { bound(&found[..size * size], size) } else { f64::INFINITY }
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
    /// Walks along a recording by steps from a sampling period on, and returns the Jacobian with the largest bound beside the bound;
    /// eigenvalues themselves take ten times as long. `roots` are the Jacobian and the right-hand sides.
    fn stiffest(&mut self, roots: &[Id], recording: &ModelRecording) -> (f64, Vec<f64>) {
        let (mut rate, mut stiffest): (f64, Vec<f64>) = (0.0, Vec::new());
        let mut x = self.initial(recording);
        let entries = roots.len() - x.len();
        let stride = (recording.len() / SAMPLES).max(1);
        for n in (0..recording.len()).step_by(stride) {
            let inputs: Vec<f64> = recording.inputs.iter().map(|input| input[n]).collect();
            let whole = recording.elapsed((n + stride).min(recording.len() - 1)) - recording.elapsed(n);
            let period = recording.step(n).min(whole);
            let mut here = self.at(roots, &x, &inputs);
            let mut own = rate_of(&here, x.len());
            let (mut time, mut h) = (0.0, period);
            for _ in 0..EVALUATIONS {
                let (jacobian, right) = here.split_at(entries);
                if !own.is_finite() {
                    return (rate, stiffest);
                }
                if own > rate {
                    (rate, stiffest) = (own, jacobian.to_vec());
                }
                if time >= whole {
                    break;
                }
                h = h.min(whole - time);
                let next = semi_implicit(&x, jacobian, right, h).map(|next| (self.at(roots, &next, &inputs), next));
                let after = next.as_ref().map_or(f64::INFINITY, |(there, _)| rate_of(there, x.len()));
                // The linearization does not hold over a step in which the equations become stiff: it is repeated with a quarter.
                let is_linear = h <= period || after * h < 1.0 || after < 2.0 * rate;
                match next {
                    Some((there, next)) if is_linear => {
                        (x, here, own, time, h) = (next, there, after, time + h, 16.0 * h)
                    }
                    _ if h > period => h *= 0.25,
                    _ => return (rate, stiffest),
                }
            }
        }
        (rate, stiffest)
    }

    fn at(&mut self, roots: &[Id], x: &[f64], inputs: &[f64]) -> Vec<f64> {
        let signals: Vec<Id> = self.model.delayed.iter().map(|of| of.value).collect();
        let mut delayed =
            if signals.is_empty() || inputs.is_empty() { Vec::new() } else { self.with(&signals, x, inputs, &[]) };
        // Sampled laws as if this were one of their instants; later ones may use those before them.
        for law in self.model.laws.iter().map(|law| law.value).filter(|_| !x.is_empty()) {
            let value = self.with(&[law], x, inputs, &delayed)[0];
            delayed.push(value);
        }
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
                (motorfit_model::InitialState::Given(id), _) => self.at(&[id.0], &[], &[])[0],
                _ => 0.0,
            };
        }
        x
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may stop")]

    use super::*;
    use motorfit_core::numeric::count;

    /// A state with cubic damping comes to rest at x = (u/c)^(1/3), where the eigenvalue is −3 c x².
    const TEXT: &str = r#"
format = 1
name = "cubic"
[inputs]
u = { unit = "V" }
[parameters]
c = { unit = "1/(V^2*s)", min = 999, max = 1001 }
k = { unit = "1/s", min = 0.999, max = 1.001 }
[states]
x = { unit = "V", d = "k*u - c*x^3", initial = 0 }
[outputs]
y = { value = "x", unit = "V" }
"#;

    fn recording(time_s: Vec<f64>) -> ModelRecording {
        let steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let is_even = steps.iter().all(|step| (step / steps[0] - 1.0).abs() < 1e-9);
        ModelRecording {
            step_s: if is_even { vec![steps[0]] } else { steps },
            inputs: vec![vec![1.0; time_s.len()]],
            measured: vec![Some(vec![0.0; time_s.len()])],
            counting: Vec::new(),
            effective_sample_ratio: 1.0,
            name: None,
            assumed: None,
            time_s,
        }
    }

    #[test]
    fn the_rate_is_that_of_the_states_that_are_reached() {
        let model = Model::parse(TEXT).unwrap();
        let space = ModelSpace::new(&model, 1);
        let even = |step_s: f64| (0..3000).map(|n| count(n) * step_s).collect::<Vec<f64>>();
        let gap: Vec<f64> =
            even(1e-3).into_iter().enumerate().map(|(n, t)| if n < 1500 { t } else { t + 10.0 }).collect();
        for recordings in [vec![even(1e-3)], vec![gap], vec![even(1e-3), even(0.1)]] {
            let recordings: Vec<ModelRecording> = recordings.into_iter().map(recording).collect();
            let rate = largest_rate(&model, &space, &recordings);
            assert!((28.0..40.0).contains(&rate), "3 c x² = 30 1/s at rest: {rate}");
        }
    }
}
