//! Steps with brushes and friction, of `L` candidates side by side.
//!
//! Each state is counted in what one unit of its reaction takes off it: a reaction then is the state itself within its
//! limits, and what it leaves is the rest. Limit of a step with friction: to the linear motor's 8 operations come four
//! (two limits, what is left of the speed, and what is added to the current); none waits for a product.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::kernel::{add_loss, multiply_add, phi};
use crate::motor::{Extended, Extent, Method, Parameter, StepMaps, step_maps};

/// A pair of numbers (current, speed) of each candidate.
pub(super) type Pair<const L: usize> = [[f64; L]; 2];

/// The step of a block of candidates.
pub(super) struct Step<const L: usize> {
    /// The map, in units of the reactions.
    pub maps: StepMaps<L>,
    phi: [[f64; L]; 4],
    /// What one unit of a reaction takes off its own state: the unit in which that is counted. 1 without reaction.
    pub units: Pair<L>,
    /// What one unit of a reaction adds to the other state.
    adds: Pair<L>,
    /// The limits of the reactions: brush drop, Coulomb friction.
    limits: Pair<L>,
}

impl<const L: usize> Step<L> {
    #[inline(always)]
    pub(super) fn new(motors: &[Extended; L], h: f64, extent: Extent, method: Method) -> Self {
        let parameters: [[f64; L]; 5] = std::array::from_fn(|p| std::array::from_fn(|lane| motors[lane].motor[p]));
        let mut maps = step_maps(&parameters, h, extent.method(method));
        let mut phi = phi(&maps);
        let (mut units, mut adds, mut limits) = ([[1.0; L]; 2], [[0.0; L]; 2], [[0.0; L]; 2]);
        for lane in 0..L {
            let drop = [0, 1].map(|axis| -(maps.taps[0][axis][lane] + maps.taps[1][axis][lane]));
            let friction = maps.torque.map(|axis| axis[lane]);
            if extent.has(Parameter::BrushDrop) {
                units[0][lane] = -drop[0];
            }
            if extent.has(Parameter::Coulomb) {
                units[1][lane] = -friction[1];
            }
            let units = units.map(|axis| axis[lane]);
            adds[0][lane] = drop[1] / units[1];
            adds[1][lane] = friction[0] / units[0];
            for (limits, of) in limits.iter_mut().zip([Parameter::BrushDrop, Parameter::Coulomb]) {
                limits[lane] = motors[lane].get(of);
            }
            phi[1][lane] *= units[1] / units[0];
            phi[2][lane] *= units[0] / units[1];
            for axis in 0..2 {
                for input in maps.taps.iter_mut().chain([&mut maps.torque]) {
                    input[axis][lane] /= units[axis];
                }
            }
        }
        Self { maps, phi, units, adds, limits }
    }

    /// A state after one step.
    #[inline(always)]
    fn next<const FMA: bool, const BRUSHES: bool>(&self, [i, w]: [f64; 2], gain: &Pair<L>, lane: usize) -> [f64; 2] {
        let Self { phi, adds, limits, .. } = self;
        let current = multiply_add::<FMA>(phi[0][lane], i, multiply_add::<FMA>(phi[1][lane], w, gain[0][lane]));
        let speed = multiply_add::<FMA>(phi[2][lane], i, multiply_add::<FMA>(phi[3][lane], w, gain[1][lane]));
        let [mut i, mut w] = [current, speed];
        if BRUSHES {
            let reaction = within(i, limits[0][lane]);
            i -= reaction;
            w = multiply_add::<FMA>(adds[0][lane], reaction, w);
        }
        let reaction = within(w, limits[1][lane]);
        [multiply_add::<FMA>(adds[1][lane], reaction, i), w - reaction]
    }

    /// States in units of the reactions.
    #[inline(always)]
    fn counted(&self, x: &Pair<L>) -> Pair<L> {
        let mut counted = *x;
        for axis in 0..2 {
            for lane in 0..L {
                counted[axis][lane] /= self.units[axis][lane];
            }
        }
        counted
    }
}

