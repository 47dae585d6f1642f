//! Statistics of signals and samples. Sums are accumulated in the order of the values unless stated otherwise.

use super::conversion::{count, whole};
use std::ops::Range;

/// Returns the arithmetic mean; NaN without values.
#[must_use]
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / count(values.len())
}

/// Returns the root mean square; NaN without values.
#[must_use]
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / count(values.len())).sqrt()
}

/// Returns the sum of squared differences from `mean`.
#[must_use]
pub fn squares_about(mean: f64, values: &[f64]) -> f64 {
    values.iter().map(|v| (v - mean) * (v - mean)).sum()
}

/// Returns the standard deviation of a population (n); NaN without values.
#[must_use]
pub fn standard_deviation(values: &[f64]) -> f64 {
    (squares_about(mean(values), values) / count(values.len())).sqrt()
}

/// Returns the standard deviation of a sample (n − 1); NaN for fewer than two values.
#[must_use]
pub fn sample_deviation(values: &[f64]) -> f64 {
    (squares_about(mean(values), values) / (count(values.len()) - 1.0)).sqrt()
}

/// Returns the largest |value|, 0 without values; computed in eight lanes, so that it vectorizes.
#[must_use]
pub fn peak(values: &[f64]) -> f64 {
    let (eights, rest) = values.as_chunks::<8>();
    let mut peaks = [0.0; 8];
    for eight in eights {
        for (peak, value) in peaks.iter_mut().zip(eight) {
            *peak = if value.abs() > *peak { value.abs() } else { *peak };
        }
    }
    rest.iter().chain(&peaks).fold(0.0, |peak, value| peak.max(value.abs()))
}

/// Returns the smallest and the largest value, +∞ and −∞ without values; computed in four lanes, so that it vectorizes.
#[must_use]
pub fn extremes(values: &[f64]) -> [f64; 2] {
    let (mut low, mut high) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
    let mut add = |lane: usize, value: f64| {
        low[lane] = if value < low[lane] { value } else { low[lane] };
        high[lane] = if value > high[lane] { value } else { high[lane] };
    };
    let (fours, rest) = values.as_chunks::<4>();
    fours.iter().for_each(|four| four.iter().enumerate().for_each(|(lane, value)| add(lane, *value)));
    rest.iter().for_each(|value| add(0, *value));
    [low.into_iter().fold(f64::INFINITY, f64::min), high.into_iter().fold(f64::NEG_INFINITY, f64::max)]
}

/// Number of lanes of [`sum`] and [`dot`]; it is fixed, so that results do not depend on the instruction set.
const LANES: usize = 32;

/// Returns the sum, accumulated in 32 lanes so that it vectorizes.
#[inline(always)]
#[must_use]
pub fn sum(values: &[f64]) -> f64 {
    let (chunks, rest) = values.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for chunk in chunks {
        sums.iter_mut().zip(chunk).for_each(|(sum, value)| *sum += value);
    }
    sums.iter().sum::<f64>() + rest.iter().sum::<f64>()
}

/// Returns the dot product over the length of the shorter slice, accumulated in 32 lanes without fused operations.
#[inline(always)]
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let size = a.len().min(b.len());
    let ((ones, rest), (others, left)) = (a[..size].as_chunks::<LANES>(), b[..size].as_chunks::<LANES>());
    let mut sums = [0.0; LANES];
    for (a, b) in ones.iter().zip(others) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest.iter().zip(left).map(|(a, b)| a * b).sum::<f64>()
}

/// Returns the values in ascending order of `f64::total_cmp`, which puts positive NaN last.
#[must_use]
pub fn sorted(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// Returns a quantile of sorted values, linear between order statistics (R. J. Hyndman, Y. Fan 1996, type 7); NaN without
/// values.
#[must_use]
pub fn quantile(sorted: &[f64], p: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = p.clamp(0.0, 1.0) * count(last);
    let (below, above) = (whole(at.floor()), whole(at.ceil()));
    if below == above || sorted[below].total_cmp(&sorted[above]).is_eq() {
        return sorted[below];
    }
    sorted[below] + (at - at.floor()) * (sorted[above] - sorted[below])
}

/// Returns the median of sorted values, half the sum of the two in the middle; NaN without values.
#[must_use]
pub fn median(sorted: &[f64]) -> f64 {
    let size = sorted.len();
    if size == 0 { f64::NAN } else { 0.5 * (sorted[(size - 1) / 2] + sorted[size / 2]) }
}

/// Returns the order statistic nearest to the quantile `p`; 0 without values. The values are reordered.
#[must_use]
pub fn order_statistic(values: &mut [f64], p: f64) -> f64 {
    let Some(last) = values.len().checked_sub(1) else { return 0.0 };
    let at = whole((count(last) * p).round()).min(last);
    *values.select_nth_unstable_by(at, f64::total_cmp).1
}

/// Returns the upper median, the larger of the two middle values; 0 without values. The values are reordered.
#[must_use]
pub fn upper_median(values: &mut [f64]) -> f64 {
    order_statistic(values, 0.5)
}

/// Returns the standard deviation of white noise on a smooth signal, estimated by the median of |third difference|. The
/// third difference removes the signal up to its parabola, and the median is insensitive to a short transient. The third
/// difference of white noise has variance `(1 + 9 + 9 + 1) σ²`, and the median of |normal| is 0.6745 σ. Zero for fewer than
/// four samples.
#[must_use]
pub fn noise_sigma(signal: &[f64]) -> f64 {
    // Non-negative numbers sort in the order of their bits.
    let third = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs().to_bits();
    let mut thirds: Vec<u64> = signal.windows(4).map(third).collect();
    if thirds.is_empty() {
        return 0.0;
    }
    let middle = thirds.len() / 2;
    let (_, median, _) = thirds.select_nth_unstable(middle);
    f64::from_bits(*median) / (0.674_489_750_196_081_7 * 20.0_f64.sqrt())
}

/// Returns the first differences, each value minus the previous one.
#[must_use]
pub fn differences(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|w| w[1] - w[0]).collect()
}

