//! Steps with brushes and friction, of `L` candidates side by side.
//!
//! A reaction is counted in what it takes off its own state: it then is that state itself within its limits.
//!
//! Limit of a step with friction: to the linear motor's 8 operations come four (two limits, what is left of the speed, and
//! what is added to the current), and 13 cycles of a step wait for each other: 4 for each product of the speed, 1 for each
//! limit, 3 for what is left. Three vectors side by side fill them; the sixteen registers then hold states and sums alone,
//! and nine loads a vector, two a cycle, take 14.5 cycles a step: 1.21 a candidate, where the linear motor's two vectors
//! take 1, the 8 cycles for which they wait. A voltage that changes adds two products, whose gains are loaded instead of
//! what is added.

use super::input::Input;
use super::kernel::{Samples, add_loss, multiply_add, phi};
use crate::motor::{Extended, Extent, Method, Parameter, StepMaps, step_maps};

/// A pair of numbers (current, speed) of each candidate.
pub(super) type Pair<const L: usize> = [[f64; L]; 2];

/// The step of a block of candidates.
pub(super) struct Step<const L: usize> {
    pub maps: StepMaps<L>,
    phi: [[f64; L]; 4],
    /// What offset and load add to both states.
    pub bias: Pair<L>,
    /// The most that brushes take off the current and friction off the speed.
    limits: Pair<L>,
    /// What a reaction adds to the other state for each unit that it takes off its own.
    adds: Pair<L>,
}

impl<const L: usize> Step<L> {
    #[inline(always)]
    pub(super) fn new(motors: &[Extended; L], h: f64, extent: Extent, method: Method) -> Self {
        let parameters: [[f64; L]; 5] = std::array::from_fn(|p| std::array::from_fn(|lane| motors[lane].motor[p]));
        let maps = step_maps(&parameters, h, extent.method(method));
        let [mut bias, mut limits, mut adds] = [[[0.0; L]; 2]; 3];
        for (lane, motor) in motors.iter().enumerate() {
            let voltage = [0, 1].map(|axis| maps.taps[0][axis][lane] + maps.taps[1][axis][lane]);
            let torque = maps.torque.map(|axis| axis[lane]);
            for axis in 0..2 {
                bias[axis][lane] =
                    voltage[axis] * motor.get(Parameter::Offset) + torque[axis] * motor.get(Parameter::Load);
            }
            for (axis, of, gain) in [(0, Parameter::BrushDrop, voltage), (1, Parameter::Coulomb, torque)] {
                if extent.has(of) {
                    limits[axis][lane] = motor.get(of) * gain[axis].abs();
                    adds[axis][lane] = -gain[1 - axis] / gain[axis];
                }
            }
        }
        Self { phi: phi(&maps), maps, bias, limits, adds }
    }

    /// A state after one step.
    #[inline(always)]
    fn next<const FMA: bool, const BRUSHES: bool>(
        &self,
        [i, w]: [f64; 2],
        input: impl Input<L>,
        lane: usize,
    ) -> [f64; 2] {
        let Self { phi, adds, limits, .. } = self;
        let [drive_i, drive_w] = [input.adds::<FMA>(self, 0, lane), input.adds::<FMA>(self, 1, lane)];
        let current = multiply_add::<FMA>(phi[0][lane], i, multiply_add::<FMA>(phi[1][lane], w, drive_i));
        let speed = multiply_add::<FMA>(phi[2][lane], i, multiply_add::<FMA>(phi[3][lane], w, drive_w));
        let [mut i, mut w] = [current, speed];
        if BRUSHES {
            let reaction = within(i, limits[0][lane]);
            i -= reaction;
            w = multiply_add::<FMA>(adds[0][lane], reaction, w);
        }
        let reaction = within(w, limits[1][lane]);
        [multiply_add::<FMA>(adds[1][lane], reaction, i), w - reaction]
    }
}

/// A reaction within ± its limit.
#[inline(always)]
fn within(reaction: f64, limit: f64) -> f64 {
    let low = if reaction > -limit { reaction } else { -limit };
    if low < limit { low } else { limit }
}

/// State and sums of errors of a block of candidates.
pub(super) struct Lanes<const L: usize> {
    pub x: Pair<L>,
    pub sums: Pair<L>,
}

impl<const L: usize> Lanes<L> {
    /// Steps over `samples`, with their errors; `inputs` are what drives each.
    #[inline(always)]
    pub(super) fn follow<const FMA: bool, const BRUSHES: bool, const ABSOLUTE: bool, const WEIGHTED: bool>(
        &mut self,
        step: &Step<L>,
        samples: Samples<'_>,
        inputs: impl Iterator<Item = impl Input<L>>,
    ) {
        let [mut i, mut w] = self.x;
        let [mut sum_i, mut sum_w] = self.sums;
        for (n, (measured, input)) in samples.measured.iter().zip(inputs).enumerate() {
            let weight = if WEIGHTED { samples.weight[n] } else { [1.0; 2] };
            for lane in 0..L {
                let [error_i, error_w] = [measured[0] - i[lane], measured[1] - w[lane]];
                sum_i[lane] = add_loss::<FMA, ABSOLUTE, WEIGHTED>(sum_i[lane], error_i, weight[0]);
                sum_w[lane] = add_loss::<FMA, ABSOLUTE, WEIGHTED>(sum_w[lane], error_w, weight[1]);
                [i[lane], w[lane]] = step.next::<FMA, BRUSHES>([i[lane], w[lane]], input, lane);
            }
        }
        self.x = [i, w];
        self.sums = [sum_i, sum_w];
    }

    /// Steps that write what is passed on the way to `seen`.
    #[inline(always)]
    pub(super) fn watch<const FMA: bool, const BRUSHES: bool>(
        &mut self,
        step: &Step<L>,
        inputs: impl Iterator<Item = impl Input<L>>,
        seen: &mut [Pair<L>],
    ) {
        let [mut i, mut w] = self.x;
        for (seen, input) in seen.iter_mut().zip(inputs) {
            *seen = [i, w];
            for lane in 0..L {
                [i[lane], w[lane]] = step.next::<FMA, BRUSHES>([i[lane], w[lane]], input, lane);
            }
        }
        self.x = [i, w];
    }

    /// The errors of what sensors show.
    #[inline(always)]
    pub(super) fn lose<const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool>(
        &mut self,
        samples: Samples<'_>,
        shown: &[Pair<L>],
    ) {
        let [mut sum_i, mut sum_w] = self.sums;
        for (n, (measured, shown)) in samples.measured.iter().zip(shown).enumerate() {
            let weight = if WEIGHTED { samples.weight[n] } else { [1.0; 2] };
            // Lane by lane of one channel, then of the other: side by side in memory.
            for lane in 0..L {
                let error = measured[0] - shown[0][lane];
                sum_i[lane] = add_loss::<FMA, ABSOLUTE, WEIGHTED>(sum_i[lane], error, weight[0]);
            }
            for lane in 0..L {
                let error = measured[1] - shown[1][lane];
                sum_w[lane] = add_loss::<FMA, ABSOLUTE, WEIGHTED>(sum_w[lane], error, weight[1]);
            }
        }
        self.sums = [sum_i, sum_w];
    }
}
