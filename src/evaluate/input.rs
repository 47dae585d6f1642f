//! The inputs of `L` candidates side by side, in pieces of samples under one step.

use super::delayed::DelayedInputs;
use super::kernel::SUM_BLOCK;
use super::problem::Problem;
use super::segment::Segment;
use super::signals::Signals;
use super::step::{Pair, Step, loaded};
use crate::motor::{Aligned, CHUNK, DriveNonlinearity, Extended, Parameter};

/// Samples under one step.
pub(super) struct Piece<'g, const L: usize> {
    pub step: usize,
    pub range: [usize; 2],
    pub input: PieceInput<'g, L>,
}

/// The inputs of a piece.
pub(super) enum PieceInput<'g, const L: usize> {
    /// The same gain at each sample.
    Constant(&'g Pair<L>),
    /// The gain of each sample.
    Each(&'g [Pair<L>]),
    /// The voltage of the recording as it is.
    Volts,
    /// Lines of it.
    Lines,
    /// Lines of it, torque, offset and load.
    Loads,
}

/// The inputs of a block of candidates on one recording.
pub(super) struct Inputs<'a, const L: usize> {
    signals: &'a Signals,
    kind: Kind<'a, L>,
    /// The gains of a piece, where they are computed before.
    gains: Aligned<[Pair<L>; CHUNK]>,
    /// The next sample.
    at: usize,
}

enum Kind<'a, const L: usize> {
    /// Some samples at a time: those whose gains are ready.
    Delayed(DelayedInputs<'a, L>, [usize; 2]),
    OnTime(OnTime<'a, L>),
}

impl<'a, const L: usize> Inputs<'a, L> {
    #[inline(always)]
    pub(super) fn new(problem: &'a Problem, signals: &'a Signals, motors: &'a Extended<[f64; L]>) -> Self {
        let at = problem.first_active(signals);
        let kind = if problem.features().is_delayed() {
            Kind::Delayed(DelayedInputs::new(problem, signals, motors), [at; 2])
        } else {
            Kind::OnTime(OnTime::new(problem, signals, motors))
        };
        Self { signals, kind, gains: Aligned([[[0.0; L]; 2]; CHUNK]), at }
    }

    /// Returns the next piece.
    #[inline(always)]
    pub(super) fn next<const FMA: bool>(&mut self, steps: &[Step<L>]) -> Option<Piece<'_, L>> {
        let Self { signals, kind, gains: Aligned(gains), at } = self;
        let start = *at;
        let (step, end, input) = match kind {
            Kind::Delayed(delayed, ready) => {
                if start == ready[1] {
                    *ready = [start, signals.len().min(start + CHUNK)];
                    delayed.fill::<FMA>(steps, *ready, gains);
                }
                let step = signals.step_of(start);
                let end = (start..ready[1]).find(|&n| signals.step_of(n) != step).unwrap_or(ready[1]);
                (step, end, PieceInput::Each(&gains[start - ready[0]..end - ready[0]]))
            }
            Kind::OnTime(on_time) => on_time.next::<FMA>(steps, start, gains)?,
        };
        *at = end;
        (end > start).then_some(Piece { step: usize::from(step), range: [start, end], input })
    }
}

/// Inputs without a delay: from segment to segment.
struct OnTime<'a, const L: usize> {
    signals: &'a Signals,
    segments: std::slice::Iter<'a, Segment>,
    now: Option<&'a Segment>,
    drives: DriveNonlinearity<[f64; L]>,
    load: [f64; L],
    /// Samples of a piece at most.
    most: usize,
    /// True if the drive's output differs from candidate to candidate.
    is_bent: bool,
    /// True if anything but the voltage acts.
    is_loaded: bool,
    /// True if steps use the voltage at their end too.
    lines: bool,
}

impl<'a, const L: usize> OnTime<'a, L> {
    fn new(problem: &Problem, signals: &'a Signals, motors: &Extended<[f64; L]>) -> Self {
        let features = problem.features();
        Self {
            signals,
            segments: problem.segments(signals).iter(),
            now: None,
            drives: DriveNonlinearity::of(motors),
            load: motors.get(Parameter::Load),
            most: if features.is_averaged() { CHUNK } else { SUM_BLOCK },
            is_bent: DriveNonlinearity::<f64>::bends(features),
            is_loaded: features.is_biased() || !signals.torque.is_empty(),
            lines: problem.model().discretization.uses_next_input(),
        }
    }

    /// Returns the step, the end and the inputs of the piece from `start` on.
    #[inline(always)]
    fn next<'g, const FMA: bool>(
        &mut self,
        steps: &[Step<L>],
        start: usize,
        gains: &'g mut [Pair<L>; CHUNK],
    ) -> Option<(u16, usize, PieceInput<'g, L>)> {
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
        } else if self.is_bent {
            let end = end.min(start + CHUNK);
            for (n, gain) in (start..end).zip(gains.iter_mut()) {
                *gain = self.gain::<FMA>(&steps[usize::from(run.step)], self.signals.inputs(n));
            }
            (run.step, end, PieceInput::Each(&gains[..end - start]))
        } else if self.is_loaded {
            (run.step, end, PieceInput::Loads)
        } else {
            (run.step, end, if self.lines { PieceInput::Lines } else { PieceInput::Volts })
        })
    }

    /// Returns what the voltage at the start of a step and, for lines, at its end, and a torque add to both states.
    #[inline(always)]
    fn gain<const FMA: bool>(&self, step: &Step<L>, [start, end, torque]: [f64; 3]) -> Pair<L> {
        let end = if self.lines { self.drives.outputs(end) } else { [0.0; L] };
        step.gain::<FMA>(&[self.drives.outputs(start), end], &loaded(self.load, torque))
    }
}