/// A reaction within ± its limit.
#[inline(always)]
fn within(reaction: f64, limit: f64) -> f64 {
    let low = if reaction > -limit { reaction } else { -limit };
    if low < limit { low } else { limit }
}

/// Samples that are passed under the same map: what was measured, and weights where they differ.
#[derive(Clone, Copy)]
pub(super) struct Samples<'a> {
    pub measured: &'a [[f64; 2]],
    pub weight: &'a [[f64; 2]],
}

/// State and sums of errors of a block of candidates.
pub(super) struct Lanes<const L: usize> {
    pub x: Pair<L>,
    pub sums: Pair<L>,
}

impl<const L: usize> Lanes<L> {
    /// Steps over `samples`, with their errors; `gains` are what drives each.
    #[inline(always)]
    pub(super) fn follow<'g, const FMA: bool, const BRUSHES: bool, const ABSOLUTE: bool, const WEIGHTED: bool>(
        &mut self,
        step: &Step<L>,
        samples: Samples<'_>,
        gains: impl Iterator<Item = &'g Pair<L>>,
    ) {
        let [mut i, mut w] = step.counted(&self.x);
        let [mut sum_i, mut sum_w] = self.sums;
        let mut minus = step.units;
        for lane in 0..L {
            minus[0][lane] = -minus[0][lane];
            minus[1][lane] = -minus[1][lane];
        }
        for (n, (measured, gain)) in samples.measured.iter().zip(gains).enumerate() {
            let weight = if WEIGHTED { samples.weight[n] } else { [1.0; 2] };
            for lane in 0..L {
                // Without brushes a current is counted as it is.
                let error_i = if BRUSHES {
                    multiply_add::<FMA>(minus[0][lane], i[lane], measured[0])
                } else {
                    measured[0] - i[lane]
                };
                let error_w = multiply_add::<FMA>(minus[1][lane], w[lane], measured[1]);
                sum_i[lane] = add_loss::<FMA, ABSOLUTE, WEIGHTED>(sum_i[lane], error_i, weight[0]);
                sum_w[lane] = add_loss::<FMA, ABSOLUTE, WEIGHTED>(sum_w[lane], error_w, weight[1]);
                [i[lane], w[lane]] = step.next::<FMA, BRUSHES>([i[lane], w[lane]], gain, lane);
            }
        }
        self.sums = [sum_i, sum_w];
        self.end(step, [i, w]);
    }

    /// Steps that write what is passed on the way to `seen`.
    #[inline(always)]
    pub(super) fn watch<'g, const FMA: bool, const BRUSHES: bool>(
        &mut self,
        step: &Step<L>,
        gains: impl Iterator<Item = &'g Pair<L>>,
        seen: &mut [Pair<L>],
    ) {
        let [mut i, mut w] = step.counted(&self.x);
        for (seen, gain) in seen.iter_mut().zip(gains) {
            // Apart from `seen`, which could be where other numbers of the step are.
            let [mut now_i, mut now_w] = [[0.0; L]; 2];
            for lane in 0..L {
                now_i[lane] = step.units[0][lane] * i[lane];
                now_w[lane] = step.units[1][lane] * w[lane];
                [i[lane], w[lane]] = step.next::<FMA, BRUSHES>([i[lane], w[lane]], gain, lane);
            }
            *seen = [now_i, now_w];
        }
        self.end(step, [i, w]);
    }

    #[inline(always)]
    fn end(&mut self, step: &Step<L>, x: Pair<L>) {
        for axis in 0..2 {
            for lane in 0..L {
                self.x[axis][lane] = step.units[axis][lane] * x[axis][lane];
            }
        }
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
            for lane in 0..L {
                let [error_i, error_w] = [measured[0] - shown[0][lane], measured[1] - shown[1][lane]];
                sum_i[lane] = add_loss::<FMA, ABSOLUTE, WEIGHTED>(sum_i[lane], error_i, weight[0]);
                sum_w[lane] = add_loss::<FMA, ABSOLUTE, WEIGHTED>(sum_w[lane], error_w, weight[1]);
            }
        }
        self.sums = [sum_i, sum_w];
    }
}
