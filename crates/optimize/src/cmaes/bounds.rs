//! Bounds of CMA-ES: a sample outside of the unit box is evaluated at the nearest point of the box, and its cost is increased by a
//! penalty that grows with the square of the distance (N. Hansen, A. S. P. Niederberger, L. Guzzella, P. Koumoutsakos, IEEE Trans.
//! Evol. Comput. 13 (2009), section IV-B).

use super::distribution::{Distribution, Strategy};
use motorfit_core::numeric::{count, median, quantile, sorted, whole};
use std::collections::VecDeque;

/// Weights of the penalty.
#[derive(Debug, Clone, Default)]
pub(super) struct Penalty {
    /// One weight for each axis; empty while the mean has always been in the box.
    weights: Vec<f64>,
    /// Interquartile ranges of the costs of the last generations.
    ranges: VecDeque<f64>,
}

impl Penalty {
    /// Adapts the weights to the costs of a generation and to the position of the mean.
    pub(super) fn adapt(&mut self, distribution: &Distribution, strategy: &Strategy, costs: &[f64]) {
        let n = distribution.mean.len();
        let finite = sorted(&costs.iter().copied().filter(|cost| cost.is_finite()).collect::<Vec<_>>());
        if !finite.is_empty() {
            let range = quantile(&finite, 0.75) - quantile(&finite, 0.25);
            self.ranges.push_back(range);
        }
        let kept = 20 + whole(3.0 * count(n) / count(strategy.lambda));
        while self.ranges.len() > kept {
            self.ranges.pop_front();
        }
        let outside: Vec<f64> = distribution.mean.iter().map(|x| (x - x.clamp(0.0, 1.0)).abs()).collect();
        if outside.iter().all(|distance| *distance == 0.0) || self.ranges.is_empty() {
            return;
        }
        if self.weights.is_empty() {
            let mean_variance = (0..n).map(|axis| distribution.covariance[(axis, axis)]).sum::<f64>() / count(n);
            let range = median(&sorted(&self.ranges.iter().copied().collect::<Vec<_>>()));
            let weight = 2.0 * range / (distribution.sigma.powi(2) * mean_variance);
            // While all costs are equal they give no scale.
            if !(weight.is_finite() && weight > 0.0) {
                return;
            }
            self.weights = vec![weight; n];
        }
        let far = (count(n).sqrt() / strategy.mass).max(1.0);
        let growth = 1.1_f64.powf((strategy.mass / (10.0 * count(n))).max(1.0));
        for (axis, weight) in self.weights.iter_mut().enumerate() {
            if outside[axis] > 3.0 * far * distribution.deviation(axis) {
                *weight *= growth;
            }
        }
    }

    /// Returns the penalty of a sample.
    pub(super) fn of(&self, distribution: &Distribution, sample: &[f64]) -> f64 {
        let n = sample.len();
        if self.weights.is_empty() || sample.iter().all(|x| (0.0..=1.0).contains(x)) {
            return 0.0;
        }
        let logarithm = |axis: usize| distribution.covariance[(axis, axis)].max(1e-300).ln();
        let mean = (0..n).map(logarithm).sum::<f64>() / count(n);
        let one = |(axis, x): (usize, &f64)| {
            let distance = x - x.clamp(0.0, 1.0);
            self.weights[axis] * distance * distance / (0.9 * (logarithm(axis) - mean)).exp()
        };
        sample.iter().enumerate().map(one).sum::<f64>() / count(n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    #[test]
    fn the_penalty_grows_with_the_distance_and_while_the_mean_is_far_outside() {
        let strategy = Strategy::new(2, 6, true);
        let mut distribution = Distribution::new(DVector::from_vec(vec![0.5, 0.5]), 0.1);
        let mut penalty = Penalty::default();
        let costs = [1.0, 2.0, 3.0, 4.0, 5.0];
        // Interquartile ranges of 2, 12, 1 and, once outside, 2: their median is 2.
        for scale in [1.0, 6.0, 0.5] {
            penalty.adapt(&distribution, &strategy, &costs.map(|cost| scale * cost));
        }
        assert!(penalty.of(&distribution, &[1.5, 0.5]) == 0.0, "no weights while the mean is inside");
        // The median range is 2 and the variance 0.01: the weights are 2 · 2 / 0.01. A sample 0.5 outside, on one of two axes.
        distribution.mean[0] = 1.05;
        let mut flat = Penalty::default();
        flat.adapt(&distribution, &strategy, &[1.0; 5]);
        assert!(flat.of(&distribution, &[1.5, 0.5]) == 0.0);
        flat.adapt(&distribution, &strategy, &[1.0; 5].map(|cost| cost + 1.0));
        flat.ranges.clear();
        flat.adapt(&distribution, &strategy, &costs);
        assert!(flat.of(&distribution, &[1.5, 0.5]) > 0.0, "weights are set once costs differ");
        penalty.adapt(&distribution, &strategy, &costs);
        assert!((penalty.of(&distribution, &[1.5, 0.5]) - 400.0 * 0.25 / 2.0).abs() < 1e-12);
        assert!(penalty.of(&distribution, &[1.0, 0.0]) == 0.0, "nothing inside");
        // More than three standard deviations outside the weight of that axis grows by a tenth, that of the other does not.
        distribution.mean[0] = 1.4;
        penalty.adapt(&distribution, &strategy, &costs);
        assert!((penalty.of(&distribution, &[1.5, 0.5]) - 1.1 * 400.0 * 0.25 / 2.0).abs() < 1e-12);
        assert!((penalty.of(&distribution, &[0.5, -0.5]) - 400.0 * 0.25 / 2.0).abs() < 1e-12);
        // A larger variance along an axis lowers its penalty: ξ is (4/2)^0.9 for variances 4 and 1.
        distribution.covariance[(0, 0)] = 4.0;
        let expected = 1.1 * 400.0 * 0.25 / 2.0 / 2.0_f64.powf(0.9);
        assert!((penalty.of(&distribution, &[1.5, 0.5]) / expected - 1.0).abs() < 1e-12);
    }
}
