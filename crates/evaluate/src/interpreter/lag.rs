//! A lag of first order of a signal over a substep; formulas: `sensor.rs`.

use super::clock::Entry;
use super::register::Register;

/// Time constant, as a part of the substep, below which there is no filter.
const NO_FILTER: f64 = 1e-9;

/// A substep of a signal: its start and length \[s\], values and slope, and the output of the filter at the start.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece<const C: usize> {
    pub from: f64,
    pub length: f64,
    pub start: Entry<C>,
    pub slope: Entry<C>,
    pub end: Entry<C>,
    pub shown: Entry<C>,
}

/// Output of the filter within a substep: the value, its derivative with respect to parameters, and its slope over time.
pub(super) struct Shown {
    pub value: f64,
    pub rate: f64,
    pub slope: f64,
}

/// A filter after a time: its time constant T, 0 where there is none, with its derivative; `exp(−s/T)` and `s/T² exp(−s/T)`.
pub(super) struct Lag {
    pub lag: f64,
    rate: f64,
    decay: f64,
    growth: f64,
}

impl Lag {
    /// Returns the filter some time after the start of a substep of a length.
    #[inline(always)]
    pub fn after(since: f64, [lag, rate]: [f64; 2], length: f64) -> Self {
        if lag <= NO_FILTER * length {
            return Self { lag: 0.0, rate, decay: 0.0, growth: 0.0 };
        }
        let decay = (-since / lag).exp();
        Self { lag, rate, decay, growth: since / (lag * lag) * decay }
    }
}

/// The filters of all lanes over a substep.
#[derive(Debug)]
pub(super) struct Lags<const C: usize> {
    /// Length of the substep \[s\].
    length: f64,
    /// Time constants, 0 where there is no filter.
    pub lag: Register<C>,
    decay: Register<C>,
    growth: Register<C>,
}

impl<const C: usize> Lags<C> {
    pub const NONE: Self = Self { length: 0.0, lag: Register::ZERO, decay: Register::ZERO, growth: Register::ZERO };

    /// Takes the time constants, which do not change, for substeps of a length.
    pub fn set(&mut self, length: f64, lag: &Register<C>) {
        if self.length.to_bits() == length.to_bits() {
            return;
        }
        self.length = length;
        for lane in 0..Register::<C>::LANES {
            let Lag { lag, decay, growth, .. } = Lag::after(length, [lag.lane(lane), 0.0], length);
            self.lag.set(lane, lag);
            self.decay.set(lane, decay);
            self.growth.set(lane, growth);
        }
    }

    #[inline(always)]
    pub fn of(&self, (part, lane): (usize, usize), rate: f64) -> Lag {
        let [lag, decay, growth] = [&self.lag, &self.decay, &self.growth].map(|of| of[part][lane]);
        Lag { lag, rate, decay, growth }
    }
}

impl<const C: usize> Piece<C> {
    /// Returns the output of the filter some time after the start, in a lane of a part; `filter` is that after this time.
    #[inline(always)]
    pub fn shown_at(&self, since: f64, (part, lane): (usize, usize), filter: &Lag) -> Shown {
        let of = |entry: &Entry<C>| [entry.value[part][lane], entry.rate[part][lane]];
        let ([y, y_rate], [a, a_rate]) = (of(&self.start), of(&self.slope));
        let ([end, end_rate], [shown, shown_rate]) = (of(&self.end), of(&self.shown));
        let share = 1.0 / (self.length * self.length);
        let bent = |y: f64, a: f64, end: f64| (end - y - a * self.length) * share;
        let (c, c_rate) = (bent(y, a, end), bent(y_rate, a_rate, end_rate));
        let signal = |y: f64, a: f64, c: f64| (y + since * (a + since * c), a + 2.0 * c * since);
        let ((value, slope), (rate, slope_rate)) = (signal(y, a, c), signal(y_rate, a_rate, c_rate));
        let &Lag { lag, rate: lag_rate, decay, growth } = filter;
        let left = |shown: f64, y: f64, a: f64, c: f64| shown - y + lag * (a - 2.0 * c * lag);
        let filtered = |value: f64, slope: f64, c: f64, left: f64| value + lag * (2.0 * c * lag - slope) + left * decay;
        let begin = left(shown, y, a, c);
        let own = filtered(value, slope, c, begin);
        let by_lag = 4.0 * c * lag - slope + (a - 4.0 * c * lag) * decay + begin * growth;
        let rate = filtered(rate, slope_rate, c_rate, left(shown_rate, y_rate, a_rate, c_rate));
        let slope = if lag > 0.0 { (value - own) / lag } else { slope };
        Shown { value: own, rate: rate + by_lag * lag_rate, slope }
    }
}
