//! The linear motor on an irregular clock: the integrals of each step are read from a table, or composed of those of its parts.
//!
//! Multiplications per candidate and step: 6 for `A x + g` and `B g − d x`, 4 to advance the state, 3 for the input and 2 for the
//! errors, which are 15 where a regular clock takes 6, and 8 more for a composition. Additions: 2, and 3 more for a composition.

use super::at_level::at_each_level;
use super::cutoff::Cut;
use super::kernel::{Block, LANES, LANES_AVX512, LANES_PORTABLE};
use super::lanes::{SUM_BLOCK, Samples, add_losses, so_far};
use super::problem::Problem;
use super::recordings::{Kernel, run};
use super::signals::Signals;
use super::step::Pair;
use motorfit_motor::{Dynamics, Input, Method, SplitSteps, TransitionIntegrals, multiply_add};

at_each_level!(run for Irregular with [LANES_AVX512, LANES, LANES_PORTABLE] candidates);

/// The kernel of the linear motor on irregular clocks.
struct Irregular;

impl<const L: usize> Kernel<L> for Irregular {
    #[inline(always)]
    fn sums<const FMA: bool>(block: &Block<'_>, recording: usize, cut: Option<&mut Cut<'_, L>>) -> Pair<L> {
        let (problem, signals) = (block.problem, &block.problem.signals()[recording]);
        let ids: [usize; L] = std::array::from_fn(|lane| lane);
        let parameters = block.parameters(&ids[..block.candidates.count()], recording);
        simulate::<L, FMA>(problem, signals, &parameters, cut)
    }
}

/// Returns the weighted sums of errors over the active samples of one recording, shape `[channels][candidates]`; those so far
/// once all candidates are beyond the limits of `cut`.
#[inline(always)]
fn simulate<const L: usize, const FMA: bool>(
    problem: &Problem,
    signals: &Signals,
    parameters: &[[f64; L]; 5],
    mut cut: Option<&mut Cut<'_, L>>,
) -> [[f64; L]; 2] {
    let clock = Clock::new::<FMA>(signals, parameters, problem.method());
    let mut lanes = Moving { x: signals.initial.map(|x| [x; L]), sums: [[0.0; L]; 2] };
    // NaN parameters must give a NaN cost even if the motor is at rest throughout.
    let mut totals = [[0.0; L]; 2];
    for parameter in parameters {
        for lane in 0..L {
            totals[0][lane] += 0.0 * parameter[lane];
        }
    }
    let loss = (problem.criterion().is_absolute(), !signals.weight.is_empty());
    let (mut from, end) = (signals.first_active, signals.len());
    let mut part = from;
    while from < end {
        let last = end.min(part + SUM_BLOCK);
        let to = match &cut {
            Some(cut) => cut.until(from, last),
            None => last,
        };
        // The steps are computed before and serve each loss, so that they are compiled once.
        match loss {
            (false, false) => clock.run::<FMA, false, false>(&mut lanes, [from, to]),
            (false, true) => clock.run::<FMA, false, true>(&mut lanes, [from, to]),
            (true, false) => clock.run::<FMA, true, false>(&mut lanes, [from, to]),
            (true, true) => clock.run::<FMA, true, true>(&mut lanes, [from, to]),
        }
        if let Some(cut) = &mut cut
            && cut.is_due(to - from)
            && cut.is_passed(&so_far(&totals, &lanes.sums))
        {
            break;
        }
        if to == last {
            totals = so_far(&totals, &lanes.sums);
            lanes.sums = [[0.0; L]; 2];
            part = last;
        }
        from = to;
    }
    so_far(&totals, &lanes.sums)
}

/// States and sums of errors of a block of candidates.
struct Moving<const L: usize> {
    x: [[f64; L]; 2],
    sums: [[f64; L]; 2],
}

/// The steps of an irregular clock for a block of candidates.
enum Clock<'a, const L: usize> {
    /// Only a voltage under a zero-order hold acts.
    ZeroOrderHold(Table<'a, L, 1>),
    /// Any input.
    General(Table<'a, L, 2>),
}

impl<'a, const L: usize> Clock<'a, L> {
    #[inline(always)]
    fn new<const FMA: bool>(signals: &'a Signals, parameters: &[[f64; L]; 5], method: Method) -> Self {
        if method.uses_next_input() || method.input == Input::Current || !signals.torque.is_empty() {
            Self::General(Table::new::<FMA>(signals, parameters, method))
        } else {
            Self::ZeroOrderHold(Table::new::<FMA>(signals, parameters, method))
        }
    }

    /// Simulates the samples `from..to` and adds their errors to the sums.
    #[inline(always)]
    fn run<const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool>(
        &self,
        lanes: &mut Moving<L>,
        range: [usize; 2],
    ) {
        match self {
            Self::ZeroOrderHold(table) => table.run::<FMA, ABSOLUTE, WEIGHTED>(lanes, range),
            Self::General(table) => table.run::<FMA, ABSOLUTE, WEIGHTED>(lanes, range),
        }
    }
}

/// The dynamics of a block of candidates and the integrals of their steps.
struct Table<'a, const L: usize, const K: usize> {
    signals: &'a Signals,
    dynamics: Dynamics<L>,
    steps: Steps<'a, L, K>,
    /// True if the voltage is linear over a step.
    is_linear: bool,
}

