//! Rounds of weights, and the estimate at the end of a descent.

use super::descent::Descent;
use super::fit::Fit;
use super::fitted::Sigma;
use super::refined::{EVALUATIONS_MAX, Refined, STEP_MAX};
use super::uncertainty::{uncertainty, whiteness};
use super::weights::{balanced, is_far, is_sacrificed, maximum_likelihood, residual_sigma};
use motorfit_core::numeric::count;

/// Length of a step \[standard errors\] that ends every round of weights but the last.
pub(super) const STEP_MAX_ROUND: f64 = 1e-2;
/// Largest number of rounds of weights.
const ROUNDS_MAX: usize = 30;
/// Relative change of σ that ends the rounds.
const SIGMA_CHANGE: f64 = 1e-6;
/// The same where friction that sticks makes the cost not smooth.
const SIGMA_CHANGE_KINKS: f64 = 1e-3;

/// Part of the cost below which the gain of the last simulations ends a descent with friction that sticks, where residuals are far
/// above the noise: errors of a model are correlated, and standard errors are far wider than those of white noise.
pub(super) const STALLED: f64 = 1e-4;
/// The same gain where residuals are noise \[σ²\]: a tenth of a standard error.
const STALLED_NOISE: f64 = 1e-2;

/// Method that computes weights from residuals.
#[derive(Debug, Clone, Copy)]
enum Weighting {
    /// Balanced weights, which sacrifice no output and no recording.
    Balanced,
    /// Maximum-likelihood weights.
    MaximumLikelihood,
}

impl<'a> Descent<'a> {
    /// Descends under weights from the residuals: balanced ones and, where some residuals are far above the noise, those of maximum
    /// likelihood unless these sacrifice an output. The present weights are the least of the first round. Returns true if the last
    /// round converged.
    pub(super) fn weighed(mut self) -> (Self, bool) {
        let found = balanced(self.fit, &self.residual_sigma());
        for (own, found) in self.sigma.iter_mut().flatten().zip(found.iter().flatten()) {
            *own = own.max(*found);
        }
        self.run(STEP_MAX_ROUND);
        let mut converged = self.rounds(Weighting::Balanced);
        if is_far(self.fit, &self.residual_sigma()) {
            // The maximum-likelihood rounds have a budget of their own, whatever the balanced rounds used.
            let mut maximum_likelihood = self.clone().at_most(EVALUATIONS_MAX);
            let ended = maximum_likelihood.rounds(Weighting::MaximumLikelihood);
            if !is_sacrificed(self.fit, &maximum_likelihood.residual_sigma(), &self.residual_sigma()) {
                (self, converged) = (maximum_likelihood, ended);
            }
        }
        (self, converged)
    }

    /// Descends in rounds of weights until they converge; returns true if the descent of the last round converged.
    fn rounds(&mut self, by: Weighting) -> bool {
        let change = if self.fit.problem.has_kinks() { SIGMA_CHANGE_KINKS } else { SIGMA_CHANGE };
        let mut converged = false;
        for _ in 0..ROUNDS_MAX {
            let last = self.reweigh(by) < change;
            converged = self.run(if last { STEP_MAX } else { STEP_MAX_ROUND });
            if last {
                break;
            }
        }
        converged
    }

    /// Sets the weights from the residuals and returns the largest relative change of a σ.
    fn reweigh(&mut self, by: Weighting) -> f64 {
        let residual = self.residual_sigma();
        let sigma = match by {
            Weighting::Balanced => balanced(self.fit, &residual),
            Weighting::MaximumLikelihood => maximum_likelihood(self.fit, &residual, &self.pooled_sigma()),
        };
        if self.fit.problem.has_kinks() {
            let is_far = is_far(self.fit, &residual);
            self.stall = Some(if is_far { STALLED } else { STALLED_NOISE / count(self.fit.count()) });
        }
        let pairs = sigma.iter().flatten().zip(self.sigma.iter().flatten());
        let largest = pairs.map(|(new, old)| (new / old - 1.0).abs()).fold(0.0, f64::max);
        self.weigh(sigma);
        largest
    }

    /// Returns the ratio of the degrees of freedom to the measured values, at least 0.1.
    fn freedom(&self) -> f64 {
        1.0 - (count(self.fit.unknowns) / count(self.fit.count())).min(0.9)
    }

    /// Returns σ of the residuals of each recording and output.
    fn residual_sigma(&self) -> Sigma {
        residual_sigma(self.fit, &self.normal, self.freedom())
    }

    /// Returns the standard deviation of the residuals of each output over all recordings.
    fn pooled_sigma(&self) -> Vec<Option<f64>> {
        let Self { fit, normal, .. } = self;
        let of = |output: usize| {
            let measured = || fit.measured().filter(|of| of.1 == output);
            let squares: f64 = measured().map(|of| normal.squares(of)).sum();
            let samples: usize = measured().map(|of| fit.problem.count(of)).sum();
            let freedom = (count(samples) * self.freedom()).max(1.0);
            (samples > 0).then(|| (squares / freedom).sqrt())
        };
        (0..fit.problem.outputs()).map(of).collect()
    }

    /// Returns the estimate that the descent reached; the residuals are tested for whiteness if `is_tested`.
    pub(super) fn finish(self, converged: bool, is_tested: bool) -> Refined {
        let Self { fit, at, normal, evaluations, .. } = &self;
        // Filtered samples are not independent: the effective sample size is smaller.
        let informing = effective(fit, &self.sigma);
        let (matrix, gradient) = fit.weighted(normal, &informing);
        let free = self.free(&gradient);
        let at_bound = (0..fit.axes.len()).map(|n| (!free.contains(&n)).then(|| self.side(n))).collect();
        let (values, initial) = (fit.values(at), fit.initial(at));
        // An extension parameter that ended at its neutral value still counts as unknown, so that the standard errors of
        // the others include its uncertainty.
        let is_idle = |n: &usize| !free.contains(n) && fit.axes[*n].is_idle(values[*n]) && matrix[(*n, *n)] > 1.0;
        let idle: Vec<usize> = (0..fit.axes.len()).filter(is_idle).collect();
        let informed: Vec<usize> = free.iter().chain(&idle).copied().collect();
        let mut uncertainty = uncertainty(fit, &values, &matrix, &informed);
        idle.iter().for_each(|n| uncertainty.forget(*n));
        if is_tested {
            uncertainty.whiteness = whiteness(fit, &values, &initial);
        }
        Refined {
            sigma: self.pooled_sigma(),
            sigmas: self.residual_sigma(),
            weights: self.sigma.clone(),
            squares: normal.all_squares(),
            at_bound,
            uncertainty,
            values,
            initial,
            converged,
            evaluations: *evaluations,
        }
    }
}

/// Returns σ of the independent part of the samples.
pub(super) fn effective(fit: &Fit<'_>, sigma: &Sigma) -> Sigma {
    fit.each(|of| sigma[of.0][of.1] / fit.problem.effective_sample_ratio(of.0).sqrt())
}
