//! Sensors with a filter and a delay, lane by lane.
//!
//! The filter is a lag of first order, `T df/dt = y − f`. Over a substep of length δ the signal is
//! `y(s) = y₀ + a s + c s²`, with its slope a at the start and `c = (y₁ − y₀ − a δ)/δ²`, so that
//! `f(s) = y(s) − T y'(s) + 2 c T² + (f₀ − y₀ + T a − 2 c T²) exp(−s/T)` is exact; it is y(s) for T = 0. A sensor shows f at the time of
//! the sample less the delay. Before the first sample the signal had its first value. Where a signal without a filter jumps between
//! substeps, the value moves within a thousandth of the substep before ([`Substep::JUMP`]), so that the cost is continuous in the delay.

use super::clock::{Clock, Entry, KEPT_MAX, zero};
use super::lag::{Lag, Lags, Piece, Shown};
use super::register::{Register, WIDTH};
use motorfit_core::numeric::{count, whole};
use motorfit_model::step::Substep;

/// Substeps that are kept beside those of the delay.
const MARGIN: usize = 3;

/// The past of a signal.
#[derive(Debug)]
pub(crate) struct Sensor<const C: usize> {
    /// Ring of the last substeps, whose length is a power of two.
    pieces: Vec<Piece<C>>,
    /// Number of the substeps so far.
    count: usize,
    /// Number of the samples so far.
    samples: usize,
    /// Time since the first sample \[s\].
    time: f64,
    /// The first value of the signal.
    first: Entry<C>,
    /// Output of the filter at the end of the last substep, and its slope there.
    shown: Entry<C>,
    slope: Register<C>,
    /// The filters over a substep.
    lags: Lags<C>,
    /// True if a lane has a delay.
    is_late: bool,
    /// The substep that each lane found last.
    found: Vec<usize>,
}

impl<const C: usize> Sensor<C> {
    pub const fn new() -> Self {
        Self {
            pieces: Vec::new(),
            count: 0,
            samples: 0,
            time: 0.0,
            first: zero(),
            shown: zero(),
            slope: Register::ZERO,
            lags: Lags::NONE,
            is_late: false,
            found: Vec::new(),
        }
    }

    /// Returns what the sensor shows at a sample, and its derivative. The signal there, the time constant of the filter and the delay have
    /// a value and a rate each.
    pub fn show(
        &mut self,
        (clock, substep): (&Clock, Substep),
        [signal, filter, delay]: [[&Register<C>; 2]; 3],
    ) -> [Register<C>; 2] {
        let now = Entry { value: *signal[0], rate: *signal[1] };
        let lanes = Register::<C>::LANES;
        if self.samples == 0 {
            let largest = (0..lanes).map(|lane| delay[0].lane(lane)).fold(0.0, f64::max);
            let parts = usize::from(substep.of.max(1));
            let needed = (largest / clock.shortest() + 1.0) * count(parts);
            let needed = whole(needed.clamp(1.0, count(KEPT_MAX))).min(clock.samples.max(1) * parts) + MARGIN;
            let none = Piece { from: 0.0, length: 1.0, start: now, slope: zero(), end: now, shown: now };
            self.pieces = vec![none; needed.next_power_of_two()];
            self.found = vec![0; lanes];
            self.is_late = largest > 0.0;
            (self.first, self.shown) = (now, now);
        }
        self.samples += 1;
        if self.count == 0 {
            return [now.value, now.rate];
        }
        if !self.is_late {
            return self.shown_now(&now, delay[1]);
        }
        let mut result = [Register::ZERO; 2];
        for lane in 0..lanes {
            let at = self.time - delay[0].lane(lane).max(0.0);
            let (value, rate) = if at <= 0.0 {
                (self.first.value.lane(lane), self.first.rate.lane(lane))
            } else {
                let lag = [filter[0].lane(lane), filter[1].lane(lane)];
                self.shown_at((at, lane), lag, (delay[1].lane(lane), &now))
            };
            result[0].set(lane, value);
            result[1].set(lane, rate);
        }
        result
    }

