//! Levenberg–Marquardt within bounds, damped after H. B. Nielsen (1999) and scaled by the diagonal (D. W. Marquardt 1963).

use super::fit::{Fit, Normal};
use crate::numeric::count;
use nalgebra::{DMatrix, DVector};

/// Longest step of a coordinate of a parameter: a factor of e, or the range of the parameter.
const TRUST: f64 = 1.0;
/// Damping below which the length of a step is taken as the distance to the optimum.
const UNDAMPED: f64 = 1e-2;
/// Damping at the start, and that at which a descent is stuck.
const DAMPING: f64 = 1e-3;
const DAMPING_MAX: f64 = 1e14;

/// Simulations over which a stalled descent gains too little.
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
    /// Number of simulations.
    pub evaluations: usize,
}

impl<'a> Descent<'a> {
    /// Begins a descent; `None` if the model diverges at the start. `sigma` is made from the first normal equations.
    pub fn new(fit: &'a Fit<'a>, start: DVector<f64>, sigma: impl Fn(&Normal) -> Vec<f64>) -> Option<Self> {
        let axes = &fit.problem.space().free;
        let bound = |open: f64, of: &dyn Fn(usize) -> f64| {
            DVector::from_fn(fit.unknowns(), |n, _| axes.get(n).map_or(open, |axis| axis.coordinate(of(n))))
        };
        let lower = bound(f64::NEG_INFINITY, &|n| axes[n].min);
        let upper = bound(f64::INFINITY, &|n| axes[n].max);
        let at = clamp(&start, &lower, &upper);
        let normal = fit.normal(&at)?;
        let sigma = sigma(&normal);
        let (damping, weights) = (DAMPING, Weights::Given);
        Some(Self { fit, at, normal, sigma, lower, upper, damping, weights, stall: None, evaluations: 1 })
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
        let end = self.evaluations + most;
        let mut growth = 2.0;
        let mut before = (self.evaluations, self.cost());
        while self.evaluations < end {
            if let Some(stall) = self.stall
                && self.evaluations >= before.0 + STALL_SIMULATIONS
            {
                let unit = if matches!(self.weights, Weights::Given) { before.1 } else { 1.0 };
                if before.1 - self.cost() < stall * unit {
                    return true;
                }
                before = (self.evaluations, self.cost());
            }
            let (matrix, gradient) = self.fit.weighted(&self.normal, &self.sigma);
            let free = self.free_with(&gradient);
            if free.is_empty() {
                return true;
            }
            // The curvature of the deviance may be negative far from the optimum.
            let step = self.step(&self.curvature(&matrix), &gradient, free.clone());
            let step = step.or_else(|| self.step(&matrix, &gradient, free));
            let next = step.map(|step| clamp(&(&self.at + step), &self.lower, &self.upper));
            let Some(next) = next else {
                self.damping *= growth;
                growth *= 2.0;
                if self.damping > DAMPING_MAX {
                    return false;
                }
                continue;
            };
            let step = &next - &self.at;
            let length = step.dot(&(&matrix * &step)).max(0.0).sqrt();
            let is_rounding = step.iter().zip(&self.at).all(|(s, x)| s.abs() <= 1e-15 * x.abs().max(1e-300));
            if is_rounding {
                return true;
            }
            let cost = self.cost();
            // The deviance may be zero; the sum of squares is what is rounded.
            let size = cost.abs().max(self.normal.cost(&self.sigma));
            let normal = self.fit.normal(&next);
            self.evaluations += 1;
            let after = normal.as_ref().map_or(f64::INFINITY, |normal| self.cost_of(normal));
            if let Some(normal) = normal.filter(|_| after < cost) {
                let predicted = 2.0 * step.dot(&gradient) - step.dot(&(&matrix * &step));
                let ratio = ((cost - after) / predicted).clamp(0.0, 1.0);
                let is_converged = length < tolerance && self.damping < UNDAMPED;
                self.damping = (self.damping * (1.0 / 3.0_f64).max(1.0 - (2.0 * ratio - 1.0).powi(3))).max(1e-12);
                growth = 2.0;
                (self.at, self.sigma, self.normal) = (next, self.sigma_of(&normal), normal);
                if is_converged {
                    return true;
                }
                continue;
            }
            // A short step that changes the cost by rounding ends the descent.
            if length < tolerance.max(1e-3) && (after - cost).abs() <= 1e-11 * size {
                return true;
            }
            self.damping *= growth;
            growth *= 2.0;
            if self.damping > DAMPING_MAX {
                return length < tolerance.max(1e-3) || self.stall.is_some();
            }
        }
        false
    }

    /// Returns a damped step in which no coordinate of a parameter exceeds [`TRUST`]: a larger one is clipped, and the others are
    /// solved for again.
    fn step(&self, matrix: &DMatrix<f64>, gradient: &DVector<f64>, mut free: Vec<usize>) -> Option<DVector<f64>> {
        let axes = self.fit.axes();
        let mut clipped = DVector::zeros(gradient.len());
        loop {
            let left = gradient - matrix * &clipped;
            let step = solve(matrix, &left, &free, self.damping)?;
            let longest =
                free.iter().copied().filter(|n| *n < axes).max_by(|a, b| step[*a].abs().total_cmp(&step[*b].abs()));
            let Some(n) = longest.filter(|n| step[*n].abs() > TRUST) else { return Some(clipped + step) };
            clipped[n] = TRUST.copysign(step[n]);
            free.retain(|other| *other != n);
            if free.is_empty() {
                return Some(clipped);
            }
        }
    }
}

/// Solves `(M + damping diag M) step = gradient` for the free unknowns; `None` if the matrix is not positive definite.
fn solve(matrix: &DMatrix<f64>, gradient: &DVector<f64>, free: &[usize], damping: f64) -> Option<DVector<f64>> {
    let largest = free.iter().map(|n| matrix[(*n, *n)]).fold(0.0, f64::max);
    let floor = (1e-14 * largest).max(f64::MIN_POSITIVE);
    let mut part = DMatrix::from_fn(free.len(), free.len(), |a, b| matrix[(free[a], free[b])]);
    for n in 0..free.len() {
        let diagonal = part[(n, n)].max(floor);
        part[(n, n)] = diagonal * (1.0 + damping);
    }
    let right = DVector::from_fn(free.len(), |n, _| gradient[free[n]]);
    let solution = part.cholesky()?.solve(&right);
    if !solution.iter().all(|value| value.is_finite()) {
        return None;
    }
    let mut step = DVector::zeros(gradient.len());
    free.iter().zip(solution.iter()).for_each(|(n, value)| step[*n] = *value);
    Some(step)
}

fn clamp(at: &DVector<f64>, lower: &DVector<f64>, upper: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(at.len(), |n, _| at[n].clamp(lower[n], upper[n]))
}
