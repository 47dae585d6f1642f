//! Levenberg–Marquardt within bounds, damped after H. B. Nielsen (1999) and scaled by the diagonal (D. W. Marquardt 1963).

use super::damped_step::damped_step;
use super::fit::{Fit, Normal};
use motorfit_core::numeric::count;
use nalgebra::{DMatrix, DVector};

/// Damping below which the length of a step is taken as the distance to the optimum.
const UNDAMPED: f64 = 1e-2;
/// Damping at the start, and that at which a descent is stuck.
const DAMPING: f64 = 1e-3;
const DAMPING_MAX: f64 = 1e14;

/// First growth of the damping after a step that gains nothing; each further one doubles it.
const GROWTH: f64 = 2.0;
/// Number of last simulations over which a stalled descent gains too little.
const STALL_SIMULATIONS: usize = 8;

/// Weights of the residuals in a descent.
pub(super) enum Weights {
    /// The inverse of the given variances.
    Given,
    /// The inverse of the variance of each block, estimated with the parameters: the cost is the deviance
    /// `Σ n ln σ²` with `σ² = r²/n`, of which the given variances are the least.
    Estimated { least: Vec<f64>, freedom: f64 },
}

/// State of a descent.
pub(super) struct Descent<'a> {
    fit: &'a Fit<'a>,
    pub at: DVector<f64>,
    pub normal: Normal,
    pub sigma: Vec<f64>,
    lower: DVector<f64>,
    upper: DVector<f64>,
    damping: f64,
    weights: Weights,
    /// Gain over [`STALL_SIMULATIONS`] below which the descent ends: a part of the cost with given weights, a difference of the deviance
    /// with estimated ones. The cost of a model with friction that sticks is not smooth, and no step is short enough.
    pub stall: Option<f64>,
    /// Lowest cost that is known from other descents: one that may stall ends when it cannot come down to it.
    pub lowest: f64,
    /// Number of simulations.
    pub evaluations: usize,
    limits: Limits,
    growth: f64,
    /// Costs at the beginning and after each simulation.
    costs: Vec<f64>,
    proposed: Option<Proposed>,
    /// True if the descent ended in an optimum, false if it did not; `None` before its end.
    pub converged: Option<bool>,
}

/// Limits of a descent: the length of the last step \[standard errors\], and the simulations at most.
#[derive(Debug, Clone, Copy)]
struct Limits {
    tolerance: f64,
    evaluations: usize,
}

/// A point whose normal equations a descent waits for.
#[derive(Debug, Clone)]
struct Proposed {
    at: DVector<f64>,
    /// Length of the step \[standard errors\].
    length: f64,
    /// Gain of the linearized model.
    gain: f64,
}

impl<'a> Descent<'a> {
    /// Begins descents side by side; `None` for one whose model diverges at the start. `sigma` is made from its normal equations.
    pub fn all(fit: &'a Fit<'a>, starts: &[DVector<f64>], sigma: impl Fn(&Normal) -> Vec<f64>) -> Vec<Option<Self>> {
        let axes = &fit.problem.space().free;
        let bound = |open: f64, of: &dyn Fn(usize) -> f64| {
            DVector::from_fn(fit.unknowns(), |n, _| axes.get(n).map_or(open, |axis| axis.coordinate(of(n))))
        };
        let lower = bound(f64::NEG_INFINITY, &|n| axes[n].min);
        let upper = bound(f64::INFINITY, &|n| axes[n].max);
        let starts: Vec<DVector<f64>> = starts.iter().map(|start| clamp(start, &lower, &upper)).collect();
        let begun = |(at, normal): (DVector<f64>, Option<Normal>)| {
            let normal = normal?;
            Some(Self {
                fit,
                at,
                sigma: sigma(&normal),
                normal,
                lower: lower.clone(),
                upper: upper.clone(),
                damping: DAMPING,
                weights: Weights::Given,
                stall: None,
                lowest: f64::INFINITY,
                evaluations: 1,
                limits: Limits { tolerance: 0.0, evaluations: 0 },
                growth: GROWTH,
                costs: Vec::new(),
                proposed: None,
                converged: None,
            })
        };
        let normals = fit.normals(&starts);
        starts.into_iter().zip(normals).map(begun).collect()
    }