    /// Returns what is shown without a delay, whose derivative is `late`; `now` is the signal.
    fn shown_now(&self, now: &Entry<C>, late: &Register<C>) -> [Register<C>; 2] {
        let end = &self.piece(self.count - 1).end;
        let mut result = [Register::ZERO; 2];
        for part in 0..C {
            for lane in 0..WIDTH {
                // Without a filter a jump at the sample is shown.
                let jump = f64::from(u8::from(self.lags.lag[part][lane] <= 0.0));
                let slope = self.slope[part][lane] * late[part][lane];
                let [value, rate] = [(&now.value, &end.value), (&now.rate, &end.rate)]
                    .map(|(now, end)| jump * (now[part][lane] - end[part][lane]));
                result[0][part][lane] = self.shown.value[part][lane] + value;
                result[1][part][lane] = self.shown.rate[part][lane] + rate - slope;
            }
        }
        result
    }

    /// Returns what a lane shows at a time after the first sample, with its derivative; `slope` is that of the delay.
    #[inline(always)]
    fn shown_at(&mut self, (at, lane): (f64, usize), lag: [f64; 2], (slope, now): (f64, &Entry<C>)) -> (f64, f64) {
        let number = self.found_at(at + 1e-12 * self.time, lane);
        let piece = self.piece(number);
        let since = (at - piece.from).clamp(0.0, piece.length);
        let lag = Lag::after(since, lag, piece.length);
        let place = (lane / WIDTH, lane % WIDTH);
        let shown = piece.shown_at(since, place, &lag);
        let (mut value, mut rate) = (shown.value, shown.rate - shown.slope * slope);
        let part = 1.0 - (piece.length - since) / piece.length * f64::from(Substep::JUMP);
        if part > 0.0 && lag.lag <= 0.0 {
            let next = if number + 1 < self.count { &self.piece(number + 1).start } else { now };
            value += part * (next.value.lane(lane) - piece.end.value.lane(lane));
            rate += part * (next.rate.lane(lane) - piece.end.rate.lane(lane));
        }
        (value, rate)
    }

    #[inline(always)]
    fn piece(&self, number: usize) -> &Piece<C> {
        &self.pieces[number & (self.pieces.len() - 1)]
    }

    /// Returns the last substep that does not begin after a time; the oldest that is kept if all do.
    #[inline(always)]
    fn found_at(&mut self, time: f64, lane: usize) -> usize {
        let oldest = self.count - self.count.min(self.pieces.len());
        let mut number = self.found[lane].max(oldest);
        while number + 1 < self.count && self.piece(number + 1).from <= time {
            number += 1;
        }
        // Only where steps differ in length can a time lie before the one found last.
        while number > oldest && self.piece(number).from > time {
            number -= 1;
        }
        self.found[lane] = number;
        number
    }

    /// Adds a substep, over which the signal is linear, or quadratic if its slope at the start is given.
    pub fn track(
        &mut self,
        (clock, substep): (&Clock, Substep),
        [start, end, filter]: [[&Register<C>; 2]; 3],
        slope: Option<[&Register<C>; 2]>,
    ) -> [Register<C>; 2] {
        let [start, end] = [start, end].map(|of| Entry { value: *of[0], rate: *of[1] });
        let parts = f64::from(substep.of.max(1));
        let step = clock.step(self.samples.saturating_sub(1));
        let length = step / parts;
        let slope = match slope {
            Some([value, rate]) => Entry { value: *value, rate: *rate },
            None => {
                Entry { value: chord(&start.value, &end.value, length), rate: chord(&start.rate, &end.rate, length) }
            }
        };
        let piece = Piece { from: self.time, length, start, slope, end, shown: self.shown };
        let [lag, lag_rate] = filter;
        self.lags.set(length, lag);
        for part in 0..C {
            for lane in 0..WIDTH {
                let lag = self.lags.of((part, lane), lag_rate[part][lane]);
                let Shown { value, rate, slope } = piece.shown_at(length, (part, lane), &lag);
                self.shown.value[part][lane] = value;
                self.shown.rate[part][lane] = rate;
                self.slope[part][lane] = slope;
            }
        }
        let place = self.count & (self.pieces.len() - 1);
        self.pieces[place] = piece;
        self.count += 1;
        self.time += length;
        [Register::ZERO; 2]
    }
}

/// Returns the slope of the line between two values.
fn chord<const C: usize>(a: &Register<C>, b: &Register<C>, length: f64) -> Register<C> {
    let mut slope = Register::ZERO;
    for part in 0..C {
        for lane in 0..WIDTH {
            slope[part][lane] = (b[part][lane] - a[part][lane]) / length;
        }
    }
    slope
}
