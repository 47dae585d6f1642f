//! The normal distribution of CMA-ES and its update (N. Hansen, The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772, 2016;
//! numbers of equations refer to it).

use crate::numbers::Numbers;
use motorfit_core::numeric::count;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Weights and learning rates for a number of axes and samples (Table 1 of the tutorial).
#[derive(Debug, Clone)]
pub(super) struct Strategy {
    /// Number of samples of a generation.
    pub lambda: usize,
    /// Recombination weights by rank; those of the worse half are negative, or zero without active update.
    pub weights: Vec<f64>,
    /// Number of samples with a positive weight.
    pub parents: usize,
    /// Variance-effective selection mass of the parents.
    pub mass: f64,
    c_sigma: f64,
    damping: f64,
    c_path: f64,
    c_one: f64,
    c_mu: f64,
    /// Expected length of a standard normal vector.
    length: f64,
}

impl Strategy {
    pub(super) fn new(axes: usize, lambda: usize, is_active: bool) -> Self {
        let (n, size) = (count(axes), count(lambda));
        let raw: Vec<f64> = (1..=lambda).map(|rank| f64::midpoint(size, 1.0).ln() - count(rank).ln()).collect(); // Eq. 49
        let parents = lambda / 2;
        let mass_of = |part: &[f64]| {
            let squares = part.iter().map(|w| w * w).sum::<f64>();
            if squares > 0.0 { part.iter().sum::<f64>().powi(2) / squares } else { 0.0 }
        };
        let (mass, mass_worse) = (mass_of(&raw[..parents]), mass_of(&raw[parents..]));
        let c_sigma = (mass + 2.0) / (n + mass + 5.0); // Eq. 55
        let damping = 1.0 + 2.0 * (((mass - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma;
        let c_path = (4.0 + mass / n) / (n + 4.0 + 2.0 * mass / n); // Eq. 56
        let c_one = 2.0 / ((n + 1.3).powi(2) + mass); // Eq. 57
        let c_mu = (2.0 * (0.25 + mass + 1.0 / mass - 2.0) / ((n + 2.0).powi(2) + mass)).min(1.0 - c_one); // Eq. 58
        // Eqs. 50 to 53: the sum of the negative weights keeps the covariance matrix positive definite.
        let worse =
            (1.0 + c_one / c_mu).min(1.0 + 2.0 * mass_worse / (mass + 2.0)).min((1.0 - c_one - c_mu) / (n * c_mu));
        let sum = |is_better: bool| raw.iter().filter(|w| (**w > 0.0) == is_better).map(|w| w.abs()).sum::<f64>();
        let (better_sum, worse_sum) = (sum(true), sum(false));
        let weight = |w: &f64| match (*w > 0.0, is_active && worse_sum > 0.0) {
            (true, _) => w / better_sum,
            (false, true) => w * worse / worse_sum,
            (false, false) => 0.0,
        };
        let weights = raw.iter().map(weight).collect();
        let length = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
        Self { lambda, weights, parents, mass, c_sigma, damping, c_path, c_one, c_mu, length }
    }
}

/// The distribution `m + σ N(0, C)`, with its evolution paths.
#[derive(Debug, Clone)]
pub(super) struct Distribution {
    pub mean: DVector<f64>,
    pub sigma: f64,
    pub covariance: DMatrix<f64>,
    /// Principal axes of the covariance, in columns, and the standard deviations along them.
    pub axes: DMatrix<f64>,
    pub lengths: DVector<f64>,
    path: DVector<f64>,
    path_sigma: DVector<f64>,
    /// Number of updates.
    pub generation: usize,
    /// Number of updates since the principal axes were computed.
    since: usize,
}

impl Distribution {
    /// Returns an isotropic distribution.
    pub(super) fn new(mean: DVector<f64>, sigma: f64) -> Self {
        let n = mean.len();
        Self {
            mean,
            sigma,
            covariance: DMatrix::identity(n, n),
            axes: DMatrix::identity(n, n),
            lengths: DVector::repeat(n, 1.0),
            path: DVector::zeros(n),
            path_sigma: DVector::zeros(n),
            generation: 0,
            since: 0,
        }
    }

    /// Writes a sample (Eqs. 38 to 40).
    pub(super) fn draw(&self, numbers: &mut Numbers, sample: &mut [f64]) {
        sample.copy_from_slice(self.mean.as_slice());
        for (axis, length) in self.axes.column_iter().zip(self.lengths.iter()) {
            let along = self.sigma * length * numbers.normal();
            for (x, part) in sample.iter_mut().zip(axis.iter()) {
                *x += along * part;
            }
        }
    }

    /// Returns `C^(−1/2) y`.
    fn whitened(&self, y: &DVector<f64>) -> DVector<f64> {
        let mut white = DVector::zeros(y.len());
        for (axis, length) in self.axes.column_iter().zip(self.lengths.iter()) {
            white.axpy(axis.dot(y) / length, &axis, 1.0);
        }
        white
    }

    /// Updates the distribution from samples in the order of their costs, the best first (Eqs. 41 to 47).
    pub(super) fn update(&mut self, strategy: &Strategy, ordered: &[&[f64]]) {
        let n = self.mean.len();
        let Strategy { weights, mass, c_sigma, damping, c_path, c_one, c_mu, length, .. } = strategy;
        let step = |x: &[f64]| DVector::from_fn(n, |axis, _| (x[axis] - self.mean[axis]) / self.sigma);
        let steps: Vec<DVector<f64>> = ordered.iter().map(|x| step(x)).collect();
        let mut mean = DVector::zeros(n);
        for (weight, y) in weights.iter().zip(&steps).take(strategy.parents) {
            mean.axpy(*weight, y, 1.0);
        }
        let white = self.whitened(&mean);
        self.mean.axpy(self.sigma, &mean, 1.0); // Eq. 42
        self.path_sigma *= 1.0 - c_sigma;
        self.path_sigma.axpy((c_sigma * (2.0 - c_sigma) * mass).sqrt(), &white, 1.0); // Eq. 43
        self.generation += 1;
        let age = 1.0 - (1.0 - c_sigma).powi(i32::try_from(2 * self.generation).unwrap_or(i32::MAX));
        let norm = self.path_sigma.norm();
        let is_short = norm / age.sqrt() < (1.4 + 2.0 / (count(n) + 1.0)) * length;
        self.path *= 1.0 - c_path;
        if is_short {
            self.path.axpy((c_path * (2.0 - c_path) * mass).sqrt(), &mean, 1.0); // Eq. 45
        }
        let sum: f64 = weights.iter().sum();
        let lost = if is_short { 0.0 } else { c_path * (2.0 - c_path) };
        self.covariance *= 1.0 + c_one * lost - c_one - c_mu * sum;
        self.covariance.ger(*c_one, &self.path, &self.path, 1.0);
        for (weight, y) in weights.iter().zip(&steps).filter(|(weight, _)| **weight != 0.0) {
            let scale = if *weight > 0.0 { 1.0 } else { count(n) / self.whitened(y).norm_squared().max(1e-300) };
            self.covariance.ger(c_mu * weight * scale, y, y, 1.0); // Eqs. 46, 47
        }
        self.sigma *= ((c_sigma / damping) * (norm / length - 1.0)).min(1.0).exp(); // Eq. 44
        self.since += 1;
        // The principal axes are computed once in so many generations that this takes no longer than the rest.
        if count(self.since) >= 1.0 / ((c_one + c_mu) * count(n) * 10.0) {
            self.decompose();
        }
    }

    fn decompose(&mut self) {
        self.since = 0;
        let transposed = self.covariance.transpose();
        self.covariance = (&self.covariance + transposed) * 0.5;
        if !self.covariance.iter().all(|v| v.is_finite()) {
            return;
        }
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(self.covariance.clone());
        self.axes = eigenvectors;
        // Rounding may make an eigenvalue of a nearly singular matrix negative; the restart follows by its condition number.
        let smallest = 1e-20 * eigenvalues.max();
        self.lengths = eigenvalues.map(|value| value.max(smallest).sqrt());
    }

    /// Returns the ratio of the largest to the smallest eigenvalue of the covariance.
    pub(super) fn condition(&self) -> f64 {
        (self.lengths.max() / self.lengths.min()).powi(2)
    }

    /// Returns the standard deviation along an axis of the box.
    pub(super) fn deviation(&self, axis: usize) -> f64 {
        self.sigma * self.covariance[(axis, axis)].max(0.0).sqrt()
    }

    /// Returns true if no standard deviation, nor the evolution path, is above `tolerance`.
    pub(super) fn is_within(&self, tolerance: f64) -> bool {
        (0..self.mean.len())
            .all(|axis| self.deviation(axis) < tolerance && (self.sigma * self.path[axis]).abs() < tolerance)
    }

    /// Returns true if a tenth of a standard deviation along the principal axis of this generation, or a fifth along an axis of the
    /// box, does not change the mean.
    pub(super) fn has_no_effect(&self) -> bool {
        let n = self.mean.len();
        let principal = self.generation % n;
        let along = 0.1 * self.sigma * self.lengths[principal];
        let is_same = |axis: usize, step: f64| (self.mean[axis] + step).to_bits() == self.mean[axis].to_bits();
        (0..n).all(|axis| is_same(axis, along * self.axes[(axis, principal)]))
            || (0..n).any(|axis| is_same(axis, 0.2 * self.deviation(axis)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_those_of_another_implementation() {
        // pycma 4.5 RecombinationWeights(6) with finalize_negative_weights for two axes.
        let strategy = Strategy::new(2, 6, true);
        let expected = [
            0.637_042_571_241_216_8,
            0.284_570_257_438_032_9,
            0.078_387_171_320_750_3,
            -0.286_383_782_596_553,
            -0.764_958_094_085_127_7,
            -1.155_981_778_158_921_2,
        ];
        for (found, expected) in strategy.weights.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-14, "{found} {expected}");
        }
        assert!((strategy.mass - 2.028_611_464_610_061_7).abs() < 1e-14);
        assert!(Strategy::new(2, 6, false).weights[3..].iter().all(|weight| *weight == 0.0));
    }

    #[test]
    fn two_updates_are_those_of_the_tutorial() {
        // Computed from Eqs. 41 to 47 with numpy, `C^(−1/2)` by the eigenvalues of C.
        let samples = [[0.5, 0.5], [0.3, 0.9], [0.8, 0.6], [0.2, 0.2], [0.9, 1.1], [-0.1, 0.7]];
        let strategy = Strategy::new(2, 6, true);
        let mut distribution = Distribution::new(DVector::from_vec(vec![0.4, 0.6]), 0.3);
        let mut update = |samples: &[[f64; 2]], mean: [f64; 2], sigma: f64, covariance: [f64; 3]| {
            distribution.update(&strategy, &samples.iter().map(<[f64; 2]>::as_slice).collect::<Vec<_>>());
            let c = &distribution.covariance;
            let found =
                [distribution.mean[0], distribution.mean[1], distribution.sigma, c[(0, 0)], c[(0, 1)], c[(1, 1)]];
            let expected = [mean[0], mean[1], sigma, covariance[0], covariance[1], covariance[2]];
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12, "{found} {expected}");
            }
        };
        let covariance = [0.716_956_410_259_577_5, -0.056_881_245_284_881_414, 0.868_039_922_110_919];
        update(&samples, [0.466_602_099_908_618_5, 0.621_666_820_107_288_2], 0.235_887_187_667_659_12, covariance);
        let mut reversed = samples.map(|x| [0.9 * x[0], 0.9 * x[1]]);
        reversed.reverse();
        let covariance = [1.279_801_337_496_037_7, -0.041_470_018_282_733_24, 0.716_430_317_786_594_5];
        update(&reversed, [0.187_277_767_950_832_23, 0.697_171_065_583_354_3], 0.253_851_066_658_18, covariance);
    }

    #[test]
    fn a_degenerate_covariance_has_no_effect_or_a_large_condition() {
        let mut distribution = Distribution::new(DVector::from_vec(vec![0.4, 0.6]), 0.3);
        assert!(!distribution.has_no_effect() && !distribution.is_within(0.2) && distribution.is_within(0.31));
        distribution.sigma = 1e-18;
        assert!(distribution.has_no_effect());
        distribution.covariance[(1, 1)] = 1e-16;
        distribution.decompose();
        assert!(distribution.condition() > 1e15);
    }
}
