//! Voltages that come late, as what they and the load add to both states at each step.

use super::extended::CHUNK;
use super::kernel::multiply_add;
use super::reaction::{Pair, Step};
use super::terminal::{Terminals, gain};
use super::{Problem, Signals};
use crate::motor::{DelayTaps, Extended, Parameter, Setting, Terminal, late, sample_times, step_maps};

/// The late inputs of a block of candidates, in the order of samples.
pub(super) struct LateInputs<'a, const L: usize> {
    signals: &'a Signals,
    setting: Setting,
    kind: Kind<L>,
}

enum Kind<const L: usize> {
    /// Steps even: by taps.
    Even(Box<Even<L>>),
    /// Steps not even or lines of their own: from piece to piece.
    Uneven { time: Vec<f64>, cursors: [usize; L] },
}

/// Even steps.
struct Even<const L: usize> {
    taps: [Taps; L],
    /// What one volt of each of the three samples adds to both states.
    gains: [Pair<L>; 3],
}

/// How the voltage comes late in one candidate.
#[derive(Clone, Copy)]
pub(super) struct Taps {
    pub delay: DelayTaps,
    /// What one volt of each of the three samples adds to both states.
    pub gains: [[f64; 3]; 2],
    /// The step in which the first movement begins after its latency; none waits for it without one.
    pub movement: Option<usize>,
    /// Steps whose voltage no taps give, and what it adds to both states: that one, and those in which lines begin.
    pub special: [(usize, [f64; 2]); 3],
}

/// No step.
pub(super) const NEVER: usize = usize::MAX;

/// Times of the samples where [`Taps`] need them; the same for all candidates.
pub(super) fn late_times(signals: &Signals, setting: Setting) -> Vec<f64> {
    let needed = setting.method.uses_next_input() || setting.extent.has(Parameter::Latency);
    if needed { sample_times(&signals.drive()) } else { Vec::new() }
}

impl<'a, const L: usize> LateInputs<'a, L> {
    pub(super) fn new(problem: &'a Problem, signals: &'a Signals, motors: &[Extended; L]) -> Self {
        let setting = problem.setting(signals);
        let kind = if signals.step_index.is_empty() && !signals.has_own_lines() {
            let time = late_times(signals, setting);
            let taps = std::array::from_fn(|lane| Taps::new(signals, setting, &motors[lane], &time));
            Kind::Even(Box::new(Even::new(taps)))
        } else {
            Kind::Uneven { time: sample_times(&signals.drive()), cursors: [0; L] }
        };
        Self { signals, setting, kind }
    }

    /// Writes what drives the candidates at samples `start` to `end`.
    #[inline(always)]
    pub(super) fn fill<const FMA: bool>(
        &mut self,
        (motors, terminals): (&[Extended; L], &Terminals<L>),
        steps: &[Step<L>],
        [start, end]: [usize; 2],
        gains: &mut [Pair<L>; CHUNK],
    ) {
        let Self { signals, setting, kind } = self;
        match kind {
            Kind::Even(even) => {
                let gains = &mut gains[..end - start];
                even.fill::<FMA>((signals, terminals), &steps[0].maps.torque, start, gains);
            }
            Kind::Uneven { time, cursors } => {
                let drive = signals.drive();
                let mut voltages = [[[0.0; L]; 2]; CHUNK];
                for lane in 0..L {
                    let late = late(&motors[lane], &drive, *setting, &*time);
                    for n in start..end {
                        let [first, last] = setting.held(late.line(n, &mut cursors[lane]));
                        voltages[n - start][0][lane] = first;
                        voltages[n - start][1][lane] = last;
                    }
                }
                for n in start..end {
                    let torque = terminals.torque(signals.torque.get(n).copied().unwrap_or(0.0));
                    let maps = &steps[usize::from(signals.step_of(n))].maps;
                    gains[n - start] = gain::<L, FMA>(maps, &voltages[n - start], &torque);
                }
            }
        }
    }
}

impl<const L: usize> Even<L> {
    fn new(taps: [Taps; L]) -> Self {
        let mut gains = [[[0.0; L]; 2]; 3];
        for (lane, taps) in taps.iter().enumerate() {
            for axis in 0..2 {
                for (gains, gain) in gains.iter_mut().zip(taps.gains[axis]) {
                    gains[axis][lane] = gain;
                }
            }
        }
        Self { taps, gains }
    }

    /// What voltages and torque add from sample `start` on. Each candidate's voltages are side by side in time, then in
    /// a column, so that both the drive and the taps are done for many at once.
    #[inline(always)]
    fn fill<const FMA: bool>(
        &self,
        (signals, terminals): (&Signals, &Terminals<L>),
        torque_gains: &Pair<L>,
        start: usize,
        gains: &mut [Pair<L>],
    ) {
        let mut given = [[0.0; L]; CHUNK + 2];
        let mut row = [0.0; CHUNK + 2];
        for (lane, taps) in self.taps.iter().enumerate() {
            taps.give(signals, terminals.drive(lane), start, &mut row[..gains.len() + 2]);
            for (given, row) in given.iter_mut().zip(row) {
                given[lane] = row;
            }
        }
        let torque = |n: usize| terminals.torque(signals.torque.get(n).copied().unwrap_or(0.0));
        let [one, two, three] = &self.gains;
        for (n, (gain, given)) in (start..).zip(gains.iter_mut().zip(given.windows(3))) {
            let torque = torque(n);
            // Apart from `gains`, which could be where other numbers are.
            let mut sums = [[0.0; L]; 2];
            for axis in 0..2 {
                for lane in 0..L {
                    let held =
                        multiply_add::<FMA>(three[axis][lane], given[2][lane], torque_gains[axis][lane] * torque[lane]);
                    let later = multiply_add::<FMA>(two[axis][lane], given[1][lane], held);
                    sums[axis][lane] = multiply_add::<FMA>(one[axis][lane], given[0][lane], later);
                }
            }
            *gain = sums;
        }
        for (lane, taps) in self.taps.iter().enumerate() {
            taps.mend(signals, terminals.drive(lane), start, |c, voltages| {
                if let Some(gains) = gains.get_mut(c) {
                    for axis in 0..2 {
                        gains[axis][lane] = voltages[axis] + torque_gains[axis][lane] * torque(start + c)[lane];
                    }
                }
            });
        }
    }
}

