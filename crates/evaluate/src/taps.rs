//! Delayed inputs of `L` candidates side by side on an even clock, as three taps for each candidate.

use super::signals::Signals;
use super::step::{Pair, loaded};
use motorfit_motor::{
    Aligned, Bend, CHUNK, Commanded, DelayTaps, DriveNonlinearity, Extended, GROUP, InputHistory, Parameter,
    SimulationSettings, SpecialStep, TapGains, interleave, multiply_add, needs_times,
};
use std::sync::Arc;

/// The load torques of a block of candidates.
pub(super) struct Torques<'a, const L: usize> {
    /// Load torque of the recording \[N·m\].
    pub torque: &'a [f64],
    /// Constant load of each candidate \[N·m\].
    pub load: [f64; L],
    /// Change of both states per unit of torque in the first step.
    pub gains: &'a Pair<L>,
    /// True if no torque acts.
    pub is_zero: bool,
}

impl<const L: usize> Torques<'_, L> {
    /// Returns the sum of load and recorded torque at a sample \[N·m\].
    #[inline(always)]
    pub(super) fn at(&self, n: usize) -> [f64; L] {
        loaded(self.load, self.torque.get(n).copied().unwrap_or(0.0))
    }
}

/// The delays of each candidate as taps, for uniform steps.
pub(super) struct Taps<const L: usize> {
    delays: [DelayTaps; L],
    drives: DriveNonlinearity<[f64; L]>,
    /// True if the voltage at the motor may differ from the commanded one.
    is_driven: bool,
    /// Change of both states per volt of each of three successive samples.
    gains: Aligned<[Pair<L>; 3]>,
    /// Steps of candidates that the taps do not cover, in the order of steps, and the number of those that have passed.
    special: Vec<Special>,
    passed: usize,
    /// End of the samples in which the commanded voltage of each candidate is known to be constant.
    until: [usize; L],
    /// Commanded voltages from outside of the recording, or from before and after the first movement, of each candidate.
    rows: Vec<[f64; CHUNK + 2]>,
    /// Voltages of all candidates at successive samples.
    given: Vec<Aligned<[f64; L]>>,
}

/// A step of a candidate that the taps do not cover.
struct Special {
    lane: usize,
    step: SpecialStep,
}

/// Smallest number of samples with constant inputs that are simulated as one piece.
const CONSTANT_MIN: usize = 16;

impl<const L: usize> Taps<L> {
    #[inline(always)]
    pub(super) fn new(motors: &Extended<[f64; L]>, signals: &Signals, settings: SimulationSettings) -> Self {
        let (drive, features) = (signals.drive(), settings.features);
        let time = if needs_times(settings) { signals.times() } else { Arc::default() };
        let gains = TapGains::new(motors, drive.step_s[0], settings);
        let delay = |lane| DelayTaps::new(&motors.lane(lane), (&gains, lane), drive, settings, time.clone());
        let delays: [DelayTaps; L] = std::array::from_fn(delay);
        let mut special = Vec::new();
        for (lane, delay) in delays.iter().enumerate() {
            let steps = delay.special.into_iter().filter(|step| step.at < signals.len());
            special.extend(steps.map(|step| Special { lane, step }));
        }
        // The sort is stable: a later entry of a candidate replaces an earlier one.
        special.sort_by_key(|special| special.step.at);
        Self {
            delays,
            drives: DriveNonlinearity::of(motors),
            is_driven: DriveNonlinearity::<f64>::is_nonlinear(features) || features.has(Parameter::Offset),
            gains: Aligned(gains.gains),
            special,
            passed: 0,
            until: [0; L],
            rows: vec![[0.0; CHUNK + 2]; L],
            given: vec![Aligned([0.0; L]); CHUNK + 2],
        }
    }

    /// Returns the end of the piece from `start` to at most `last`, and whether its inputs are constant. Writes the contributions of
    /// voltages and torque: one for all samples if they are constant, else one for each.
    #[inline(always)]
    pub(super) fn next<const FMA: bool>(
        &mut self,
        (signals, history): (&Signals, InputHistory),
        torques: &Torques<'_, L>,
        [start, last]: [usize; 2],
        gains: &mut [Pair<L>; CHUNK],
    ) -> (usize, bool) {
        let commanded = Commanded { voltage: &signals.voltage, history };
        let constant =
            if signals.torque.is_empty() { self.constant_until(commanded, signals, start).min(last) } else { start };
        let is_constant = constant >= start + CONSTANT_MIN;
        let end = if is_constant { constant } else { last.min(start + CHUNK) };
        let count = if is_constant { 1 } else { end - start };
        let gains = &mut gains[..count];
        self.interleave(commanded, start, count + 2);
        if torques.is_zero {
            self.respond::<FMA, false>(torques, start, gains);
        } else {
            self.respond::<FMA, true>(torques, start, gains);
        }
        while let Some(Special { step: SpecialStep { at, change, .. }, lane }) = self.special.get(self.passed)
            && *at < end
        {
            for axis in 0..2 {
                if let Some(gains) = at.checked_sub(start).and_then(|n| gains.get_mut(n)) {
                    gains[axis][*lane] = change[axis] + torques.gains[axis][*lane] * torques.at(*at)[*lane];
                }
            }
            self.passed += 1;
        }
        (end, is_constant)
    }

