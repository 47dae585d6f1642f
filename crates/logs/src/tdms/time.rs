//! Times of TDMS files: timestamps, and waveforms with a start and an increment.

use motorfit_core::numeric::{count_u64, wide};

/// Nanoseconds of a second.
const NANO: i128 = 1_000_000_000;
/// Number of counts of a timestamp in a second.
const SECOND: i128 = 1 << 64;
/// Largest increment of a waveform \[s\].
const STEP_MAX: f64 = 1e9;
/// Largest distance between the starts of a waveform and of the log \[s\].
const OFFSET_MAX: f64 = 1e15;

/// Returns the difference of two timestamps \[s\]. A difference within 1 ps of whole nanoseconds is rounded to them, because
/// writers round decimal fractions of a second to binary ones.
pub(super) fn difference_s(time: i128, origin: i128) -> f64 {
    let counts = time.saturating_sub(origin);
    let nanoseconds = rounded(counts);
    let exact = (nanoseconds / NANO).saturating_mul(SECOND).saturating_add(nanoseconds % NANO * SECOND / NANO);
    if counts.saturating_sub(exact).abs() <= SECOND / (1000 * NANO) {
        wide(nanoseconds) / 1e9
    } else {
        wide(counts) / wide(SECOND)
    }
}

/// Returns a number of counts in nanoseconds, rounded.
fn rounded(counts: i128) -> i128 {
    counts.div_euclid(SECOND) * NANO + (counts.rem_euclid(SECOND) * NANO + SECOND / 2) / SECOND
}

/// Start and increment of a waveform, as its properties state them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Waveform {
    /// Time of day of the start, where it is known.
    pub start: Option<i128>,
    /// Time of the first sample since the start \[s\].
    pub offset_s: f64,
    /// Time between two samples \[s\].
    pub increment_s: f64,
}

/// Times of the samples of a waveform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Clock {
    /// Time of the first sample \[ns\].
    start: i128,
    step: Step,
}

/// Time between two samples.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Step {
    /// A whole number of nanoseconds.
    Nanoseconds(i128),
    /// The reciprocal of a whole number of samples per second.
    Rate(f64),
    /// Any other time \[s\].
    Seconds(f64),
}

impl Waveform {
    /// Returns the waveform of properties; `None` if its increment or offset is not a time.
    pub(super) fn new(start: Option<i128>, offset_s: f64, increment_s: f64) -> Option<Self> {
        let valid = increment_s > 0.0 && increment_s <= STEP_MAX && offset_s.abs() <= OFFSET_MAX;
        // LabVIEW writes the time 0 where the start is unknown.
        valid.then_some(Self { start: start.filter(|&time| time != 0), offset_s, increment_s })
    }

    /// Returns the times of the waveform; the time of day counts if `absolute` is true.
    pub(super) fn clock(&self, absolute: bool) -> Clock {
        let start = self.start.filter(|_| absolute).map_or(0, rounded);
        #[expect(clippy::cast_possible_truncation, reason = "below OFFSET_MAX")]
        let offset = (self.offset_s * 1e9).round() as i128;
        let nanoseconds = (self.increment_s * 1e9).round();
        let rate = self.increment_s.recip().round();
        let equal = |a: f64, b: f64| a.total_cmp(&b).is_eq();
        let step = if nanoseconds >= 1.0 && equal(nanoseconds / 1e9, self.increment_s) {
            #[expect(clippy::cast_possible_truncation, reason = "below STEP_MAX")]
            Step::Nanoseconds(nanoseconds as i128)
        } else if rate >= 1.0 && equal(rate.recip(), self.increment_s) {
            Step::Rate(rate)
        } else {
            Step::Seconds(self.increment_s)
        };
        Clock { start: start.saturating_add(offset), step }
    }
}

impl Clock {
    /// Returns the time of the first sample \[ns\].
    pub(super) fn start(&self) -> i128 {
        self.start
    }

    /// Returns the clock with times since an origin \[ns\].
    pub(super) fn since(self, origin: i128) -> Self {
        Self { start: self.start.saturating_sub(origin), ..self }
    }

    /// Returns the time of a sample \[s\].
    pub(super) fn time_s(&self, sample: u64) -> f64 {
        let start_s = wide(self.start) / 1e9;
        match self.step {
            Step::Nanoseconds(step) => wide(self.start.saturating_add(step.saturating_mul(i128::from(sample)))) / 1e9,
            Step::Rate(rate) => start_s + count_u64(sample) / rate,
            Step::Seconds(step) => start_s + count_u64(sample) * step,
        }
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_cmp, reason = "exact equality is meant")]
    use super::*;

    #[test]
    fn differences_of_timestamps() {
        let origin = 3_800_000_000 * SECOND + 12345;
        assert_eq!(difference_s(origin, origin), 0.0);
        // The count of 0.002 s is rounded as a double by writers.
        #[expect(clippy::cast_possible_truncation, reason = "below 1 << 64")]
        let count = (0.002 * 2_f64.powi(64)) as i128;
        assert_eq!(difference_s(origin + count + 500, origin), 0.002);
        assert_eq!(difference_s(origin - count, origin), -0.002);
        assert_eq!(difference_s(origin + SECOND / 3, origin), 1.0 / 3.0);
        assert_eq!(difference_s(origin + SECOND * 7 + SECOND / 2, origin), 7.5);
        for (a, b) in [(i128::MAX, i128::MIN), (i128::MIN, i128::MAX), (i128::MAX, 0), (i128::MIN, 0)] {
            assert!(difference_s(a, b).abs() > 1e18);
        }
    }

    #[test]
    fn times_of_waveforms() {
        let times = |increment: f64| {
            let clock = Waveform::new(None, 0.0, increment).unwrap().clock(true);
            [1, 3, 401, 1_000_003].map(|n| clock.time_s(n))
        };
        assert_eq!(times(0.002), [0.002, 0.006, 0.802, 2000.006]);
        assert_eq!(times(1.0 / 51200.0), [1.0 / 51200.0, 3.0 / 51200.0, 401.0 / 51200.0, 1_000_003.0 / 51200.0]);
        assert_eq!(times(0.123_456_789_012)[1], 0.123_456_789_012 * 3.0);
        assert_eq!(Waveform::new(None, 0.0, 1.0 / 49.0).unwrap().clock(true).time_s(49), 1.0);
        let late = Waveform::new(Some(10 * SECOND), 0.25, 0.5).unwrap();
        assert_eq!(late.clock(true).start(), 10 * NANO + NANO / 4);
        assert_eq!(late.clock(true).since(10 * NANO).time_s(2), 1.25);
        assert_eq!(late.clock(false).time_s(2), 1.25);
        assert_eq!(Waveform::new(Some(0), 0.0, 1.0).unwrap().start, None);
        for (offset, increment) in [(0.0, 0.0), (0.0, -1.0), (0.0, f64::NAN), (f64::INFINITY, 1.0), (f64::NAN, 1.0)] {
            assert_eq!(Waveform::new(None, offset, increment), None);
        }
        let far = Waveform::new(Some(i128::MIN), 1e15, 1e9).unwrap().clock(true);
        assert!(far.since(i128::MAX).time_s(u64::MAX).is_finite());
    }
}
