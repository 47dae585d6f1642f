//! Descent of a refinement: Levenberg–Marquardt steps within bounds, damped after H. B. Nielsen (1999), under given weights.
//!
//! A descent asks for the normal equations of one point after another, so that many descents can be computed side by side.

use super::damped_step::trusted_step;
use super::fit::{Fit, Normal};
use super::fitted::Sigma;
use super::refined::{EVALUATIONS_MAX, STEP_MAX};
use motorfit_core::numeric::count;
use nalgebra::DVector;

/// Damping below which the length of a step is taken as the distance to the optimum.
const UNDAMPED: f64 = 1e-2;
/// Damping at the start, its smallest value, and that at which a descent is stuck. A smaller damping lets rounding move a descent along
/// directions without information.
const DAMPING: f64 = 1e-3;
const DAMPING_MIN: f64 = 1e-12;
const DAMPING_MAX: f64 = 1e16;
/// First growth of the damping after a step that gains nothing; each further one doubles it.
const GROWTH: f64 = 2.0;
/// Length of a step \[standard errors\] up to which a change of the cost by rounding ends a descent.
const SHORT: f64 = 1e-3;
/// Relative change of the cost that is rounding.
const ROUNDING: f64 = 1e-12;
/// Number of last simulations over which a stalled descent gains too little.
const STALL_SIMULATIONS: usize = 8;

/// State of a descent.
#[derive(Clone)]
pub(super) struct Descent<'a> {
    pub fit: &'a Fit<'a>,
    pub at: DVector<f64>,
    pub normal: Normal,
    pub sigma: Sigma,
    lower: DVector<f64>,
    upper: DVector<f64>,
    damping: f64,
    growth: f64,
    tolerance: f64,
    /// Part of the cost below which the gain over [`STALL_SIMULATIONS`] ends the descent. The cost of a model with friction that sticks
    /// is not smooth, and no step is short enough.
    pub stall: Option<f64>,
    /// Lowest cost that is known from other descents: one that may stall ends when it cannot come down to it.
    pub lowest: f64,
    /// Number of simulations.
    pub evaluations: usize,
    evaluations_max: usize,
    /// Costs at the beginning and after each simulation.
    costs: Vec<f64>,
    proposed: Option<Proposed>,
    /// True if the descent ended in an optimum, false if it did not; `None` before its end.
    converged: Option<bool>,
}

/// A point whose normal equations a descent waits for.
#[derive(Clone)]
struct Proposed {
    at: DVector<f64>,
    /// Length of the step \[standard errors\].
    length: f64,
    /// Gain of the linearized model.
    gain: f64,
}

impl<'a> Descent<'a> {
    /// Begins descents side by side under the weights `sigma`; `None` for one whose machine diverges at the start.
    pub(super) fn all(fit: &'a Fit<'a>, starts: &[DVector<f64>], sigma: &Sigma) -> Vec<Option<Self>> {
        let bound = |of: &dyn Fn(usize) -> f64, open: f64| {
            DVector::from_fn(fit.unknowns, |n, _| fit.axes.get(n).map_or(open, |axis| axis.of(of(n))))
        };
        let lower = bound(&|n| fit.axes[n].min, f64::NEG_INFINITY);
        let upper = bound(&|n| fit.axes[n].max, f64::INFINITY);
        let starts: Vec<DVector<f64>> = starts.iter().map(|start| clamp(start, &lower, &upper)).collect();
        let normals = fit.normals(&starts);
        let begun = |(at, normal): (DVector<f64>, Option<Normal>)| {
            Some(Self {
                fit,
                at,
                normal: normal?,
                sigma: sigma.clone(),
                lower: lower.clone(),
                upper: upper.clone(),
                damping: DAMPING,
                growth: GROWTH,
                tolerance: 0.0,
                stall: None,
                lowest: f64::INFINITY,
                evaluations: 1,
                evaluations_max: EVALUATIONS_MAX,
                costs: Vec::new(),
                proposed: None,
                converged: None,
            })
        };
        starts.into_iter().zip(normals).map(begun).collect()
    }

    /// Begins a descent; `None` if the machine diverges at the start.
    pub(super) fn new(fit: &'a Fit<'a>, start: &DVector<f64>, sigma: &Sigma) -> Option<Self> {
        Self::all(fit, std::slice::from_ref(start), sigma).pop().flatten()
    }

    /// Limits the descent to this number of further simulations.
    pub(super) fn at_most(mut self, evaluations: usize) -> Self {
        self.evaluations_max = self.evaluations + evaluations;
        self
    }

    /// Returns the weighted sum of squares.
    pub(super) fn cost(&self) -> f64 {
        self.normal.cost(&self.sigma)
    }

    /// Begins anew under other weights.
    pub(super) fn weigh(&mut self, sigma: Sigma) {
        self.sigma = sigma;
        self.damping = self.damping.min(DAMPING);
    }

    /// Descends until a step is shorter than `tolerance` standard errors; returns false if the limits ended it before.
    pub(super) fn run(&mut self, tolerance: f64) -> bool {
        self.begin(tolerance);
        while let Some(at) = self.propose() {
            let normal = self.fit.normal(&at);
            self.receive(normal);
        }
        self.converged == Some(true)
    }

