//! Descents of a search side by side, from their starts to their ends.

use super::fitted::check;
use super::refine::check_sigma;
use crate::descent::Descent;
use crate::fit::Fit;
use crate::fitted::Sigma;
use crate::refined::Refined;
use crate::weights::deviations;
use motorfit_core::Result;
use motorfit_core::numeric::count;
use motorfit_evaluate::model::ModelProblem;

/// Relative difference of costs within which descents ended in the same optimum.
const SAME: f64 = 1e-4;
/// Length of the last step of a descent \[standard deviations of the signals\]: far below any noise.
const TOLERANCE: f64 = 1e-7;
/// Simulations of a descent at most.
const SIMULATIONS: usize = 80;
/// The same of a descent that compares starts, and the length of its last step in standard errors.
const SIMULATIONS_ROUGH: usize = 40;
const TOLERANCE_ROUGH: f64 = 1e-2;
/// Part of the cost below which the gain of a descent with friction that sticks ends it.
const STALLED: f64 = 1e-3;

/// A point of the search.
#[derive(Debug, Clone)]
pub(super) struct SearchPoint {
    /// Values of the free parameters.
    pub values: Vec<f64>,
    /// Initial values of the open states of each recording.
    pub initial: Vec<Vec<f64>>,
    /// True if it is, or comes from, a given start: one of the user, or the best of a population search.
    pub is_given: bool,
}

/// The end of a descent.
#[derive(Debug, Clone)]
pub(super) struct End {
    pub at: SearchPoint,
    pub cost: f64,
}

impl End {
    /// Returns true if the end has a cost of so many residuals, up to the accuracy of descents.
    pub fn is_at(&self, cost: f64, residuals: usize) -> bool {
        self.cost <= cost * (1.0 + SAME) + TOLERANCE * TOLERANCE * count(residuals)
    }
}

/// Descends from each start, all side by side; a start from which the model diverges has no end. With `are_compared` descents that
/// may stall end when they cannot come down to the lowest of the others. Returns the number of simulations too.
pub(super) fn descend(fitted: &ModelProblem, starts: &[SearchPoint], are_compared: bool) -> (Vec<Option<End>>, u64) {
    let fit = &Fit::new(fitted);
    let effort = Effort { simulations: SIMULATIONS, tolerance: TOLERANCE * count(fit.count()).sqrt(), are_compared };
    let descents = descended(fit, starts, &deviations(fit), effort);
    let simulations = descents.iter().flatten().map(|descent| descent.evaluations as u64).sum();
    let end = |(descent, start): (Descent<'_>, &SearchPoint)| {
        let (values, initial) = (fit.values(&descent.at), fit.initial(&descent.at));
        End { at: SearchPoint { values, initial, is_given: start.is_given }, cost: descent.cost() }
    };
    let ends = descents.into_iter().zip(starts).map(|(descent, start)| Some(end((descent?, start)))).collect();
    (ends, simulations)
}

/// Descends from some starts, each with the same initial states, to a hundredth of a standard error under the weights `sigma`, and
/// returns the lowest; `None` if the model diverges from all.
///
/// # Errors
/// Returns `Usage` if a start or the weights do not fit the problem.
pub fn best_model_start(
    problem: &ModelProblem,
    starts: &[Vec<f64>],
    initial: &[Vec<f64>],
    sigma: &Sigma,
) -> Result<Option<Refined>> {
    starts.iter().try_for_each(|start| check(problem, start, initial))?;
    check_sigma(problem, sigma)?;
    let fit = &Fit::new(problem);
    let point = |values: &Vec<f64>| SearchPoint { values: values.clone(), initial: initial.to_vec(), is_given: false };
    let starts: Vec<SearchPoint> = starts.iter().map(point).collect();
    let effort = Effort { simulations: SIMULATIONS_ROUGH, tolerance: TOLERANCE_ROUGH, are_compared: true };
    let ends = descended(fit, &starts, sigma, effort).into_iter().flatten();
    let lowest = ends.min_by(|a, b| a.cost().total_cmp(&b.cost()));
    Ok(lowest.map(|descent| descent.finish(false, false)))
}

/// Limits of descents side by side.
#[derive(Clone, Copy)]
struct Effort {
    simulations: usize,
    /// Length of the last step.
    tolerance: f64,
    /// True if descents that cannot come down to the lowest of the others end.
    are_compared: bool,
}

/// Descends from each start under the weights `sigma`; `None` for a start from which the model diverges.
fn descended<'a>(
    fit: &'a Fit<'a>,
    starts: &[SearchPoint],
    sigma: &Sigma,
    Effort { simulations, tolerance, are_compared }: Effort,
) -> Vec<Option<Descent<'a>>> {
    let begun: Vec<_> = starts.iter().map(|start| fit.at(&start.values, &start.initial)).collect();
    let mut descents: Vec<Option<Descent<'_>>> = Descent::all(fit, &begun, sigma);
    for descent in &mut descents {
        *descent = descent.take().map(|descent| descent.at_most(simulations));
    }
    for descent in descents.iter_mut().flatten() {
        descent.stall = fit.problem.has_kinks().then_some(STALLED);
        descent.begin(tolerance);
    }
    loop {
        let mut numbers = Vec::new();
        let mut points = Vec::new();
        for (n, descent) in descents.iter_mut().enumerate() {
            if let Some(point) = descent.as_mut().and_then(Descent::propose) {
                numbers.push(n);
                points.push(point);
            }
        }
        if points.is_empty() {
            break;
        }
        for (n, normal) in numbers.into_iter().zip(fit.normals(&points)) {
            if let Some(descent) = &mut descents[n] {
                descent.receive(normal);
            }
        }
        if !are_compared {
            continue;
        }
        // A given start may be an optimum, to which no descent from elsewhere has to come close to be of use.
        let others = descents.iter().zip(starts).filter(|(_, start)| !start.is_given);
        let lowest = others.filter_map(|(descent, _)| Some(descent.as_ref()?.cost())).fold(f64::INFINITY, f64::min);
        descents.iter_mut().flatten().for_each(|descent| descent.lowest = lowest * (1.0 + SAME));
    }
    descents
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_within_the_accuracy_of_descents_are_one_optimum() {
        let end = |cost| End { at: SearchPoint { values: Vec::new(), initial: Vec::new(), is_given: false }, cost };
        // With noise a ten-thousandth of the cost; without, the square of the last step for each residual.
        assert!(end(2.0001).is_at(2.0, 100) && !end(2.001).is_at(2.0, 100));
        assert!(end(5e-13).is_at(0.0, 100) && !end(5e-12).is_at(0.0, 100));
    }
}
