//! Measurements of a throughput benchmark and the conclusions from them.
//!
//! Each time is a median over rounds with a distribution-free 95 % confidence interval from order statistics. The
//! baseline is measured twice as a control: if the two measurements differ by more than their intervals, the intervals
//! are too narrow for this machine.

use super::contender::Contender;
use motorfit_core::numeric;
use motorfit_identify::device::{AdapterThroughput, ThroughputCurve, ThroughputProfile};

/// Time of one evaluator for one population size and one length of the recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// Index of the evaluator in [`Throughput::contenders`].
    pub contender: usize,
    /// Number of candidates.
    pub population: usize,
    /// Number of samples of the recording.
    pub samples: usize,
    /// Median time of a batch \[s\]; `None` if the time budget does not allow a round.
    pub seconds: Option<f64>,
    /// 95 % confidence interval of the median \[s\]; NaN with fewer than six rounds, which cannot give one.
    pub interval: [f64; 2],
    /// Number of rounds.
    pub rounds: usize,
    /// Time that the device computed in one evaluation, by its own clock, and the time of that evaluation end to end
    /// \[s\]; `None` if the device has no clock.
    pub kernel: Option<[f64; 2]>,
    /// Median and interval of the control, the second measurement of the baseline \[s\]; `None` for other evaluators.
    pub again: Option<(f64, [f64; 2])>,
}

impl Measurement {
    pub(super) fn of(contender: usize, population: usize, samples: usize, mut times: Vec<f64>) -> Self {
        times.sort_by(f64::total_cmp);
        let rounds = times.len();
        let seconds = (rounds > 0).then(|| numeric::median(&times));
        let interval = if rounds < ROUNDS_MIN {
            [f64::NAN; 2]
        } else {
            let outside = outside(rounds);
            [times[outside], times[rounds - 1 - outside]]
        };
        Self { contender, population, samples, seconds, interval, rounds, kernel: None, again: None }
    }

    /// Returns the throughput end to end \[candidate-steps/s\].
    #[must_use]
    pub fn rate(&self) -> Option<f64> {
        self.seconds.map(|seconds| self.steps() / seconds)
    }

    /// Returns the throughput by the device's own clock \[candidate-steps/s\].
    #[must_use]
    pub fn kernel_rate(&self) -> Option<f64> {
        self.kernel.map(|[seconds, _]| self.steps() / seconds)
    }

    /// Returns half the width of the interval relative to the median; `None` with fewer than six rounds.
    #[must_use]
    pub fn spread(&self) -> Option<f64> {
        let half = 0.5 * (self.interval[1] - self.interval[0]);
        self.seconds.map(|median| half / median).filter(|spread| spread.is_finite())
    }

    /// Returns the bounds of the time \[s\]: the interval or, with fewer than six rounds, the median divided and
    /// multiplied by [`UNCERTAINTY_FACTOR`].
    fn limits(&self) -> Option<[f64; 2]> {
        self.seconds.map(|s| {
            if self.interval[0].is_nan() { [s / UNCERTAINTY_FACTOR, s * UNCERTAINTY_FACTOR] } else { self.interval }
        })
    }

    fn steps(&self) -> f64 {
        numeric::count(self.population) * numeric::count(self.samples)
    }
}

/// Fewest rounds that give a 95 % interval of the median.
const ROUNDS_MIN: usize = 6;
/// Largest assumed error of a time measured in fewer rounds, as a factor.
const UNCERTAINTY_FACTOR: f64 = 1.25;

/// Smallest population size from which one evaluator is faster than another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Crossover {
    /// Faster from this population size on, wherever both were measured.
    From(usize),
    /// Not faster at the largest population size at which both were measured.
    Never,
    /// No population size was measured for both.
    Unknown,
}

/// Returns the number of the `n` sorted values that are outside, on each side, a 95 % confidence interval of the
/// median: the largest number of heads whose cumulative probability in `n` tosses of a fair coin is at most 2.5 %.
fn outside(n: usize) -> usize {
    let mut probability = 0.5_f64.powi(i32::try_from(n).unwrap_or(i32::MAX));
    let (mut sum, mut count) = (probability, 0);
    while sum <= 0.025 {
        count += 1;
        probability *= numeric::count(n - count + 1) / numeric::count(count);
        sum += probability;
    }
    count.saturating_sub(1).min((n - 1) / 2)
}