    /// Begins a descent; `None` if the model diverges at the start.
    pub fn new(fit: &'a Fit<'a>, start: DVector<f64>, sigma: impl Fn(&Normal) -> Vec<f64>) -> Option<Self> {
        Self::all(fit, &[start], sigma).pop().flatten()
    }

    /// Returns the weighted sum of squares, or the deviance.
    pub fn cost(&self) -> f64 {
        self.cost_of(&self.normal)
    }

    fn cost_of(&self, normal: &Normal) -> f64 {
        let Weights::Estimated { freedom, .. } = &self.weights else { return normal.cost(&self.sigma) };
        let sigma = self.sigma_of(normal);
        let blocks = normal.blocks.iter().zip(&sigma);
        let logarithms: f64 = blocks.map(|(block, sigma)| 2.0 * freedom * count(block.count) * sigma.ln()).sum();
        normal.cost(&sigma) + logarithms
    }

    /// Returns the standard deviation of each block.
    fn sigma_of(&self, normal: &Normal) -> Vec<f64> {
        match &self.weights {
            Weights::Given => self.sigma.clone(),
            Weights::Estimated { least, freedom } => {
                normal.rms().iter().zip(least).map(|(rms, least)| (rms / freedom.sqrt()).max(*least)).collect()
            }
        }
    }

    /// Begins anew with other weights.
    pub fn weigh(&mut self, weights: Weights) {
        self.weights = weights;
        self.sigma = self.sigma_of(&self.normal);
        self.damping = DAMPING;
    }

    /// Returns the curvature of the cost: of the deviance `M − Σ 2 g gᵀ/n` with the weighted gradient g of each block.
    fn curvature(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        let mut curvature = matrix.clone();
        if let Weights::Estimated { least, freedom } = &self.weights {
            for ((block, sigma), least) in self.normal.blocks.iter().zip(&self.sigma).zip(least) {
                if sigma > least {
                    let gradient = block.gradient() / (sigma * sigma);
                    curvature -= &gradient * gradient.transpose() * (2.0 / (freedom * count(block.count)));
                }
            }
        }
        curvature
    }

    /// Returns true for each unknown that is free to move: not at a bound that the descent pushes against.
    pub fn free(&self) -> Vec<usize> {
        let (_, gradient) = self.fit.weighted(&self.normal, &self.sigma);
        self.free_with(&gradient)
    }

    fn free_with(&self, gradient: &DVector<f64>) -> Vec<usize> {
        let is_blocked = |n: usize| {
            (self.at[n] <= self.lower[n] && gradient[n] < 0.0) || (self.at[n] >= self.upper[n] && gradient[n] > 0.0)
        };
        (0..self.at.len()).filter(|n| !is_blocked(*n)).collect()
    }

