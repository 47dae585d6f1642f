//! One step of `L` candidates with extensions side by side.
//!
//! Throughput of a step with friction at AVX2: the 8 operations of the linear motor and four more (two limits, the remaining
//! speed, the increment of the current). The latency of a step is 13 cycles: 4 for each product of the speed, 1 for each limit
//! and 3 for the remaining speed. Three vectors side by side hide it. The sixteen registers then have states and sums only, and
//! nine loads per vector and two of measured values, at two per cycle, take 14.5 cycles, or 1.21 per candidate; the two vectors
//! of the linear motor take 1, from a latency of 8 cycles. A voltage that changes at each sample adds two products.

use super::lanes::phi;
use motorfit_motor::{Bend, Extended, ModelFeatures, Parameter, Reactions, StepMaps, multiply_add};

/// A pair of numbers (current, speed) for each candidate.
pub(super) type Pair<const L: usize> = [[f64; L]; 2];

/// Changes of the voltages of a block of candidates within the steps of a piece.
pub(super) trait Bends: Copy {
    /// Returns true if the voltage of a candidate may change within a step.
    fn is_any(self, step: usize) -> bool;
    /// Returns the change of the voltage of a candidate within a step.
    fn at(self, step: usize, lane: usize) -> Option<Bend<f64>>;
}

/// The coefficients of a step for a block of candidates.
#[repr(align(64))]
pub(super) struct Step<const L: usize> {
    pub maps: StepMaps<L>,
    pub phi: [[f64; L]; 4],
    /// Contribution of voltage offset and load to both states.
    bias: Pair<L>,
    reactions: Reactions<L>,
}

