//! The scalar evaluator, the reference for the others: simulates one candidate after the other by `motor::simulate` and sums
//! errors in blocks.
//!
//! It simulates every sample, including those at rest before the input, and shares no loop with the fast evaluators.

use super::evaluator::{Batch, Evaluator};
use super::problem::Problem;
use super::signals::Signals;
use motorfit_core::Result;

/// The scalar reference evaluator, in f64 on one thread.
#[derive(Debug, Clone, Copy, Default)]
pub struct Scalar;

impl Scalar {
    /// Returns the cost of one candidate, which has one value per free axis.
    #[must_use]
    pub fn cost(problem: &Problem, candidate: &[f64]) -> f64 {
        let total = problem.signals().iter().enumerate().map(|(recording, signals)| {
            let sums = sums(problem, signals, candidate, recording);
            signals.factor[0] * sums[0] + signals.factor[1] * sums[1]
        });
        problem.cost(total.sum())
    }
}

impl Evaluator for Scalar {
    fn evaluate(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> Result<()> {
        batch.check(costs)?;
        let mut costs = costs.iter_mut();
        for group in batch.groups {
            let rows = (0..group.candidates.count()).map(|row| group.candidates.row(row));
            for (candidate, cost) in rows.zip(&mut costs) {
                *cost = Self::cost(group.problem, candidate);
            }
        }
        Ok(())
    }

    fn name(&self) -> String {
        "scalar f64, one thread".to_owned()
    }
}

/// Returns the weighted sums of errors per channel over all samples of one recording.
fn sums(problem: &Problem, signals: &Signals, candidate: &[f64], recording: usize) -> [f64; 2] {
    let absolute = problem.criterion().is_absolute();
    let mut sums = [Sum::default(); 2];
    let mut n = 0;
    problem.walk(candidate, recording, signals.initial, |x| {
        for channel in 0..2 {
            let e = signals.measured[n][channel] - x[channel];
            let loss = if absolute { e.abs() } else { e * e };
            sums[channel].add(loss * signals.weight.get(n).map_or(1.0, |w| w[channel]));
        }
        n += 1;
    });
    sums.map(Sum::value)
}

/// A sum in blocks. Its rounding error grows with the block length plus the number of blocks, not with their product.
#[derive(Clone, Copy, Default)]
struct Sum {
    total: f64,
    block: f64,
    terms: u32,
}

impl Sum {
    fn add(&mut self, term: f64) {
        self.block += term;
        self.terms += 1;
        if self.terms == 64 {
            *self = Self { total: self.total + self.block, ..Self::default() };
        }
    }

    fn value(self) -> f64 {
        self.total + self.block
    }
}
