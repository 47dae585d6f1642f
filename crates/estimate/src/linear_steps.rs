//! One-step maps of the linear motor with their derivatives with respect to the logarithms of its parameters.
//!
//! On a clock with many distinct step lengths each step is split into a coarse and a fine part, which keeps the number of
//! maps with derivatives small.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use motorfit_evaluate::Run;
use motorfit_motor::{Dual, SplitSteps, StepMap, StepMaps, multiply_add};

/// Entries of a row: derivatives with respect to five parameters and two initial states, and the error.
pub(super) const ROW: usize = 8;
/// Index of the first initial state in a row; the error follows both.
pub(super) const INITIAL: usize = 5;

/// A one-step map with its derivatives; each derivative has a lane for each entry of a row.
pub(super) struct Step {
    map: StepMap,
    d: [[f64; ROW]; 4],
    taps: [[[f64; ROW]; 2]; 2],
    torque: [[f64; ROW]; 2],
}

impl Step {
    /// Separates a map of dual numbers into values and derivatives.
    #[inline(always)]
    pub(super) fn new(maps: &StepMaps<1, Dual<5>>) -> Self {
        let zero = [0.0; ROW];
        let mut step = Self {
            map: StepMap { d: [0.0; 4], taps: [[0.0; 2]; 2], torque: [0.0; 2] },
            d: [zero; 4],
            taps: [[zero; 2]; 2],
            torque: [zero; 2],
        };
        for n in 0..4 {
            step.map.d[n] = maps.d[n][0].value;
            step.d[n][..INITIAL].copy_from_slice(&maps.d[n][0].derivatives);
        }
        for axis in 0..2 {
            for tap in 0..2 {
                step.map.taps[tap][axis] = maps.taps[tap][axis][0].value;
                step.taps[tap][axis][..INITIAL].copy_from_slice(&maps.taps[tap][axis][0].derivatives);
            }
            step.map.torque[axis] = maps.torque[axis][0].value;
            step.torque[axis][..INITIAL].copy_from_slice(&maps.torque[axis][0].derivatives);
        }
        step
    }
}

/// The steps of a recording, each in `PARTS` parts. This is a trait because closures would not be compiled for the target
/// features of the functions that call them.
pub(super) trait Steps<const PARTS: usize> {
    /// Returns the parts of a step of a run, in order of time.
    fn parts(&self, run: &Run) -> [Part<'_>; PARTS];
}

/// Maps of undivided steps, one for each distinct length.
pub(super) struct WholeSteps(pub Vec<Step>);

impl Steps<1> for WholeSteps {
    #[inline(always)]
    fn parts(&self, run: &Run) -> [Part<'_>; 1] {
        [Part::new(&self.0[usize::from(run.step)], run.voltage, run.torque)]
    }
}

/// Maps of the coarse and the fine parts of split steps.
pub(super) struct SplitTables<'a> {
    pub split: &'a SplitSteps,
    pub coarse: Vec<Step>,
    pub fine: Vec<Step>,
    /// True for a first-order hold.
    pub is_first_order_hold: bool,
}

impl Steps<2> for SplitTables<'_> {
    #[inline(always)]
    fn parts(&self, run: &Run) -> [Part<'_>; 2] {
        let step = usize::from(run.step);
        let ([coarse, fine], [v, v_next]) = (self.split.part_indices[step], run.voltage);
        let between = if self.is_first_order_hold { v + self.split.coarse_fraction[step] * (v_next - v) } else { v };
        let first = Part::new(&self.coarse[coarse], [v, between], run.torque);
        [first, Part::new(&self.fine[fine], [between, v_next], run.torque)]
    }
}

/// A part of a step with the contributions of the inputs to the state and to its derivatives.
pub(super) struct Part<'a> {
    step: &'a Step,
    phi: [f64; 4],
    gain: [f64; 2],
    slope: [[f64; ROW]; 2],
}

impl<'a> Part<'a> {
    /// Makes a part from its map, the voltage \[V\] at its start and (used by a first-order hold) at its end, and the load
    /// torque \[N·m\].
    #[inline(always)]
    fn new(step: &'a Step, [v, v_next]: [f64; 2], load: f64) -> Self {
        let Step { map, taps, torque, .. } = step;
        let mut gain = [0.0; 2];
        for a in 0..2 {
            gain[a] = map.taps[0][a] * v + map.taps[1][a] * v_next + map.torque[a] * load;
        }
        let mut slope = [[0.0; ROW]; 2];
        for a in 0..2 {
            for lane in 0..ROW {
                slope[a][lane] = taps[0][a][lane] * v + taps[1][a][lane] * v_next + torque[a][lane] * load;
            }
        }
        Self { step, phi: [map.d[0] + 1.0, map.d[1], map.d[2], map.d[3] + 1.0], gain, slope }
    }

    /// Advances the state and its derivatives over this part.
    #[inline(always)]
    pub(super) fn pass<const FMA: bool>(&self, x: &mut [f64; 2], s: &mut [[f64; ROW]; 2]) {
        let Self { step: Step { map, d, .. }, phi, gain, slope } = self;
        let (s_i, s_w) = (s[0], s[1]);
        for a in 0..2 {
            for lane in 0..ROW {
                let own = multiply_add::<FMA>(d[2 * a][lane], x[0], slope[a][lane]);
                let forced = multiply_add::<FMA>(d[2 * a + 1][lane], x[1], own);
                let turned = multiply_add::<FMA>(phi[2 * a + 1], s_w[lane], forced);
                s[a][lane] = multiply_add::<FMA>(phi[2 * a], s_i[lane], turned);
            }
        }
        let [i, w] = *x;
        *x = [i + (map.d[0] * i + map.d[1] * w + gain[0]), w + (map.d[2] * i + map.d[3] * w + gain[1])];
    }
}
