//! Coulomb friction and brush drop: set-valued reactions.
//!
//! Friction is a torque of at most ±Tc \[N·m\] against the motion, brush drop a voltage of at most ±vb \[V\] against the
//! current. Each takes the value that makes its state zero at the end of the step, clipped to its limits, so that it can stop
//! the motor or the current but not reverse it. (Time stepping with set-valued friction: J. J. Moreau 1988; D. E. Stewart, SIAM
//! Review 42, 2000.)
//!
//! A unit of the reaction has the gain g on each state. A reaction that subtracts δ from its own state adds
//! `−(g_other/g_own) δ` to the other state, and |δ| is at most the limit times |g_own|. Hence δ is the own state itself,
//! clipped, and the state is exactly zero while the motor sticks.
//!
//! In a step in which the state passes zero the reaction changes its sign within the step. With the state x₀ at the start, x at
//! the end without the reaction, the largest change l = limit |g_own| and the pull q = −sign(x₀) (x − x₀) against the state, the
//! state reaches zero after the fraction `|x₀|/(q + l)` of the step, and moves on by the rest of it times `q − l`, if that is
//! positive. The fraction is that of a uniform motion, so that the error of a passage is of second order in the step; with one
//! sign for the whole step it would be of first order, and dead times and inductances would be estimated too small.
//!
//! A voltage with a dead time may change at the fraction f of a step. Its change adds a part to the states at the end, so that the
//! motion without reactions has two pieces, uniform up to f and from f on, each with its share of the limit. A change in the step in
//! which a start latency ends counts from the start of the step.
//!
//! Shader: `shaders/friction.wgsl`. The oracle, its derivatives, the kernel and the shaders share these formulas. They are tested
//! against closed forms and a simulation with finer steps in `tests/evaluate/extensions/meaning.rs`
//! (`the_motor_sticks_up_to_the_friction_torque`, `friction_converges_with_the_step`, `brushes_reduce_the_voltage_by_their_drop`,
//! `reactions_change_their_sign_where_a_late_voltage_turns_the_motor`).

use super::discretize::StepMaps;
use super::dual::Number;
use super::extended::Extended;
use super::features::ModelFeatures;
use super::parameter::Parameter;

/// The reaction that acts against each state: brush drop against the current, Coulomb friction against the speed.
const REACTIONS: [Parameter; 2] = [Parameter::BrushDrop, Parameter::Coulomb];

/// The reactions of a step for `L` motors side by side.
#[derive(Clone, Copy)]
pub struct Reactions<const L: usize, T = f64> {
    /// Largest magnitude that a reaction subtracts from its own state.
    limits: [[T; L]; 2],
    /// Change of the other state per unit subtracted from the own state.
    pub adds: [[T; L]; 2],
}

impl<const L: usize, T: Number> Reactions<L, T> {
    /// Returns the reactions of motors for a step with the given maps; those of parameters outside the features are zero.
    #[inline(always)]
    pub fn new(motors: &Extended<[T; L]>, maps: &StepMaps<L, T>, features: ModelFeatures) -> Self {
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

    /// Returns the state at the end of a step after the active reactions: first of the brushes, then of friction. `before` is the
    /// state at its start, `x` that at its end without reactions.
    #[inline(always)]
    pub fn friction_step<const FMA: bool>(
        &self,
        acts: [bool; 2],
        (before, x): ([T; 2], [T; 2]),
        bend: Option<Bend<T>>,
        lane: usize,
    ) -> [T; 2] {
        self.apply::<FMA>(acts, x, lane, |own, x, limit| match bend.filter(|bend| bend.added[own].value() != 0.0) {
            Some(bend) => x - bend.state(before[own], x, (limit, own)),
            None if is_passage(before[own].value(), x.value(), limit.value()) => x - passed(before[own], x, limit),
            None => x.clip(limit),
        })
    }

    /// Returns the state at the end of a step in which the voltage does not change and no state passes zero, and a number that is
    /// negative if one does.
    #[inline(always)]
    pub fn friction_step_without_passage<const FMA: bool>(
        &self,
        acts: [bool; 2],
        before: [T; 2],
        x: [T; 2],
        lane: usize,
    ) -> ([T; 2], f64) {
        let mut least = f64::INFINITY;
        let x = self.apply::<FMA>(acts, x, lane, |own, x, limit| {
            let margin = margin_to_passage(before[own].value(), x.value(), limit.value());
            least = if margin < least { margin } else { least };
            x.clip(limit)
        });
        (x, least)
    }

    /// Subtracts what `taken` returns for the index of a state, its value and its limit, from the states in turn.
    #[inline(always)]
    fn apply<const FMA: bool>(
        &self,
        acts: [bool; 2],
        [mut i, mut w]: [T; 2],
        lane: usize,
        mut taken: impl FnMut(usize, T, T) -> T,
    ) -> [T; 2] {
        let Self { limits, adds } = self;
        if acts[0] {
            let taken = taken(0, i, limits[0][lane]);
            (i, w) = (i - taken, T::multiply_add::<FMA>(adds[0][lane], taken, w));
        }
        if acts[1] {
            let taken = taken(1, w, limits[1][lane]);
            (i, w) = (T::multiply_add::<FMA>(adds[1][lane], taken, i), w - taken);
        }
        [i, w]
    }
}

/// A change of the voltage within a step.
#[derive(Clone, Copy)]
pub struct Bend<T> {
    /// Fraction of the step at which the voltage changes.
    pub at: T,
    /// Part of the change of both states over the step that is due to it.
    pub added: [T; 2],
}

impl<T: Number> Bend<T> {
    /// Returns a state at the end of a step with a limit of its reaction, and the index of the state.
    #[inline(always)]
    fn state(&self, before: T, x: T, (limit, own): (T, usize)) -> T {
        let first = (x - self.added[own] - before) * self.at;
        let middle = passed(before, before + first, limit * self.at);
        passed(middle, middle + (x - before - first), limit * (T::constant(1.0) - self.at))
    }
}

/// Returns a number that is negative if a state passes zero within a step: it is not zero at the start, `x` without the reaction at
/// the end, and the pull against it is above the limit of the reaction.
#[inline(always)]
pub fn margin_to_passage(before: f64, x: f64, limit: f64) -> f64 {
    const SIGN: u64 = 1 << 63;
    let along = f64::from_bits(x.to_bits() ^ (before.to_bits() & SIGN));
    let pulled = before.abs() - limit;
    along - if pulled < limit { pulled } else { limit }
}

/// Returns true if a state passes zero within a step. One that starts at zero is moved by the pull beyond the limit, which is the same
/// as clipping.
#[inline(always)]
fn is_passage(before: f64, x: f64, limit: f64) -> bool {
    before != 0.0 && margin_to_passage(before, x, limit) < 0.0
}

/// Returns a state after a uniform motion from `before` to `x`, at most ±`limit` of which the reaction takes.
#[inline(always)]
pub fn passed<T: Number>(before: T, x: T, limit: T) -> T {
    if !is_passage(before.value(), x.value(), limit.value()) {
        return x - x.clip(limit);
    }
    let (size, along) = if before.value() > 0.0 { (before, x) } else { (-before, -x) };
    let pull = size - along;
    let left = T::constant(1.0) - size / (pull + limit);
    let beyond = left * (pull - limit);
    if before.value() > 0.0 { -beyond } else { beyond }
}

/// Returns the flags of the reactions of a model: brush drop, Coulomb friction.
pub(crate) fn reactions(features: ModelFeatures) -> [bool; 2] {
    REACTIONS.map(|of| features.has(of))
}
