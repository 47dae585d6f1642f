//! Delayed inputs of `L` candidates side by side: the contribution of the delayed voltage and the load torque to both states at
//! each step.

use super::problem::Problem;
use super::signals::Signals;
use super::step::{Pair, Step, loaded};
use crate::motor::{
    Aligned, CHUNK, Commanded, DelayTaps, DelayedVoltage, DriveNonlinearity, Extended, Parameter, SimulationSettings,
    StepVoltage, multiply_add, sample_times, tap_times,
};

/// The delayed inputs of a block of candidates on one recording, computed in the order of samples.
pub(super) struct DelayedInputs<'a, const L: usize> {
    signals: &'a Signals,
    settings: SimulationSettings,
    load: [f64; L],
    clock: Clock<'a, L>,
}

enum Clock<'a, const L: usize> {
    /// Uniform steps: the delayed input is a weighted sum of samples.
    Even(Box<Taps<L>>),
    /// Irregular steps, or voltages that are linear over each step and may jump between steps: each candidate with the index of
    /// the piece of its delayed input.
    Uneven(Vec<(DelayedVoltage<'a, f64>, usize)>),
}

/// The delays of each candidate as taps, for uniform steps.
struct Taps<const L: usize> {
    delays: [DelayTaps; L],
    drives: DriveNonlinearity<[f64; L]>,
    /// Change of both states per volt of each of three successive samples.
    gains: [Pair<L>; 3],
}

impl<'a, const L: usize> DelayedInputs<'a, L> {
    pub(super) fn new(problem: &Problem, signals: &'a Signals, motors: &Extended<[f64; L]>) -> Self {
        let (settings, drive) = (problem.settings(signals), signals.drive());
        let clock = if signals.step_index.is_empty() && !signals.has_slopes() {
            let time = tap_times(&drive, settings);
            let delay = |lane| DelayTaps::new(&motors.lane(lane), drive, settings, time.clone());
            Clock::Even(Box::new(Taps::new(std::array::from_fn(delay), DriveNonlinearity::of(motors))))
        } else {
            let time = sample_times(&drive);
            let delayed = |lane| DelayedVoltage::new(&motors.lane(lane), drive, settings, time.clone());
            Clock::Uneven((0..L).map(|lane| (delayed(lane), 0)).collect())
        };
        Self { signals, settings, load: motors.get(Parameter::Load), clock }
    }

    /// Writes the contributions of the inputs at samples `start..end` to both states.
    #[inline(always)]
    pub(super) fn fill<const FMA: bool>(
        &mut self,
        steps: &[Step<L>],
        [start, end]: [usize; 2],
        gains: &mut [Pair<L>; CHUNK],
    ) {
        let Self { signals, settings, load, clock } = self;
        let gains = &mut gains[..end - start];
        let torques = Torques { torque: &signals.torque, load: *load, gains: &steps[0].maps.torque };
        match clock {
            Clock::Even(taps) => {
                let commanded = Commanded { voltage: &signals.voltage, history: settings.history };
                taps.fill::<FMA>(commanded, &torques, start, gains);
            }
            Clock::Uneven(lanes) => {
                let mut voltages = Aligned([[[0.0; L]; 2]; CHUNK]);
                let voltages = &mut voltages.0;
                let mut changes = Aligned([[[0.0; L]; 2]; CHUNK]);
                let changes = &mut changes.0;
                for (lane, (delayed, cursor)) in lanes.iter_mut().enumerate() {
                    for n in start..end {
                        let StepVoltage { ends, added } = delayed.step_voltage(n, cursor);
                        for axis in 0..2 {
                            voltages[n - start][axis][lane] = ends[axis];
                            changes[n - start][axis][lane] = added.unwrap_or_default()[axis];
                        }
                    }
                }
                for (n, (gain, (voltages, changes))) in
                    (start..).zip(gains.iter_mut().zip(voltages.iter().zip(changes)))
                {
                    *gain = steps[usize::from(signals.step_of(n))].gain::<FMA>(voltages, &torques.at(n));
                    for axis in 0..2 {
                        for lane in 0..L {
                            gain[axis][lane] += changes[axis][lane];
                        }
                    }
                }
            }
        }
    }
}

/// The load torques of a block of candidates.
struct Torques<'a, const L: usize> {
    /// Load torque of the recording \[N·m\].
    torque: &'a [f64],
    /// Constant load of each candidate \[N·m\].
    load: [f64; L],
    /// Change of both states per unit of torque in the first step.
    gains: &'a Pair<L>,
}

impl<const L: usize> Torques<'_, L> {
    /// Returns the sum of load and recorded torque at a sample \[N·m\].
    #[inline(always)]
    fn at(&self, n: usize) -> [f64; L] {
        loaded(self.load, self.torque.get(n).copied().unwrap_or(0.0))
    }
}

impl<const L: usize> Taps<L> {
    fn new(delays: [DelayTaps; L], drives: DriveNonlinearity<[f64; L]>) -> Self {
        let gain = |tap: usize| [0, 1].map(|axis| std::array::from_fn(|lane| delays[lane].gains[axis][tap]));
        Self { gains: [gain(0), gain(1), gain(2)], delays, drives }
    }

    /// Writes the contributions of voltages and torque from sample `start` on. The voltages of a candidate are computed for
    /// successive samples at once, then transposed, so that both the drive and the taps are vectorized.
    #[inline(always)]
    fn fill<const FMA: bool>(
        &self,
        commanded: Commanded<'_>,
        torques: &Torques<'_, L>,
        start: usize,
        gains: &mut [Pair<L>],
    ) {
        let mut given = Aligned([[0.0; L]; CHUNK + 2]);
        let given = &mut given.0;
        let mut row = [0.0; CHUNK + 2];
        for (lane, delay) in self.delays.iter().enumerate() {
            delay.fill(commanded, self.drives.lane(lane), start, &mut row[..gains.len() + 2]);
            for (given, row) in given.iter_mut().zip(row) {
                given[lane] = row;
            }
        }
        let [one, two, three] = &self.gains;
        for (n, (gain, given)) in (start..).zip(gains.iter_mut().zip(given.windows(3))) {
            let torque = torques.at(n);
            // A local array cannot alias the inputs, unlike `gains`, which lets the compiler vectorize.
            let mut sums = [[0.0; L]; 2];
            for axis in 0..2 {
                for lane in 0..L {
                    let constant = multiply_add::<FMA>(
                        three[axis][lane],
                        given[2][lane],
                        torques.gains[axis][lane] * torque[lane],
                    );
                    let later = multiply_add::<FMA>(two[axis][lane], given[1][lane], constant);
                    sums[axis][lane] = multiply_add::<FMA>(one[axis][lane], given[0][lane], later);
                }
            }
            *gain = sums;
        }
        for (lane, delay) in self.delays.iter().enumerate() {
            for (at, voltages) in delay.special {
                if let Some(gains) = at.checked_sub(start).and_then(|n| gains.get_mut(n)) {
                    for axis in 0..2 {
                        gains[axis][lane] = voltages[axis] + torques.gains[axis][lane] * torques.at(at)[lane];
                    }
                }
            }
        }
    }
}
