//! What drives candidates with extensions: the voltage behind the drive, on time or late, and the load torque, as what
//! they add to both states at each step.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::extended::{CHUNK, Pair, gain};
use super::kernel::multiply_add;
use super::problem::Spans;
use super::{Problem, Signals, Span};
use crate::motor::{DelayTaps, Extended, Parameter, Setting, StepMaps, late, sample_times, step_maps, terminal};

/// The inputs of a block of candidates, in the order of samples.
pub(super) struct Inputs<'a, const L: usize> {
    signals: &'a Signals,
    setting: Setting,
    load: [f64; L],
    kind: Kind<'a, L>,
}

enum Kind<'a, const L: usize> {
    /// On time: stretch by stretch.
    Spans { spans: Spans<'a>, now: Option<(usize, Pair<L>)> },
    /// Late, steps even: by taps.
    Even(Box<[Taps; L]>),
    /// Late, steps not even or lines of their own: from piece to piece.
    Uneven { time: Vec<f64>, cursors: [usize; L] },
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

impl<'a, const L: usize> Inputs<'a, L> {
    pub(super) fn new(problem: &'a Problem, signals: &'a Signals, motors: &[Extended; L]) -> Self {
        let setting = problem.setting(signals);
        let kind = if !setting.extent.is_delayed() {
            Kind::Spans { spans: problem.spans(signals), now: None }
        } else if signals.step_index.is_empty() && !signals.has_own_lines() {
            let time = late_times(signals, setting);
            let taps = |lane: usize| Taps::new(signals, setting, &motors[lane], &time);
            Kind::Even(Box::new(std::array::from_fn(taps)))
        } else {
            Kind::Uneven { time: sample_times(&signals.drive()), cursors: [0; L] }
        };
        Self { signals, setting, load: std::array::from_fn(|lane| motors[lane].get(Parameter::Load)), kind }
    }

    /// Writes what drives the candidates at samples `start` to `end`; `maps` are those of a sample's step.
    #[inline(always)]
    pub(super) fn fill<'m, const FMA: bool>(
        &mut self,
        motors: &[Extended; L],
        [start, end]: [usize; 2],
        maps: impl Fn(usize) -> &'m StepMaps<L>,
        gains: &mut [Pair<L>; CHUNK],
    ) {
        let Self { signals, setting, load, kind } = self;
        match kind {
            Kind::Spans { spans, now } => {
                let mut n = start;
                while n < end {
                    let (until, gain) = match now.filter(|(until, _)| n < *until) {
                        Some(now) => now,
                        None => match spans.next() {
                            Some(span) => *now.insert((span.end, span_gain::<L, FMA>(motors, load, maps(n), span))),
                            None => (end, [[0.0; L]; 2]),
                        },
                    };
                    let to = until.min(end);
                    gains[n - start..to - start].fill(gain);
                    n = to;
                }
            }
            Kind::Even(taps) => {
                let maps = maps(start);
                for lane in 0..L {
                    taps[lane].fill::<L, FMA>(signals, (&motors[lane], lane), [start, end], gains);
                }
                add_torque::<L, FMA>(signals, load, maps, [start, end], gains);
            }
            Kind::Uneven { time, cursors } => {
                let drive = signals.drive();
                let lines = setting.method.uses_next_input();
                let mut voltages = [[[0.0; L]; 2]; CHUNK];
                for lane in 0..L {
                    let motor = &motors[lane];
                    let piece = |n: usize| {
                        let start = terminal(motor, drive.voltage[n]);
                        [start, if lines { terminal(motor, drive.end(n)) } else { start }]
                    };
                    let late = late(motor, *setting, time, piece);
                    for n in start..end {
                        let [first, last] = setting.held(late.line(n, drive.step(n), &mut cursors[lane]));
                        voltages[n - start][0][lane] = first;
                        voltages[n - start][1][lane] = last;
                    }
                }
                for n in start..end {
                    let [first, last] = &voltages[n - start];
                    let torque = load.map(|load| load + signals.torque.get(n).copied().unwrap_or(0.0));
                    gains[n - start] = gain::<L, FMA>(maps(n), [first, last], &torque);
                }
            }
        }
    }
}

