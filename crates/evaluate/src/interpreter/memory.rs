//! Operations with a memory: delays of signals and moving averages of sensors, lane by lane.
//!
//! A signal has the integral S, which is linear between samples if the signal is constant over each step, and quadratic if it is linear.
//! Over a step, or a substep, from t of length h the signal with the delay d has the mean `(S(t+h−d) − S(t−d))/h`. At the instant t it
//! has its value at t−d, where it is linear, and otherwise the mean over a short h, which is that value but just before a jump (see
//! [`Substep::JUMP`]). Before the first sample a signal has its first value.
//! With a latency it keeps that value until the latency after its first movement has passed too. A sensor's moving average is that
//! of the DC motor (`motor/sensor.rs`).

use super::register::{Register, WIDTH};
use super::sensor::Sensor;
use motorfit_core::numeric::{count, whole};
use motorfit_model::step::Substep;
use motorfit_motor::MovingAverage;

/// Samples that a memory keeps at most. A longer delay or window counts from the oldest sample kept.
pub(super) const KEPT_MAX: usize = 1 << 20;
/// Samples of a ring beside those of the delay or window.
const MARGIN: usize = 3;

/// Steps of a recording, for delays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Clock {
    /// Step after each sample \[s\]; one value if the clock is regular.
    pub step_s: Vec<f64>,
    /// Time at which the inputs first change, from the first sample \[s\]; +∞ if they do not.
    pub first_change_s: f64,
    /// Number of samples.
    pub samples: usize,
}

impl Clock {
    pub fn step(&self, n: usize) -> f64 {
        self.step_s.get(n).or(self.step_s.last()).copied().unwrap_or(1.0)
    }

    pub fn shortest(&self) -> f64 {
        self.step_s.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// Values of a memory at a sample: of a signal, and of its derivative.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry<const C: usize> {
    pub value: Register<C>,
    pub rate: Register<C>,
}

/// A signal at a time: its integral and value, the derivatives of both with respect to parameters, its slope over time, and the time since
/// its sample \[s\].
struct Reached {
    sum: f64,
    sum_rate: f64,
    value: f64,
    value_rate: f64,
    slope: f64,
    since: f64,
}

/// The memory of one operation.
#[derive(Debug)]
pub(crate) struct Memory<const C: usize> {
    /// Ring buffer of the last samples.
    past: Vec<Entry<C>>,
    /// Integrals up to each sample of the ring, for delays.
    integrals: Vec<Entry<C>>,
    /// Time of each sample of the ring, from the first sample \[s\].
    times: Vec<f64>,
    /// Samples at the delayed ends and beginnings of the last substep, for each lane: the next ones lie there or a little later.
    found: Vec<[usize; 2]>,
    first: Option<Entry<C>>,
    sums: Entry<C>,
    n: usize,
    time: f64,
    /// Past of a signal that a sensor shows with a filter and a delay.
    pub sensor: Sensor<C>,
}

pub(super) const fn zero<const C: usize>() -> Entry<C> {
    Entry { value: Register::ZERO, rate: Register::ZERO }
}

impl<const C: usize> Memory<C> {
    pub fn new() -> Self {
        Self {
            past: Vec::new(),
            integrals: Vec::new(),
            times: Vec::new(),
            found: Vec::new(),
            first: None,
            sums: zero(),
            n: 0,
            time: 0.0,
            sensor: Sensor::new(),
        }
    }

    /// Makes a ring for `samples` samples, but no more than the recording has. Its size is a power of two, whose remainders are cheap.
    fn reserve(&mut self, samples: f64, clock: &Clock, with_integrals: bool) {
        let samples = whole(samples.clamp(1.0, count(KEPT_MAX - MARGIN))).min(clock.samples.max(1)) + MARGIN;
        let samples = samples.next_power_of_two();
        self.past = vec![zero(); samples];
        if with_integrals {
            self.integrals = vec![zero(); samples];
            self.times = vec![0.0; samples];
            self.found = vec![[0; 2]; Register::<C>::LANES];
        }
    }

    /// Returns the place of a sample in the ring.
    #[inline(always)]
    fn place(&self, sample: usize) -> usize {
        sample & (self.past.len() - 1)
    }

