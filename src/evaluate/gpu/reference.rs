//! References of deviations in f32.

use crate::evaluate::{Problem, Signals};
use crate::motor::{Parameters, StepMap, inverse, walk};

/// D_r⁻¹ and the maps of one step of the reference; `None` for a reference that stays where it starts.
pub(super) type ReferenceStep = Option<([f64; 4], StepMap)>;

/// The reference of deviations: a motor's trajectory, and for each step the factors that turn a candidate's maps into forces.
///
/// With the reference's maps D_r and gains Γ_r, its increment δ = D_r x_r + Γ_r u and M = D D_r⁻¹, a candidate's own
/// increment at the reference's state is `D x_r + Γ u = M δ + (Γ − M Γ_r) u`. The force on the deviation is that less δ:
/// `(M − I) δ + (Γ − M Γ_r) u`. Unlike `(D − D_r) x_r + (Γ − Γ_r) u` its terms do not cancel in the steady state.
pub(super) struct Reference {
    pub trajectory: Vec<[f64; 2]>,
    /// The factor of the force's matrix at each sample: δ.
    pub drive: Vec<[f64; 2]>,
    /// D_r⁻¹ and the gains of each step. None for a reference that stays where it starts, because the motor diverges or
    /// D_r has no inverse: the force is then `D x_r + Γ u` itself, and `drive` is x_r.
    pub steps: Vec<ReferenceStep>,
}

impl Reference {
    pub(super) fn new(problem: &Problem, signals: &Signals, motor: &Parameters) -> Self {
        let method = problem.method();
        let mut trajectory = Vec::with_capacity(signals.len());
        walk(motor, &signals.drive(), signals.initial, method, |x| trajectory.push(x));
        let steps: Vec<_> = signals.step_s.iter().map(|&h| inverted(StepMap::new(motor, h, method))).collect();
        // f32 holds up to 3e38; squares of errors must fit too.
        if steps.iter().all(Option::is_some) && trajectory.iter().flatten().all(|x| x.abs() < 1e15) {
            let mut drive: Vec<[f64; 2]> =
                trajectory.windows(2).map(|x| [x[1][0] - x[0][0], x[1][1] - x[0][1]]).collect();
            drive.push([0.0; 2]);
            return Self { trajectory, drive, steps };
        }
        let still = vec![signals.initial; signals.len()];
        Self { trajectory: still.clone(), drive: still, ..Self::none(signals) }
    }

    /// Nothing but the number of steps: for a shader that takes no deviations.
    pub(super) fn none(signals: &Signals) -> Self {
        Self { trajectory: Vec::new(), drive: Vec::new(), steps: vec![None; signals.step_s.len()] }
    }
}

fn inverted(map: StepMap) -> ReferenceStep {
    let inverse = inverse(map.d);
    inverse.iter().all(|v| v.is_finite()).then_some((inverse, map))
}
