//! Delayed inputs of `L` candidates side by side: the contribution of the delayed voltage and the load torque to both states at
//! each step.

use super::lanes::SUM_BLOCK;
use super::problem::Problem;
use super::signals::Signals;
use super::step::{Bends, Pair, Step};
use super::taps::{Taps, Torques};
use super::uneven::Uneven;
use motorfit_motor::{Bend, CHUNK, Extended, Parameter, SimulationSettings};

/// The delayed inputs of a block of candidates on one recording, computed in the order of samples.
pub(super) struct DelayedInputs<'a, const L: usize> {
    signals: &'a Signals,
    settings: SimulationSettings,
    load: [f64; L],
    clock: Clock<'a, L>,
    /// Index of the first sample that is simulated.
    first: usize,
}

enum Clock<'a, const L: usize> {
    /// Uniform steps: the delayed input is a weighted sum of samples.
    Even(Box<Taps<L>>),
    /// Irregular steps, or voltages that are linear over each step and may jump between steps.
    Uneven(Box<Uneven<'a, L>>),
}

/// Changes of the voltages of a block of candidates within the steps of a piece.
#[derive(Clone, Copy)]
pub(super) enum VoltageChanges<'a, const L: usize> {
    /// Voltages change at samples only.
    None,
    /// Changes of taps, with the first sample of the piece.
    Even(&'a Taps<L>, usize),
    Uneven(&'a Uneven<'a, L>),
}

impl<const L: usize> Bends for VoltageChanges<'_, L> {
    #[inline(always)]
    fn is_any(self, step: usize) -> bool {
        match self {
            Self::None => false,
            Self::Even(taps, _) => taps.has_bend(step),
            Self::Uneven(uneven) => uneven.has_bend(step),
        }
    }

    #[inline(always)]
    fn at(self, step: usize, lane: usize) -> Option<Bend<f64>> {
        match self {
            Self::None => None,
            Self::Even(taps, start) => Some(taps.bend((start, step), lane)),
            Self::Uneven(uneven) => uneven.bend(step, lane),
        }
    }
}

impl<'a, const L: usize> DelayedInputs<'a, L> {
    #[inline(always)]
    pub(super) fn new(problem: &Problem, signals: &'a Signals, motors: &Extended<[f64; L]>) -> Self {
        let settings = problem.settings(signals);
        let clock = if signals.step_index.is_empty() && !signals.has_slopes() {
            Clock::Even(Box::new(Taps::new(motors, signals, settings)))
        } else {
            Clock::Uneven(Box::new(Uneven::new(motors, signals, settings)))
        };
        Self { signals, settings, load: motors.get(Parameter::Load), clock, first: problem.first_active(signals) }
    }

    /// Returns the changes of the voltages within the steps of the last piece, which began at sample `start`.
    #[inline(always)]
    pub(super) fn changes(&self, start: usize) -> VoltageChanges<'_, L> {
        match &self.clock {
            Clock::Even(taps) => VoltageChanges::Even(taps, start),
            Clock::Uneven(uneven) => VoltageChanges::Uneven(uneven),
        }
    }

    /// Returns the end of the piece that begins at sample `start`, and whether its inputs are constant. Writes the contributions of
    /// the inputs to both states: one for all samples if they are constant, else one for each.
    #[inline(always)]
    pub(super) fn next<const FMA: bool>(
        &mut self,
        steps: &[Step<L>],
        start: usize,
        gains: &mut [Pair<L>; CHUNK],
    ) -> (usize, bool) {
        let Self { signals, settings, load, clock, first } = self;
        let is_zero = signals.torque.is_empty() && !settings.features.has(Parameter::Load);
        let torques = Torques { torque: &signals.torque, load: *load, gains: &steps[0].maps.torque, is_zero };
        match clock {
            Clock::Even(taps) => {
                // No piece crosses a multiple of the block of sums, so that sums do not depend on the pieces.
                let last = signals.len().min(start + SUM_BLOCK - (start - *first) % SUM_BLOCK);
                taps.next::<FMA>((signals, settings.history), &torques, [start, last], gains)
            }
            Clock::Uneven(uneven) => {
                let end = signals.len().min(start + CHUNK);
                uneven.next::<FMA>(signals, (steps, &torques), [start, end], gains);
                (end, false)
            }
        }
    }
}
