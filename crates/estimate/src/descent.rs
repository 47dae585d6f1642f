//! Descent of a refinement: Levenberg–Marquardt steps within bounds, damped after H. B. Nielsen (1999) and scaled by the
//! diagonal (D. W. Marquardt 1963), with weights from the residuals.

use super::normal::{Fit, Normal, Sigma};
use super::refined::{EVALUATIONS_MAX, Refined, STEP_MAX};
use super::uncertainty::{uncertainty, whiteness};
use super::weights::{balanced, is_far, is_sacrificed, maximum_likelihood, residual_sigma};
use motorfit_core::numeric;
use motorfit_core::setting::text;
use motorfit_core::{Error, ErrorKind, Result};
use motorfit_evaluate::Signals;
use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// Damping below which the length of a step is taken as the distance to the optimum.
const UNDAMPED: f64 = 1e-2;
/// Longest step of a coordinate.
const TRUST: f64 = 1.0;

/// Method that computes weights from residuals.
#[derive(Debug, Clone, Copy)]
pub(super) enum Weighting {
    /// Balanced weights, which sacrifice no channel and no recording.
    Balanced,
    /// Maximum-likelihood weights.
    MaximumLikelihood,
}

/// State of a descent.
#[derive(Clone)]
pub(super) struct Descent<'a> {
    fit: &'a Fit<'a>,
    lower: DVector<f64>,
    upper: DVector<f64>,
    at: DVector<f64>,
    normal: Normal,
    sigma: Sigma,
    damping: f64,
    evaluations: usize,
    evaluations_max: usize,
}

impl<'a> Descent<'a> {
    pub(super) fn new(fit: &'a Fit<'a>, start: &[f64], sigma: Sigma) -> Result<Self> {
        let axes = fit.problem.space().free();
        let bound = |of: &dyn Fn(usize) -> f64, open: f64| {
            DVector::from_fn(fit.unknowns, |n, _| axes.get(n).map_or(open, |axis| axis.coordinate(of(n))))
        };
        let lower = bound(&|n| axes[n].min, f64::NEG_INFINITY);
        let upper = bound(&|n| axes[n].max, f64::INFINITY);
        let at = clamp(&fit.start(start), &lower, &upper);
        let normal = fit.normal(&at);
        if !normal.is_finite() {
            return Err(Error::new(
                ErrorKind::NotIdentified,
                "the simulated motor diverges at the start of the refinement",
                text!("Start elsewhere, or use " [Discretization = "zoh"] ", which is stable for every motor."),
            ));
        }
        Ok(Self {
            fit,
            lower,
            upper,
            at,
            normal,
            sigma,
            damping: 1e-3,
            evaluations: 1,
            evaluations_max: EVALUATIONS_MAX,
        })
    }

    /// Limits the descent to this number of further simulations.
    pub(super) fn at_most(mut self, evaluations: usize) -> Self {
        self.evaluations_max = self.evaluations + evaluations;
        self
    }

    /// Descends until a step is shorter than `tolerance` standard errors; returns false if the limits ended it before.
    pub(super) fn run(&mut self, tolerance: f64) -> bool {
        let mut growth = 2.0;
        while self.evaluations < self.evaluations_max {
            let (matrix, gradient) = self.fit.weighted(&self.normal, &self.sigma);
            let cost = self.normal.cost(&self.sigma);
            let free = self.free(&gradient);
            let Some(step) = self.trusted(&matrix, &gradient, free) else {
                self.damping = (self.damping * growth).max(1e-12);
                growth *= 2.0;
                if self.damping > 1e16 {
                    return false;
                }
                continue;
            };
            let next = clamp(&(&self.at + step), &self.lower, &self.upper);
            let step = &next - &self.at;
            let length = step.dot(&(&matrix * &step)).max(0.0).sqrt();
            let smallest = step.iter().zip(&self.at).all(|(s, x)| s.abs() <= 1e-15 * x.abs().max(1.0));
            if smallest {
                return true;
            }
            // Another simulation would improve the estimate by far less than its standard error. Between rounds of weights the
            // step is not taken: the next round starts from the sums at the present point.
            if length < tolerance && self.damping < UNDAMPED {
                if tolerance <= STEP_MAX {
                    self.at = next;
                }
                return true;
            }
            let normal = self.fit.normal(&next);
            self.evaluations += 1;
            let after = if normal.is_finite() { normal.cost(&self.sigma) } else { f64::INFINITY };
            let predicted = 2.0 * step.dot(&gradient) - step.dot(&(&matrix * &step));
            if after < cost {
                let ratio = ((cost - after) / predicted).clamp(0.0, 1.0);
                self.damping = (self.damping * (1.0 / 3.0_f64).max(1.0 - (2.0 * ratio - 1.0).powi(3))).max(1e-14);
                growth = 2.0;
                (self.at, self.normal) = (next, normal);
                if length < tolerance {
                    return true;
                }
            } else {
                // A short step that changes the cost by no more than rounding ends the descent.
                if length < tolerance.max(1e-3) && (after - cost).abs() <= 1e-12 * cost {
                    return true;
                }
                self.damping = (self.damping * growth).max(1e-12);
                growth *= 2.0;
                if self.damping > 1e16 {
                    return length < tolerance.max(1e-3);
                }
            }
        }
        false
    }

