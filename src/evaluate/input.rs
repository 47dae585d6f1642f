//! What drives `L` candidates side by side, in pieces of samples under one step.

use super::extended::CHUNK;
use super::kernel::{SUM_BLOCK, multiply_add};
use super::late::LateInputs;
use super::problem::Stretches;
use super::reaction::{Pair, Step};
use super::span::Stretch;
use super::terminal::Terminals;
use super::{Problem, Signals};
use crate::motor::{Extended, Parameter};

/// What drives the candidates at one sample.
pub(super) trait Input<const L: usize>: Copy {
    /// What it adds to a state of a candidate.
    fn adds<const FMA: bool>(self, step: &Step<L>, axis: usize, lane: usize) -> f64;
}

/// What is added, known.
impl<const L: usize> Input<L> for &Pair<L> {
    #[inline(always)]
    fn adds<const FMA: bool>(self, _: &Step<L>, axis: usize, lane: usize) -> f64 {
        self[axis][lane]
    }
}

/// A voltage that is held.
impl<const L: usize> Input<L> for f64 {
    #[inline(always)]
    fn adds<const FMA: bool>(self, step: &Step<L>, axis: usize, lane: usize) -> f64 {
        step.maps.taps[0][axis][lane] * self
    }
}

/// A line of voltage.
impl<const L: usize> Input<L> for [f64; 2] {
    #[inline(always)]
    fn adds<const FMA: bool>(self, step: &Step<L>, axis: usize, lane: usize) -> f64 {
        let [start, end] = &step.maps.taps;
        multiply_add::<FMA>(end[axis][lane], self[1], start[axis][lane] * self[0])
    }
}

/// A line of voltage and a torque, with what acts always.
impl<const L: usize> Input<L> for [f64; 3] {
    #[inline(always)]
    fn adds<const FMA: bool>(self, step: &Step<L>, axis: usize, lane: usize) -> f64 {
        let ([start, end], torque) = (&step.maps.taps, &step.maps.torque);
        let load = multiply_add::<FMA>(torque[axis][lane], self[2], step.bias[axis][lane]);
        multiply_add::<FMA>(end[axis][lane], self[1], multiply_add::<FMA>(start[axis][lane], self[0], load))
    }
}

/// Samples under one step.
pub(super) struct Piece<'g, const L: usize> {
    pub step: usize,
    pub range: [usize; 2],
    pub driven: Driven<'g, L>,
}

/// What drives the samples of a piece.
pub(super) enum Driven<'g, const L: usize> {
    /// The same at each.
    Held(&'g Pair<L>),
    /// Known at each.
    Each(&'g [Pair<L>]),
    /// The voltage of the recording as it is.
    Volts,
    /// Lines of it.
    Lines,
    /// Lines of it, torque, and what acts always.
    Loads,
}

/// What drives a block of candidates on one recording.
pub(super) struct Inputs<'a, const L: usize> {
    signals: &'a Signals,
    motors: &'a [Extended; L],
    terminals: Terminals<L>,
    kind: Kind<'a, L>,
    /// What drives the samples of a piece, where that is made before.
    gains: [Pair<L>; CHUNK],
    /// The next sample.
    at: usize,
}

enum Kind<'a, const L: usize> {
    /// Some samples at a time: those that are ready.
    Late(LateInputs<'a, L>, [usize; 2]),
    OnTime(OnTime<'a>),
}

impl<'a, const L: usize> Inputs<'a, L> {
    #[inline(always)]
    pub(super) fn new(problem: &'a Problem, signals: &'a Signals, motors: &'a [Extended; L]) -> Self {
        let at = problem.first_active(signals);
        let kind = if problem.extent().is_delayed() {
            Kind::Late(LateInputs::new(problem, signals, motors), [at; 2])
        } else {
            Kind::OnTime(OnTime::new(problem, signals))
        };
        Self { signals, motors, terminals: Terminals::new(motors), kind, gains: [[[0.0; L]; 2]; CHUNK], at }
    }

    /// The next piece.
    #[inline(always)]
    pub(super) fn next<const FMA: bool>(&mut self, steps: &[Step<L>]) -> Option<Piece<'_, L>> {
        let Self { signals, motors, terminals, kind, gains, at } = self;
        let start = *at;
        let (step, end, driven) = match kind {
            Kind::Late(late, ready) => {
                if start == ready[1] {
                    *ready = [start, signals.len().min(start + CHUNK)];
                    late.fill::<FMA>((motors, terminals), steps, *ready, gains);
                }
                let step = signals.step_of(start);
                let end = (start..ready[1]).find(|&n| signals.step_of(n) != step).unwrap_or(ready[1]);
                (step, end, Driven::Each(&gains[start - ready[0]..end - ready[0]]))
            }
            Kind::OnTime(on_time) => on_time.next::<FMA, L>((signals, terminals), steps, start, gains)?,
        };
        *at = end;
        (end > start).then_some(Piece { step: usize::from(step), range: [start, end], driven })
    }
}

/// Inputs that come on time: from stretch to stretch.
struct OnTime<'a> {
    stretches: Stretches<'a>,
    now: Option<&'a Stretch>,
    /// Samples of a piece at most.
    most: usize,
    /// Whether the drive makes another voltage of each.
    is_driven: bool,
    /// Whether anything but the voltage acts.
    is_loaded: bool,
    /// Whether steps use the voltage at their end too.
    lines: bool,
}

impl<'a> OnTime<'a> {
    fn new(problem: &Problem, signals: &'a Signals) -> Self {
        let extent = problem.extent();
        Self {
            stretches: problem.stretches(signals),
            now: None,
            most: if extent.is_averaged() { CHUNK } else { SUM_BLOCK },
            is_driven: extent.has_any(&[Parameter::Deadband, Parameter::Saturation, Parameter::NegativeGain]),
            is_loaded: extent.is_biased() || !signals.torque.is_empty(),
            lines: problem.model().discretization.uses_next_input(),
        }
    }

    /// The piece from `start` on: its step, its end, and what drives it.
    #[inline(always)]
    fn next<'g, const FMA: bool, const L: usize>(
        &mut self,
        (signals, terminals): (&Signals, &Terminals<L>),
        steps: &[Step<L>],
        start: usize,
        gains: &'g mut [Pair<L>; CHUNK],
    ) -> Option<(u16, usize, Driven<'g, L>)> {
        if self.now.is_none_or(|stretch| stretch.span.end == start) {
            self.now = self.stretches.next();
            if let Some(Stretch { span, held: true }) = self.now {
                let inputs = [span.voltage[0], span.voltage[1], span.torque];
                gains[0] = terminals.gain::<FMA>(&steps[usize::from(span.step)].maps, inputs, self.lines);
            }
        }
        let Stretch { span, held } = self.now?;
        let end = span.end.min(start + self.most);
        Some(if *held {
            (span.step, end, Driven::Held(&gains[0]))
        } else if self.is_driven {
            let end = end.min(start + CHUNK);
            let maps = &steps[usize::from(span.step)].maps;
            for (n, gain) in (start..end).zip(gains.iter_mut()) {
                *gain = terminals.gain::<FMA>(maps, signals.inputs(n), self.lines);
            }
            (span.step, end, Driven::Each(&gains[..end - start]))
        } else if self.is_loaded {
            (span.step, end, Driven::Loads)
        } else {
            (span.step, end, if self.lines { Driven::Lines } else { Driven::Volts })
        })
    }
}
