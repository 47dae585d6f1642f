//! Statistics of repeated runs: bootstrap confidence intervals, Wilcoxon's signed-rank test, Holm's correction and the
//! probability of superiority.

use motorfit_core::numeric::{count, quantile, sorted, whole};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Number of bootstrap resamples.
const RESAMPLES: usize = 4000;

/// Returns the 95 % percentile bootstrap confidence interval of the median (Efron 1979), NaN without values. The same
/// seed gives the same interval.
pub(super) fn median_interval(values: &[f64], seed: u64) -> [f64; 2] {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut resample = vec![0.0; values.len()];
    let mut median = || {
        resample.iter_mut().for_each(|v| *v = values[random.random_range(0..values.len())]);
        resample.sort_by(f64::total_cmp);
        quantile(&resample, 0.5)
    };
    if values.is_empty() {
        return [f64::NAN; 2];
    }
    let medians = sorted(&(0..RESAMPLES).map(|_| median()).collect::<Vec<_>>());
    [0.025, 0.975].map(|p| quantile(&medians, p))
}

/// Returns the 95 % percentile bootstrap confidence interval of a statistic of two samples that are paired by index; NaN without pairs.
/// The same seed gives the same interval.
pub(super) fn paired_interval(a: &[f64], b: &[f64], seed: u64, statistic: impl Fn(&[f64], &[f64]) -> f64) -> [f64; 2] {
    let pairs = a.len().min(b.len());
    if pairs == 0 {
        return [f64::NAN; 2];
    }
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut resampled = || {
        let drawn = (0..pairs).map(|_| random.random_range(0..pairs)).map(|pair| (a[pair], b[pair]));
        let (a, b): (Vec<f64>, Vec<f64>) = drawn.unzip();
        statistic(&a, &b)
    };
    let resampled = sorted(&(0..RESAMPLES).map(|_| resampled()).collect::<Vec<_>>());
    [0.025, 0.975].map(|p| quantile(&resampled, p))
}

/// Returns the two-sided p-value of Wilcoxon's signed-rank test (Wilcoxon 1945) for paired differences. Zeros and NaN
/// are omitted. The distribution is exact up to 50 differences without ties; otherwise it is the normal approximation
/// with a correction for ties.
pub(super) fn wilcoxon(differences: &[f64]) -> f64 {
    let mut kept: Vec<f64> = differences.iter().copied().filter(|d| *d != 0.0 && !d.is_nan()).collect();
    kept.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let n = kept.len();
    if n == 0 {
        return 1.0;
    }
    let (mut positive, mut ties, mut first) = (0.0, 0.0, 0);
    while first < n {
        let end = (first..n).find(|&k| kept[k].abs().total_cmp(&kept[first].abs()).is_ne()).unwrap_or(n);
        let (tied, rank) = (count(end - first), 0.5 * count(first + 1 + end));
        positive += rank * count(kept[first..end].iter().filter(|d| **d > 0.0).count());
        ties += tied * tied * tied - tied;
        first = end;
    }
    let all = 0.5 * count(n) * count(n + 1);
    let smaller = positive.min(all - positive);
    if n <= 50 && ties == 0.0 {
        return exact(n, smaller);
    }
    let variance = count(n) * count(n + 1) * count(2 * n + 1) / 24.0 - ties / 48.0;
    libm::erfc((0.5 * all - smaller) / (2.0 * variance).sqrt()).min(1.0)
}

/// Returns twice the probability, at most 1, that `n` ranks with random signs have a sum of positive ranks of at most
/// `sum`.
fn exact(n: usize, sum: f64) -> f64 {
    let most = n * (n + 1) / 2;
    let mut ways = vec![0.0; most + 1];
    ways[0] = 1.0;
    for rank in 1..=n {
        for total in (rank..=most).rev() {
            ways[total] += ways[total - rank];
        }
    }
    let within: f64 = ways[..=whole(sum).min(most)].iter().sum();
    (2.0 * within / 2.0_f64.powi(i32::try_from(n).unwrap_or(i32::MAX))).min(1.0)
}