    /// Returns the mean over a substep of a delayed signal, or its value at an instant, and its derivative. `signal`, `delay`, `latency` and
    /// `end` have a value and a rate each; `end` is a signal at the end of the step if it is linear over the step.
    pub fn delayed(
        &mut self,
        (clock, substep): (&Clock, Substep),
        [signal, delay, latency]: [[&Register<C>; 2]; 3],
        end: Option<[&Register<C>; 2]>,
    ) -> [Register<C>; 2] {
        let entry = Entry { value: *signal[0], rate: *signal[1] };
        let later = end.map_or(entry, |end| Entry { value: *end[0], rate: *end[1] });
        if self.first.is_none() {
            self.first = Some(entry);
            let largest = (0..Register::<C>::LANES).map(|lane| delay[0].lane(lane)).fold(0.0, f64::max);
            self.reserve((largest / clock.shortest()).ceil() + 1.0, clock, true);
            self.sums = zero();
        }
        let first = self.first.unwrap_or(entry);
        let at = self.place(self.n);
        let step = clock.step(self.n);
        let is_instant = substep.of == 0;
        let h = step / f64::from(if is_instant { Substep::JUMP } else { substep.of });
        let from = self.time + f64::from(substep.place) * h;
        self.past[at] = entry;
        self.integrals[at] = self.sums;
        self.times[at] = self.time;
        if end.is_some() {
            let next = self.place(self.n + 1);
            (self.past[next], self.times[next]) = (later, self.time + step);
        }
        let is_linear = end.is_some();
        let mut result = [Register::ZERO; 2];
        for lane in 0..Register::<C>::LANES {
            let d = delay[0].lane(lane).max(0.0);
            let slope = delay[1].lane(lane);
            let (start, begun) = self.integral((from - d, lane), &first, (self.found[lane][1], is_linear));
            let (mut mean, mut rate);
            if is_instant && is_linear {
                self.found[lane][1] = begun;
                (mean, rate) = (start.value, start.value_rate - start.slope * slope);
            } else {
                let (end, ended) = self.integral((from + h - d, lane), &first, (self.found[lane][0], is_linear));
                self.found[lane] = [ended, begun];
                if is_instant {
                    // Of a jump within h the part after it; without one the value itself, free of the rounding of integrals. Its
                    // derivative is that of the held signal beside the jump: that of the jump would hold descents there.
                    let part = (end.since / h).clamp(0.0, 1.0);
                    mean = start.value + part * (end.value - start.value);
                    rate = start.value_rate + part * (end.value_rate - start.value_rate);
                } else {
                    mean = (end.sum - start.sum) / h;
                    rate = (end.sum_rate - start.sum_rate) / h - (end.value - start.value) / h * slope;
                }
            }
            let wait = latency[0].lane(lane);
            if wait > 0.0 {
                let begin = clock.first_change_s + d + wait;
                let held = ((begin - from) / h).clamp(0.0, 1.0);
                if held > 0.0 {
                    let slope =
                        if held < 1.0 && !is_instant { (delay[1].lane(lane) + latency[1].lane(lane)) / h } else { 0.0 };
                    rate = (1.0 - held) * rate + held * first.rate.lane(lane) - slope * (mean - first.value.lane(lane));
                    mean = (1.0 - held) * mean + held * first.value.lane(lane);
                }
            }
            result[0].set(lane, mean);
            result[1].set(lane, rate);
        }
        for part in 0..C {
            for lane in 0..WIDTH {
                let mean = |from: &Register<C>, to: &Register<C>| match is_linear {
                    true => 0.5 * (from.0[part][lane] + to.0[part][lane]),
                    false => from.0[part][lane],
                };
                self.sums.value.0[part][lane] += step * mean(&entry.value, &later.value);
                self.sums.rate.0[part][lane] += step * mean(&entry.rate, &later.rate);
            }
        }
        self.n += 1;
        self.time += step;
        result
    }

