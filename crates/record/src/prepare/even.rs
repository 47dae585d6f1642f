//! Copies of a recording on a regular clock, for methods that need evenly spaced samples. Their estimates start the fit of
//! the recording itself.

use super::resample::{lines, regular};
use super::time;
use crate::record::{Excluded, Record};
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};

/// Largest ratio of samples of a copy to those of the recording, which a long gap would exceed.
const SAMPLES_MAX: f64 = 4.0;

impl Record {
    /// Returns a copy with a sample every `period_s` \[s\]: outputs by cubic interpolation through the four nearest samples,
    /// the input as its mean over each period. `is_held` takes the input as a zero-order hold instead of a first-order hold.
    /// Samples in gaps are excluded from the criterion.
    ///
    /// # Errors
    /// Returns `Usage` if the copy would have more than [`SAMPLES_MAX`] times as many samples.
    #[doc(hidden)]
    pub fn resampled_evenly(&self, period_s: f64, is_held: bool) -> Result<Self> {
        if self.duration_s() / period_s > SAMPLES_MAX * motorfit_core::numeric::count(self.len()) {
            let message = format!("a recording with long gaps cannot be resampled to a clock of {period_s} s");
            return Err(Error::usage(message, text!("Use " [Gaps = "split"] ".")));
        }
        let [mean, slope] = match self.slope() {
            [] => lines(self.input(), is_held),
            slope => [self.input().to_vec(), slope.to_vec()],
        };
        let made = regular(&self.samples.clone().with_input(mean), &slope, period_s);
        let times = &self.samples.time_s;
        let missing = time::gaps(times).into_iter().filter_map(|n| {
            let at = |t: f64| made.samples.time_s.partition_point(|even| *even <= t);
            let (start, end) = (at(times[n - 1]), at(times[n]));
            (start < end).then_some(Excluded { start, end, channels: [true; 2] })
        });
        let missing: Vec<Excluded> = missing.collect();
        let mut copy = self.clone().resampled(made, format!("resampled to even steps of {period_s} s"))?;
        copy.excluded.extend(missing);
        Ok(Self { slope: Vec::new(), interpolated: true, ..copy })
    }

    /// Returns the longest segment without a gap; `None` for a recording without gaps.
    #[doc(hidden)]
    pub fn longest_segment(&self) -> Option<Self> {
        let gaps = time::gaps(&self.samples.time_s);
        if gaps.is_empty() {
            return None;
        }
        let starts = std::iter::once(0).chain(gaps.iter().copied());
        let ends = gaps.iter().copied().chain([self.len()]);
        let longest = starts.zip(ends).max_by_key(|(start, end)| end - start)?;
        self.part(longest.0..longest.1, "the longest segment without a gap".to_owned()).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Samples, Source};

    #[test]
    fn gaps_are_excluded_and_the_longest_segment_has_none() {
        let time_s: Vec<f64> =
            (0..60).map(|n| 0.01 * f64::from(n + 30 * i32::from(n >= 20)) + 1e-3 * f64::from(n % 2)).collect();
        let voltage = vec![1.0; 60];
        let samples = Samples { speed: Some(time_s.clone()), voltage, time_s, ..Samples::default() };
        let record = Record::from_file(samples, Source::default(), true).unwrap();
        let copy = record.resampled_evenly(0.01, true).unwrap();
        assert!(copy.steps().step_index.is_empty() && copy.len() == 90);
        let counting: Vec<usize> = copy.counting().iter().enumerate().filter(|(_, c)| !c[1]).map(|(n, _)| n).collect();
        assert_eq!((counting[0], counting[counting.len() - 1], counting.len()), (20, 50, 31));
        let error = |n: usize| copy.samples().speed.as_ref().unwrap()[n] - copy.samples().time_s[n];
        assert!((0..90).all(|n| error(n).abs() < 1e-12), "a line stays a line");
        assert_eq!(record.longest_segment().unwrap().len(), 40);
        assert!(copy.longest_segment().is_none() && record.resampled_evenly(1e-3, true).is_err());
    }
}
