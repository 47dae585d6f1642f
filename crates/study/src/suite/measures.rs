//! Success rates and expected running times.

use super::definition::SuiteProblem;
use super::run::{SuiteBlock, SuiteResult, SuiteRun};
use motorfit_core::numeric::{count, count_u64, quantile, sorted};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Number of bootstrap resamples.
const RESAMPLES: usize = 1000;

/// Success rate and expected running time of a search at one budget and target, over all problems or on one.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct SuiteMeasure {
    /// Fraction of runs that reached the target; NaN without runs.
    pub success: f64,
    /// Expected running time \[evaluations\]: the evaluations of all runs, up to the target or to the end, divided by the number of
    /// runs that reached it; +∞ if none did. Over several problems it is that for a problem drawn at random.
    pub ert: f64,
    /// 95 % percentile bootstrap interval of the expected running time, resampled over the runs of each problem.
    #[serde(rename = "ert_ci95")]
    pub ert_interval: [f64; 2],
}

/// Evaluations of a run, up to the target or to the end, and true if it reached the target.
pub(super) type Attempt = (u64, bool);

/// Returns the expected running time of attempts.
pub(super) fn running_time(attempts: impl Iterator<Item = Attempt>) -> f64 {
    let (spent, successes) =
        attempts.fold((0_u64, 0_u64), |(spent, n), (more, hit)| (spent.saturating_add(more), n + u64::from(hit)));
    if successes == 0 { f64::INFINITY } else { count_u64(spent) / count_u64(successes) }
}

impl SuiteMeasure {
    /// Returns the measure of the attempts on each problem; `seed` draws the bootstrap.
    pub(super) fn of(problems: &[Vec<Attempt>], seed: u64) -> Self {
        let all = || problems.iter().flatten().copied();
        let runs = all().count();
        let success = count(all().filter(|(_, hit)| *hit).count()) / count(runs);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut resampled = || {
            let mut drawn = Vec::with_capacity(runs);
            for attempts in problems.iter().filter(|attempts| !attempts.is_empty()) {
                drawn.extend((0..attempts.len()).map(|_| attempts[random.random_range(0..attempts.len())]));
            }
            running_time(drawn.into_iter())
        };
        let ert = running_time(all());
        let times =
            if ert.is_finite() { sorted(&(0..RESAMPLES).map(|_| resampled()).collect::<Vec<_>>()) } else { Vec::new() };
        let ert_interval = if times.is_empty() { [ert; 2] } else { [0.025, 0.975].map(|p| quantile(&times, p)) };
        Self { success, ert, ert_interval }
    }
}

impl SuiteResult {
    /// Returns the attempts of an entrant to reach a relative gap, on each problem of a budget.
    pub(super) fn attempts(&self, budget: usize, entrant: usize, gap: f64) -> Vec<Vec<Attempt>> {
        let of = |(problem, block): (&SuiteProblem, &SuiteBlock)| {
            let target = problem.cost(gap);
            let attempt = |run: &SuiteRun| {
                let reached = run.evaluations_to(target);
                (reached.unwrap_or(run.evaluations), reached.is_some())
            };
            block.of(entrant).iter().map(attempt).collect()
        };
        self.of_budget(budget).map(of).collect()
    }

    /// Returns success rate and expected running time of an entrant over all problems of a budget. Indices are those of the settings.
    #[must_use]
    pub fn measure(&self, budget: usize, entrant: usize, gap: f64) -> SuiteMeasure {
        SuiteMeasure::of(&self.attempts(budget, entrant, gap), self.spec.seed)
    }

    /// Returns the name of each problem of a budget with success rate and expected running time of an entrant on it.
    #[must_use]
    pub fn measures(&self, budget: usize, entrant: usize, gap: f64) -> Vec<(&str, SuiteMeasure)> {
        let names = self.of_budget(budget).map(|(problem, _)| problem.name.as_str());
        let attempts = self.attempts(budget, entrant, gap).into_iter();
        names.zip(attempts.map(|attempts| SuiteMeasure::of(&[attempts], self.spec.seed))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn running_times_are_those_of_the_definition() {
        // Two successes after 10 and 30 of 100 evaluations, one failure: 140 evaluations for two successes.
        let attempts = vec![(10, true), (30, true), (100, false)];
        let measure = SuiteMeasure::of(std::slice::from_ref(&attempts), 1);
        assert_eq!((measure.success, measure.ert), (2.0 / 3.0, 70.0));
        assert!(measure.ert_interval[0] < 70.0 && measure.ert_interval[1] > 70.0, "{measure:?}");
        // A problem without a success adds its evaluations.
        let both = SuiteMeasure::of(&[attempts, vec![(100, false); 3]], 1);
        assert_eq!((both.success, both.ert), (1.0 / 3.0, 220.0));
        let none = SuiteMeasure::of(&[vec![(100, false)]], 1);
        assert_eq!((none.success, none.ert), (0.0, f64::INFINITY));
        assert!(SuiteMeasure::of(&[], 1).success.is_nan());
    }

    #[test]
    fn intervals_of_running_times_cover_the_expectation() {
        // Success with probability 1/2 after an exponential time of mean 20, else 100 evaluations: the expectation of a restarted
        // search is (0.5 · 20 + 0.5 · 100) / 0.5 = 120. 400 samples of 60 runs: 380 ± 4.4 are expected, and percentile
        // intervals of a ratio from 60 runs cover a little less.
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut attempt = || match random.random::<f64>() < 0.5 {
            true => (1000.0 * -20.0 * (1.0 - random.random::<f64>()).ln(), true),
            false => (100_000.0, false),
        };
        let covered = (0..400).filter(|&seed| {
            let attempts = (0..60)
                .map(|_| attempt())
                .map(|(spent, hit)| (motorfit_core::numeric::whole_u64(spent), hit))
                .collect();
            let [low, high] = SuiteMeasure::of(&[attempts], seed).ert_interval;
            (low..=high).contains(&120_000.0)
        });
        let covered = covered.count();
        assert!((362..=394).contains(&covered), "{covered} of 400");
    }
}
