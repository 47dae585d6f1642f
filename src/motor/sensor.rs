//! Sensors that show the moving average of the last samples.
//!
//! A window of N samples, N no whole number, is `⌊N⌋` samples and a part of the oldest of them. With the running sum S of
//! the whole ones: `S ← S + (x − x_oldest)`, shown is `(S + (N − ⌊N⌋) x_oldest)/N`. Before the first sample a sensor has
//! seen the initial state. Twin: `shaders/sensor.wgsl`.
//!
//! The formula is one for all number types; the past samples are kept in a queue by the oracle, in a ring of blocks by the
//! kernel. The test that holds the formula is `sensors_average` in `tests/extensions/meaning.rs`.

use super::dual::Number;
use std::collections::VecDeque;

/// The longest window, in samples: a longer one is as good as the whole recording.
pub(crate) const WINDOW_MAX: f64 = 1e6;

/// Samples that the kernel computes at a time.
pub(crate) const CHUNK: usize = 64;

/// Numbers that vectors are loaded from: a vector of AVX-512 is a cache line, and each load off its boundary takes two.
#[repr(align(64))]
pub(crate) struct Aligned<T>(pub T);

/// The weights of a moving average. With arrays as values it is those of several sensors, a lane each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MovingAverage<T> {
    /// Weight of the oldest sample.
    pub(crate) part: T,
    /// One over the window.
    pub(crate) share: T,
}

impl<T: Number> MovingAverage<T> {
    /// Returns the whole samples of a window and the weights.
    pub(crate) fn new(window: T) -> (usize, Self) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and 1e6")]
        let whole = window.value().clamp(1.0, WINDOW_MAX) as usize;
        (whole, Self { part: window - T::constant(number(whole)), share: T::constant(1.0) / window })
    }

    /// Adds a sample to the running sum, takes the oldest off and returns the average.
    #[inline(always)]
    pub(crate) fn show(self, sum: &mut T, value: T, oldest: T) -> T {
        *sum = *sum + (value - oldest);
        (*sum + self.part * oldest) * self.share
    }
}

#[expect(clippy::cast_precision_loss, reason = "at most 1e6")]
fn number(whole: usize) -> f64 {
    whole as f64
}

/// One sensor with its past samples in a queue.
pub(super) struct Sensor<T> {
    average: MovingAverage<T>,
    whole: usize,
    /// The last `whole` values, the oldest first.
    seen: VecDeque<T>,
    initial: T,
    sum: T,
}

impl<T: Number> Sensor<T> {
    pub(super) fn new(window: T, initial: T) -> Self {
        let (whole, average) = MovingAverage::new(window);
        Self { average, whole, seen: VecDeque::new(), initial, sum: initial * number(whole) }
    }

    #[inline(always)]
    pub(super) fn show(&mut self, value: T) -> T {
        let full = self.seen.len() == self.whole;
        let oldest = if full { self.seen.pop_front().unwrap_or(self.initial) } else { self.initial };
        self.seen.push_back(value);
        self.average.show(&mut self.sum, value, oldest)
    }
}

/// The sensors of one channel of `L` motors side by side, some samples at a time.
pub(crate) struct MovingAverages<const L: usize> {
    average: MovingAverage<[f64; L]>,
    whole: [usize; L],
    sum: [f64; L],
    /// The last values, each at its number modulo the length; before the first sample, the initial state.
    ring: Vec<[f64; L]>,
}

impl<const L: usize> MovingAverages<L> {
    pub(crate) fn new(windows: [f64; L], initial: f64) -> Self {
        let lanes = windows.map(MovingAverage::new);
        let whole = lanes.map(|(whole, _)| whole);
        let longest = whole.iter().copied().max().unwrap_or(1);
        Self {
            average: MovingAverage { part: lanes.map(|(_, one)| one.part), share: lanes.map(|(_, one)| one.share) },
            whole,
            sum: whole.map(|whole| number(whole) * initial),
            ring: vec![[initial; L]; (longest + CHUNK).next_power_of_two()],
        }
    }

    /// Replaces the states of at most [`CHUNK`] samples from `start` on by what is shown of them.
    #[inline(always)]
    pub(crate) fn show(&mut self, start: usize, channel: usize, seen: &mut [[[f64; L]; 2]]) {
        let mask = self.ring.len() - 1;
        for (n, seen) in (start..).zip(seen.iter()) {
            self.ring[n & mask] = seen[channel];
        }
        let mut oldest = Aligned([[0.0; L]; CHUNK]);
        let oldest = &mut oldest.0[..seen.len()];
        for lane in 0..L {
            let (wrapped, last) = self.ring.split_at(start.wrapping_sub(self.whole[lane]) & mask);
            for (oldest, value) in oldest.iter_mut().zip(last.iter().chain(wrapped)) {
                oldest[lane] = value[lane];
            }
        }
        let Self { average: MovingAverage { part, share }, sum, .. } = self;
        for (seen, oldest) in seen.iter_mut().zip(oldest) {
            let values = &mut seen[channel];
            for lane in 0..L {
                let average = MovingAverage { part: part[lane], share: share[lane] };
                values[lane] = average.show(&mut sum[lane], values[lane], oldest[lane]);
            }
        }
    }
}
