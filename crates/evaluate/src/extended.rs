//! The kernel for motors with extensions: simulates `L` candidates side by side through one recording.
//!
//! Without delays and moving averages it steps through segments of constant inputs, as the kernel of the linear motor does, or
//! reads the inputs of each step from the recording, and adds the squares of the errors as the states change. Otherwise, and for
//! weighted and absolute errors, it computes a chunk of samples at a time: the inputs of each candidate, then the states, then the
//! sensor outputs, then the errors.

use super::at_level::at_level;
use super::cutoff::Cut;
use super::input::{Inputs, Piece, PieceInput};
use super::kernel::{Block, LANES_AVX512, LANES_PORTABLE};
use super::lanes::{SUM_BLOCK, Samples, so_far};
use super::path::{Even, Irregular, Lanes, Path};
use super::problem::Problem;
use super::recordings::{Kernel, run};
use super::signals::Signals;
use super::step::{Pair, Step};
use motorfit_motor::{
    Aligned, CHUNK, Dynamics, Extended, Method, ModelFeatures, MovingAverages, Parameter, TransitionIntegrals,
    step_maps,
};

/// Candidates side by side at AVX2: one vector more than for the linear motor, because the latency of a step is longer.
pub(super) const LANES_AVX2: usize = 12;

/// Candidates side by side at AVX-512 on even clocks without moving averages: they hide the latency of a step. With averages, or
/// many distinct steps, 32 are slower than 24 (measured).
pub(super) const LANES_WIDE: usize = 32;

at_level! {
    pub(super) fn avx512_even(block: &Block<'_>, costs: &mut [f64]) = avx512 {
        run::<WithExtensions<true, false>, LANES_WIDE, true>(block, costs)
    } else avx2
}

at_level! {
    pub(super) fn avx512(block: &Block<'_>, costs: &mut [f64]) = avx512 {
        run::<WithExtensions<false, true>, LANES_AVX512, true>(block, costs)
    } else avx2
}

at_level! {
    pub(super) fn avx2(block: &Block<'_>, costs: &mut [f64]) = avx2 {
        run::<WithExtensions<true, true>, LANES_AVX2, true>(block, costs)
    } else portable
}

pub(super) fn portable(block: &Block<'_>, costs: &mut [f64]) {
    run::<WithExtensions<true, true>, LANES_PORTABLE, false>(block, costs);
}

/// The kernel of motors with extensions. It has loops that add errors as the states change for even clocks if `EVEN` is true, and
/// code for irregular clocks if `IRREGULAR` is true. Without the first, even clocks are simulated a chunk at a time.
struct WithExtensions<const EVEN: bool, const IRREGULAR: bool>;

impl<const L: usize, const EVEN: bool, const IRREGULAR: bool> Kernel<L> for WithExtensions<EVEN, IRREGULAR> {
    #[inline(always)]
    fn sums<const FMA: bool>(block: &Block<'_>, recording: usize, cut: Option<&mut Cut<'_, L>>) -> Pair<L> {
        let Block { problem, candidates, .. } = *block;
        let last = candidates.count() - 1;
        let motors: [Extended; L] =
            std::array::from_fn(|lane| problem.motor(candidates.row(lane.min(last)), recording));
        let motors = Extended::side_by_side(&motors);
        Simulation::<L, EVEN, IRREGULAR>::new(problem, &problem.signals()[recording], &motors).sums::<FMA>(&motors, cut)
    }
}

/// The simulation of a block of candidates on one recording.
struct Simulation<'a, const L: usize, const EVEN: bool, const IRREGULAR: bool> {
    problem: &'a Problem,
    signals: &'a Signals,
    steps: Vec<Step<L>>,
    lanes: Lanes<L>,
    /// Number of samples whose errors are in the sums of `lanes` and not yet in `totals`.
    summed: usize,
    totals: Pair<L>,
    /// Moving averages of the current and speed sensors.
    sensors: [Option<MovingAverages<L>>; 2],
    /// The states before each step of a piece, then the outputs of the sensors; `None` if errors are summed while the states move.
    seen: Option<Box<Aligned<[Pair<L>; CHUNK]>>>,
}

