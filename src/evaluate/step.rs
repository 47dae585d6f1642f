//! One step of `L` candidates with extensions side by side.
//!
//! Limit of a step with friction: to the linear motor's 8 operations come four (two limits, what is left of the speed, and
//! what is added to the current), and 13 cycles of a step wait for each other: 4 for each product of the speed, 1 for each
//! limit, 3 for what is left. Three vectors side by side fill them; the sixteen registers then hold states and sums alone,
//! and nine loads a vector, two a cycle, take 14.5 cycles a step: 1.21 a candidate, where the linear motor's two vectors
//! take 1, the 8 cycles for which they wait. A voltage that changes adds two products, whose gains are loaded instead of
//! what is added.

use super::kernel::phi;
use crate::motor::{Extended, Method, ModelFeatures, Parameter, Reactions, StepMaps, multiply_add, step_maps};

/// A pair of numbers (current, speed) of each candidate.
pub(super) type Pair<const L: usize> = [[f64; L]; 2];

/// The step of a block of candidates.
#[repr(align(64))]
pub(super) struct Step<const L: usize> {
    pub maps: StepMaps<L>,
    phi: [[f64; L]; 4],
    /// The contribution of offset and load to both states.
    bias: Pair<L>,
    reactions: Reactions<L>,
}

impl<const L: usize> Step<L> {
    #[inline(always)]
    pub(super) fn new(motors: &Extended<[f64; L]>, h: f64, features: ModelFeatures, method: Method) -> Self {
        let maps = step_maps(&motors.motor, h, method);
        let [offset, load] = [Parameter::Offset, Parameter::Load].map(|of| motors.get(of));
        let mut bias = [[0.0; L]; 2];
        for (axis, bias) in bias.iter_mut().enumerate() {
            for lane in 0..L {
                let voltage = maps.taps[0][axis][lane] + maps.taps[1][axis][lane];
                bias[lane] = voltage * offset[lane] + maps.torque[axis][lane] * load[lane];
            }
        }
        Self { phi: phi(&maps), reactions: Reactions::new(motors, &maps, features), maps, bias }
    }

    /// Returns the state of a candidate after one step.
    #[inline(always)]
    pub(super) fn next<const FMA: bool, const BRUSHES: bool>(
        &self,
        [i, w]: [f64; 2],
        input: impl Input<L>,
        lane: usize,
    ) -> [f64; 2] {
        let Self { phi, reactions, .. } = self;
        let [gain_i, gain_w] = [input.gain::<FMA>(self, 0, lane), input.gain::<FMA>(self, 1, lane)];
        let current = multiply_add::<FMA>(phi[0][lane], i, multiply_add::<FMA>(phi[1][lane], w, gain_i));
        let speed = multiply_add::<FMA>(phi[2][lane], i, multiply_add::<FMA>(phi[3][lane], w, gain_w));
        reactions.friction_step::<FMA>([BRUSHES, true], [current, speed], lane)
    }

    /// Returns what voltages at both ends of the step and a torque add to both states.
    #[inline(always)]
    pub(super) fn gain<const FMA: bool>(&self, [start, end]: &Pair<L>, torque: &[f64; L]) -> Pair<L> {
        let (taps, own) = (&self.maps.taps, &self.maps.torque);
        let mut gain = [[0.0; L]; 2];
        for axis in 0..2 {
            for lane in 0..L {
                let constant = multiply_add::<FMA>(taps[0][axis][lane], start[lane], own[axis][lane] * torque[lane]);
                gain[axis][lane] = multiply_add::<FMA>(taps[1][axis][lane], end[lane], constant);
            }
        }
        gain
    }
}

/// Returns loads with a torque added.
#[inline(always)]
pub(super) fn loaded<const L: usize>(mut loads: [f64; L], torque: f64) -> [f64; L] {
    for load in &mut loads {
        *load += torque;
    }
    loads
}

/// The input of the candidates at one sample.
pub(super) trait Input<const L: usize>: Copy {
    /// Returns what it adds to a state of a candidate.
    fn gain<const FMA: bool>(self, step: &Step<L>, axis: usize, lane: usize) -> f64;
}

/// An input whose gains were computed before.
impl<const L: usize> Input<L> for &Pair<L> {
    #[inline(always)]
    fn gain<const FMA: bool>(self, _: &Step<L>, axis: usize, lane: usize) -> f64 {
        self[axis][lane]
    }
}

/// A constant voltage.
impl<const L: usize> Input<L> for f64 {
    #[inline(always)]
    fn gain<const FMA: bool>(self, step: &Step<L>, axis: usize, lane: usize) -> f64 {
        step.maps.taps[0][axis][lane] * self
    }
}

/// A line of voltage.
impl<const L: usize> Input<L> for [f64; 2] {
    #[inline(always)]
    fn gain<const FMA: bool>(self, step: &Step<L>, axis: usize, lane: usize) -> f64 {
        let [start, end] = &step.maps.taps;
        multiply_add::<FMA>(end[axis][lane], self[1], start[axis][lane] * self[0])
    }
}

/// A line of voltage and a torque, with offset and load.
impl<const L: usize> Input<L> for [f64; 3] {
    #[inline(always)]
    fn gain<const FMA: bool>(self, step: &Step<L>, axis: usize, lane: usize) -> f64 {
        let ([start, end], torque) = (&step.maps.taps, &step.maps.torque);
        let load = multiply_add::<FMA>(torque[axis][lane], self[2], step.bias[axis][lane]);
        multiply_add::<FMA>(end[axis][lane], self[1], multiply_add::<FMA>(start[axis][lane], self[0], load))
    }
}
