//! The evaluator with tables of poles.

use super::block::UNSERVED;
use super::shared::tables;
use crate::Result;
use crate::candidates::Candidates;
use crate::evaluate::cpu::{Level, cpu_name};
use crate::evaluate::evaluator::{Batch, Evaluator, Group};
use crate::evaluate::problem::Problem;
use crate::evaluate::signals::Signals;
use crate::evaluate::simd::Simd;
use rayon::prelude::*;

/// Bound of the relative error of a total above which the kernel computes the cost.
const TOLERANCE: f64 = 1e-9;
/// Factor on the bounds, which count only the largest errors of rounding: against a simulation in twice the precision the largest error
/// of 30,000 motors over four decades was 2.5 times its bound.
pub(super) const SAFETY: f64 = 4.0;
/// Candidates that are evaluated at once, which bounds the memory and the number of their cells.
const CHUNK: usize = 1 << 14;

/// An evaluator whose time per candidate does not depend on the length of the recording.
///
/// It serves linear motors with a voltage and without load torque on even clocks, zero- or first-order hold, known initial states and
/// criteria of unweighted squares. Other problems, and candidates whose cost could be wrong by more than 1e-9 of it, go to [`Simd`]:
/// those near the optimum of a recording without noise, and motors that grow faster than 2/T, oscillate more than 65,000 times as fast as
/// they decay, or have time constants below 10⁻⁸ of a step. Tables are shared by all evaluators of the process.
#[derive(Debug, Clone, Copy)]
pub struct PoleTables {
    level: Level,
    kernel: Simd,
}

impl Default for PoleTables {
    fn default() -> Self {
        Self::at(Level::best())
    }
}

/// Returns true if a recording has what the tables need.
fn is_servable(problem: &Problem, signals: &Signals) -> bool {
    signals.step_index.is_empty()
        && signals.weight.is_empty()
        && signals.torque.is_empty()
        && !signals.has_slopes()
        && signals.len() >= problem.first_active(signals) + 2
}

impl PoleTables {
    /// Returns an evaluator at a SIMD level. If this machine lacks the level, the best available one is used.
    #[must_use]
    pub fn at(level: Level) -> Self {
        let level = if level.is_available() { level } else { Level::best() };
        Self { level, kernel: Simd::at(level) }
    }

    /// Returns true if candidates of a problem are evaluated by tables.
    #[must_use]
    pub fn serves(problem: &Problem) -> bool {
        let method = problem.method();
        problem.features().is_linear()
            && method.discretization.is_exact()
            && method.input == crate::motor::Input::Voltage
            && !problem.criterion().is_absolute()
            && problem.signals().iter().all(|signals| is_servable(problem, signals))
    }

    fn group(&mut self, group: &Group<'_>, costs: &mut [f64]) -> Result<()> {
        let (problem, count) = (group.problem, costs.len());
        let (mut totals, mut errors) = (vec![0.0; count], vec![0.0; count]);
        let mut sums = vec![UNSERVED; count];
        for (recording, signals) in problem.signals().iter().enumerate() {
            let tables = tables(problem, signals, self.level);
            let parameters = |n: usize| problem.parameters(group.candidates.row(n), recording).to_array();
            tables.sums(parameters, &mut sums);
            let scaling = problem.scaling(signals);
            for ((total, error), sums) in totals.iter_mut().zip(&mut errors).zip(&sums) {
                *total += scaling.total([sums[0].value, sums[1].value]);
                // A channel that was not measured has the factor 0.
                let own = |c: usize| if scaling.factor[c] > 0.0 { scaling.factor[c] * sums[c].error } else { 0.0 };
                *error += SAFETY * (own(0) + own(1));
            }
        }
        let mut uncertain = Vec::new();
        for (n, (total, error)) in totals.into_iter().zip(errors).enumerate() {
            if error.is_finite() && error <= TOLERANCE * total {
                costs[n] = problem.cost(total);
                continue;
            }
            // Any value between the cutoff and the cost will do. A total below its error may be zero.
            let least = (error.is_finite() && total > error).then(|| problem.cost(total - error));
            match (least, group.candidates.cutoffs().get(n)) {
                (Some(least), Some(cutoff)) if least >= *cutoff => costs[n] = least,
                _ => uncertain.push(n),
            }
        }
        self.by_kernel(group, &uncertain, costs)
    }

    /// Computes the costs of some candidates by the kernel.
    fn by_kernel(&mut self, group: &Group<'_>, numbers: &[usize], costs: &mut [f64]) -> Result<()> {
        if numbers.is_empty() {
            return Ok(());
        }
        let candidates = group.candidates;
        let values: Vec<f64> = numbers.iter().flat_map(|n| candidates.row(*n)).copied().collect();
        let cutoffs: Vec<f64> = numbers.iter().filter_map(|n| candidates.cutoffs().get(*n)).copied().collect();
        let mut own = Candidates::new(&values, candidates.width());
        if !cutoffs.is_empty() {
            own = own.with_cutoffs(&cutoffs);
        }
        let mut found = vec![0.0; numbers.len()];
        self.kernel.evaluate(&Batch { groups: &[Group { candidates: own, ..*group }] }, &mut found)?;
        for (n, cost) in numbers.iter().zip(found) {
            costs[*n] = cost;
        }
        Ok(())
    }
}

impl Evaluator for PoleTables {
    fn evaluate(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> Result<()> {
        batch.check(costs)?;
        let mut rest = costs;
        let mut parts = Vec::with_capacity(batch.groups.len());
        for group in batch.groups {
            let (own, others) = rest.split_at_mut(group.candidates.count());
            parts.push((group, own));
            rest = others;
        }
        let evaluator = *self;
        let evaluate = |(group, costs): (&Group<'_>, &mut [f64])| {
            let mut evaluator = evaluator;
            if !Self::serves(group.problem) {
                return evaluator.kernel.evaluate(&Batch { groups: &[*group] }, costs);
            }
            for (part, own) in costs.chunks_mut(CHUNK).enumerate() {
                let candidates = group.candidates.rows(part * CHUNK, part * CHUNK + own.len());
                evaluator.group(&Group { candidates, ..*group }, own)?;
            }
            Ok(())
        };
        match parts.len() {
            1 => parts.into_iter().try_for_each(evaluate),
            _ => parts.into_par_iter().try_for_each(evaluate),
        }
    }

    fn name(&self) -> String {
        format!("tables of poles on {} ({})", cpu_name(), self.level.name())
    }
}
