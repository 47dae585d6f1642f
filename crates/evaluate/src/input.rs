//! The inputs of `L` candidates side by side, in pieces of consecutive samples.

use super::delayed::{DelayedInputs, VoltageChanges};
use super::lanes::SUM_BLOCK;
use super::problem::Problem;
use super::segment::Segment;
use super::signals::Signals;
use super::step::{Pair, Step, loaded};
use motorfit_motor::{Aligned, CHUNK, DriveNonlinearity, Extended, Parameter};

/// Samples of a piece whose states are kept without sensors that average: with the inputs of as many they stay in the fastest cache.
const KEPT: usize = 16;

/// Consecutive samples.
pub(super) struct Piece<'g, const L: usize> {
    /// Index of the step length, unless samples have inputs of their own.
    pub step: usize,
    /// First sample, and one past the last.
    pub range: [usize; 2],
    pub input: PieceInput<'g, L>,
    /// Changes of the voltages within steps.
    pub changes: VoltageChanges<'g, L>,
}

/// The inputs of a piece.
pub(super) enum PieceInput<'g, const L: usize> {
    /// The same contribution to both states at every sample.
    Constant(&'g Pair<L>),
    /// The contribution to both states at each sample.
    Each(&'g [Pair<L>]),
    /// The contribution to both states at each sample of an irregular clock.
    EachStep(&'g [Pair<L>]),
    /// The recorded voltage under a zero-order hold; this and those below only where states are not kept.
    ZeroOrderHold,
    /// The recorded voltage under a first-order hold.
    FirstOrderHold,
    /// The recorded voltage under either hold, with torque, voltage offset and load.
    WithLoad,
}

/// The inputs of a block of candidates on one recording.
pub(super) struct Inputs<'a, const L: usize> {
    signals: &'a Signals,
    kind: Kind<'a, L>,
    /// Contributions of the inputs to both states, for pieces that compute them ahead.
    gains: Aligned<[Pair<L>; CHUNK]>,
    /// Index of the next sample.
    at: usize,
    /// True if states are kept, for which pieces have at most [`CHUNK`] samples.
    is_observed: bool,
}

enum Kind<'a, const L: usize> {
    /// Delayed inputs, the range of samples whose contributions are computed, and true if they are constant.
    Delayed(DelayedInputs<'a, L>, [usize; 2], bool),
    OnTime(OnTime<'a, L>),
}

impl<'a, const L: usize> Inputs<'a, L> {
    #[inline(always)]
    pub(super) fn new(
        problem: &'a Problem,
        signals: &'a Signals,
        motors: &'a Extended<[f64; L]>,
        is_observed: bool,
    ) -> Self {
        let at = problem.first_active(signals);
        let kind = if problem.features().is_delayed() {
            Kind::Delayed(DelayedInputs::new(problem, signals, motors), [at; 2], false)
        } else {
            Kind::OnTime(OnTime::new(problem, signals, motors, is_observed))
        };
        Self { signals, kind, gains: Aligned([[[0.0; L]; 2]; CHUNK]), at, is_observed }
    }

    /// Returns the next piece, `None` at the end of the recording.
    #[inline(always)]
    pub(super) fn next<const FMA: bool>(&mut self, steps: &[Step<L>]) -> Option<Piece<'_, L>> {
        let Self { signals, kind, gains: Aligned(gains), at, is_observed } = self;
        let start = *at;
        let (step, end, input, changes) = match kind {
            Kind::Delayed(delayed, ready, is_constant) => {
                if start == ready[1] {
                    if start == signals.len() {
                        return None;
                    }
                    *ready = [start; 2];
                    (ready[1], *is_constant) = delayed.next::<FMA>(steps, start, gains);
                }
                if *is_constant {
                    let end = if *is_observed { ready[1].min(start + CHUNK) } else { ready[1] };
                    (0, end, PieceInput::Constant(&gains[0]), VoltageChanges::None)
                } else {
                    (0, ready[1], each(signals, &gains[..ready[1] - start]), delayed.changes(start))
                }
            }
            Kind::OnTime(on_time) => {
                let (step, end, input) = on_time.next::<FMA>(steps, start, gains)?;
                (step, end, input, VoltageChanges::None)
            }
        };
        *at = end;
        (end > start).then_some(Piece { step: usize::from(step), range: [start, end], input, changes })
    }
}

/// Inputs without a delay, taken from segment to segment.
struct OnTime<'a, const L: usize> {
    signals: &'a Signals,
    segments: std::slice::Iter<'a, Segment>,
    now: Option<&'a Segment>,
    drives: DriveNonlinearity<[f64; L]>,
    load: [f64; L],
    /// Largest number of samples of a piece.
    most: usize,
    /// True if the drive is nonlinear, so that its output differs between candidates.
    is_nonlinear: bool,
    /// True if states are kept, for which inputs that change are computed ahead.
    is_observed: bool,
    /// True if a torque, a load or a voltage offset acts.
    is_loaded: bool,
    /// True if a step uses the voltage at its end too.
    uses_end: bool,
}