/// Voltages that the drive is told: the last lasts on.
struct Told<'a> {
    voltage: &'a [f64],
    before: f64,
}

impl<'a> Told<'a> {
    /// The first `known` of a recording.
    #[inline(always)]
    fn of(signals: &'a Signals, known: usize) -> Self {
        Self { voltage: &signals.voltage[..known], before: signals.beginning.voltage }
    }

    /// Writes those from sample `from` - `back` on.
    #[inline(always)]
    fn copy(&self, from: usize, back: usize, to: &mut [f64]) {
        let early = back.saturating_sub(from).min(to.len());
        let (before, rest) = to.split_at_mut(early);
        before.fill(self.before);
        let known = self.voltage.get((from + early).saturating_sub(back)..).unwrap_or_default();
        let (told, after) = rest.split_at_mut(known.len().min(rest.len()));
        told.copy_from_slice(&known[..told.len()]);
        after.fill(self.voltage.last().copied().unwrap_or(self.before));
    }
}

impl Taps {
    /// `time`: of [`late_times`].
    pub(super) fn new(signals: &Signals, setting: Setting, motor: &Extended, time: &[f64]) -> Self {
        let h = signals.step_s[0];
        let lines = setting.method.uses_next_input();
        let delay = DelayTaps::new(motor.get(Parameter::DeadTime) / h, lines);
        let maps = step_maps(&motor.motor.map(|p| [p]), h, setting.extent.method(setting.method));
        let gain = |voltages: [f64; 2]| {
            let [first, last] = setting.held(voltages);
            [0, 1].map(|axis| maps.taps[0][axis][0] * first + maps.taps[1][axis][0] * last)
        };
        let taps = [0, 1, 2].map(|n| gain([delay.start[n], delay.end[n]]));
        let movement = setting.extent.has(Parameter::Latency).then(|| {
            let steps = (motor.get(Parameter::DeadTime) + motor.get(Parameter::Latency)) / h;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked")]
            let at =
                if (0.0..1e9).contains(&steps) { setting.beginning.first_movement + steps as usize } else { NEVER };
            at
        });
        let begin = if lines { [delay.whole.checked_sub(1), Some(delay.whole)] } else { [None; 2] };
        let drive = signals.drive();
        let late = late(motor, &drive, setting, time);
        // What acts there is known but for a piece or two; from the first one on it would be found too.
        let acts = setting.beginning.first_movement.saturating_sub(2);
        let special = [(movement, acts), (begin[0], 0), (begin[1], 0)].map(|(at, mut acts)| {
            let at = at.filter(|at| *at < signals.len());
            at.map_or((NEVER, [0.0; 2]), |at| (at, gain(late.line(at, &mut acts))))
        });
        Self { delay, gains: [0, 1].map(|axis| taps.map(|tap| tap[axis])), movement, special }
    }

    /// The voltages behind the drive that enter the steps from `start` on: three each, the first of step n at n - `start`.
    #[inline(always)]
    fn give(&self, signals: &Signals, drive: Terminal<f64>, start: usize, row: &mut [f64]) {
        let back = self.delay.whole + 1;
        // Until the first movement acts, the voltage is as before it.
        let moves = self.movement.unwrap_or(0).saturating_sub(start).min(row.len());
        let (still, moving) = row.split_at_mut(moves);
        Told::of(signals, signals.beginning.first_movement).copy(start, back, still);
        Told::of(signals, signals.len()).copy(start + moves, back, moving);
        for voltage in row {
            *voltage = drive.gives(*voltage);
        }
    }

    /// Steps, counted from `start`, for which [`Self::give`] does not hold, and what the voltages add in them.
    #[inline(always)]
    fn mend(&self, signals: &Signals, drive: Terminal<f64>, start: usize, mut put: impl FnMut(usize, [f64; 2])) {
        // The last before the movement: two of their three voltages were given as if it had come.
        let moves = self.movement.unwrap_or(0);
        if (start..=start + CHUNK + 2).contains(&moves) {
            for n in moves.saturating_sub(2).max(start)..moves {
                let mut three = [0.0; 3];
                Told::of(signals, signals.beginning.first_movement).copy(n, self.delay.whole + 1, &mut three);
                let given = three.map(|voltage| drive.gives(voltage));
                put(n - start, self.gains.map(|taps| taps[0] * given[0] + (taps[1] * given[1] + taps[2] * given[2])));
            }
        }
        for (at, gain) in self.special.iter().filter(|(at, _)| *at >= start) {
            put(at - start, *gain);
        }
    }
}