    /// Returns the unknowns that may move: all but those at a bound that the descent pushes against.
    fn free(&self, gradient: &DVector<f64>) -> Vec<usize> {
        let blocked = |n: usize| {
            (self.at[n] <= self.lower[n] && gradient[n] < 0.0) || (self.at[n] >= self.upper[n] && gradient[n] > 0.0)
        };
        (0..self.fit.unknowns).filter(|&n| !blocked(n)).collect()
    }

    /// Returns a step in which no coordinate of a parameter exceeds [`TRUST`]: a larger one is clipped, and the others are
    /// solved for again. Scaling the complete step would hardly move it when one parameter has little influence.
    fn trusted(&self, matrix: &DMatrix<f64>, gradient: &DVector<f64>, mut free: Vec<usize>) -> Option<DVector<f64>> {
        let axes = self.fit.problem.space().free().len();
        let mut edge = DVector::zeros(self.fit.unknowns);
        loop {
            let left = gradient - matrix * &edge;
            let step = damped_step(matrix, &left, &free, self.damping)?;
            let longest =
                free.iter().copied().filter(|n| *n < axes).max_by(|a, b| step[*a].abs().total_cmp(&step[*b].abs()));
            match longest.filter(|n| step[*n].abs() > TRUST) {
                Some(n) => edge[n] = TRUST.copysign(step[n]),
                None => return Some(edge + step),
            }
            free.retain(|n| edge[*n] == 0.0);
        }
    }

    /// Sets the first weights: balanced ones, with no σ below its initial value.
    pub(super) fn begin(&mut self) {
        let found = balanced(self.fit.problem.signals(), &self.residual_sigma());
        for (own, found) in self.sigma.iter_mut().zip(&found) {
            *own = [0, 1].map(|channel| own[channel].max(found[channel]));
        }
    }

    /// Sets the weights from the residuals and returns the largest relative change of a σ.
    pub(super) fn reweight(&mut self, by: Weighting) -> f64 {
        let (signals, residual) = (self.fit.problem.signals(), self.residual_sigma());
        let sigma = match by {
            Weighting::Balanced => balanced(signals, &residual),
            Weighting::MaximumLikelihood => {
                let is_extended = !self.fit.problem.features().is_linear();
                maximum_likelihood(signals, &residual, is_extended.then(|| self.pooled_sigma()))
            }
        };
        let pairs = sigma.iter().flatten().zip(self.sigma.iter().flatten());
        let largest = pairs.map(|(new, old)| (new / old - 1.0).abs()).fold(0.0, f64::max);
        self.sigma = sigma;
        self.damping = self.damping.min(1e-3);
        largest
    }

    /// Returns true if some residuals are far above the noise.
    pub(super) fn is_far(&self) -> bool {
        is_far(self.fit.problem.signals(), &self.residual_sigma())
    }

    /// Returns true if the residuals of some channel are much larger than those of a descent with balanced weights.
    pub(super) fn sacrifices(&self, balanced: &Self) -> bool {
        is_sacrificed(self.fit.problem.signals(), &self.residual_sigma(), &balanced.residual_sigma())
    }

    /// Returns the ratio of the degrees of freedom to the measured values, at least 0.1.
    fn freedom(&self) -> f64 {
        1.0 - (numeric::count(self.fit.unknowns) / numeric::count(self.fit.count())).min(0.9)
    }

    /// Returns σ of the residuals of each recording and channel; 1 for a channel that was not measured.
    fn residual_sigma(&self) -> Sigma {
        residual_sigma(self.fit.problem.signals(), &self.normal, self.freedom())
    }