/// Comparison of the baseline with its control over all cases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// Index of the evaluator that was measured twice.
    pub contender: usize,
    /// Number of cases.
    pub cases: usize,
    /// Number of cases in which the two intervals do not overlap.
    pub apart: usize,
    /// Median and largest relative difference between the two measurements.
    pub difference: [f64; 2],
}

/// Result of a throughput benchmark.
pub struct Throughput {
    /// The evaluators that were measured.
    pub contenders: Vec<Contender>,
    /// Error messages of evaluators that could not be opened or failed in a measurement.
    pub refused: Vec<String>,
    /// One measurement per evaluator and case.
    pub measurements: Vec<Measurement>,
    /// Peak rate of one core, measured in the same run \[multiply–adds/s\]; `None` without FMA instructions.
    pub fma_peak: Option<f64>,
    /// True if the observer ended the benchmark early.
    pub interrupted: bool,
}

impl Throughput {
    /// Returns the measurements of an evaluator.
    pub fn of(&self, contender: usize) -> impl Iterator<Item = &Measurement> {
        self.measurements.iter().filter(move |m| m.contender == contender)
    }

    /// Returns the measurement of an evaluator for a population size and a number of samples, if there is one.
    #[must_use]
    pub fn case(&self, contender: usize, population: usize, samples: usize) -> Option<&Measurement> {
        self.of(contender).find(|m| m.population == population && m.samples == samples)
    }

    /// Returns the index of the evaluator that others are compared with: the last kernel of the CPU, SIMD on all threads.
    #[must_use]
    pub fn baseline(&self) -> Option<usize> {
        self.contenders.iter().rposition(|c| c.evaluator == "kernel")
    }

    /// Returns the population size from which `contender` is faster than `baseline` on recordings of `samples` samples,
    /// by more than both intervals.
    #[must_use]
    pub fn crossover(&self, contender: usize, baseline: usize, samples: usize) -> Crossover {
        let limits = |who: usize, population: usize| self.case(who, population, samples).and_then(Measurement::limits);
        let mut both: Vec<(usize, bool)> = Vec::new();
        for m in self.of(contender).filter(|m| m.samples == samples) {
            if let (Some(ours), Some(theirs)) = (m.limits(), limits(baseline, m.population)) {
                both.push((m.population, ours[1] < theirs[0]));
            }
        }
        both.sort_unstable();
        // A win at a population size below a loss does not count.
        let first = both.iter().rposition(|(_, wins)| !wins).map_or(0, |last| last + 1);
        match (both.is_empty(), both.get(first)) {
            (true, _) => Crossover::Unknown,
            (_, Some((population, _))) => Crossover::From(*population),
            (_, None) => Crossover::Never,
        }
    }

    /// Compares the two measurements of the baseline; `None` if no case has an interval.
    #[must_use]
    pub fn control(&self) -> Option<Control> {
        let contender = self.baseline()?;
        let pair = |m: &Measurement| {
            let (seconds, (again, interval)) = (m.seconds.filter(|_| m.rounds >= ROUNDS_MIN)?, m.again?);
            let apart = m.interval[1] < interval[0] || interval[1] < m.interval[0];
            Some(((again - seconds).abs() / seconds, apart))
        };
        let mut pairs: Vec<(f64, bool)> = self.of(contender).filter_map(pair).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let difference = [pairs.get(pairs.len().saturating_sub(1) / 2)?.0, pairs.last()?.0];
        let apart = pairs.iter().filter(|(_, apart)| *apart).count();
        Some(Control { contender, cases: pairs.len(), apart, difference })
    }

