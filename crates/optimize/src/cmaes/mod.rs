//! CMA-ES, the covariance matrix adaptation evolution strategy (N. Hansen, A. Ostermeier, Evol. Comput. 9 (2001)), with active
//! update (G. A. Jastrebski, D. V. Arnold, IEEE CEC 2006) and restarts.
//!
//! Each generation is drawn from a normal distribution in the box scaled to the unit cube; the distribution is updated from the order
//! of the costs. The first mean of each run is uniform in the box. The number of samples is its own setting: the evaluations of the
//! budget, population times generations, are spent in more and smaller generations.

mod bounds;
mod distribution;
mod restarts;

pub use restarts::Restarts;

use super::population::Population;
use super::rule::Rule;
use super::table::{Range, SWITCH, search};
use bounds::Penalty;
use distribution::{Distribution, Strategy};
use nalgebra::DVector;
use restarts::{LAMBDA_MAX, RecentCosts, Schedule, Start, published_lambda};

search! {
    CmaEs = "cmaes", "CMA-ES with restarts";
    /// Settings of CMA-ES.
    pub struct CmaEsOptions {
        /// Number of samples of a generation of the first run; 0 for the published 4 + ⌊3 ln n⌋ with n axes.
        lambda: usize = 0, "lambda" in Range::Count(LAMBDA_MAX);
        /// First step size, as a fraction of the range of each axis.
        sigma: f64 = 0.2, "sigma" in Range::Number(0.0, 1.0, true);
        /// Restarts once a run has converged: with alternating, growing or the same number of samples.
        restarts: Restarts = Restarts::Bipop, "restarts" in Range::Choice(&["bipop", "ipop", "same"]);
        /// True if the worst samples reduce the variance in their directions.
        active: bool = true, "active" in SWITCH;
    }
}

/// The present run of the strategy.
struct Current {
    start: Start,
    strategy: Strategy,
    distribution: Distribution,
    penalty: Penalty,
    recent: RecentCosts,
    evaluations: u64,
}

#[derive(Default)]
struct CmaEs {
    options: CmaEsOptions,
    schedule: Schedule,
    current: Option<Current>,
    /// True if the present run has ended, so that the next generation begins another one.
    has_ended: bool,
    /// Samples in the unit cube before they were moved into it, row-major.
    samples: Vec<f64>,
}

impl CmaEs {
    /// Begins a run at a mean uniform in the box.
    fn restart(&mut self, start: Start, population: &mut Population) {
        let numbers = &mut population.numbers[0];
        let axes = population.setup.bounds.len();
        let mean = DVector::from_fn(axes, |_, _| numbers.unit());
        self.current = Some(Current {
            start,
            strategy: Strategy::new(axes, start.lambda, self.options.active),
            distribution: Distribution::new(mean, self.options.sigma * start.scale),
            penalty: Penalty::default(),
            recent: RecentCosts::default(),
            evaluations: 0,
        });
        self.has_ended = false;
    }

    /// Replaces the population by samples of the distribution.
    fn sample(&mut self, population: &mut Population) {
        let Some(current) = &self.current else { return };
        let Population { setup, numbers, values, .. } = population;
        let size = current.strategy.lambda * setup.bounds.len();
        self.samples.resize(size, 0.0);
        for sample in self.samples.chunks_exact_mut(setup.bounds.len()) {
            current.distribution.draw(&mut numbers[0], sample);
        }
        let inside = |(x, (min, max)): (&f64, &(f64, f64))| (min + (max - min) * x.clamp(0.0, 1.0)).clamp(*min, *max);
        values.clear();
        values.extend(self.samples.iter().zip(setup.bounds.iter().cycle()).map(inside));
    }
}

impl Rule for CmaEs {
    fn begin(&mut self, population: &mut Population) {
        let published = published_lambda(population.width());
        let lambda = if self.options.lambda == 0 { published } else { self.options.lambda.max(2) };
        let start = self.schedule.begin(lambda);
        self.restart(start, population);
        self.sample(population);
    }

    fn learn(&mut self, population: &Population, mut costs: Vec<f64>) {
        let Some(current) = &mut self.current else { return };
        current.evaluations += costs.len() as u64;
        let width = population.width();
        if costs.len() < current.strategy.lambda {
            return;
        }
        let Current { strategy, distribution, penalty, recent, .. } = current;
        penalty.adapt(distribution, strategy, &costs);
        let rows: Vec<&[f64]> = self.samples.chunks_exact(width).collect();
        costs.iter_mut().zip(&rows).for_each(|(cost, row)| *cost += penalty.of(distribution, row));
        let mut order: Vec<usize> = (0..costs.len()).collect();
        order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
        let ordered: Vec<&[f64]> = order.iter().map(|n| rows[*n]).collect();
        let sorted: Vec<f64> = order.iter().map(|n| costs[*n]).collect();
        if sorted[0].is_finite() {
            distribution.update(strategy, &ordered);
        }
        let sigma = self.options.sigma * current.start.scale;
        self.has_ended = recent.has_ended(&sorted, distribution, strategy, sigma)
            || current.evaluations >= current.start.evaluations;
    }

    fn changes_size(&self) -> bool {
        true
    }

    fn advance(&mut self, population: &mut Population) {
        if self.has_ended {
            let spent = self.current.as_ref().map_or(0, |current| current.evaluations);
            let start = self.schedule.next(self.options.restarts, spent, &mut population.numbers[0]);
            self.restart(start, population);
        }
        self.sample(population);
    }
}
