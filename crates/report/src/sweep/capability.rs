//! Process capability of a production line: Cp and Cpk with 95 % intervals.
//!
//! With limits L and U, mean m and standard deviation s of n motors, `Cp = (U − L) / (6 s)` and `Cpk = min(U − m, m − L) / (3 s)`. The
//! interval of Cp is that of s, by the χ² distribution (S. Kotz, N. L. Johnson, "Process Capability Indices", 1993); that of Cpk
//! is the normal approximation `Cpk ± z √(1/(9 n) + Cpk² / (2 (n − 1)))` (A. F. Bissell, Applied Statistics 39(3), 1990). Both hold
//! for normally distributed parameters. The spread includes the error of the estimates, so that the indices are conservative.

use motorfit_core::numeric::{count, mean, sample_deviation};

/// 97.5 % quantile of the standard normal distribution.
const Z: f64 = 1.959_963_984_540_054;

/// Capability indices of a parameter over the motors; NaN where they do not exist.
pub(super) struct Capability {
    pub mean: f64,
    pub deviation: f64,
    pub cp: f64,
    pub cp_ci95: [f64; 2],
    pub cpk: f64,
    pub cpk_ci95: [f64; 2],
}

impl Capability {
    /// Computes the indices of values with a lower and an upper limit. There are none for fewer than two motors or without a
    /// spread, and no Cp with an infinite limit.
    pub(super) fn of(values: &[f64], [low, high]: [f64; 2]) -> Self {
        let (mean, deviation) = (mean(values), sample_deviation(values));
        let none =
            Self { mean, deviation, cp: f64::NAN, cp_ci95: [f64::NAN; 2], cpk: f64::NAN, cpk_ci95: [f64::NAN; 2] };
        if values.len() < 2 || deviation.is_nan() || deviation <= 0.0 {
            return none;
        }
        let freedom = count(values.len() - 1);
        let cp = Some((high - low) / (6.0 * deviation)).filter(|cp| cp.is_finite()).unwrap_or(f64::NAN);
        let cpk = (high - mean).min(mean - low) / (3.0 * deviation);
        let error = (1.0 / (9.0 * count(values.len())) + cpk * cpk / (2.0 * freedom)).sqrt();
        Self {
            cp,
            cp_ci95: [0.025, 0.975].map(|p| cp * (chi_square_quantile(p, freedom) / freedom).sqrt()),
            cpk,
            cpk_ci95: [cpk - Z * error, cpk + Z * error],
            ..none
        }
    }
}

/// Returns the quantile of the χ² distribution with `freedom` degrees of freedom, to nine digits.
fn chi_square_quantile(p: f64, freedom: f64) -> f64 {
    let (mut low, mut high) = (0.0, 2.0 * freedom + 100.0);
    for _ in 0..100 {
        let middle = f64::midpoint(low, high);
        if gamma_share(0.5 * freedom, 0.5 * middle) < p { low = middle } else { high = middle }
    }
    f64::midpoint(low, high)
}

/// Largest number of terms of the series; it needs some multiples of √a.
const TERMS_MAX: u32 = 100_000;

/// Returns the regularized lower incomplete gamma function P(a, x) by its series, for x not far above a.
fn gamma_share(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let (mut term, mut sum) = (1.0 / a, 1.0 / a);
    for n in 1..TERMS_MAX {
        term *= x / (a + f64::from(n));
        sum += term;
        if term < 1e-17 * sum {
            break;
        }
    }
    let logarithm = a * x.ln() - x - libm::lgamma(a);
    (sum.ln() + logarithm).exp().min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_chi_square_are_those_of_the_tables() {
        // Tables of the χ² distribution, such as E. S. Pearson and H. O. Hartley, "Biometrika Tables for Statisticians", Table 8.
        for (freedom, low, high) in [
            (1.0, 0.000_982_069, 5.023_886),
            (9.0, 2.700_389, 19.022_77),
            (29.0, 16.047_07, 45.722_29),
            (99.0, 73.361_08, 128.421_99),
        ] {
            for (p, expected) in [(0.025, low), (0.975, high)] {
                let found = chi_square_quantile(p, freedom);
                assert!((found / expected - 1.0_f64).abs() < 2e-6, "{freedom} {p}: {found}");
            }
        }
        // For many degrees of freedom the distribution is nearly normal (Wilson and Hilferty: an error below 1e-5 here).
        let (freedom, part) = (20_000.0, 2.0 / (9.0 * 20_000.0));
        let expected = freedom * f64::powi(1.0 - part + Z * f64::sqrt(part), 3);
        assert!((chi_square_quantile(0.975, freedom) / expected - 1.0).abs() < 1e-5);
    }

    #[test]
    fn indices_are_those_of_the_formulas() {
        // Mean 10, sum of squares 18, sample variance 2 over ten motors.
        let values = [8.0, 8.0, 9.0, 10.0, 10.0, 10.0, 10.0, 11.0, 12.0, 12.0];
        let found = Capability::of(&values, [4.0, 13.0]);
        let s = f64::sqrt(2.0);
        assert!((found.mean - 10.0).abs() < 1e-12 && (found.deviation - s).abs() < 1e-12);
        assert!((found.cp - 9.0 / (6.0 * s)).abs() < 1e-12 && (found.cpk - 3.0 / (3.0 * s)).abs() < 1e-12);
        let [low, high] = found.cp_ci95;
        assert!((low - found.cp * f64::sqrt(2.700_389 / 9.0)).abs() < 1e-5, "{low}");
        assert!((high - found.cp * f64::sqrt(19.022_77 / 9.0)).abs() < 1e-5, "{high}");
        // Cpk² = 1/2: the standard error is √(1/90 + 1/36) = 0.19720.
        let half = 1.959_964 * 0.197_203;
        assert!((found.cpk_ci95[0] - (found.cpk - half)).abs() < 1e-5, "{:?}", found.cpk_ci95);
        assert!((found.cpk_ci95[1] - (found.cpk + half)).abs() < 1e-5, "{:?}", found.cpk_ci95);
        let one_sided = Capability::of(&values, [4.0, f64::INFINITY]);
        assert!(one_sided.cp.is_nan() && (one_sided.cpk - 6.0 / (3.0 * s)).abs() < 1e-12);
        for values in [&[][..], &[1.0], &[1.0, 1.0]] {
            assert!(Capability::of(values, [0.0, 2.0]).cpk.is_nan());
        }
    }

    #[test]
    fn intervals_cover_the_true_indices() {
        use rand::{RngExt as _, SeedableRng as _};
        // 4000 lines of 30 motors with Cp = Cpk = 4/3. The 95 % intervals cover between 93.5 and 96.5 % of them: the binomial
        // deviation is 0.34 %, and Bissell's interval is an approximation.
        let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
        let mut normal = || {
            let [u, v]: [f64; 2] = [random.random(), random.random()];
            (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
        };
        let (mut cp, mut cpk) = (0, 0);
        for _ in 0..4000 {
            let values: Vec<f64> = (0..30).map(|_| normal()).collect();
            let found = Capability::of(&values, [-4.0, 4.0]);
            let covers = |[low, high]: [f64; 2]| u32::from(low <= 4.0 / 3.0 && 4.0 / 3.0 <= high);
            cp += covers(found.cp_ci95);
            cpk += covers(found.cpk_ci95);
        }
        assert!((3740..=3860).contains(&cp), "{cp} of 4000");
        assert!((3700..=3900).contains(&cpk), "{cpk} of 4000");
    }
}
