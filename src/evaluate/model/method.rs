//! Choice of the integration method of a model for a problem.
//!
//! Affine equations on an even clock take matrix exponentials, which are exact. For others the largest eigenvalue |λ| of the Jacobian
//! is sought over the bounds and along trajectories: a state at rest hides the stiffness of a backlash. With `h|λ|` up to 0.7
//! the error of the Runge–Kutta method is below 1e-3 of a step's change and falls with its fourth power; beyond, exponentials are exact
//! for the stiff affine part. On irregular clocks the Runge–Kutta method takes substeps instead.

use super::recording::{ModelRecording, open_initial};
use super::space::ModelSpace;
use crate::model::graph::{Direction, Graph, Id, Leaf, evaluate};
use crate::model::step::{Affine, open_states};
use crate::model::{IntegrationMethod, Model};
use crate::numeric::{count, whole};
use nalgebra::{DMatrix, Schur};
use rand::{RngExt as _, SeedableRng as _};

/// Largest `h|λ|` of the Runge–Kutta method.
pub(super) const STIFFNESS_MAX: f64 = 0.7;
/// Iterations of the eigenvalues at most.
const ITERATIONS_MAX: usize = 500;
/// Largest number of substeps.
pub(super) const SUBSTEPS_MAX: usize = 64;
/// Number of candidates in the bounds at which the Jacobian is evaluated, and of samples along the trajectory of each.
const CANDIDATES: usize = 24;
const SAMPLES: usize = 60;

/// Stiffness of a model on some recordings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness {
    /// Largest magnitude of an eigenvalue of the Jacobian that was found \[1/s\].
    pub rate: f64,
    /// Longest step times that rate.
    pub per_step: f64,
    /// True if the equations are affine in states and inputs.
    pub is_affine: bool,
}

/// Integration method of a model on some recordings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelMethod {
    /// The method.
    pub method: IntegrationMethod,
    /// Number of substeps of the Runge–Kutta method; 1 for exponentials.
    pub substeps: usize,
    /// The stiffness that decided.
    pub stiffness: Stiffness,
    /// True if `h|λ|` of a substep is larger than the method is accurate for.
    pub is_rough: bool,
    /// True if the model has friction that sticks or delays, whose events within a step are exact to second order only.
    pub has_events: bool,
}

impl ModelMethod {
    /// Chooses the method of a model.
    pub(super) fn of(model: &Model, space: &ModelSpace, recordings: &[ModelRecording]) -> Self {
        let is_even = recordings.iter().all(|recording| recording.regular_step_s().is_some());
        let mut graph = model.graph.clone();
        let affine = Affine::of(model, &mut graph);
        let is_affine = affine.nonlinear_rows(&graph).is_empty();
        let step = recordings.iter().map(ModelRecording::longest_step_s).fold(0.0, f64::max);
        let rate = if is_even && is_affine { 0.0 } else { largest_rate(model, space, recordings, step) };
        let stiffness = Stiffness { rate, per_step: step * rate, is_affine };
        let has_events = model.reactions() > 0 || !model.delayed.is_empty();
        let exponential =
            Self { method: IntegrationMethod::Exponential, substeps: 1, stiffness, is_rough: false, has_events };
        if is_even && (is_affine || stiffness.per_step > STIFFNESS_MAX) {
            return exponential;
        }
        let needed = whole((stiffness.per_step / STIFFNESS_MAX).ceil().min(1e6)).max(1);
        let substeps = needed.min(SUBSTEPS_MAX);
        Self { method: IntegrationMethod::RungeKutta, substeps, stiffness, is_rough: needed > substeps, has_events }
    }

    /// Returns true if steps are exact: affine equations with matrix exponentials, without friction that sticks and without delays.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.method == IntegrationMethod::Exponential && self.stiffness.is_affine && !self.has_events
    }

    /// Returns a description of the method and of the reason for it.
    #[must_use]
    pub fn described(&self) -> String {
        let Stiffness { per_step, is_affine, .. } = self.stiffness;
        let stiffness = crate::text::significant(per_step, 2);
        match self.method {
            IntegrationMethod::Exponential if self.is_exact() => {
                "matrix exponentials, exact: the equations are affine".to_owned()
            }
            IntegrationMethod::Exponential if is_affine => {
                let substeps =
                    if self.substeps > 1 { format!("{} substeps", self.substeps) } else { "one step".to_owned() };
                format!(
                    "matrix exponentials with {substeps}: the equations are affine, up to friction that sticks and delays"
                )
            }
            IntegrationMethod::Exponential if self.substeps > 1 => {
                format!("exponential Runge–Kutta of order 4 with {} substeps (h|λ| = {stiffness})", self.substeps)
            }
            IntegrationMethod::Exponential => {
                format!(
                    "exponential Runge–Kutta of order 4: the equations are stiff for the sampling period (h|λ| = {stiffness})"
                )
            }
            IntegrationMethod::RungeKutta if self.substeps == 1 => {
                format!("Runge–Kutta of order 4 (h|λ| = {stiffness})")
            }
            IntegrationMethod::RungeKutta => {
                format!("Runge–Kutta of order 4 with {} substeps (h|λ| = {stiffness})", self.substeps)
            }
        }
    }
}

/// Returns the largest magnitude of an eigenvalue of the Jacobian over candidates in the bounds and along their trajectories.
fn largest_rate(model: &Model, space: &ModelSpace, recordings: &[ModelRecording], step: f64) -> f64 {
    let mut graph = model.graph.clone();
    let jacobian = jacobian(model, &mut graph);
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
        let mut rate: f64 = 0.0;
        for n in (0..recording.len()).step_by(stride) {
            let inputs: Vec<f64> = recording.inputs.iter().map(|input| input[n]).collect();
            let entries = walk.at(&jacobian, &x, &inputs);
            rate = rate.max(spectral_radius(&entries, x.len()));
            // Explicit steps that are short enough for the rate found up to here; enough of them to move on.
            let substeps = whole((step * rate / STIFFNESS_MAX).ceil().min(20.0)).max(1);
            for _ in 0..substeps {
                x = walk.stepped(&x, &inputs, step / count(substeps));
            }
            if !x.iter().all(|value| value.abs() < 1e9) {
                break;
            }
        }
        largest = largest.max(rate);
    }
    largest
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

fn spectral_radius(entries: &[f64], size: usize) -> f64 {
    if entries.iter().any(|entry| !entry.is_finite()) {
        return 0.0;
    }
    let matrix = DMatrix::from_row_slice(size, size, entries);
    // The row norm is a bound, in place of eigenvalues that do not converge.
    let norm = entries.chunks(size.max(1)).map(|row| row.iter().map(|v| v.abs()).sum()).fold(0.0, f64::max);
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

    fn stepped(&mut self, x: &[f64], inputs: &[f64], h: f64) -> Vec<f64> {
        let right: Vec<Id> = self.model.states.iter().map(|state| state.derivative).collect();
        let moved = |k: &[f64], by: f64| x.iter().zip(k).map(|(x, k)| x + by * k).collect::<Vec<f64>>();
        let k1 = self.at(&right, x, inputs);
        let k2 = self.at(&right, &moved(&k1, 0.5 * h), inputs);
        let k3 = self.at(&right, &moved(&k2, 0.5 * h), inputs);
        let k4 = self.at(&right, &moved(&k3, h), inputs);
        let change = |n: usize| h / 6.0 * (k1[n] + 2.0 * (k2[n] + k3[n]) + k4[n]);
        (0..x.len()).map(|n| x[n] + change(n)).collect()
    }
}
