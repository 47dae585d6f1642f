//! Autocorrelation of residuals and their cross-correlation with the input, for plots (L. Ljung, *System Identification: Theory
//! for the User*, 2nd ed., 1999, section 16.6).

use motorfit_core::numeric::{count, mean};

/// Largest lag \[samples\].
const LAGS: usize = 25;
/// Quantile of the standard normal distribution for limits that 99 % of the correlations of an adequate model are within.
const QUANTILE: f64 = 2.576;

/// Correlations of the residuals of a channel. An adequate model has 99 % of them within the limits.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualCorrelation {
    /// Autocorrelation at the lags 1 to 25, relative to lag 0.
    pub autocorrelation: Vec<f64>,
    /// Limit of the autocorrelation of white residuals, `2.576/√N`.
    pub autocorrelation_limit: f64,
    /// Cross-correlation coefficients of the residual with the input at the lags −25 to 25; positive lags mean that the residual
    /// follows the input.
    pub cross_correlation: Vec<f64>,
    /// Limit of the cross-correlation of residuals that are independent of the input: its asymptotic variance is the sum of the
    /// products of both autocorrelations, over N.
    pub cross_correlation_limit: f64,
}

impl ResidualCorrelation {
    /// Returns the lags of the cross-correlation \[samples\].
    pub fn cross_lags() -> impl Iterator<Item = f64> {
        (0..=2 * LAGS).map(|n| count(n) - count(LAGS))
    }

    /// Computes the correlations of residuals with an input of the same length. A residual of NaN does not count: its products are
    /// left out. Returns `None` for fewer than 100 residuals, for a constant input, and for residuals that are all zero.
    #[must_use]
    pub fn of(residuals: &[f64], input: &[f64]) -> Option<Self> {
        let counting: Vec<f64> = residuals.iter().copied().filter(|r| !r.is_nan()).collect();
        let n = counting.len();
        if n < 4 * LAGS || residuals.len() != input.len() {
            return None;
        }
        let [mean_e, mean_u] = [&counting, input].map(mean);
        let e: Vec<f64> = residuals.iter().map(|r| if r.is_nan() { 0.0 } else { r - mean_e }).collect();
        let u: Vec<f64> = input.iter().map(|v| v - mean_u).collect();
        let [of_e, of_u] = [&e, &u].map(|x| autocorrelation(x));
        let (of_e, of_u) = (of_e?, of_u?);
        let size = (lagged(&e, &e, 0) * lagged(&u, &u, 0)).sqrt();
        let after = |lag: usize| lagged(&u, &e, lag) / size;
        let before = |lag: usize| lagged(&e, &u, lag) / size;
        let cross = (1..=LAGS).rev().map(before).chain((0..=LAGS).map(after)).collect();
        // Both autocorrelations are even, and lag 0 counts once.
        let sum: f64 = of_e.iter().zip(&of_u).map(|(a, b)| a * b).sum();
        let variance = (1.0 + 2.0 * sum).max(1.0 / count(LAGS)) / count(n);
        Some(Self {
            autocorrelation: of_e,
            autocorrelation_limit: QUANTILE / count(n).sqrt(),
            cross_correlation: cross,
            cross_correlation_limit: QUANTILE * variance.sqrt(),
        })
    }
}

/// Returns the sum of products `a[t] b[t + lag]`.
fn lagged(a: &[f64], b: &[f64], lag: usize) -> f64 {
    a.iter().zip(b.iter().skip(lag)).map(|(a, b)| a * b).sum()
}

