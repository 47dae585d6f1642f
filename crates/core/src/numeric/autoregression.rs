//! Autoregressive models of a signal by the method of J. P. Burg (1967).

use super::conversion::count;
use super::statistics::dot;
use multiversion::multiversion;

/// A stable autoregression `e[n] = Σ a[k] e[n−1−k] + ε[n]`: its poles are inside the unit circle.
#[derive(Debug, Clone, PartialEq)]
pub struct Autoregression {
    /// Coefficients `a`; empty for a white signal.
    pub coefficients: Vec<f64>,
    /// Ratio of the variance of ε to the mean square of the signal.
    pub innovation: f64,
}

/// Fits an autoregression to a signal by Burg's method, which is accurate also for slowly decaying correlations. Of the
/// orders up to `order_max` it selects the one with the lowest `N ln(innovation) + penalty · order`: a penalty of 2 gives
/// AIC, one of ln N gives BIC.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
#[must_use]
pub fn autoregression(values: &[f64], order_max: usize, penalty: f64) -> Autoregression {
    let size = values.len();
    // Backward errors are stored one index earlier with every order, so that the pairs of an order have equal indices.
    let (mut forward, mut backward) = (values.to_vec(), values.to_vec());
    let mut best = Autoregression { coefficients: Vec::new(), innovation: 1.0 };
    let mut coefficients = Vec::<f64>::new();
    let (mut left, mut least) = (1.0_f64, 0.0);
    for order in 1..=order_max.min(size.saturating_sub(1)) {
        let (ahead, behind) = (&mut forward[order..], &mut backward[..size - order]);
        let reflection = 2.0 * dot(ahead, behind) / (dot(ahead, ahead) + dot(behind, behind));
        left *= 1.0 - reflection * reflection;
        if !(reflection.is_finite() && left > 0.0) {
            break;
        }
        for (ahead, behind) in ahead.iter_mut().zip(behind) {
            (*ahead, *behind) = (*ahead - reflection * *behind, *behind - reflection * *ahead);
        }
        let reversed: Vec<f64> = coefficients.iter().rev().copied().collect();
        coefficients.iter_mut().zip(reversed).for_each(|(a, b)| *a -= reflection * b);
        coefficients.push(reflection);
        let criterion = count(size) * left.ln() + count(order) * penalty;
        if criterion < least {
            least = criterion;
            best = Autoregression { coefficients: coefficients.clone(), innovation: left };
        }
    }
    best
}