impl<'a, const L: usize, const EVEN: bool, const IRREGULAR: bool> Simulation<'a, L, EVEN, IRREGULAR> {
    /// Returns true if the states of a piece are kept before their errors are summed: for sensors that average, and for weighted and
    /// absolute errors, for which a loop of their own over each kind of inputs and reactions would double the code.
    fn is_observed(problem: &Problem, signals: &Signals) -> bool {
        let is_followed = EVEN || !signals.step_index.is_empty();
        let is_weighted = problem.criterion().is_absolute() || !signals.weight.is_empty();
        !is_followed || is_weighted || problem.features().is_averaged()
    }

    #[inline(always)]
    fn new(problem: &'a Problem, signals: &'a Signals, motors: &Extended<[f64; L]>) -> Self {
        let (features, method) = (problem.features(), problem.method());
        let steps = steps(signals, motors, features, method);
        let sensors = [(Parameter::CurrentAverage, 0), (Parameter::SpeedAverage, 1)].map(|(of, channel)| {
            let new = || MovingAverages::new(motors.get(of), signals.initial[channel], signals.len());
            features.has(of).then(new)
        });
        let seen = Self::is_observed(problem, signals).then(|| Box::new(Aligned([[[0.0; L]; 2]; CHUNK])));
        let mut totals = [[0.0; L]; 2];
        // NaN step maps must give a NaN cost even if the input is zero.
        for lane in 0..L {
            totals[0][lane] = 0.0 * steps[0].maps.d.iter().map(|d| d[lane]).sum::<f64>();
        }
        let lanes = Lanes { x: signals.initial.map(|x| [x; L]), sums: [[0.0; L]; 2] };
        Self { problem, signals, steps, lanes, summed: 0, totals, sensors, seen }
    }

    /// Returns the weighted sums of errors over the active samples, shape `[channels][candidates]`; those so far once all
    /// candidates are beyond the limits of `cut`.
    #[inline(always)]
    fn sums<const FMA: bool>(mut self, motors: &Extended<[f64; L]>, mut cut: Option<&mut Cut<'_, L>>) -> Pair<L> {
        let mut inputs = Inputs::new(self.problem, self.signals, motors, self.seen.is_some());
        while let Some(mut piece) = inputs.next::<FMA>(&self.steps) {
            let [start, end] = piece.range;
            // Pieces with an input of their own for each sample are short.
            let is_whole = matches!(piece.input, PieceInput::Each(_) | PieceInput::EachStep(_));
            let mut from = start;
            while from < end {
                let to = match &cut {
                    Some(cut) if !is_whole => cut.until(from, end),
                    _ => end,
                };
                piece.range = [from, to];
                self.advance::<FMA>(&piece);
                if let Some(cut) = &mut cut
                    && cut.is_due(to - from)
                    && cut.is_passed(&so_far(&self.totals, &self.lanes.sums))
                {
                    return so_far(&self.totals, &self.lanes.sums);
                }
                from = to;
            }
            self.summed += end - start;
            if self.summed >= SUM_BLOCK {
                self.flush();
            }
        }
        self.flush();
        self.totals
    }

    #[inline(always)]
    fn advance<const FMA: bool>(&mut self, piece: &Piece<'_, L>) {
        let (signals, range) = (self.signals, piece.range);
        let [start, end] = range;
        // The steps leave the simulation while its states change.
        let steps = std::mem::take(&mut self.steps);
        let step = &steps[piece.step];
        // A piece with changes is not divided.
        let bends = piece.changes;
        match piece.input {
            PieceInput::Constant(gain) => {
                self.pass::<FMA, _>(range, Even { step, inputs: std::iter::repeat(gain), bends });
            }
            PieceInput::Each(gains) => self.pass::<FMA, _>(range, Even { step, inputs: gains.iter(), bends }),
            PieceInput::EachStep(_) if !IRREGULAR => {
                debug_assert!(false, "a kernel for even clocks on an irregular one")
            }
            PieceInput::EachStep(gains) => {
                let index = &signals.step_index[start..end];
                self.pass::<FMA, _>(range, Irregular { steps: &steps, index, gains, bends });
            }
            PieceInput::ZeroOrderHold => {
                let inputs = signals.voltage[start..end].iter().copied();
                self.follow::<FMA, _>(range, Even { step, inputs, bends });
            }
            PieceInput::FirstOrderHold => {
                let inputs = (start..end).map(|n| signals.voltages_at(n));
                self.follow::<FMA, _>(range, Even { step, inputs, bends });
            }
            PieceInput::WithLoad => {
                let inputs = (start..end).map(|n| signals.inputs(n));
                self.follow::<FMA, _>(range, Even { step, inputs, bends });
            }
        }
        self.steps = steps;
    }