/// Returns the autocorrelation at the lags from 1; `None` if the signal is zero or not finite.
fn autocorrelation(signal: &[f64]) -> Option<Vec<f64>> {
    let power = lagged(signal, signal, 0);
    let is_signal = power > 0.0 && power.is_finite();
    is_signal.then(|| (1..=LAGS).map(|lag| lagged(signal, signal, lag) / power).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};

    /// Returns a first-order autoregression with the coefficient `a`.
    fn autoregression(numbers: &mut rand_chacha::ChaCha8Rng, a: f64, length: usize) -> Vec<f64> {
        let mut state = 0.0;
        let mut next = || {
            // The sum of twelve uniform numbers is close to normal.
            let white: f64 = (0..12).map(|_| numbers.random::<f64>()).sum::<f64>() - 6.0;
            state = a * state + white;
            state
        };
        (0..length).map(|_| next()).collect()
    }

    #[test]
    fn independent_signals_exceed_the_limits_in_one_percent_of_the_lags() {
        for (a, b) in [(0.0, 0.0), (0.0, 0.9), (0.5, 0.8)] {
            let [mut outside, mut all, mut white, mut lags] = [0.0; 4];
            for seed in 0..200 {
                let mut numbers = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
                let [e, u] = [a, b].map(|a| autoregression(&mut numbers, a, 1000));
                let found = ResidualCorrelation::of(&e, &u).unwrap();
                let beyond = |values: &[f64], limit: f64| values.iter().filter(|r| r.abs() > limit).count() as f64;
                outside += beyond(&found.cross_correlation, found.cross_correlation_limit);
                all += found.cross_correlation.len() as f64;
                white += beyond(&found.autocorrelation, found.autocorrelation_limit);
                lags += found.autocorrelation.len() as f64;
            }
            // 10,200 lags, correlated by up to 0.9: the fraction has a standard deviation of about 0.3 %.
            assert!((0.003..0.02).contains(&(outside / all)), "{a} {b}: {}", outside / all);
            let is_white = a == 0.0;
            assert_eq!(is_white, white / lags < 0.02, "{a}: {}", white / lags);
        }
    }

    #[test]
    fn a_residual_that_follows_the_input_has_its_lag() {
        let mut numbers = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let u = autoregression(&mut numbers, 0.0, 500);
        let e: Vec<f64> = (0..500).map(|n| if n < 7 { 0.0 } else { u[n - 7] }).collect();
        let found = ResidualCorrelation::of(&e, &u).unwrap();
        let lags = ResidualCorrelation::cross_lags();
        let (at, value) = lags.zip(&found.cross_correlation).max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
        assert!((at - 7.0).abs() < 0.5 && *value > 0.95, "{at} {value}");
    }

    #[test]
    fn residuals_that_do_not_count_change_nothing() {
        // Pairs of masked outliers every 40 samples: with them the autocorrelation would be theirs.
        let mut numbers = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let [e, u] = [0.0, 0.5].map(|a| autoregression(&mut numbers, a, 4000));
        let clean = ResidualCorrelation::of(&e, &u).unwrap();
        let masked: Vec<f64> = e.iter().enumerate().map(|(n, r)| if n % 40 < 2 { f64::NAN } else { *r }).collect();
        let found = ResidualCorrelation::of(&masked, &u).unwrap();
        assert!(
            (found.autocorrelation_limit / clean.autocorrelation_limit - (4000.0_f64 / 3800.0).sqrt()).abs() < 1e-12
        );
        let largest = |values: &[f64], limit: f64| values.iter().map(|r| r.abs()).fold(0.0, f64::max) / limit;
        assert!(largest(&found.autocorrelation, found.autocorrelation_limit) < 1.5);
        assert!(largest(&found.cross_correlation, found.cross_correlation_limit) < 1.5);
        let outliers: Vec<f64> = e.iter().enumerate().map(|(n, r)| if n % 40 < 2 { 50.0 } else { *r }).collect();
        let with = ResidualCorrelation::of(&outliers, &u).unwrap();
        assert!(largest(&with.autocorrelation, with.autocorrelation_limit) > 10.0);
    }

    #[test]
    fn short_constant_and_damaged_signals_have_none() {
        let wave: Vec<f64> = (0..200).map(|n| (f64::from(n) * 0.3).sin()).collect();
        assert!(ResidualCorrelation::of(&wave, &wave).is_some());
        assert!(ResidualCorrelation::of(&wave[..99], &wave[..99]).is_none());
        assert!(ResidualCorrelation::of(&wave, &[1.0; 200]).is_none());
        assert!(ResidualCorrelation::of(&wave, &wave[1..]).is_none());
        let mut damaged = wave.clone();
        damaged[5] = f64::INFINITY;
        assert!(
            ResidualCorrelation::of(&damaged, &wave).is_none() && ResidualCorrelation::of(&wave, &damaged).is_none()
        );
    }
}