    /// Sets the tolerance of [`run`](Self::run), for [`propose`](Self::propose) and [`receive`](Self::receive) in turn.
    pub(super) fn begin(&mut self, tolerance: f64) {
        (self.tolerance, self.growth, self.converged) = (tolerance, GROWTH, None);
        self.costs = vec![self.cost()];
    }

    /// Returns the next point whose normal equations are needed; `None` at the end.
    pub(super) fn propose(&mut self) -> Option<DVector<f64>> {
        while self.converged.is_none() {
            if self.evaluations >= self.evaluations_max || self.is_left_behind() {
                self.converged = Some(false);
                break;
            }
            if self.is_stalled() {
                self.converged = Some(true);
                break;
            }
            let (matrix, gradient) = self.fit.weighted(&self.normal, &self.sigma);
            let limits = (self.damping, self.fit.axes.len());
            let Some(step) = trusted_step(&matrix, &gradient, self.free(&gradient), limits) else {
                self.grow(false);
                continue;
            };
            let at = clamp(&(&self.at + step), &self.lower, &self.upper);
            let step = &at - &self.at;
            let square = step.dot(&(&matrix * &step));
            let length = square.max(0.0).sqrt();
            if step.iter().zip(&self.at).all(|(s, x)| s.abs() <= 1e-15 * x.abs().max(1.0)) {
                self.converged = Some(true);
                break;
            }
            // Another simulation would improve the estimate by far less than its standard error. Between rounds of weights the
            // step is not taken: the next round starts from the sums at the present point.
            if length < self.tolerance && self.damping < UNDAMPED {
                if self.tolerance <= STEP_MAX {
                    self.at = at;
                }
                self.converged = Some(true);
                break;
            }
            let gain = 2.0 * step.dot(&gradient) - square;
            self.proposed = Some(Proposed { at: at.clone(), length, gain });
            return Some(at);
        }
        None
    }

    /// Takes the normal equations of the point that was proposed; `None` if the machine diverges there.
    pub(super) fn receive(&mut self, normal: Option<Normal>) {
        let Some(proposed) = self.proposed.take() else { return };
        self.evaluations += 1;
        self.judge(proposed, normal);
        self.costs.push(self.cost());
    }

    /// Moves to the point if its cost is lower.
    fn judge(&mut self, Proposed { at, length, gain }: Proposed, normal: Option<Normal>) {
        let cost = self.cost();
        let after = normal.as_ref().map_or(f64::INFINITY, |normal| normal.cost(&self.sigma));
        let is_short = length < self.tolerance.max(SHORT);
        if let Some(normal) = normal.filter(|_| after < cost) {
            let ratio = ((cost - after) / gain).clamp(0.0, 1.0);
            self.damping = (self.damping * (1.0 / 3.0_f64).max(1.0 - (2.0 * ratio - 1.0).powi(3))).max(DAMPING_MIN);
            self.growth = GROWTH;
            (self.at, self.normal) = (at, normal);
            if length < self.tolerance {
                self.converged = Some(true);
            }
        } else if is_short && (after - cost).abs() <= ROUNDING * cost {
            self.converged = Some(true);
        } else {
            self.grow(is_short || self.stall.is_some());
        }
    }

    /// Increases the damping; beyond its limit the descent is stuck, in an optimum or not.
    fn grow(&mut self, is_optimum: bool) {
        self.damping = (self.damping * self.growth).max(DAMPING_MIN);
        self.growth *= GROWTH;
        if self.damping > DAMPING_MAX {
            self.converged = Some(is_optimum);
        }
    }

    /// Returns true if the last simulations gained too little.
    fn is_stalled(&self) -> bool {
        let (Some(stall), Some(before)) = (self.stall, self.cost_before(1)) else { return false };
        before - self.cost() < stall * before
    }

    /// Returns true if the lowest known cost is out of reach at the larger gain of the last two windows.
    fn is_left_behind(&self) -> bool {
        let windows = (self.stall, self.cost_before(2), self.cost_before(1));
        let (Some(_), Some(earlier), Some(before)) = windows else { return false };
        let now = self.cost();
        let left = count(self.evaluations_max - self.evaluations) / count(STALL_SIMULATIONS);
        now - left * (before - now).max(earlier - before) > self.lowest
    }

    /// Returns the cost so many windows of [`STALL_SIMULATIONS`] ago.
    fn cost_before(&self, windows: usize) -> Option<f64> {
        let place = self.costs.len().checked_sub(windows * STALL_SIMULATIONS + 1)?;
        self.costs.get(place).copied()
    }

    /// Returns the unknowns that may move: all but those at a bound that the descent pushes against.
    pub(super) fn free(&self, gradient: &DVector<f64>) -> Vec<usize> {
        let is_blocked = |n: usize| {
            (self.at[n] <= self.lower[n] && gradient[n] < 0.0) || (self.at[n] >= self.upper[n] && gradient[n] > 0.0)
        };
        (0..self.fit.unknowns).filter(|n| !is_blocked(*n)).collect()
    }

    /// Returns the bound that a parameter is at.
    pub(super) fn side(&self, n: usize) -> &'static str {
        if self.at[n] <= self.lower[n] { "min" } else { "max" }
    }
}

fn clamp(unknowns: &DVector<f64>, lower: &DVector<f64>, upper: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(unknowns.len(), |n, _| unknowns[n].max(lower[n]).min(upper[n]))
}