    /// Returns the bound that a parameter is at.
    pub fn bound(&self, n: usize) -> Option<&'static str> {
        match self.at[n] {
            at if at <= self.lower[n] => Some("min"),
            at if at >= self.upper[n] => Some("max"),
            _ => None,
        }
    }

    /// Descends until a step is shorter than `tolerance` standard errors, or gains too little; returns false if `most` simulations did
    /// not suffice.
    pub fn run(&mut self, tolerance: f64, most: usize) -> bool {
        self.begin(tolerance, most);
        while let Some(at) = self.propose() {
            let normal = self.fit.normals(&[at]).pop().flatten();
            self.receive(normal);
        }
        self.converged == Some(true)
    }

    /// Sets the limits of [`run`](Self::run), for [`propose`](Self::propose) and [`receive`](Self::receive) in turn.
    pub fn begin(&mut self, tolerance: f64, most: usize) {
        self.limits = Limits { tolerance, evaluations: self.evaluations + most };
        self.growth = GROWTH;
        self.costs = vec![self.cost()];
        self.converged = None;
    }

    /// Returns the next point whose normal equations are needed; `None` at the end.
    pub fn propose(&mut self) -> Option<DVector<f64>> {
        while self.converged.is_none() {
            if self.evaluations >= self.limits.evaluations || self.is_left_behind() {
                self.converged = Some(false);
                break;
            }
            if self.is_stalled() {
                self.converged = Some(true);
                break;
            }
            let (matrix, gradient) = self.fit.weighted(&self.normal, &self.sigma);
            let free = self.free_with(&gradient);
            if free.is_empty() {
                self.converged = Some(true);
                break;
            }
            // The curvature of the deviance may be negative far from the optimum.
            let limits = (self.damping, self.fit.axes());
            let step = damped_step(&self.curvature(&matrix), &gradient, free.clone(), limits);
            let step = step.or_else(|| damped_step(&matrix, &gradient, free, limits));
            let next = step.map(|step| clamp(&(&self.at + step), &self.lower, &self.upper));
            let Some(at) = next else {
                self.grow(false);
                continue;
            };
            let step = &at - &self.at;
            let square = step.dot(&(&matrix * &step));
            if step.iter().zip(&self.at).all(|(s, x)| s.abs() <= 1e-15 * x.abs().max(1e-300)) {
                self.converged = Some(true);
                break;
            }
            let gain = 2.0 * step.dot(&gradient) - square;
            self.proposed = Some(Proposed { at: at.clone(), length: square.max(0.0).sqrt(), gain });
            return Some(at);
        }
        None
    }

    /// Takes the normal equations of the point that was proposed; `None` if the model diverges there.
    pub fn receive(&mut self, normal: Option<Normal>) {
        let Some(proposed) = self.proposed.take() else { return };
        self.evaluations += 1;
        self.judge(proposed, normal);
        self.costs.push(self.cost());
    }

    /// Moves to the point if its cost is lower.
    fn judge(&mut self, Proposed { at, length, gain }: Proposed, normal: Option<Normal>) {
        let tolerance = self.limits.tolerance;
        let cost = self.cost();
        let after = normal.as_ref().map_or(f64::INFINITY, |normal| self.cost_of(normal));
        if let Some(normal) = normal.filter(|_| after < cost) {
            let ratio = ((cost - after) / gain).clamp(0.0, 1.0);
            if length < tolerance && self.damping < UNDAMPED {
                self.converged = Some(true);
            }
            self.damping = (self.damping * (1.0 / 3.0_f64).max(1.0 - (2.0 * ratio - 1.0).powi(3))).max(1e-12);
            self.growth = GROWTH;
            (self.at, self.sigma, self.normal) = (at, self.sigma_of(&normal), normal);
            return;
        }
        // A short step that changes the cost by rounding ends the descent. The deviance may be zero; the sum of squares is what is rounded.
        let size = cost.abs().max(self.normal.cost(&self.sigma));
        let is_short = length < tolerance.max(1e-3);
        if is_short && (after - cost).abs() <= 1e-11 * size {
            self.converged = Some(true);
            return;
        }
        self.grow(is_short || self.stall.is_some());
    }

    /// Increases the damping; beyond its limit the descent is stuck, in an optimum or not.
    fn grow(&mut self, is_optimum: bool) {
        self.damping *= self.growth;
        self.growth *= GROWTH;
        if self.damping > DAMPING_MAX {
            self.converged = Some(is_optimum);
        }
    }

    /// Returns true if the last simulations gained too little.
    fn is_stalled(&self) -> bool {
        let (Some(stall), Some(before)) = (self.stall, self.cost_before(1)) else { return false };
        let unit = if matches!(self.weights, Weights::Given) { before } else { 1.0 };
        before - self.cost() < stall * unit
    }

    /// Returns true if the lowest known cost is out of reach at the larger gain of the last two windows.
    fn is_left_behind(&self) -> bool {
        let windows = (self.stall, self.cost_before(2), self.cost_before(1));
        let (Some(_), Some(earlier), Some(before)) = windows else { return false };
        let now = self.cost();
        let left = count(self.limits.evaluations - self.evaluations) / count(STALL_SIMULATIONS);
        now - left * (before - now).max(earlier - before) > self.lowest
    }

    /// Returns the cost so many windows of [`STALL_SIMULATIONS`] ago.
    fn cost_before(&self, windows: usize) -> Option<f64> {
        let place = self.costs.len().checked_sub(windows * STALL_SIMULATIONS + 1)?;
        self.costs.get(place).copied()
    }
}

fn clamp(at: &DVector<f64>, lower: &DVector<f64>, upper: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(at.len(), |n, _| at[n].clamp(lower[n], upper[n]))
}