impl<const L: usize> Step<L> {
    #[inline(always)]
    pub(super) fn new(motors: &Extended<[f64; L]>, maps: StepMaps<L>, features: ModelFeatures) -> Self {
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

    /// Returns the state of a candidate after one step without reactions.
    #[inline(always)]
    pub(super) fn free<const FMA: bool>(&self, [i, w]: [f64; 2], input: impl Input<L>, lane: usize) -> [f64; 2] {
        let phi = &self.phi;
        let [gain_i, gain_w] = [input.gain::<FMA>(self, 0, lane), input.gain::<FMA>(self, 1, lane)];
        let current = multiply_add::<FMA>(phi[0][lane], i, multiply_add::<FMA>(phi[1][lane], w, gain_i));
        let speed = multiply_add::<FMA>(phi[2][lane], i, multiply_add::<FMA>(phi[3][lane], w, gain_w));
        [current, speed]
    }

    /// Subtracts the reactions from the states at the end of the step `n` of a piece. `before` are the states at its start. Steps in
    /// which a state passes zero, or the voltage changes within the step, are computed once more.
    #[inline(always)]
    pub(super) fn react<const FMA: bool>(
        &self,
        acts: [bool; 2],
        before: &Pair<L>,
        x: &mut Pair<L>,
        (bends, n): (impl Bends, usize),
    ) {
        let mut next = [[0.0; L]; 2];
        let mut margins = [0.0; L];
        for lane in 0..L {
            let [was, free] = [[before[0][lane], before[1][lane]], [x[0][lane], x[1][lane]]];
            let ([i, w], margin) = self.reactions.friction_step_without_passage::<FMA>(acts, was, free, lane);
            (next[0][lane], next[1][lane], margins[lane]) = (i, w, margin);
        }
        if least(&margins) < 0.0 || bends.is_any(n) {
            self.pass::<FMA>(acts, (before, x), (&margins, &mut next), (bends, n));
        }
        *x = next;
    }

    /// Computes the states of those candidates once more that may pass zero in the step, or whose voltage changes within it. A function
    /// of its own keeps the code of the kernels small.
    #[inline(never)]
    fn pass<const FMA: bool>(
        &self,
        acts: [bool; 2],
        (before, x): (&Pair<L>, &Pair<L>),
        (margins, next): (&[f64; L], &mut Pair<L>),
        (bends, n): (impl Bends, usize),
    ) {
        for lane in 0..L {
            let bend = bends.at(n, lane);
            if margins[lane] < 0.0 || bend.is_some_and(|bend| bend.added.iter().any(|part| *part != 0.0)) {
                let ends = ([before[0][lane], before[1][lane]], [x[0][lane], x[1][lane]]);
                [next[0][lane], next[1][lane]] = self.reactions.friction_step::<FMA>(acts, ends, bend, lane);
            }
        }
    }

    /// Returns the contribution of an input to both states.
    #[inline(always)]
    pub(super) fn input_gain<const FMA: bool>(&self, inputs: impl Input<L>) -> Pair<L> {
        let mut gain = [[0.0; L]; 2];
        for (axis, gain) in gain.iter_mut().enumerate() {
            for (lane, gain) in gain.iter_mut().enumerate() {
                *gain = inputs.gain::<FMA>(self, axis, lane);
            }
        }
        gain
    }

    /// Returns the contribution to both states of the voltages at both ends of the step and of a torque.
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

/// Returns the smallest number, by halves, as vectors of any width do it.
#[inline(always)]
pub(super) fn least<const L: usize>(numbers: &[f64; L]) -> f64 {
    const WIDTH: usize = 4;
    let mut least = [f64::INFINITY; WIDTH];
    for lane in 0..L {
        let own = &mut least[lane % WIDTH];
        *own = if numbers[lane] < *own { numbers[lane] } else { *own };
    }
    let [a, b, c, d] = least;
    let [a, b] = [if a < b { a } else { b }, if c < d { c } else { d }];
    if a < b { a } else { b }
}

/// Returns the loads of the candidates plus a common torque \[N·m\].
#[inline(always)]
pub(super) fn loaded<const L: usize>(mut loads: [f64; L], torque: f64) -> [f64; L] {
    for load in &mut loads {
        *load += torque;
    }
    loads
}

/// The input of the candidates at one sample.
pub(super) trait Input<const L: usize>: Copy {
    /// Returns its contribution to a state of a candidate.
    fn gain<const FMA: bool>(self, step: &Step<L>, axis: usize, lane: usize) -> f64;
}

/// An input given by its contributions, which were computed before.
impl<const L: usize> Input<L> for &Pair<L> {
    #[inline(always)]
    fn gain<const FMA: bool>(self, _: &Step<L>, axis: usize, lane: usize) -> f64 {
        self[axis][lane]
    }
}

/// A voltage under a zero-order hold.
impl<const L: usize> Input<L> for f64 {
    #[inline(always)]
    fn gain<const FMA: bool>(self, step: &Step<L>, axis: usize, lane: usize) -> f64 {
        step.maps.taps[0][axis][lane] * self
    }
}

/// A voltage under a first-order hold: at the start and at the end of the step.
impl<const L: usize> Input<L> for [f64; 2] {
    #[inline(always)]
    fn gain<const FMA: bool>(self, step: &Step<L>, axis: usize, lane: usize) -> f64 {
        let [start, end] = &step.maps.taps;
        multiply_add::<FMA>(end[axis][lane], self[1], start[axis][lane] * self[0])
    }
}

/// A voltage at the start and at the end of the step, and a torque, with offset and load of the candidate.
impl<const L: usize> Input<L> for [f64; 3] {
    #[inline(always)]
    fn gain<const FMA: bool>(self, step: &Step<L>, axis: usize, lane: usize) -> f64 {
        let ([start, end], torque) = (&step.maps.taps, &step.maps.torque);
        let load = multiply_add::<FMA>(torque[axis][lane], self[2], step.bias[axis][lane]);
        multiply_add::<FMA>(end[axis][lane], self[1], multiply_add::<FMA>(start[axis][lane], self[0], load))
    }
}