    /// Returns the throughput profile from which `auto` chooses a device; `None` if the CPU was not measured.
    #[must_use]
    pub fn throughput_profile(&self) -> Option<ThroughputProfile> {
        let curve = |n: usize| {
            let point = |m: &Measurement| Some((m.samples as u64, m.population as u64, m.seconds?));
            ThroughputCurve { points: self.of(n).filter_map(point).collect() }
        };
        let adapter = |(n, contender): (usize, &Contender)| {
            let (backend, driver) = contender.driver.clone()?;
            Some(AdapterThroughput {
                name: contender.device.clone(),
                kind: contender.kind.to_owned(),
                backend,
                driver,
                precision: contender.precision.to_owned(),
                opening_s: contender.opening_s,
                curve: curve(n),
            })
        };
        let baseline = self.baseline()?;
        Some(ThroughputProfile {
            motorfit: env!("CARGO_PKG_VERSION").to_owned(),
            cpu: ThroughputProfile::this_cpu(),
            threads: self.contenders[baseline].threads,
            curve: curve(baseline),
            adapters: self.contenders.iter().enumerate().filter_map(adapter).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    /// Returns the facts of an evaluator.
    fn named(name: &str) -> Contender {
        Contender::on_cpu(name.to_owned(), 1, 8.0)
    }

    fn result(contenders: Vec<Contender>, measurements: Vec<Measurement>) -> Throughput {
        Throughput { contenders, refused: Vec::new(), measurements, fma_peak: None, interrupted: false }
    }

    #[test]
    fn a_crossover_needs_a_win_at_every_larger_population() {
        let seconds = [[1.0, 2.0, 10.0, 40.0], [3.0, 1.5, 12.0, 20.0], [0.5, 1.0, 5.0, 20.0]];
        let mut measurements = Vec::new();
        for (contender, seconds) in seconds.iter().enumerate() {
            for (n, seconds) in seconds.iter().enumerate() {
                measurements.push(Measurement::of(contender, [1, 10, 100, 1000][n], 10, vec![*seconds]));
            }
        }
        let mut result = result(["base", "late", "always"].map(named).into(), measurements);
        // The win at 10 is followed by a loss at 100, so only 1000 counts.
        assert_eq!(result.crossover(1, 0, 10), Crossover::From(1000));
        assert_eq!(result.crossover(2, 0, 10), Crossover::From(1));
        assert_eq!(result.crossover(0, 2, 10), Crossover::Never);
        assert_eq!(result.crossover(1, 0, 99), Crossover::Unknown);
        assert_eq!(result.measurements[0].rate(), Some(10.0));
        // A lead smaller than the intervals does not count.
        result.measurements[7].interval = [10.0, 50.0];
        assert_eq!(result.crossover(1, 0, 10), Crossover::Never);
        // A case that only one of the two measured counts for neither.
        result.measurements[7].interval = [f64::NAN; 2];
        result.measurements[3].seconds = None;
        assert_eq!(result.crossover(1, 0, 10), Crossover::Never);
        assert_eq!(result.crossover(2, 0, 10), Crossover::From(1));
    }

    #[test]
    fn intervals_cover_the_median() {
        // Tabulated order statistics: values outside the 95 % interval on each side, for n values.
        for (n, expected) in [(1, 0), (5, 0), (6, 0), (8, 0), (9, 1), (11, 1), (12, 2), (15, 3), (20, 5), (25, 7)] {
            assert_eq!(outside(n), expected, "{n}");
        }
        let m = Measurement::of(0, 1, 1, (1..=9).rev().map(f64::from).collect());
        assert_eq!((m.seconds, m.interval, m.rounds), (Some(5.0), [2.0, 8.0], 9));
        let few = Measurement::of(0, 1, 1, vec![1.0, 2.0]);
        assert_eq!((few.seconds, few.spread()), (Some(1.5), None), "two rounds have no interval of 95 %");
        assert_eq!(Measurement::of(0, 1, 1, Vec::new()).seconds, None);
    }

    #[test]
    fn a_control_reveals_intervals_that_are_too_narrow() {
        let times = |from: f64| (0..9).map(|n| from + f64::from(n)).collect::<Vec<f64>>();
        let case = |population: usize, again: f64| {
            let control = Measurement::of(0, population, 9, times(again));
            let again = control.seconds.map(|median| (median, control.interval));
            Measurement { again, ..Measurement::of(0, population, 9, times(100.0)) }
        };
        let result = result(vec![named("a")], vec![case(1, 120.0), case(2, 101.0)]);
        let control = result.control().unwrap();
        assert_eq!((control.contender, control.cases, control.apart), (0, 2, 1));
        assert!((control.difference[1] - 20.0 / 104.0).abs() < 1e-12);
    }
}