/// Replaces the values of a signal between some of its samples, `own`, by linear interpolation at the times or places `at`; before the
/// first and after the last of them the nearest holds.
#[doc(hidden)]
pub fn interpolate_between(at: &[f64], values: &mut [f64], own: &[usize]) {
    for pair in own.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let (begin, slope) = (values[from], (values[to] - values[from]) / (at[to] - at[from]));
        for n in from + 1..to {
            values[n] = begin + slope * (at[n] - at[from]);
        }
    }
    let (Some(&first), Some(&last)) = (own.first(), own.last()) else { return };
    let (early, late) = (values[first], values[last]);
    values[..first].fill(early);
    values[last + 1..].fill(late);
}

/// Returns the cumulative sums of the values.
pub fn running_sums(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sum = 0.0;
    let next = |value| {
        sum += value;
        sum
    };
    values.map(next).collect()
}

/// Returns the least-squares slope of y over x for points `(x, y)`; 0 if x is constant.
#[must_use]
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let size = count(points.len().max(1));
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / size, y + p.1 / size));
    let (xx, xy) =
        points.iter().fold((0.0, 0.0), |(xx, xy), p| (xx + (p.0 - x) * (p.0 - x), xy + (p.0 - x) * (p.1 - y)));
    if xx > 0.0 { xy / xx } else { 0.0 }
}

/// Returns the maximal ranges of consecutive indices below `size` for which `test` is true.
pub fn runs(size: usize, test: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = None;
    for n in 0..=size {
        if n < size && test(n) {
            start.get_or_insert(n);
        } else if let Some(start) = start.take() {
            runs.push(start..n);
        }
    }
    runs
}

/// Quantile of the standard normal distribution that is exceeded with probability 1e-4.
const Z: f64 = 3.719;

/// Returns the value that χ² with `freedom` degrees of freedom exceeds with probability 1e-4 (E. B. Wilson, M. M. Hilferty
/// 1931). It is too high by 7 % for one degree of freedom, 2 % for five, 1 % for ten, and less for more.
#[must_use]
pub fn chi_square_limit(freedom: usize) -> f64 {
    let part = 2.0 / (9.0 * count(freedom));
    count(freedom) * (1.0 - part + Z * part.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_cmp, reason = "exact equality is meant")]

    use super::*;

    #[test]
    fn quantiles_are_those_of_the_textbook() {
        let values = sorted(&[4.0, 1.0, 3.0, 2.0]);
        assert_eq!([0.0, 0.25, 0.5, 1.0].map(|p| quantile(&values, p)), [1.0, 1.75, 2.5, 4.0]);
        assert!(quantile(&[], 0.5).is_nan());
        let infinite = [1.0, f64::INFINITY, f64::INFINITY];
        assert_eq!([0.5, 0.9].map(|p| quantile(&infinite, p)), [f64::INFINITY; 2], "no NaN between infinities");
        assert!((sample_deviation(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]) - (32.0_f64 / 7.0).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn medians_and_order_statistics_by_hand() {
        let mut values = [3.0, 1.0, 4.0, 2.0];
        assert_eq!((median(&[1.0, 2.0, 3.0, 4.0]), upper_median(&mut values)), (2.5, 3.0));
        assert_eq!((order_statistic(&mut values, 0.3), order_statistic(&mut [], 0.3)), (2.0, 0.0));
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn lanes_and_their_rest_count_alike() {
        let values: Vec<f64> = (0..77).map(f64::from).collect();
        assert_eq!((sum(&values), dot(&values, &values[..70])), (2926.0, 111_895.0));
        let signs: Vec<f64> = values.iter().map(|v| if v % 2.0 == 0.0 { -v } else { *v }).collect();
        assert_eq!((peak(&signs), extremes(&signs)), (76.0, [-76.0, 75.0]));
        assert_eq!((peak(&[]), extremes(&[])), (0.0, [f64::INFINITY, f64::NEG_INFINITY]));
    }

    #[test]
    fn runs_and_slopes_by_hand() {
        assert_eq!(runs(7, |n| ![0, 3, 4].contains(&n)), [1..3, 5..7]);
        assert_eq!(slope(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]), 2.0);
        assert_eq!(slope(&[(1.0, 1.0), (1.0, 3.0)]), 0.0);
        // χ² with ten degrees of freedom exceeds 35.56 with probability 1e-4.
        assert!((chi_square_limit(10) / 35.56 - 1.0).abs() < 0.015);
    }
}