    /// Returns true for brush drop and for Coulomb friction if the motor has it.
    fn reactions(&self) -> [bool; 2] {
        [Parameter::BrushDrop, Parameter::Coulomb].map(|of| self.problem.features().has(of))
    }

    /// Simulates a piece, whose states are kept if sensors or errors need them.
    #[inline(always)]
    fn pass<const FMA: bool, P: Path<L>>(&mut self, range: [usize; 2], path: P) {
        if self.seen.is_none() {
            return self.follow::<FMA, P>(range, path);
        }
        match self.reactions() {
            [true, _] => self.observe::<FMA, true, true>(range, path),
            [false, true] => self.observe::<FMA, false, true>(range, path),
            [false, false] => self.observe::<FMA, false, false>(range, path),
        }
    }

    /// Simulates a piece and adds the squares of its errors.
    #[inline(always)]
    fn follow<const FMA: bool, P: Path<L>>(&mut self, [start, end]: [usize; 2], path: P) {
        if !EVEN && P::IS_EVEN {
            debug_assert!(false, "this kernel keeps the states of even clocks");
            return;
        }
        let (reactions, measured) = (self.reactions(), Samples::of(self.signals, start, end).measured);
        let lanes = &mut self.lanes;
        match reactions {
            [true, _] => path.follow::<FMA, true, true>(lanes, measured),
            [false, true] => path.follow::<FMA, false, true>(lanes, measured),
            [false, false] => path.follow::<FMA, false, false>(lanes, measured),
        }
    }

    /// Simulates a piece, then computes what the sensors show and adds its errors.
    #[inline(always)]
    fn observe<const FMA: bool, const BRUSHES: bool, const FRICTION: bool>(
        &mut self,
        [start, end]: [usize; 2],
        path: impl Path<L>,
    ) {
        let Self { problem, signals, lanes, sensors, seen, .. } = self;
        let Some(seen) = seen else { return };
        let samples = Samples::of(signals, start, end);
        let seen = &mut seen.0[..end - start];
        path.observe::<FMA, BRUSHES, FRICTION>(&mut lanes.x, seen);
        for (channel, sensor) in sensors.iter_mut().enumerate() {
            if let Some(sensor) = sensor {
                sensor.show(channel, seen);
            }
        }
        match (problem.criterion().is_absolute(), !signals.weight.is_empty()) {
            (false, false) => lanes.add_all::<FMA, false, false>(samples, seen),
            (false, true) => lanes.add_all::<FMA, false, true>(samples, seen),
            (true, false) => lanes.add_all::<FMA, true, false>(samples, seen),
            (true, true) => lanes.add_all::<FMA, true, true>(samples, seen),
        }
    }

    /// Adds the sums of a block of samples to the totals. Summation in blocks bounds the rounding error by the block length.
    #[inline(always)]
    fn flush(&mut self) {
        self.totals = so_far(&self.totals, &self.lanes.sums);
        self.lanes.sums = [[0.0; L]; 2];
        self.summed = 0;
    }
}

/// Returns the distinct steps. Iterator adapters would not be compiled for the SIMD level, so these are loops.
#[inline(always)]
fn steps<const L: usize>(
    signals: &Signals,
    motors: &Extended<[f64; L]>,
    features: ModelFeatures,
    method: Method,
) -> Vec<Step<L>> {
    let mut steps = Vec::with_capacity(signals.step_s.len());
    let Some(split) = &signals.split else {
        for &h in &signals.step_s {
            steps.push(Step::new(motors, step_maps(&motors.motor, h, method), features));
        }
        return steps;
    };
    let dynamics = Dynamics::new(&motors.motor, method.input);
    let [coarse, fine] = TransitionIntegrals::<L, 2>::of_parts::<false>(split, &dynamics, method);
    for (&[one, two], &h) in split.part_indices.iter().zip(&signals.step_s) {
        let maps = coarse[one].then::<false>(&fine[two], &dynamics).maps(&dynamics, h, method);
        steps.push(Step::new(motors, maps, features));
    }
    steps
}
