//! The evaluator with tables of poles.

use super::bounded::Bounded;
use super::shared::{self, tables};
use crate::cpu::Level;
use crate::evaluator::{Batch, Evaluator, Group};
use crate::problem::Problem;
use crate::same_problem::{Costed, as_one, by_problem};
use crate::signals::Signals;
use crate::simd::Simd;
use motorfit_core::Result;
use motorfit_core::candidates::Candidates;
use rayon::prelude::*;

/// Bound of the relative error of a total above which the kernel computes the cost.
const TOLERANCE: f64 = 1e-9;
/// Factor on the bounds, which count only the largest errors of rounding: against a simulation in twice the precision the largest error
/// of 10⁵ motors over four decades was 3.3 times its bound, at a cost that is accurate to 3e-15.
pub(super) const SAFETY: f64 = 4.0;
/// Number of candidates for each thread that are evaluated at once, a bound of the memory and of the number of cells.
const CHUNK: usize = 1 << 15;
/// Largest number of threads that count for this.
const CHUNKS_MAX: usize = 8;
/// Number of candidates in a parallel task that turns totals into costs: some 10 µs.
const PART: usize = 1 << 12;

/// An evaluator whose time per candidate does not depend on the length of the recording.
///
/// It serves linear motors with a voltage and without load torque on even clocks, zero- or first-order hold, known initial states and
/// criteria of unweighted squares. Other problems, and candidates whose cost could be wrong by more than 1e-9 of it, go to [`Simd`]:
/// those near the optimum of a recording without noise, and motors that grow faster than 2/T, oscillate more than 65,000 times as fast as
/// they decay, or have time constants below 10⁻⁸ of a step. All evaluators of a process share their tables, up to 200 MB of them.
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

    /// Drops the tables of all recordings, which the evaluators of a process share.
    pub fn clear() {
        shared::clear();
    }

    /// Returns true if candidates of a problem are evaluated by tables; none are in WebAssembly, where a page runs single searches, for which
    /// the kernel is as fast, and loads sooner without this code.
    #[must_use]
    pub fn serves(problem: &Problem) -> bool {
        let method = problem.method();
        cfg!(not(target_arch = "wasm32"))
            && problem.features().is_linear()
            && method.discretization.is_exact()
            && method.input == motorfit_motor::Input::Voltage
            && !problem.criterion().is_absolute()
            && problem.signals().iter().all(|signals| is_servable(problem, signals))
    }

    fn group(&mut self, group: &Group<'_>, costs: &mut [f64]) -> Result<()> {
        let problem = group.problem;
        let mut totals = vec![Bounded::new(0.0, 0.0); costs.len()];
        for (recording, signals) in problem.signals().iter().enumerate() {
            let places = problem.space().places(u32::try_from(recording).unwrap_or(u32::MAX));
            let rows = |first: usize, rows: &mut [[f64; 5]]| {
                let own = group.candidates.rows(first, first + rows.len());
                for (p, place) in places.into_iter().enumerate() {
                    let values = own.values().chunks_exact(own.width().max(1));
                    match place {
                        Ok(place) => rows.iter_mut().zip(values).for_each(|(row, values)| row[p] = values[place]),
                        Err(fixed) => rows.iter_mut().for_each(|row| row[p] = fixed),
                    }
                }
            };
            let scaling = problem.scaling(signals);
            // A channel that was not measured has the factor 0.
            let error =
                |c: usize, sum: &Bounded| if scaling.factor[c] > 0.0 { scaling.factor[c] * sum.error } else { 0.0 };
            let put = |total: &mut Bounded, sums: [Bounded; 2]| {
                let value = scaling.total([sums[0].value, sums[1].value]);
                *total = *total + Bounded::new(value, SAFETY * (error(0, &sums[0]) + error(1, &sums[1])));
            };
            tables(problem, signals, self.level).sums(rows, put, &mut totals);
        }
        if costs.len() <= PART {
            let uncertain = costs_or_uncertain(group, 0, &totals, costs);
            return self.by_kernel(group, &uncertain, costs);
        }
        let parts = costs.par_chunks_mut(PART).zip(totals.par_chunks(PART)).enumerate();
        let uncertain = parts.map(|(n, (costs, totals))| costs_or_uncertain(group, n * PART, totals, costs));
        let uncertain: Vec<Vec<usize>> = uncertain.collect();
        self.by_kernel(group, &uncertain.concat(), costs)
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
        self.kernel.costs(group.problem, own, &mut found)?;
        for (n, cost) in numbers.iter().zip(found) {
            costs[*n] = cost;
        }
        Ok(())
    }
}

/// Computes the costs of candidates from a number on, given their totals, and returns the numbers of those that are uncertain.
fn costs_or_uncertain(group: &Group<'_>, first: usize, totals: &[Bounded], costs: &mut [f64]) -> Vec<usize> {
    let mut uncertain = Vec::new();
    for (n, (Bounded { value: total, error }, cost)) in totals.iter().zip(costs).enumerate() {
        if error.is_finite() && *error <= TOLERANCE * total {
            *cost = group.problem.cost(*total);
            continue;
        }
        // Any value between the cutoff and the cost will do. A total below its error may be zero.
        let least = (error.is_finite() && total > error).then(|| group.problem.cost(total - error));
        match (least, group.candidates.cutoffs().get(first + n)) {
            (Some(least), Some(cutoff)) if least >= *cutoff => *cost = least,
            _ => uncertain.push(first + n),
        }
    }
    uncertain
}

impl Evaluator for PoleTables {
    fn evaluate(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> Result<()> {
        batch.check(costs)?;
        let evaluator = *self;
        let evaluate = |groups: Vec<Costed<'_, '_, Problem>>| {
            as_one(groups, |group, costs| {
                let mut evaluator = evaluator;
                if !Self::serves(group.problem) {
                    return evaluator.kernel.evaluate(&Batch { groups: &[*group] }, costs);
                }
                let chunk = CHUNK * rayon::current_num_threads().min(CHUNKS_MAX);
                for (part, own) in costs.chunks_mut(chunk).enumerate() {
                    let candidates = group.candidates.rows(part * chunk, part * chunk + own.len());
                    evaluator.group(&Group { candidates, ..*group }, own)?;
                }
                Ok(())
            })
        };
        let mut problems = by_problem(batch.groups, costs);
        match problems.len() {
            1 => problems.drain(..).try_for_each(evaluate),
            _ => problems.into_par_iter().try_for_each(evaluate),
        }
    }

    fn name(&self) -> String {
        self.kernel.name()
    }
}
