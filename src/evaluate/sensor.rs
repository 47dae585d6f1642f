//! Sensors that show the mean of their last samples, of `L` candidates side by side.

use super::extended::CHUNK;
use super::reaction::Pair;
use crate::motor::WINDOW_MAX;

/// One channel's sensors; of the last samples the oldest counts in part.
pub(super) struct Sensor<const L: usize> {
    whole: [usize; L],
    part: [f64; L],
    /// 1/window.
    share: [f64; L],
    sum: [f64; L],
    /// The last values, at their number modulo the length; before the first sample, what the motor began with.
    ring: Vec<[f64; L]>,
}

impl<const L: usize> Sensor<L> {
    pub(super) fn new(windows: [f64; L], initial: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and 1e6")]
        let whole = windows.map(|window| window.clamp(1.0, WINDOW_MAX) as usize);
        let longest = whole.iter().copied().max().unwrap_or(1);
        #[expect(clippy::cast_precision_loss, reason = "at most 1e6")]
        let counts = whole.map(|whole| whole as f64);
        Self {
            whole,
            part: std::array::from_fn(|lane| windows[lane] - counts[lane]),
            share: windows.map(|window| 1.0 / window),
            sum: counts.map(|count| count * initial),
            ring: vec![[initial; L]; (longest + CHUNK).next_power_of_two()],
        }
    }

    /// Replaces what passed at the samples from `start` on by what is shown of it.
    #[inline(always)]
    pub(super) fn show(&mut self, start: usize, channel: usize, seen: &mut [Pair<L>]) {
        let mask = self.ring.len() - 1;
        for (n, seen) in (start..).zip(seen.iter()) {
            self.ring[n & mask] = seen[channel];
        }
        let mut oldest = [[0.0; L]; CHUNK];
        let oldest = &mut oldest[..seen.len()];
        for lane in 0..L {
            let (wrapped, last) = self.ring.split_at(start.wrapping_sub(self.whole[lane]) & mask);
            for (oldest, value) in oldest.iter_mut().zip(last.iter().chain(wrapped)) {
                oldest[lane] = value[lane];
            }
        }
        let Self { part, share, sum, .. } = self;
        for (seen, oldest) in seen.iter_mut().zip(oldest) {
            let values = &mut seen[channel];
            for lane in 0..L {
                sum[lane] += values[lane] - oldest[lane];
                values[lane] = (sum[lane] + part[lane] * oldest[lane]) * share[lane];
            }
        }
    }
}