enum Steps<'a, const L: usize, const K: usize> {
    /// The integrals of each distinct step.
    Whole(Vec<TransitionIntegrals<L, K>>),
    /// The integrals of coarse and of fine parts.
    Parts(&'a SplitSteps, [Vec<TransitionIntegrals<L, K>>; 2]),
}

impl<'a, const L: usize, const K: usize> Table<'a, L, K> {
    #[inline(always)]
    fn new<const FMA: bool>(signals: &'a Signals, parameters: &[[f64; L]; 5], method: Method) -> Self {
        let dynamics = Dynamics::new(parameters, method.input);
        let steps = if let Some(split) = &signals.split {
            Steps::Parts(split, TransitionIntegrals::of_parts::<FMA>(split, &dynamics, method))
        } else {
            let mut whole = vec![TransitionIntegrals::zero(); signals.step_s.len()];
            for (whole, &h) in whole.iter_mut().zip(&signals.step_s) {
                *whole = TransitionIntegrals::new(&dynamics, [h; L], method);
            }
            Steps::Whole(whole)
        };
        Self { signals, dynamics, steps, is_linear: method.uses_next_input() }
    }

    #[inline(always)]
    fn run<const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool>(
        &self,
        lanes: &mut Moving<L>,
        range: [usize; 2],
    ) {
        match &self.steps {
            Steps::Whole(whole) => self.pass::<FMA, ABSOLUTE, WEIGHTED, false>(lanes, range, ([whole, &[]], &[])),
            Steps::Parts(split, [coarse, fine]) => {
                self.pass::<FMA, ABSOLUTE, WEIGHTED, true>(lanes, range, ([coarse, fine], &split.part_indices));
            }
        }
    }

    /// Simulates the samples `from..to` with the integrals of whole steps, or, if `COMPOSED` is true, of coarse and fine parts,
    /// given with the indices of the parts of each step.
    #[inline(always)]
    fn pass<const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool, const COMPOSED: bool>(
        &self,
        lanes: &mut Moving<L>,
        [from, to]: [usize; 2],
        ([whole, fine], indices): ([&[TransitionIntegrals<L, K>]; 2], &[[usize; 2]]),
    ) {
        let Self { signals, dynamics, .. } = self;
        let samples = Samples::of(signals, from, to);
        // Black boxes force lanes through memory; otherwise the compiler splits them into scalars.
        let (lanes, dynamics) = (std::hint::black_box(lanes), std::hint::black_box(dynamics));
        let Moving { mut x, mut sums } = *lanes;
        for (n, measured) in samples.measured.iter().enumerate() {
            let weight = if WEIGHTED { samples.weight[n] } else { [1.0; 2] };
            add_losses::<L, FMA, ABSOLUTE, WEIGHTED>(&mut sums, &x, *measured, weight);
            let step = usize::from(signals.step_of(from + n));
            let inputs = if K > 1 { self.inputs(from + n, step) } else { [signals.voltage[from + n], 0.0, 0.0] };
            if COMPOSED {
                let [one, two] = indices[step];
                let mut composed = whole[one].then::<FMA>(&fine[two], dynamics);
                // The registers of AVX-512 hold the composition.
                if L < LANES_AVX512 {
                    composed = std::hint::black_box(composed);
                }
                advance::<L, K, FMA>(&mut x, dynamics, &composed, inputs);
            } else {
                advance::<L, K, FMA>(&mut x, dynamics, &whole[step], inputs);
            }
        }
        (lanes.x, lanes.sums) = (x, sums);
    }

    /// Returns the voltage at sample `n` \[V\], its slope until the next sample \[V/s\] and the torque \[N·m\].
    #[inline(always)]
    fn inputs(&self, n: usize, step: usize) -> [f64; 3] {
        let [start, end, torque] = self.signals.inputs(n);
        [start, if self.is_linear { (end - start) / self.signals.step_s[step] } else { 0.0 }, torque]
    }
}

/// Advances the states by one step.
#[inline(always)]
fn advance<const L: usize, const K: usize, const FMA: bool>(
    x: &mut [[f64; L]; 2],
    Dynamics { a, voltage, torque, determinant, .. }: &Dynamics<L>,
    TransitionIntegrals(integrals): &TransitionIntegrals<L, K>,
    [volts, slope, load]: [f64; 3],
) {
    let ([i, w], [r, q]) = (*x, &integrals[0]);
    for axis in 0..2 {
        for n in 0..L {
            // A x + g and B g − d x
            let [mut one, mut two] = [voltage[0][axis][n] * volts, voltage[1][axis][n] * volts];
            if K > 1 {
                one = multiply_add::<FMA>(torque[0][axis][n], load, one);
                two = multiply_add::<FMA>(torque[1][axis][n], load, two);
            }
            let mut own = a[2 * axis + 1][n] * w[n];
            if K > 1 || axis == 0 {
                own = multiply_add::<FMA>(a[2 * axis + 1][n], w[n], one);
            }
            let rate = multiply_add::<FMA>(a[2 * axis][n], i[n], own);
            let rest = multiply_add::<FMA>(-determinant[n], x[axis][n], two);
            let mut next = multiply_add::<FMA>(r[n], rate, multiply_add::<FMA>(q[n], rest, x[axis][n]));
            for [r, q] in &integrals[1..] {
                next = multiply_add::<FMA>(r[n], voltage[0][axis][n] * slope, next);
                next = multiply_add::<FMA>(q[n], voltage[1][axis][n] * slope, next);
            }
            x[axis][n] = next;
        }
    }
}