    /// Returns the standard deviation of the residuals of each channel over all recordings.
    fn pooled_sigma(&self) -> [Option<f64>; 2] {
        let signals = self.fit.problem.signals();
        [0, 1].map(|channel| {
            let measured = || (0..signals.len()).filter(|n| signals[*n].has(channel));
            let squares: f64 = measured().map(|n| self.normal.squares(n, channel)).sum();
            let count: usize = measured().map(|n| signals[n].count(channel)).sum();
            let freedom = (numeric::count(count) * self.freedom()).max(1.0);
            (count > 0).then(|| (squares / freedom).sqrt())
        })
    }

    /// Returns the values that the descent reached, and the number of its simulations.
    pub(super) fn end(&self) -> (Vec<f64>, usize) {
        (self.fit.values(&self.at), self.evaluations)
    }

    /// Returns the estimate that the descent reached; the residuals are tested for whiteness if `is_tested`.
    pub(super) fn finish(self, converged: bool, is_tested: bool) -> Refined {
        let Self { fit, at, normal, evaluations, .. } = &self;
        let axes = fit.problem.space().free();
        // Filtered samples are not independent: the effective sample size is smaller.
        let effective_sigma =
            |(sigma, signals): (&[f64; 2], &Arc<Signals>)| sigma.map(|s| s / signals.effective_sample_ratio.sqrt());
        let informing: Sigma = self.sigma.iter().zip(fit.problem.signals()).map(effective_sigma).collect();
        let (matrix, gradient) = fit.weighted(normal, &informing);
        let free = self.free(&gradient);
        let at_bound = (0..axes.len()).map(|n| match (free.contains(&n), at[n] <= self.lower[n]) {
            (true, _) => None,
            (false, true) => Some("min"),
            (false, false) => Some("max"),
        });
        let (values, initial) = (fit.values(at), fit.initial(at));
        // An extension parameter that ended at its neutral value still counts as unknown, so that the standard errors of
        // the others include its uncertainty.
        let is_idle = |n: &usize| !free.contains(n) && axes[*n].is_idle(values[*n]) && matrix[(*n, *n)] > 1.0;
        let idle: Vec<usize> = (0..axes.len()).filter(is_idle).collect();
        let informed: Vec<usize> = free.iter().chain(&idle).copied().collect();
        let mut uncertainty = uncertainty(fit, &values, &matrix, &informed);
        idle.iter().for_each(|n| uncertainty.forget(*n));
        if is_tested {
            uncertainty.whiteness = whiteness(fit, &values, &initial);
        }
        Refined {
            parameters: fit.problem.parameters(&values, 0),
            sigma: self.pooled_sigma(),
            sigmas: self.residual_sigma(),
            weights: self.sigma.clone(),
            squares: normal.all_squares(),
            at_bound: at_bound.collect(),
            uncertainty,
            values,
            initial,
            converged,
            evaluations: *evaluations,
        }
    }
}

fn clamp(unknowns: &DVector<f64>, lower: &DVector<f64>, upper: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(unknowns.len(), |n, _| unknowns[n].max(lower[n]).min(upper[n]))
}

/// Returns `(JᵀJ + λ diag JᵀJ)⁻¹ Jᵀe` over the unknowns that may move, zero for the others; `None` if it has no solution.
fn damped_step(matrix: &DMatrix<f64>, gradient: &DVector<f64>, free: &[usize], damping: f64) -> Option<DVector<f64>> {
    // Scaling by the diagonal makes the step independent of units.
    let scale: Vec<f64> = free.iter().map(|&n| matrix[(n, n)].sqrt()).collect();
    let divisor = |n: usize| if scale[n] > 0.0 { scale[n] } else { 1.0 };
    let system = DMatrix::from_fn(free.len(), free.len(), |a, b| {
        let own = if a == b { damping } else { 0.0 };
        matrix[(free[a], free[b])] / (divisor(a) * divisor(b)) + own
    });
    let right = DVector::from_fn(free.len(), |a, _| gradient[free[a]] / divisor(a));
    let solved = system.cholesky()?.solve(&right);
    let mut step = DVector::zeros(matrix.nrows());
    for (n, &unknown) in free.iter().enumerate() {
        step[unknown] = solved[n] / divisor(n);
    }
    step.iter().all(|v| v.is_finite()).then_some(step)
}
