//! Sensors that output a moving average of samples.
//!
//! A window of N samples, N real, consists of the last `⌊N⌋` samples and the fraction `N − ⌊N⌋` of the sample before them,
//! `x_oldest`. With the running sum S of the last `⌊N⌋` samples, `S ← S + (x − x_oldest)`, the output is
//! `(S + (N − ⌊N⌋) x_oldest)/N`. Before the first sample a sensor has seen the initial state. Shader: `shaders/sensor.wgsl`.
//!
//! All number types share the formula. The oracle keeps past samples in a queue, the kernel in a ring buffer of blocks. The
//! formula is tested by `sensors_average` in `tests/evaluate/extensions/meaning.rs`.

use super::dual::Number;
use super::interleave::{Aligned, CHUNK, GROUP, interleave};
use std::collections::VecDeque;

/// Largest number of samples kept for a window. In a longer window the excess weight goes to the oldest sample kept. No
/// more samples are kept than the recording has.
pub const WINDOW_MAX: f64 = 1e6;

/// The weights of a moving average; arrays as values hold several sensors, a lane each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MovingAverage<T> {
    /// Weight `N − ⌊N⌋` of the sample before the last `⌊N⌋`, before division by the window N.
    pub part: T,
    /// Reciprocal of the window.
    pub share: T,
}

impl<T: Number> MovingAverage<T> {
    /// Returns `⌊N⌋` for a window of N samples, and the weights.
    pub fn new(window: T) -> (usize, Self) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and 1e6")]
        let whole = window.value().clamp(1.0, WINDOW_MAX) as usize;
        (whole, Self { part: window - T::constant(number(whole)), share: T::constant(1.0) / window })
    }

    /// Adds a sample to the running sum, subtracts `oldest`, the sample before the last `⌊N⌋`, and returns the average.
    #[inline(always)]
    pub fn show(self, sum: &mut T, value: T, oldest: T) -> T {
        *sum = *sum + (value - oldest);
        (*sum + self.part * oldest) * self.share
    }
}

#[expect(clippy::cast_precision_loss, reason = "at most 1e6")]
fn number(whole: usize) -> f64 {
    whole as f64
}

/// A sensor with its past samples in a queue.
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

/// The sensors of one channel of `L` motors side by side, evaluated in blocks of samples.
pub struct MovingAverages<const L: usize> {
    average: MovingAverage<[f64; L]>,
    /// Number of complete samples of each window, at most the length of the recording.
    reach: [usize; L],
    /// The largest of `reach`.
    longest: usize,
    sum: [f64; L],
    /// Past values, the last of which is in row `end − 1`; at first the initial state. Rows move to the front when the last row is
    /// in use.
    past: Vec<Aligned<[f64; L]>>,
    end: usize,
    /// The sample before the last `reach` of each motor, at successive samples.
    oldest: Vec<Aligned<[f64; L]>>,
}

impl<const L: usize> MovingAverages<L> {
    /// Makes sensors for a recording of `samples` samples.
    pub fn new(windows: [f64; L], initial: f64, samples: usize) -> Self {
        let lanes = windows.map(MovingAverage::new);
        let whole = lanes.map(|(whole, _)| whole);
        // All samples before the first equal the initial state, so a window never needs more than the recording.
        let reach = whole.map(|whole| whole.min(samples.max(1)));
        let longest = reach.iter().copied().max().unwrap_or(1);
        Self {
            average: MovingAverage { part: lanes.map(|(_, one)| one.part), share: lanes.map(|(_, one)| one.share) },
            reach,
            longest,
            sum: whole.map(|whole| number(whole) * initial),
            past: vec![Aligned([initial; L]); longest + longest.clamp(CHUNK, samples.max(CHUNK))],
            end: longest,
            oldest: vec![Aligned([0.0; L]); CHUNK],
        }
    }

    /// Replaces the states of at most [`CHUNK`] successive samples by the outputs of the sensors.
    #[inline(always)]
    pub fn show(&mut self, channel: usize, seen: &mut [[[f64; L]; 2]]) {
        if self.end + seen.len() > self.past.len() {
            self.past.copy_within(self.end - self.longest..self.end, 0);
            self.end = self.longest;
        }
        let new = &mut self.past[self.end..self.end + seen.len()];
        for (past, seen) in new.iter_mut().zip(seen.iter()) {
            past.0 = seen[channel];
        }
        let oldest = &mut self.oldest[..seen.len()];
        let (groups, _) = self.reach.as_chunks::<GROUP>();
        for (group, reach) in groups.iter().enumerate() {
            let sources = reach.map(|reach| &self.past[self.end - reach..][..seen.len()]);
            interleave(sources, oldest, GROUP * group, |Aligned(values), motor| values[motor]);
        }
        // Local copies stay in registers.
        let (MovingAverage { part, share }, mut sum) = (self.average, self.sum);
        for (seen, Aligned(oldest)) in seen.iter_mut().zip(oldest) {
            let mut values = seen[channel];
            for lane in 0..L {
                let average = MovingAverage { part: part[lane], share: share[lane] };
                values[lane] = average.show(&mut sum[lane], values[lane], oldest[lane]);
            }
            seen[channel] = values;
        }
        self.sum = sum;
        self.end += seen.len();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_past_samples_are_kept_than_the_recording_has() {
        const SAMPLES: usize = 1001;
        let windows = [1.0, 3.7, 64.0, 1000.0, 1001.0, 1002.5, 1024.0, 1e6];
        let mut kernel = MovingAverages::new(windows, 0.5, SAMPLES);
        assert_eq!(kernel.past.len(), 2 * SAMPLES, "not the million of the longest window");
        let mut oracle = windows.map(|window| Sensor::new(window, 0.5));
        let value = |n: usize| number(n * n % 97) - 40.0;
        for start in (0..SAMPLES).step_by(CHUNK) {
            let numbers = start..(start + CHUNK).min(SAMPLES);
            let mut seen: Vec<[[f64; 8]; 2]> = numbers.clone().map(|n| [[value(n); 8], [0.0; 8]]).collect();
            kernel.show(0, &mut seen);
            for (n, seen) in numbers.zip(seen) {
                for (lane, sensor) in oracle.iter_mut().enumerate() {
                    let shown: f64 = sensor.show(value(n));
                    assert_eq!(shown.to_bits(), seen[0][lane].to_bits(), "sample {n}, window {}", windows[lane]);
                }
            }
        }
    }
}
