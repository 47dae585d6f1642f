//! Measurements of a bench, and conclusions from them.
//!
//! A figure is the median over rounds with its interval of 95 % by order statistics, which supposes nothing about how
//! times are distributed. One contender is measured twice, as a control: where the two differ by more than their
//! intervals, those are too narrow for this machine.

use super::contender::Contender;
use crate::device::{AdapterThroughput, ThroughputCurve, ThroughputProfile};
use crate::numeric;

/// A contender at one population and recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// Which contender.
    pub contender: usize,
    /// Candidates.
    pub population: usize,
    /// Samples.
    pub samples: usize,
    /// Median seconds of a batch; `None` where the budget does not allow one.
    pub seconds: Option<f64>,
    /// An interval that covers the median with 95 %; NaN below six rounds, which cannot have one.
    pub interval: [f64; 2],
    /// Rounds.
    pub rounds: usize,
    /// Seconds that the device computed in an evaluation, by its own clock, and those of that evaluation from end to end;
    /// `None` without a clock.
    pub kernel: Option<[f64; 2]>,
    /// Median and interval of the same once more, as a control; of the baseline only.
    pub again: Option<(f64, [f64; 2])>,
}

impl Measurement {
    pub(super) fn of(contender: usize, population: usize, samples: usize, mut times: Vec<f64>) -> Self {
        times.sort_by(f64::total_cmp);
        let rounds = times.len();
        let seconds = (rounds > 0).then(|| numeric::median(&times));
        let interval = if rounds < FEWEST {
            [f64::NAN; 2]
        } else {
            let outside = outside(rounds);
            [times[outside], times[rounds - 1 - outside]]
        };
        Self { contender, population, samples, seconds, interval, rounds, kernel: None, again: None }
    }

    /// Candidate-steps a second.
    #[must_use]
    pub fn rate(&self) -> Option<f64> {
        self.seconds.map(|seconds| self.steps() / seconds)
    }

    /// Candidate-steps a second of the device's own time.
    #[must_use]
    pub fn kernel_rate(&self) -> Option<f64> {
        self.kernel.map(|[seconds, _]| self.steps() / seconds)
    }

    /// Half the interval, relative to the median; `None` below six rounds.
    #[must_use]
    pub fn spread(&self) -> Option<f64> {
        let half = 0.5 * (self.interval[1] - self.interval[0]);
        self.seconds.map(|median| half / median).filter(|spread| spread.is_finite())
    }

    /// From where to where the time may be: the interval, or what a single round is trusted for.
    fn limits(&self) -> Option<[f64; 2]> {
        self.seconds.map(|s| if self.interval[0].is_nan() { [s / ONCE, s * ONCE] } else { self.interval })
    }

    fn steps(&self) -> f64 {
        numeric::count(self.population) * numeric::count(self.samples)
    }
}

/// Rounds below which no interval covers the median with 95 %, and by which factor a single one may be off.
const FEWEST: usize = 6;
const ONCE: f64 = 1.25;

/// From which population on a contender is faster than another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Crossover {
    /// From here on, wherever both were measured.
    From(usize),
    /// Not at the largest population where both were measured.
    Never,
    /// They were nowhere measured both.
    Unknown,
}

/// Returns the number of `n` sorted values outside an interval that covers the median with 95 % on each side: as many as n
/// coins show heads at most with a chance of 2.5 %.
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

/// A contender against its control, over all cases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// The contender that was measured twice.
    pub contender: usize,
    /// Cases.
    pub cases: usize,
    /// Those where the two intervals do not meet.
    pub apart: usize,
    /// The median and the largest difference of the two, relative.
    pub difference: [f64; 2],
}

/// The result of a bench.
pub struct Throughput {
    /// Who took part.
    pub contenders: Vec<Contender>,
    /// Adapters that could not take part, and why.
    pub refused: Vec<String>,
    /// Every case of every contender.
    pub measurements: Vec<Measurement>,
    /// Multiply–adds a second of one core, measured in the same run; `None` without FMA.
    pub fma_peak: Option<f64>,
    /// True if the observer ended it early.
    pub interrupted: bool,
}

impl Throughput {
    /// Measurements of a contender.
    pub fn of(&self, contender: usize) -> impl Iterator<Item = &Measurement> {
        self.measurements.iter().filter(move |m| m.contender == contender)
    }