    /// Returns the end of the samples from `start` on in which the input of every candidate is constant.
    #[inline(always)]
    fn constant_until(&mut self, commanded: Commanded<'_>, signals: &Signals, start: usize) -> usize {
        // Steps before `start` were not simulated.
        let mut first = self.special.get(self.passed).map_or(usize::MAX, |special| special.step.at);
        for (until, delay) in self.until.iter_mut().zip(&self.delays) {
            if first < start + CONSTANT_MIN {
                break;
            }
            if *until < start + CONSTANT_MIN {
                *until = delay.constant_until(commanded, signals.voltage_ends(), start);
            }
            first = first.min(*until);
        }
        first
    }

    /// Brings the voltages of each candidate, which are consecutive in memory, to `given`, where those of a sample are.
    #[inline(always)]
    fn interleave(&mut self, commanded: Commanded<'_>, start: usize, count: usize) {
        let Self { delays, rows, given, .. } = self;
        let given = &mut given[..count];
        let (delays, _) = delays.as_chunks::<GROUP>();
        let (rows, _) = rows.as_chunks_mut::<GROUP>();
        for (group, (delays, rows)) in delays.iter().zip(rows).enumerate() {
            let mut sources: [&[f64]; GROUP] = [&[]; GROUP];
            for (source, (delay, row)) in sources.iter_mut().zip(delays.iter().zip(rows)) {
                *source = if let Some(first) = delay.source(commanded, start, count) {
                    &commanded.voltage[first..first + count]
                } else {
                    delay.fill(commanded, start, &mut row[..count]);
                    &row[..count]
                };
            }
            interleave(sources, given, GROUP * group, |volts, _| *volts);
        }
        if self.is_driven {
            for Aligned(voltages) in given {
                self.drives.drive(voltages);
            }
        }
    }

    /// Returns true if the voltage of a candidate changes within a step of the last piece, whose inputs are not constant.
    #[inline(always)]
    pub(super) fn has_bend(&self, step: usize) -> bool {
        let [Aligned(before), Aligned(after)] = [&self.given[step], &self.given[step + 1]];
        let mut largest = 0.0;
        for lane in 0..L {
            let change = (after[lane] - before[lane]).abs();
            largest = if change > largest { change } else { largest };
        }
        largest > 0.0
    }

    /// Returns the change of the voltage of a candidate within a step of the last piece, which began at sample `start` and whose inputs
    /// are not constant.
    #[inline(always)]
    pub(super) fn bend(&self, (start, step): (usize, usize), lane: usize) -> Bend<f64> {
        let special = self.special[..self.passed].iter().rev().take_while(|special| special.step.at >= start);
        let own = special.into_iter().find(|special| special.step.at == start + step && special.lane == lane);
        let added = match own {
            Some(special) => special.step.added,
            None => {
                let jump = self.given[step + 1].0[lane] - self.given[step].0[lane];
                [0, 1].map(|axis| self.gains.0[1][axis][lane] * jump)
            }
        };
        Bend { at: self.delays[lane].bend_at, added }
    }

    /// Writes the contributions of the voltages in `given`, and those of the torque if `LOADED` is true.
    #[inline(always)]
    fn respond<const FMA: bool, const LOADED: bool>(
        &self,
        torques: &Torques<'_, L>,
        start: usize,
        gains: &mut [Pair<L>],
    ) {
        let Self { gains: Aligned([one, two, three]), given, .. } = self;
        let (load, of_load) = (torques.load, torques.gains);
        for (n, gain) in gains.iter_mut().enumerate() {
            let torque = if LOADED { torques.torque.get(start + n).copied().unwrap_or(0.0) } else { 0.0 };
            // A local array cannot alias the inputs, unlike `gains`, which lets the compiler vectorize.
            let mut sums = [[0.0; L]; 2];
            for axis in 0..2 {
                for lane in 0..L {
                    let mut sum = three[axis][lane] * given[n + 2].0[lane];
                    if LOADED {
                        sum = multiply_add::<FMA>(of_load[axis][lane], load[lane] + torque, sum);
                    }
                    sum = multiply_add::<FMA>(two[axis][lane], given[n + 1].0[lane], sum);
                    sums[axis][lane] = multiply_add::<FMA>(one[axis][lane], given[n].0[lane], sum);
                }
            }
            *gain = sums;
        }
    }
}
