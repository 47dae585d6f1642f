//! One piece of a simulation of `L` candidates with extensions: consecutive samples with steps and inputs of one kind.

use super::delayed::VoltageChanges;
use super::lanes::{Samples, add_loss, add_losses, advance};
use super::step::{Input, Pair, Step};

/// States and sums of errors of a block of candidates.
pub(super) struct Lanes<const L: usize> {
    pub x: Pair<L>,
    pub sums: Pair<L>,
}

impl<const L: usize> Lanes<L> {
    /// Adds the errors of the sensor outputs `shown` to the sums.
    #[inline(always)]
    pub(super) fn add_all<const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool>(
        &mut self,
        samples: Samples<'_>,
        shown: &[Pair<L>],
    ) {
        let mut sums = self.sums;
        for (n, (measured, shown)) in samples.measured.iter().zip(shown).enumerate() {
            let weight = if WEIGHTED { samples.weight[n] } else { [1.0; 2] };
            add_losses::<L, FMA, ABSOLUTE, WEIGHTED>(&mut sums, shown, *measured, weight);
        }
        self.sums = sums;
    }
}

/// The steps and inputs of consecutive samples.
pub(super) trait Path<const L: usize> {
    /// True if all steps have the same length.
    const IS_EVEN: bool;

    /// Simulates and adds the squares of the errors from the `measured` outputs to the sums.
    fn follow<const FMA: bool, const BRUSHES: bool, const FRICTION: bool>(
        self,
        lanes: &mut Lanes<L>,
        measured: &[[f64; 2]],
    );

    /// Simulates and writes the state before each step to `seen`.
    fn observe<const FMA: bool, const BRUSHES: bool, const FRICTION: bool>(self, x: &mut Pair<L>, seen: &mut [Pair<L>]);
}

/// Steps of the same length.
pub(super) struct Even<'a, const L: usize, I> {
    pub step: &'a Step<L>,
    pub inputs: I,
    pub bends: VoltageChanges<'a, L>,
}

impl<const L: usize, I: Iterator<Item: Input<L>>> Path<L> for Even<'_, L, I> {
    const IS_EVEN: bool = true;

    #[inline(always)]
    fn follow<const FMA: bool, const BRUSHES: bool, const FRICTION: bool>(
        self,
        lanes: &mut Lanes<L>,
        measured: &[[f64; 2]],
    ) {
        let mut x = lanes.x;
        let [mut sum_i, mut sum_w] = lanes.sums;
        for (n, (measured, input)) in measured.iter().zip(self.inputs).enumerate() {
            let before = x;
            for lane in 0..L {
                let [i, w] = [before[0][lane], before[1][lane]];
                let [error_i, error_w] = [measured[0] - i, measured[1] - w];
                sum_i[lane] = add_loss::<FMA, false, false>(sum_i[lane], error_i, 1.0);
                sum_w[lane] = add_loss::<FMA, false, false>(sum_w[lane], error_w, 1.0);
                [x[0][lane], x[1][lane]] = self.step.free::<FMA>([i, w], input, lane);
            }
            if BRUSHES || FRICTION {
                self.step.react::<FMA>([BRUSHES, FRICTION], &before, &mut x, (self.bends, n));
            }
        }
        lanes.x = x;
        lanes.sums = [sum_i, sum_w];
    }

    #[inline(always)]
    fn observe<const FMA: bool, const BRUSHES: bool, const FRICTION: bool>(
        self,
        x: &mut Pair<L>,
        seen: &mut [Pair<L>],
    ) {
        let mut moving = *x;
        for (n, (seen, input)) in seen.iter_mut().zip(self.inputs).enumerate() {
            let before = moving;
            *seen = before;
            for lane in 0..L {
                [moving[0][lane], moving[1][lane]] =
                    self.step.free::<FMA>([before[0][lane], before[1][lane]], input, lane);
            }
            if BRUSHES || FRICTION {
                self.step.react::<FMA>([BRUSHES, FRICTION], &before, &mut moving, (self.bends, n));
            }
        }
        *x = moving;
    }
}

/// Steps of different lengths, each with the contribution of its inputs to both states.
pub(super) struct Irregular<'a, const L: usize> {
    pub steps: &'a [Step<L>],
    /// Index of the step of each sample.
    pub index: &'a [u16],
    pub gains: &'a [Pair<L>],
    pub bends: VoltageChanges<'a, L>,
}

impl<const L: usize> Irregular<'_, L> {
    /// Advances the states by the step of sample `n`.
    #[inline(always)]
    fn advance<const FMA: bool, const BRUSHES: bool, const FRICTION: bool>(&self, x: &mut Pair<L>, n: usize) {
        let step = &self.steps[usize::from(self.index[n])];
        let before = *x;
        advance::<L, FMA>(x, &step.phi, &self.gains[n]);
        if BRUSHES || FRICTION {
            step.react::<FMA>([BRUSHES, FRICTION], &before, x, (self.bends, n));
        }
    }
}

impl<const L: usize> Path<L> for Irregular<'_, L> {
    const IS_EVEN: bool = false;

    #[inline(always)]
    fn follow<const FMA: bool, const BRUSHES: bool, const FRICTION: bool>(
        self,
        lanes: &mut Lanes<L>,
        measured: &[[f64; 2]],
    ) {
        let Lanes { mut x, mut sums } = *lanes;
        for (n, measured) in measured.iter().enumerate() {
            add_losses::<L, FMA, false, false>(&mut sums, &x, *measured, [1.0; 2]);
            self.advance::<FMA, BRUSHES, FRICTION>(&mut x, n);
        }
        *lanes = Lanes { x, sums };
    }

    #[inline(always)]
    fn observe<const FMA: bool, const BRUSHES: bool, const FRICTION: bool>(
        self,
        x: &mut Pair<L>,
        seen: &mut [Pair<L>],
    ) {
        let mut moving = *x;
        for (n, seen) in seen.iter_mut().enumerate() {
            *seen = moving;
            self.advance::<FMA, BRUSHES, FRICTION>(&mut moving, n);
        }
        *x = moving;
    }
}
