//! Reference trajectories for the evaluation of deviations in f32.

use motorfit_evaluate::{Problem, Signals};
use motorfit_motor::{Parameters, StepMap, inverse, walk};

/// D_r⁻¹ and the step map of the reference for one step length; `None` for a reference that stays at its initial state.
pub(crate) type ReferenceStep = Option<([f64; 4], StepMap)>;

/// The reference of deviations: the trajectory of a motor, and the matrices that turn a candidate's step maps into forces.
///
/// Let D_r and Γ_r be the map and the gains of the reference, δ = D_r x_r + Γ_r u its increment over a step, and M = D D_r⁻¹.
/// The increment of a candidate from the state of the reference is `D x_r + Γ u = M δ + (Γ − M Γ_r) u`. The force on the
/// deviation is the difference to δ, `(M − I) δ + (Γ − M Γ_r) u`. Unlike those of `(D − D_r) x_r + (Γ − Γ_r) u`, its terms do
/// not cancel in the steady state.
pub(crate) struct Reference {
    /// State of the reference at each sample.
    pub trajectory: Vec<[f64; 2]>,
    /// Increment δ of the reference after each sample, which the matrix of the force multiplies.
    pub drive: Vec<[f64; 2]>,
    /// D_r⁻¹ and step map for each distinct step. `None` for a reference that stays at its initial state, because the motor
    /// diverges or D_r is singular: the force is then `D x_r + Γ u`, and `drive` is x_r.
    pub steps: Vec<ReferenceStep>,
}

impl Reference {
    pub(crate) fn new(problem: &Problem, signals: &Signals, motor: &Parameters) -> Self {
        let method = problem.method();
        let mut trajectory = Vec::with_capacity(signals.len());
        walk(motor, &signals.drive(), signals.initial, method, |x| trajectory.push(x));
        let steps: Vec<_> = signals.step_s.iter().map(|&h| inverted(StepMap::new(motor, h, method))).collect();
        // The largest f32 is 3e38, and squares of errors must be representable too.
        if steps.iter().all(Option::is_some) && trajectory.iter().flatten().all(|x| x.abs() < 1e15) {
            let mut drive: Vec<[f64; 2]> =
                trajectory.windows(2).map(|x| [x[1][0] - x[0][0], x[1][1] - x[0][1]]).collect();
            drive.push([0.0; 2]);
            return Self { trajectory, drive, steps };
        }
        let still = vec![signals.initial; signals.len()];
        Self { trajectory: still.clone(), drive: still, ..Self::none(signals) }
    }

    /// Returns an empty reference with the number of steps, for a shader that does not use deviations.
    pub(crate) fn none(signals: &Signals) -> Self {
        Self { trajectory: Vec::new(), drive: Vec::new(), steps: vec![None; signals.step_s.len()] }
    }
}

fn inverted(map: StepMap) -> ReferenceStep {
    let inverse = inverse(map.d);
    inverse.iter().all(|v| v.is_finite()).then_some((inverse, map))
}