/// Returns p-values adjusted for multiple comparisons by Holm's step-down method (Holm 1979), in the same order.
pub(super) fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|a, b| p_values[*a].total_cmp(&p_values[*b]));
    let mut adjusted = vec![0.0; p_values.len()];
    let mut least: f64 = 0.0;
    for (rank, &n) in order.iter().enumerate() {
        least = least.max((count(p_values.len() - rank) * p_values[n]).min(1.0));
        adjusted[n] = least;
    }
    adjusted
}

/// Returns the probability of superiority `P(a < b) + P(a = b) / 2` (Vargha and Delaney 2000); NaN without values.
pub(super) fn superiority(a: &[f64], b: &[f64]) -> f64 {
    let b = sorted(b);
    let wins = |x: &f64| {
        let (below, up_to) =
            (b.partition_point(|y| y.total_cmp(x).is_lt()), b.partition_point(|y| y.total_cmp(x).is_le()));
        count(b.len() - up_to) + 0.5 * count(up_to - below)
    };
    a.iter().map(wins).sum::<f64>() / count(a.len() * b.len())
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_cmp, reason = "exact equality is meant")]

    use super::*;

    #[test]
    fn wilcoxon_agrees_with_scipy() {
        // scipy 1.17 stats.wilcoxon: exact; with ties, method="approx"; beyond 50, without correction.
        let d = [0.5, -1.25, 3.0, 2.5, -0.75, 4.0, 1.5, -2.0, 6.0, 5.0];
        assert!((wilcoxon(&d) - 0.083_984_375).abs() < 1e-12, "{}", wilcoxon(&d));
        let d = [1.0, 1.0, -1.0, 2.0, 2.0, 3.0, -2.0, 4.0, 5.0, 5.0, 1.0, 7.0];
        assert!((wilcoxon(&d) - 0.016_104_395_272_305_463).abs() < 1e-12, "{}", wilcoxon(&d));
        let d: Vec<f64> = (0..60).map(|n| f64::from((n * 37) % 61) - 24.0 + 0.01 * f64::from(n)).collect();
        assert!((wilcoxon(&d) - 0.012_575_018_443_691_98).abs() < 1e-12, "{}", wilcoxon(&d));
        assert_eq!((wilcoxon(&[0.0; 9]), wilcoxon(&[])), (1.0, 1.0));
        // If all n differences have the same sign, p = 2/2^n.
        let one_side: Vec<f64> = (1..=50).map(f64::from).collect();
        assert!((wilcoxon(&one_side) / 2.0_f64.powi(-49) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn wilcoxon_has_its_nominal_level() {
        // Under symmetric differences about 5 % of 2000 tests reject at the 5 % level; the tolerance is 3 standard
        // deviations.
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut rejects = |shift: f64| {
            let mut draw = || random.random::<f64>() + random.random::<f64>() - 1.0 + shift;
            (0..2000).filter(|_| wilcoxon(&(0..20).map(|_| draw()).collect::<Vec<_>>()) < 0.05).count()
        };
        let (alike, apart) = (rejects(0.0), rejects(0.4));
        assert!((70..=130).contains(&alike), "{alike} of 2000");
        assert!(apart > 1900, "{apart} of 2000");
    }

    #[test]
    fn intervals_have_their_nominal_coverage() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(6);
        let covered = (0..400).filter(|&n| {
            // The median of the exponential distribution is ln 2.
            let values: Vec<f64> = (0..50).map(|_| -(1.0 - random.random::<f64>()).ln()).collect();
            let [low, high] = median_interval(&values, n);
            (low..=high).contains(&std::f64::consts::LN_2)
        });
        // The expectation is 380 ± 4.4; percentile intervals of a median deviate a little from their level.
        let covered = covered.count();
        assert!((362..=394).contains(&covered), "{covered} of 400");
        assert_eq!(median_interval(&[1.0, 2.0, 9.0], 1), median_interval(&[1.0, 2.0, 9.0], 1));
    }

    #[test]
    fn corrections_and_effects_are_those_of_the_textbook() {
        let adjusted = holm(&[0.01, 0.04, 0.03, 0.005]);
        for (ours, theirs) in adjusted.iter().zip([0.03, 0.06, 0.06, 0.02]) {
            assert!((ours - theirs).abs() < 1e-15, "{adjusted:?}");
        }
        assert!((superiority(&[1.0, 2.0], &[2.0, 3.0]) - 0.875).abs() < 1e-15);
    }
}
