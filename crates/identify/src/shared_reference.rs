//! One global search that all runs on the same recordings share.
//!
//! The reference is computed under the weights of a separate fit, which starts from the Steiglitz–McBride estimate or from the
//! starts of the extensions. It therefore depends on the recordings and the model, but not on the runs.

use super::prepare::Prepared;
use super::refine::Fit;
use super::start::Start;
use super::verify::{Claim, EQUAL, References, Verification, compared, references, sigmas, verify};
use motorfit_estimate::{Estimate, Refined, best_start, delay_starts, global_reference, refine_on};
use motorfit_evaluate::Problem;
use motorfit_motor::Axis;
use std::sync::Arc;

/// Largest relative difference of the weights of two fits of the same optimum.
const SAME_WEIGHTS: f64 = 1e-3;

/// A global search of one problem, with which many fits are compared.
pub(super) struct SharedReference {
    problem: Arc<Problem>,
    estimate: Option<Estimate>,
    /// Weights of the reference, and the reference under these weights; `None` if no fit succeeds.
    found: Option<(Vec<Vec<f64>>, References)>,
}

impl SharedReference {
    /// Searches the box of a problem. `optimum` is the optimum from the model selection, if there was one.
    pub(super) fn new(prepared: &Prepared<'_>, problem: &Arc<Problem>, start: &Start, optimum: Option<&[f64]>) -> Self {
        let estimate = start.estimate.as_ref().ok().filter(|estimate| !estimate.is_resampled).cloned();
        let plain = prepared.fitted(problem.space());
        let found = fitted(prepared, problem, start, optimum).and_then(|refined| {
            let (space, searched) = (problem.space(), &refined.values);
            let claim = Claim { space, refined: &refined, searched, is_judged: false, estimate: estimate.as_ref() };
            let sigma = sigmas(prepared.records, &refined);
            let references = references(&plain, &sigma, &claim)?;
            Some((sigma, references))
        });
        Self { problem: problem.clone(), estimate, found }
    }

    /// Verifies a fit. A fit in another space, or one whose optimum is lower than the reference, gets a separate search.
    pub(super) fn verify(&self, prepared: &Prepared<'_>, fit: &Fit) -> Verification {
        let estimate = self.estimate.as_ref();
        self.verdict(prepared, fit).unwrap_or_else(|| verify(prepared, fit, estimate).verification)
    }

    /// Verifies a fit in this box that ended in the optimum of the reference or in a higher one; `None` for others.
    fn verdict(&self, prepared: &Prepared<'_>, fit: &Fit) -> Option<Verification> {
        let (weights, references) = self.found.as_ref().filter(|_| fit.space == *self.problem.space())?;
        let (plain, sigma) = (prepared.fitted(&fit.space), sigmas(prepared.records, &fit.refined));
        let (own, lowest) = (fit.refined.weighted(&sigma), references.best.weighted(&sigma));
        let gap = (own - lowest) / lowest.max(1.0);
        let pairs = weights.iter().flatten().zip(sigma.iter().flatten());
        let is_same = pairs.into_iter().all(|(a, b)| (a - b).abs() <= SAME_WEIGHTS * a.abs());
        let claim = Claim::of(prepared, fit, self.estimate.as_ref());
        let verdict = || compared(prepared, (&plain, &sigma), &claim, Some(references)).verification;
        (gap > EQUAL || (gap >= -EQUAL && is_same)).then(verdict)
    }
}

/// Fits a problem from `optimum`, from the Steiglitz–McBride estimate or from the starts of the extensions; if there are none,
/// from a global search.
fn fitted(prepared: &Prepared<'_>, problem: &Arc<Problem>, start: &Start, optimum: Option<&[f64]>) -> Option<Refined> {
    let (plain, deviations) = (prepared.fitted(problem.space()), prepared.deviations());
    let inside = |estimate: &Estimate| {
        let value = |axis: &Axis| estimate.parameters.get(axis.parameter).clamp(axis.min, axis.max);
        problem.space().free().iter().map(value).collect::<Vec<f64>>()
    };
    let starts = match (optimum, &start.estimate) {
        (Some(optimum), _) => vec![optimum.to_vec()],
        (None, Ok(estimate)) => vec![inside(estimate)],
        (None, Err(_)) => delay_starts(problem, &start.motors).unwrap_or_default(),
    };
    let from = match &starts[..] {
        [one] => Some(one.clone()),
        several => best_start(&plain, several, deviations).map(|rough| rough.values),
    };
    let anywhere = || Some(global_reference(&plain, deviations).ok()?.refined.values);
    refine_on(&plain, &from.or_else(anywhere)?, None).ok()
}
