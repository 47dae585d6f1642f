//! Restarts of CMA-ES: BIPOP (N. Hansen, GECCO 2009) and IPOP (A. Auger, N. Hansen, IEEE CEC 2005), and the conditions under which
//! a run ends.

use super::distribution::{Distribution, Strategy};
use crate::numbers::Numbers;
use crate::table::setting_choice;
use motorfit_core::numeric::{count, whole};
use std::collections::VecDeque;

/// Restarts once a run has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Restarts {
    /// Runs with twice the samples of the largest so far alternate with runs with few samples and a small step size, so that both
    /// take as many evaluations.
    Bipop,
    /// Every run has twice the samples of the one before.
    Ipop,
    /// Every run has the same number of samples.
    Same,
}

setting_choice!(Restarts: Restarts::Bipop, Restarts::Ipop, Restarts::Same);

/// Factor of the number of samples at a restart.
const GROWTH: usize = 2;
/// Largest number of samples of a generation.
pub(super) const LAMBDA_MAX: u32 = 1 << 16;

/// Settings of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Start {
    pub lambda: usize,
    /// Step size relative to that of the settings.
    pub scale: f64,
    /// Largest number of evaluations of the run.
    pub evaluations: u64,
}

/// The runs so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Schedule {
    /// Number of samples of the first run, and of the last run with many.
    first: usize,
    many: usize,
    /// Evaluations of the runs with many samples and of those with few.
    spent: [u64; 2],
    /// True if the present run has few samples.
    is_few: bool,
}

impl Schedule {
    /// Returns the first run, whose evaluations count as those of runs with few samples.
    pub(super) fn begin(&mut self, lambda: usize) -> Start {
        (self.first, self.many, self.is_few) = (lambda, lambda, true);
        Start { lambda, scale: 1.0, evaluations: u64::MAX }
    }

    /// Returns the next run after one with so many evaluations.
    pub(super) fn next(&mut self, restarts: Restarts, evaluations: u64, numbers: &mut Numbers) -> Start {
        self.spent[usize::from(self.is_few)] += evaluations;
        let [many, few] = self.spent;
        self.is_few = restarts == Restarts::Bipop && few < many;
        if self.is_few {
            let ratio = 0.5 * count(self.many) / count(self.first);
            let size = whole(count(self.first) * ratio.powf(numbers.unit().powi(2)));
            let scale = 10.0_f64.powf(-2.0 * numbers.unit());
            return Start { lambda: size.max(self.first), scale, evaluations: (many / 2).max(1) };
        }
        if restarts != Restarts::Same {
            self.many = (self.many * GROWTH).min(LAMBDA_MAX as usize);
        }
        Start { lambda: self.many, scale: 1.0, evaluations: u64::MAX }
    }
}

/// The best costs of the last generations of a run, by which it ends.
#[derive(Debug, Clone, Default)]
pub(super) struct RecentCosts {
    best: VecDeque<f64>,
    /// For each of the last generations, true if the best costs were equal.
    is_flat: VecDeque<bool>,
}

/// Range of the best costs, relative to the lowest, below which a run ends.
const COST_RANGE: f64 = 1e-12;
/// Standard deviations, relative to the first step size, below which a run ends.
const STEP: f64 = 1e-12;
/// Condition number of the covariance above which a run ends.
const CONDITION: f64 = 1e14;
/// Growth of the step size above which a run ends.
const DIVERGENCE: f64 = 1e4;

impl RecentCosts {
    /// Takes the costs of a generation in ascending order. Returns true if the run has ended, by the conditions of BIPOP: the best
    /// costs, equal costs, standard deviations, the condition number, no effect on the mean, and the number of generations.
    pub(super) fn has_ended(&mut self, sorted: &[f64], at: &Distribution, strategy: &Strategy, sigma: f64) -> bool {
        let (n, lambda) = (count(at.mean.len()), count(strategy.lambda));
        let generations = 10 + whole((30.0 * n / lambda).ceil());
        let behind = 1 + whole((0.1 + lambda / 4.0).ceil());
        self.best.push_back(sorted[0]);
        self.is_flat.push_back(sorted[0].to_bits() == sorted[behind.min(sorted.len() - 1)].to_bits());
        while self.best.len() > generations {
            self.best.pop_front();
        }
        while self.is_flat.len() > at.mean.len().max(3) {
            self.is_flat.pop_front();
        }
        let (low, high) = self
            .best
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), cost| (low.min(*cost), high.max(*cost)));
        let flat = self.is_flat.iter().filter(|flat| **flat).count();
        let largest = 100.0 + 50.0 * (n + 3.0).powi(2) / lambda.sqrt();
        !sorted[0].is_finite()
            || self.best.len() == generations && high - low <= COST_RANGE * low.abs()
            || self.is_flat.len() == at.mean.len().max(3) && 3 * flat > self.is_flat.len()
            || at.is_within(STEP * sigma)
            || at.condition() > CONDITION
            || at.sigma * at.lengths.max() > DIVERGENCE * sigma
            || !at.mean.iter().all(|x| x.is_finite())
            || at.has_no_effect()
            || count(at.generation) > largest
    }
}

/// Returns the published number of samples, `4 + ⌊3 ln n⌋`.
pub(super) fn published_lambda(axes: usize) -> usize {
    4 + whole((3.0 * count(axes).ln()).floor())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SearchSettings;
    use crate::population::Population;

    fn numbers() -> Numbers {
        Population::new(SearchSettings { bounds: vec![(0.0, 1.0)], ..SearchSettings::default() }).unwrap().numbers[0]
            .clone()
    }

    #[test]
    fn few_and_many_samples_take_as_many_evaluations() {
        let (mut schedule, mut numbers) = (Schedule::default(), numbers());
        assert_eq!(schedule.begin(8).lambda, 8);
        let (mut spent, mut largest, mut ran) = ([0, 0], 8, 500);
        for _ in 0..40 {
            spent[usize::from(schedule.is_few)] += ran;
            let start = schedule.next(Restarts::Bipop, ran, &mut numbers);
            assert_eq!(schedule.is_few, spent[1] < spent[0], "the regime that has spent less runs next");
            if schedule.is_few {
                assert!(
                    (4..=largest / 2 + 8).contains(&start.lambda) && (0.01..=1.0).contains(&start.scale),
                    "{start:?}"
                );
                assert_eq!(start.evaluations, spent[0] / 2);
                ran = start.evaluations;
            } else {
                largest *= 2;
                assert_eq!((start.lambda, start.scale.to_bits()), (largest.min(1 << 16), 1.0_f64.to_bits()));
                ran = 100 * largest as u64;
            }
        }
        assert!(largest > 64 && 2 * spent[1] > spent[0], "{spent:?}");
        let mut lambdas = |restarts: Restarts| {
            let mut schedule = Schedule::default();
            schedule.begin(8);
            [0; 3].map(|_| schedule.next(restarts, 100, &mut numbers).lambda)
        };
        assert_eq!((lambdas(Restarts::Ipop), lambdas(Restarts::Same)), ([16, 32, 64], [8, 8, 8]));
    }

    #[test]
    fn the_published_number_of_samples() {
        assert_eq!([1, 2, 5, 10, 30].map(published_lambda), [4, 6, 8, 10, 14]);
    }
}