    /// A case of a contender.
    #[must_use]
    pub fn case(&self, contender: usize, population: usize, samples: usize) -> Option<&Measurement> {
        self.of(contender).find(|m| m.population == population && m.samples == samples)
    }

    /// The CPU at its best: what adapters are held against.
    #[must_use]
    pub fn baseline(&self) -> Option<usize> {
        self.contenders.iter().rposition(|c| c.kind == "cpu")
    }

    /// From which population on a contender is faster than another on recordings of so many samples, by more than both
    /// intervals.
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
        // From there on: not a lucky case among losses.
        let first = both.iter().rposition(|(_, wins)| !wins).map_or(0, |last| last + 1);
        match (both.is_empty(), both.get(first)) {
            (true, _) => Crossover::Unknown,
            (_, Some((population, _))) => Crossover::From(*population),
            (_, None) => Crossover::Never,
        }
    }

    /// Returns the difference between two measurements of the same evaluator.
    #[must_use]
    pub fn control(&self) -> Option<Control> {
        let contender = self.baseline()?;
        let pair = |m: &Measurement| {
            let (seconds, (again, interval)) = (m.seconds.filter(|_| m.rounds >= FEWEST)?, m.again?);
            let apart = m.interval[1] < interval[0] || interval[1] < m.interval[0];
            Some(((again - seconds).abs() / seconds, apart))
        };
        let mut pairs: Vec<(f64, bool)> = self.of(contender).filter_map(pair).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let difference = [pairs.get(pairs.len().saturating_sub(1) / 2)?.0, pairs.last()?.0];
        let apart = pairs.iter().filter(|(_, apart)| *apart).count();
        Some(Control { contender, cases: pairs.len(), apart, difference })
    }

    /// Returns the throughput by which `auto` chooses; `None` where the CPU was not measured.
    #[must_use]
    pub fn paces(&self) -> Option<ThroughputProfile> {
        let pace = |n: usize| {
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
                pace: pace(n),
            })
        };
        let baseline = self.baseline()?;
        Some(ThroughputProfile {
            motorfit: env!("CARGO_PKG_VERSION").to_owned(),
            cpu: ThroughputProfile::this_cpu(),
            threads: self.contenders[baseline].threads,
            pace: pace(baseline),
            adapters: self.contenders.iter().enumerate().filter_map(adapter).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::Scalar;

    /// A contender that is never run.
    fn named(name: &str) -> Contender {
        Contender::on_cpu(name.to_owned(), Box::new(Scalar), 1).unwrap()
    }

    fn result(contenders: Vec<Contender>, measurements: Vec<Measurement>) -> Throughput {
        Throughput { contenders, refused: Vec::new(), measurements, fma_peak: None, interrupted: false }
    }

    #[test]
    fn a_crossover_is_from_where_on_it_wins_and_stays() {
        let seconds = [[1.0, 2.0, 10.0, 40.0], [3.0, 1.5, 12.0, 20.0], [0.5, 1.0, 5.0, 20.0]];
        let mut measurements = Vec::new();
        for (contender, seconds) in seconds.iter().enumerate() {
            for (n, seconds) in seconds.iter().enumerate() {
                measurements.push(Measurement::of(contender, [1, 10, 100, 1000][n], 10, vec![*seconds]));
            }
        }
        let mut result = result(["base", "late", "always"].map(named).into(), measurements);
        // It wins at 10, loses at 100, wins at 1000: from 1000 on.
        assert_eq!(result.crossover(1, 0, 10), Crossover::From(1000));
        assert_eq!(result.crossover(2, 0, 10), Crossover::From(1));
        assert_eq!(result.crossover(0, 2, 10), Crossover::Never);
        assert_eq!(result.crossover(1, 0, 99), Crossover::Unknown);
        assert_eq!(result.measurements[0].rate(), Some(10.0));
        // A lead within the intervals is none.
        result.measurements[7].interval = [10.0, 50.0];
        assert_eq!(result.crossover(1, 0, 10), Crossover::Never);
        // What one of them could not afford is no loss and no win of the other.
        result.measurements[7].interval = [f64::NAN; 2];
        result.measurements[3].seconds = None;
        assert_eq!(result.crossover(1, 0, 10), Crossover::Never);
        assert_eq!(result.crossover(2, 0, 10), Crossover::From(1));
    }

    #[test]
    fn intervals_cover_the_median() {
        // Tables of order statistics: of n, how many lie outside on each side at 95 %.
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
    fn a_control_tells_intervals_that_are_too_narrow() {
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