/// What drives the candidates over a stretch.
#[inline(always)]
fn span_gain<const L: usize, const FMA: bool>(
    motors: &[Extended; L],
    load: &[f64; L],
    maps: &StepMaps<L>,
    span: &Span,
) -> Pair<L> {
    let [start, end] = span.voltage.map(|v| std::array::from_fn(|lane| terminal(&motors[lane], v)));
    gain::<L, FMA>(maps, [&start, &end], &load.map(|load| load + span.torque))
}

#[inline(always)]
fn add_torque<const L: usize, const FMA: bool>(
    signals: &Signals,
    load: &[f64; L],
    maps: &StepMaps<L>,
    [start, end]: [usize; 2],
    gains: &mut [Pair<L>; CHUNK],
) {
    for n in start..end {
        let torque = signals.torque.get(n).copied().unwrap_or(0.0);
        for axis in 0..2 {
            for lane in 0..L {
                let gain = &mut gains[n - start][axis][lane];
                *gain = multiply_add::<FMA>(maps.torque[axis][lane], load[lane] + torque, *gain);
            }
        }
    }
}

/// Voltages that the drive is told: the last lasts on.
struct Told<'a> {
    voltage: &'a [f64],
    before: f64,
}

impl Told<'_> {
    #[inline(always)]
    fn at(&self, n: Option<usize>) -> f64 {
        let last = self.voltage.len().wrapping_sub(1);
        n.and_then(|n| self.voltage.get(n.min(last))).copied().unwrap_or(self.before)
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
        let late = late(motor, setting, time, |n| {
            let start = terminal(motor, drive.voltage[n]);
            [start, if lines { terminal(motor, drive.end(n)) } else { start }]
        });
        // What acts there is known but for a piece or two; from the first one on it would be found too.
        let acts = setting.beginning.first_movement.saturating_sub(2);
        let special = [(movement, acts), (begin[0], 0), (begin[1], 0)].map(|(at, mut acts)| {
            let at = at.filter(|at| *at < signals.len());
            at.map_or((NEVER, [0.0; 2]), |at| (at, gain(late.line(at, h, &mut acts))))
        });
        Self { delay, gains: [0, 1].map(|axis| taps.map(|tap| tap[axis])), movement, special }
    }

    /// What the voltages add to both states of one candidate.
    #[inline(always)]
    fn fill<const L: usize, const FMA: bool>(
        &self,
        signals: &Signals,
        (motor, lane): (&Extended, usize),
        [start, end]: [usize; 2],
        gains: &mut [Pair<L>; CHUNK],
    ) {
        let moves = self.movement.unwrap_or(0).clamp(start, end);
        // Until the first movement acts, the voltage is as before it.
        for (from, to, known) in [(start, moves, signals.beginning.first_movement), (moves, end, signals.len())] {
            let told = Told { voltage: &signals.voltage[..known], before: signals.beginning.voltage };
            self.fill_part::<L, FMA>(&told, (motor, lane), from, &mut gains[from - start..to - start]);
        }
        for (at, gain) in self.special.iter().filter(|(at, _)| (start..end).contains(at)) {
            (gains[at - start][0][lane], gains[at - start][1][lane]) = (gain[0], gain[1]);
        }
    }

    /// The same under the voltages `told`.
    #[inline(always)]
    fn fill_part<const L: usize, const FMA: bool>(
        &self,
        told: &Told<'_>,
        (motor, lane): (&Extended, usize),
        start: usize,
        gains: &mut [Pair<L>],
    ) {
        let mut given = [0.0; CHUNK + 2];
        for (n, given) in (start..).zip(given[..gains.len() + 2].iter_mut()) {
            *given = terminal(motor, told.at(n.checked_sub(self.delay.whole + 1)));
        }
        for axis in 0..2 {
            let [one, two, three] = self.gains[axis];
            for (n, gain) in gains.iter_mut().enumerate() {
                let later = multiply_add::<FMA>(two, given[n + 1], three * given[n + 2]);
                gain[axis][lane] = multiply_add::<FMA>(one, given[n], later);
            }
        }
    }
}