    /// Returns the signal of a lane at a time; then the sample there, which is sought from the one `found` before. The present sample
    /// lasts on.
    #[inline(always)]
    fn integral(
        &self,
        (time, lane): (f64, usize),
        first: &Entry<C>,
        (found, is_linear): (usize, bool),
    ) -> (Reached, usize) {
        if time <= 0.0 {
            let (value, value_rate) = (first.value.lane(lane), first.rate.lane(lane));
            let (sum, sum_rate) = (value * time, value_rate * time);
            return (Reached { sum, sum_rate, value, value_rate, slope: 0.0, since: 0.0 }, found);
        }
        let sample = self.sample_at(time + 1e-12 * self.time, found);
        let at = self.place(sample);
        let since = time - self.times[at];
        let (past, sums) = (&self.past[at], &self.integrals[at]);
        let (value, value_rate) = (past.value.lane(lane), past.rate.lane(lane));
        let (sum, sum_rate) = (sums.value.lane(lane) + since * value, sums.rate.lane(lane) + since * value_rate);
        if !is_linear {
            return (Reached { sum, sum_rate, value, value_rate, slope: 0.0, since }, sample);
        }
        let next = self.place(sample + 1);
        let step = self.times[next] - self.times[at];
        let [slope, slope_rate] =
            [self.past[next].value.lane(lane) - value, self.past[next].rate.lane(lane) - value_rate]
                .map(|change| change / step);
        let reached = Reached {
            sum: sum + 0.5 * since * since * slope,
            sum_rate: sum_rate + 0.5 * since * since * slope_rate,
            value: value + since * slope,
            value_rate: value_rate + since * slope_rate,
            slope,
            since,
        };
        (reached, sample)
    }

    /// Returns the last sample of the ring that is not later than a time; the oldest if all are. With a delay that is constant it is the
    /// one found before, or the next.
    #[inline(always)]
    fn sample_at(&self, time: f64, found: usize) -> usize {
        // The ring has at least four places; one is that of the next sample.
        let oldest = self.n - self.n.min(self.past.len() - 2);
        let mut sample = found.max(oldest);
        if self.times[self.place(sample)] > time {
            return self.bisected(time, oldest);
        }
        while sample < self.n && self.times[self.place(sample + 1)] <= time {
            sample += 1;
        }
        sample
    }

    #[cold]
    fn bisected(&self, time: f64, oldest: usize) -> usize {
        let (mut sample, mut later) = (oldest, self.n + 1);
        while sample + 1 < later {
            let middle = usize::midpoint(sample, later);
            if self.times[self.place(middle)] > time { later = middle } else { sample = middle }
        }
        sample
    }

    /// Returns the moving average of a signal, and its derivative; the window is a number of samples.
    pub fn averaged(&mut self, clock: &Clock, [signal, window]: [[&Register<C>; 2]; 2]) -> [Register<C>; 2] {
        let entry = Entry { value: *signal[0], rate: *signal[1] };
        let lanes = Register::<C>::LANES;
        if self.first.is_none() {
            self.first = Some(entry);
            let largest = (0..lanes).map(|lane| window[0].lane(lane)).fold(1.0, f64::max);
            self.reserve(largest.ceil() + 1.0, clock, false);
            for lane in 0..lanes {
                let (whole, _) = MovingAverage::new(window[0].lane(lane).max(1.0));
                self.sums.value.set(lane, count(whole) * entry.value.lane(lane));
                self.sums.rate.set(lane, count(whole) * entry.rate.lane(lane));
            }
        }
        let first = self.first.unwrap_or(entry);
        let size = self.past.len();
        let at = self.place(self.n);
        self.past[at] = entry;
        let mut result = [Register::ZERO; 2];
        for lane in 0..lanes {
            let width = window[0].lane(lane).max(1.0);
            let (whole, average) = MovingAverage::new(width);
            let oldest = if whole > self.n { &first } else { &self.past[self.place(self.n - whole.min(size - 1))] };
            let (mut sum, mut sum_rate) = (self.sums.value.lane(lane), self.sums.rate.lane(lane));
            let shown = average.show(&mut sum, entry.value.lane(lane), oldest.value.lane(lane));
            let rate = average.show(&mut sum_rate, entry.rate.lane(lane), oldest.rate.lane(lane));
            self.sums.value.set(lane, sum);
            self.sums.rate.set(lane, sum_rate);
            result[0].set(lane, shown);
            result[1].set(lane, rate + (oldest.value.lane(lane) - shown) / width * window[1].lane(lane));
        }
        self.n += 1;
        result
    }
}
