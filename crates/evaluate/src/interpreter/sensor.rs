//! Sensors with a filter and a delay, lane by lane.
//!
//! The filter is a lag of first order, `T df/dt = y − f`. Over a substep of length δ the signal is
//! `y(s) = y₀ + a s + c s²`, with its slope a at the start and `c = (y₁ − y₀ − a δ)/δ²`, so that
//! `f(s) = y(s) − T y'(s) + 2 c T² + (f₀ − y₀ + T a − 2 c T²) exp(−s/T)` is exact; it is y(s) for T = 0. A sensor shows f at the time of
//! the sample less the delay. Before the first sample the signal had its first value. Where a signal without a filter jumps between
//! substeps, the value moves within a thousandth of the substep before ([`Substep::JUMP`]), so that the cost is continuous in the delay.

use super::memory::{Clock, Entry, KEPT_MAX, zero};
use super::register::Register;
use motorfit_core::numeric::{count, whole};
use motorfit_model::step::Substep;

/// Substeps that are kept beside those of the delay.
const MARGIN: usize = 3;
/// Time constant, as a part of the substep, below which there is no filter.
const NO_FILTER: f64 = 1e-9;

/// A value with its derivative, or the coefficients of one.
type Pair = [f64; 2];

/// A substep of a signal: its start and length \[s\], values and slope, and what the filter shows at the start.
#[derive(Debug, Clone, Copy)]
struct Piece<const C: usize> {
    from: f64,
    length: f64,
    start: Entry<C>,
    slope: Entry<C>,
    end: Entry<C>,
    shown: Entry<C>,
}

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
    /// What the filter shows at the end of the last substep.
    shown: Entry<C>,
    /// The substep that each lane found last.
    found: Vec<usize>,
}

/// What the filter shows within a substep: the value, its derivative with respect to parameters, and its slope over time.
struct Shown {
    value: f64,
    rate: f64,
    slope: f64,
}

impl<const C: usize> Sensor<C> {
    pub const fn new() -> Self {
        let (first, shown) = (zero(), zero());
        Self { pieces: Vec::new(), count: 0, samples: 0, time: 0.0, first, shown, found: Vec::new() }
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
            (self.first, self.shown) = (now, now);
        }
        let mut result = [now.value, now.rate];
        for lane in 0..lanes {
            let late = delay[0].lane(lane).max(0.0);
            let at = self.time - late;
            let (value, rate) = match (self.count, at <= 0.0) {
                (0, _) => continue,
                (_, true) => (self.first.value.lane(lane), self.first.rate.lane(lane)),
                _ => {
                    let lag = [filter[0].lane(lane), filter[1].lane(lane)];
                    self.shown_at((at, lane), lag, (delay[1].lane(lane), &now))
                }
            };
            result[0].set(lane, value);
            result[1].set(lane, rate);
        }
        self.samples += 1;
        result
    }

    /// Returns what a lane shows at a time after the first sample, with its derivative; `slope` is that of the delay.
    #[inline(always)]
    fn shown_at(&mut self, (at, lane): (f64, usize), lag: Pair, (slope, now): (f64, &Entry<C>)) -> (f64, f64) {
        let number = self.found_at(at + 1e-12 * self.time, lane);
        let piece = self.piece(number);
        let since = (at - piece.from).clamp(0.0, piece.length);
        let shown = piece.shown_at((since, lane), lag);
        let (mut value, mut rate) = (shown.value, shown.rate - shown.slope * slope);
        let part = 1.0 - (piece.length - since) / piece.length * f64::from(Substep::JUMP);
        if part > 0.0 && lag[0] <= NO_FILTER * piece.length {
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
        let chord = |a: &Register<C>, b: &Register<C>| {
            let mut chord = Register::ZERO;
            (0..Register::<C>::LANES).for_each(|lane| chord.set(lane, (b.lane(lane) - a.lane(lane)) / length));
            chord
        };
        let slope = match slope {
            Some([value, rate]) => Entry { value: *value, rate: *rate },
            None => Entry { value: chord(&start.value, &end.value), rate: chord(&start.rate, &end.rate) },
        };
        let piece = Piece { from: self.time, length, start, slope, end, shown: self.shown };
        let place = self.count & (self.pieces.len() - 1);
        self.pieces[place] = piece;
        for lane in 0..Register::<C>::LANES {
            let shown = piece.shown_at((length, lane), [filter[0].lane(lane), filter[1].lane(lane)]);
            self.shown.value.set(lane, shown.value);
            self.shown.rate.set(lane, shown.rate);
        }
        self.count += 1;
        self.time += length;
        [Register::ZERO; 2]
    }
}

impl<const C: usize> Piece<C> {
    /// Returns what a lane shows some time after the start, with a filter of the time constant `lag`.
    #[inline(always)]
    fn shown_at(&self, (since, lane): (f64, usize), [lag, lag_rate]: Pair) -> Shown {
        let of = |entry: &Entry<C>| [entry.value.lane(lane), entry.rate.lane(lane)];
        let ([y, y_rate], [a, a_rate]) = (of(&self.start), of(&self.slope));
        let ([end, end_rate], [shown, shown_rate]) = (of(&self.end), of(&self.shown));
        let bent = |y: f64, a: f64, end: f64| (end - y - a * self.length) / (self.length * self.length);
        let (c, c_rate) = (bent(y, a, end), bent(y_rate, a_rate, end_rate));
        let signal = |y: f64, a: f64, c: f64| (y + since * (a + since * c), a + 2.0 * c * since);
        let ((value, slope), (rate, slope_rate)) = (signal(y, a, c), signal(y_rate, a_rate, c_rate));
        if lag <= NO_FILTER * self.length {
            return Shown { value, rate: rate - slope * lag_rate, slope };
        }
        let decay = (-since / lag).exp();
        let left = |shown: f64, y: f64, a: f64, c: f64| shown - y + lag * (a - 2.0 * c * lag);
        let filtered = |value: f64, slope: f64, c: f64, left: f64| value + lag * (2.0 * c * lag - slope) + left * decay;
        let begin = left(shown, y, a, c);
        let own = filtered(value, slope, c, begin);
        let by_lag = 4.0 * c * lag - slope + (a - 4.0 * c * lag + begin * since / (lag * lag)) * decay;
        let rate = filtered(rate, slope_rate, c_rate, left(shown_rate, y_rate, a_rate, c_rate));
        Shown { value: own, rate: rate + by_lag * lag_rate, slope: (value - own) / lag }
    }
}
