//! Coulomb friction and brush drop: set-valued reactions, constant over a step.
//!
//! Friction is a torque of at most ±Tc \[N·m\] against the motion, brush drop a voltage of at most ±vb \[V\] against the
//! current. Each takes the value that makes its state zero at the end of the step, clipped to its limits, so that it can stop
//! the motor or the current but not reverse it. (Time stepping with set-valued friction: J. J. Moreau 1988; D. E. Stewart, SIAM
//! Review 42, 2000.)
//!
//! A unit of the reaction has the gain g on each state. A reaction that subtracts δ from its own state adds
//! `−(g_other/g_own) δ` to the other state, and |δ| is at most the limit times |g_own|. Hence δ is the own state itself,
//! clipped, and the state is exactly zero while the motor sticks. Shader: `shaders/friction.wgsl`.
//!
//! The oracle, its derivatives, the kernel and the shaders share this formula. It is tested against closed forms and a
//! simulation with finer steps in `tests/extensions/meaning.rs` (`the_motor_sticks_up_to_the_friction_torque`,
//! `friction_converges_with_the_step`, `brushes_reduce_the_voltage_by_their_drop`).

use super::discretize::StepMaps;
use super::dual::Number;
use super::extended::Extended;
use super::features::ModelFeatures;
use super::parameter::Parameter;

/// The reaction that acts against each state: brush drop against the current, Coulomb friction against the speed.
const REACTIONS: [Parameter; 2] = [Parameter::BrushDrop, Parameter::Coulomb];

/// The reactions of a step for `L` motors side by side.
#[derive(Clone, Copy)]
pub(crate) struct Reactions<const L: usize, T = f64> {
    /// Largest magnitude that a reaction subtracts from its own state.
    limits: [[T; L]; 2],
    /// Change of the other state per unit subtracted from the own state.
    pub(crate) adds: [[T; L]; 2],
}

impl<const L: usize, T: Number> Reactions<L, T> {
    #[inline(always)]
    pub(crate) fn new(motors: &Extended<[T; L]>, maps: &StepMaps<L, T>, features: ModelFeatures) -> Self {
        let [mut limits, mut adds] = [[[T::constant(0.0); L]; 2]; 2];
        for (own, of) in REACTIONS.into_iter().enumerate() {
            if !features.has(of) {
                continue;
            }
            let mut gain = maps.torque;
            if of == Parameter::BrushDrop {
                let [start, end] = &maps.taps;
                for (gain, (start, end)) in gain.iter_mut().zip(start.iter().zip(end)) {
                    for lane in 0..L {
                        gain[lane] = start[lane] + end[lane];
                    }
                }
            }
            let strength = motors.get(of);
            for lane in 0..L {
                limits[own][lane] = strength[lane] * gain[own][lane].abs();
                adds[own][lane] = -gain[1 - own][lane] / gain[own][lane];
            }
        }
        Self { limits, adds }
    }

    /// Returns the state at the end of a step after the active reactions: first of the brushes, then of friction.
    #[inline(always)]
    pub(crate) fn friction_step<const FMA: bool>(&self, acts: [bool; 2], x: [T; 2], lane: usize) -> [T; 2] {
        let Self { limits, adds } = self;
        let [mut i, mut w] = x;
        if acts[0] {
            let taken = i.clip(limits[0][lane]);
            (i, w) = (i - taken, T::multiply_add::<FMA>(adds[0][lane], taken, w));
        }
        if acts[1] {
            let taken = w.clip(limits[1][lane]);
            (i, w) = (T::multiply_add::<FMA>(adds[1][lane], taken, i), w - taken);
        }
        [i, w]
    }
}

/// Returns the flags of the reactions of a model: brush drop, Coulomb friction.
pub(crate) fn reactions(features: ModelFeatures) -> [bool; 2] {
    REACTIONS.map(|of| features.has(of))
}