impl<'a, const L: usize> OnTime<'a, L> {
    fn new(problem: &Problem, signals: &'a Signals, motors: &Extended<[f64; L]>, is_observed: bool) -> Self {
        let features = problem.features();
        Self {
            signals,
            segments: problem.segments(signals).iter(),
            now: None,
            drives: DriveNonlinearity::of(motors),
            load: motors.get(Parameter::Load),
            most: match (features.is_averaged(), is_observed) {
                (true, _) => CHUNK,
                (false, true) => KEPT,
                (false, false) => SUM_BLOCK,
            },
            is_nonlinear: DriveNonlinearity::<f64>::is_nonlinear(features),
            is_observed,
            is_loaded: features.is_biased() || !signals.torque.is_empty(),
            uses_end: problem.model().discretization.uses_next_input(),
        }
    }

    /// Returns the index of the step length, the end and the inputs of the piece that begins at `start`.
    #[inline(always)]
    fn next<'g, const FMA: bool>(
        &mut self,
        steps: &[Step<L>],
        start: usize,
        gains: &'g mut [Pair<L>; CHUNK],
    ) -> Option<(u16, usize, PieceInput<'g, L>)> {
        if !self.signals.step_index.is_empty() {
            let end = self.signals.len().min(start + CHUNK);
            self.fill::<FMA>(steps, [start, end], gains);
            return (end > start).then_some((0, end, each(self.signals, &gains[..end - start])));
        }
        if self.now.is_none_or(|segment| segment.run.end == start) {
            self.now = self.segments.next();
            if let Some(Segment { run, constant: true }) = self.now {
                let inputs = [run.voltage[0], run.voltage[1], run.torque];
                gains[0] = self.gain::<FMA>(&steps[usize::from(run.step)], inputs);
            }
        }
        let Segment { run, constant } = self.now?;
        let end = run.end.min(start + self.most);
        Some(if *constant {
            (run.step, end, PieceInput::Constant(&gains[0]))
        } else if self.is_nonlinear || self.is_observed {
            let end = end.min(start + self.most.min(CHUNK));
            self.fill::<FMA>(steps, [start, end], gains);
            (run.step, end, PieceInput::Each(&gains[..end - start]))
        } else if self.is_loaded {
            (run.step, end, PieceInput::WithLoad)
        } else {
            (run.step, end, if self.uses_end { PieceInput::FirstOrderHold } else { PieceInput::ZeroOrderHold })
        })
    }

    /// Writes the contributions of the inputs of consecutive samples to both states.
    #[inline(always)]
    fn fill<const FMA: bool>(&self, steps: &[Step<L>], [start, end]: [usize; 2], gains: &mut [Pair<L>; CHUNK]) {
        for (n, gain) in (start..end).zip(gains.iter_mut()) {
            let (step, inputs) = (&steps[usize::from(self.signals.step_of(n))], self.signals.inputs(n));
            *gain = match (self.is_nonlinear, self.is_loaded) {
                (true, _) => self.gain::<FMA>(step, inputs),
                (false, true) => step.input_gain::<FMA>(inputs),
                (false, false) if self.uses_end => step.input_gain::<FMA>([inputs[0], inputs[1]]),
                (false, false) => step.input_gain::<FMA>(inputs[0]),
            };
        }
    }

    /// Returns the contribution to both states of the voltage at the start and the end of a step and of a torque. The voltage
    /// at the end counts only if the discretization uses it.
    #[inline(always)]
    fn gain<const FMA: bool>(&self, step: &Step<L>, [start, end, torque]: [f64; 3]) -> Pair<L> {
        let end = if self.uses_end { self.drives.outputs(end) } else { [0.0; L] };
        step.gain::<FMA>(&[self.drives.outputs(start), end], &loaded(self.load, torque))
    }
}

/// Returns the input of samples with contributions of their own.
fn each<'g, const L: usize>(signals: &Signals, gains: &'g [Pair<L>]) -> PieceInput<'g, L> {
    if signals.step_index.is_empty() { PieceInput::Each(gains) } else { PieceInput::EachStep(gains) }
}
