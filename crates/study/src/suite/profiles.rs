//! Distributions of running times over problems, and profiles.

use super::gap::GAP_MIN;
use super::run::SuiteResult;
use motorfit_core::numeric::{count, count_u64};

/// Points of a distribution: a number of evaluations or a ratio, and the fraction up to it.
pub type Profile = Vec<(f64, f64)>;

/// Number of targets of a distribution, equally spaced in the logarithm from a gap of 1 down to [`GAP_MIN`].
const TARGETS: usize = 41;

/// Returns the empirical distribution of values: at each finite value the fraction of `of` that is at most the value.
fn distribution(mut values: Vec<f64>, of: usize) -> Profile {
    values.retain(|value| value.is_finite());
    values.sort_by(f64::total_cmp);
    let mut points: Profile = Vec::new();
    for (n, value) in (1..).zip(values) {
        let point = (value, count(n) / count(of.max(1)));
        match points.last_mut() {
            Some(last) if last.0.total_cmp(&value).is_eq() => *last = point,
            _ => points.push(point),
        }
    }
    points
}

impl SuiteResult {
    /// Returns for each entrant the fraction of all (problem, run, target) triples reached, over evaluations divided by the number of
    /// free parameters, as COCO shows it. Targets are 41 gaps from 1 down to 1e-8.
    #[must_use]
    pub fn reached(&self, budget: usize) -> Vec<Profile> {
        let gaps = (0..TARGETS).map(|n| GAP_MIN.powf(count(n) / count(TARGETS - 1)));
        let targets: Vec<f64> = gaps.collect();
        let one = |entrant: usize| {
            let (mut times, mut all) = (Vec::new(), 0);
            for (problem, block) in self.of_budget(budget) {
                let axes = count(problem.truth.len());
                for run in block.of(entrant) {
                    let reached = targets.iter().filter_map(|gap| run.evaluations_to(problem.cost(*gap)));
                    times.extend(reached.map(|evaluations| count_u64(evaluations) / axes));
                    all += targets.len();
                }
            }
            distribution(times, all)
        };
        (0..self.spec.entrants.len()).map(one).collect()
    }

    /// Returns the expected running time of each entrant on each problem of a budget, shape `[entrants][problems]`.
    fn running_times(&self, budget: usize, gap: f64) -> Vec<Vec<f64>> {
        let time = |attempts: Vec<super::measures::Attempt>| super::measures::running_time(attempts.into_iter());
        let one = |entrant: usize| self.attempts(budget, entrant, gap).into_iter().map(time).collect();
        (0..self.spec.entrants.len()).map(one).collect()
    }

    /// Returns for each entrant the fraction of problems whose expected running time to a relative gap is within a factor of the
    /// shortest one, over the factor: the performance profile of Dolan and Moré.
    #[must_use]
    pub fn performance_profile(&self, budget: usize, gap: f64) -> Vec<Profile> {
        let times = self.running_times(budget, gap);
        let problems = self.of_budget(budget).count();
        let shortest = |problem: usize| times.iter().map(|times| times[problem]).fold(f64::INFINITY, f64::min);
        let ratios = |times: &Vec<f64>| times.iter().enumerate().map(|(n, time)| time / shortest(n)).collect();
        times.iter().map(|times| distribution(ratios(times), problems)).collect()
    }

    /// Returns for each entrant the fraction of problems whose expected running time to a relative gap is within a number of simplex
    /// gradients (evaluations divided by one more than the free parameters), over that number: the data profile of Moré and Wild.
    #[must_use]
    pub fn data_profile(&self, budget: usize, gap: f64) -> Vec<Profile> {
        let axes: Vec<f64> = self.of_budget(budget).map(|(problem, _)| count(problem.truth.len())).collect();
        let gradients = |times: &Vec<f64>| times.iter().zip(&axes).map(|(time, axes)| time / (axes + 1.0)).collect();
        self.running_times(budget, gap).iter().map(|times| distribution(gradients(times), axes.len())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distributions_are_step_functions_of_sorted_values() {
        let points = distribution(vec![3.0, f64::INFINITY, 1.0, 3.0, f64::NAN], 8);
        assert_eq!(points, [(1.0, 1.0 / 8.0), (3.0, 3.0 / 8.0)]);
        assert!(distribution(Vec::new(), 0).is_empty());
    }
}
