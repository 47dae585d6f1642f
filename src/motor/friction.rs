//! Coulomb friction and brush drop: set-valued reactions, constant over a step.
//!
//! Friction is a torque of at most ±Tc against the movement, brush drop a voltage of at most ±vb against the current. Each
//! is as large as it takes to end the step at zero, clipped to its limits: it can stop the motor, or the current, but not
//! reverse it. (Time stepping with set-valued friction: J. J. Moreau 1988; D. E. Stewart, SIAM Review 42, 2000.)
//!
//! With the gains g of a unit of the reaction on the two states, own and other, a reaction that takes δ off its own state
//! adds `−(g_other/g_own) δ` to the other one, and |δ| is at most the limit times |g_own|. So δ is the own state itself,
//! clipped, and the state is exactly zero while the motor sticks. Twin: `shaders/friction.wgsl`.
//!
//! The oracle, its derivatives, the kernel and the shaders share this formula; the tests that hold it are the closed forms
//! and the finer simulation of `tests/extensions/meaning.rs` (`friction_holds_the_motor_up_to_its_torque`,
//! `held_friction_is_that_of_a_finer_simulation`, `brushes_take_their_drop`).

use super::discretize::StepMaps;
use super::dual::Number;
use super::extended::Extended;
use super::features::ModelFeatures;
use super::parameter::Parameter;

/// The state that each reaction acts against: 0 the current, 1 the speed.
const REACTIONS: [Parameter; 2] = [Parameter::BrushDrop, Parameter::Coulomb];

/// The reactions of a step for `L` motors side by side.
#[derive(Clone, Copy)]
pub(crate) struct Reactions<const L: usize, T = f64> {
    /// The most that a reaction takes off its own state.
    limits: [[T; L]; 2],
    /// The change of the other state for each unit that it takes off its own.
    pub(crate) adds: [[T; L]; 2],
}

impl<const L: usize, T: Number> Reactions<L, T> {
    #[inline(always)]
    pub(crate) fn new(motors: &Extended<[T; L]>, maps: &StepMaps<L, T>, features: ModelFeatures) -> Self {
        let [mut limits, mut adds] = [[[T::constant(0.0); L]; 2]; 2];
        for (own, of) in REACTIONS.into_iter().enumerate().filter(|(_, of)| features.has(*of)) {
            for lane in 0..L {
                let gain = [0, 1].map(|axis| match of {
                    Parameter::BrushDrop => maps.taps[0][axis][lane] + maps.taps[1][axis][lane],
                    _ => maps.torque[axis][lane],
                });
                limits[own][lane] = motors.get(of)[lane] * gain[own].abs();
                adds[own][lane] = -gain[1 - own] / gain[own];
            }
        }
        Self { limits, adds }
    }

    /// Returns the state at the end of a step with the reactions that act: of brushes, then of friction.
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

/// Returns which reactions a model has.
pub(crate) fn reactions(features: ModelFeatures) -> [bool; 2] {
    REACTIONS.map(|of| features.has(of))
}
