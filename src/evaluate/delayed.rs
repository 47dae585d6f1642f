//! Delayed inputs of `L` candidates side by side: the contribution of the delayed voltage and the load torque to both states at
//! each step.

use super::lanes::SUM_BLOCK;
use super::problem::Problem;
use super::signals::Signals;
use super::step::{Pair, Step};
use super::taps::{Taps, Torques};
use crate::motor::{Aligned, CHUNK, DelayedVoltage, Extended, Parameter, SimulationSettings, StepVoltage};

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
    /// Irregular steps, or voltages that are linear over each step and may jump between steps: each candidate with the index of
    /// the piece of its delayed input.
    Uneven(Vec<(DelayedVoltage<'a, f64>, usize)>),
}

impl<'a, const L: usize> DelayedInputs<'a, L> {
    #[inline(always)]
    pub(super) fn new(problem: &Problem, signals: &'a Signals, motors: &Extended<[f64; L]>) -> Self {
        let (settings, drive) = (problem.settings(signals), signals.drive());
        let clock = if signals.step_index.is_empty() && !signals.has_slopes() {
            Clock::Even(Box::new(Taps::new(motors, signals, settings)))
        } else {
            let time = signals.times();
            let delayed = |lane| DelayedVoltage::new(&motors.lane(lane), drive, settings, time.clone());
            Clock::Uneven((0..L).map(|lane| (delayed(lane), 0)).collect())
        };
        Self { signals, settings, load: motors.get(Parameter::Load), clock, first: problem.first_active(signals) }
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
            Clock::Uneven(lanes) => {
                let end = signals.len().min(start + CHUNK);
                uneven::<L, FMA>(signals, lanes, (steps, &torques), [start, end], gains);
                (end, false)
            }
        }
    }
}

/// Writes the contributions of the inputs at samples `start..end` of an irregular clock.
#[inline(always)]
fn uneven<const L: usize, const FMA: bool>(
    signals: &Signals,
    lanes: &mut [(DelayedVoltage<'_, f64>, usize)],
    (steps, torques): (&[Step<L>], &Torques<'_, L>),
    [start, end]: [usize; 2],
    gains: &mut [Pair<L>; CHUNK],
) {
    // Under a zero-order hold pieces of equal voltages are taken together.
    let holds = !signals.has_slopes() && lanes.iter().all(|(delayed, _)| delayed.holds());
    let mut voltages = Aligned([[[0.0; L]; 2]; CHUNK]);
    let voltages = &mut voltages.0;
    let mut changes = Aligned([[[0.0; L]; 2]; CHUNK]);
    let changes = &mut changes.0;
    let run_ends = if holds { signals.voltage_ends() } else { &[] };
    for (lane, (delayed, cursor)) in lanes.iter_mut().enumerate() {
        let mut n = start;
        while n < end {
            let until = if holds { delayed.constant_until([n, end], cursor, run_ends) } else { n };
            if until > n {
                let constant = delayed.output(*cursor);
                for voltages in &mut voltages[n - start..until - start] {
                    (voltages[0][lane], voltages[1][lane]) = (constant, constant);
                }
                n = until;
                continue;
            }
            let StepVoltage { ends, added } = delayed.step_voltage(n, cursor);
            for axis in 0..2 {
                voltages[n - start][axis][lane] = ends[axis];
                changes[n - start][axis][lane] = added.unwrap_or_default()[axis];
            }
            n += 1;
        }
    }
    for (n, (gain, (voltages, changes))) in (start..end).zip(gains.iter_mut().zip(voltages.iter().zip(changes))) {
        *gain = steps[usize::from(signals.step_of(n))].gain::<FMA>(voltages, &torques.at(n));
        for axis in 0..2 {
            for lane in 0..L {
                gain[axis][lane] += changes[axis][lane];
            }
        }
    }
}
