//! Ranges and ticks of axes.

use crate::numeric::{count, whole};

/// Largest magnitude that is drawn: differences and ratios of such numbers are finite.
pub(super) const DRAWN_MAX: f64 = 1e150;

/// Returns the range of values; a constant or no value gives a range around it.
pub(super) fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
    if low > high {
        return [0.0, 1.0];
    }
    let size = low.abs().max(high.abs());
    if high - low > 1e-9 * size { [low, high] } else { [low - 0.1 * size - 1e-12, high + 0.1 * size + 1e-12] }
}

/// Returns ticks in a range at multiples of 1, 2 or 5 times a power of ten, at most `most` of them, with their labels.
pub(super) fn ticks([low, high]: [f64; 2], most: u32) -> Vec<(f64, String)> {
    let step = round_step((high - low) / f64::from(most.max(1)));
    let first = (low / step).ceil();
    let at = |n: usize| (first + count(n)) * step;
    let places = whole(-step.log10().floor());
    let label = |value: f64| {
        let value = if value.abs() < 1e-9 * step { 0.0 } else { value };
        let is_plain = places <= 5 && low.abs().max(high.abs()) < 1e6;
        if is_plain { format!("{value:.places$}") } else { exponent(value, step) }
    };
    let most = usize::try_from(most).unwrap_or(usize::MAX).saturating_add(1);
    (0..=most)
        .map(at)
        .take_while(|v| *v <= high + 1e-9 * step)
        .map(|v| (v, label(v).replace('-', "\u{2212}")))
        .collect()
}

/// Returns a number with an exponent and the digits that distinguish it from its neighbours at a distance of `step`.
fn exponent(value: f64, step: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (value.abs().log10().floor() - step.log10().floor()).clamp(0.0, 15.0);
    format!("{value:.*e}", whole(digits))
}

/// Returns the smallest of 1, 2 and 5 times a power of ten that is at least `least`.
pub(in crate::report) fn round_step(least: f64) -> f64 {
    let power = 10.0_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|step| step * power).find(|step| *step >= least).unwrap_or(10.0 * power)
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "exact ends are meant")]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_in_the_range() {
        let labels = |range, most| ticks(range, most).into_iter().map(|(_, label)| label).collect::<Vec<_>>();
        assert_eq!(labels([0.0, 3.0], 6), ["0.0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0"]);
        assert_eq!(labels([-2.3, 8.1], 5), ["0", "5"]);
        assert_eq!(labels([-0.05, 0.05], 6), ["\u{2212}0.04", "\u{2212}0.02", "0.00", "0.02", "0.04"]);
        assert_eq!(labels([0.0, 2e7], 4), ["0", "5e6", "1.0e7", "1.5e7", "2.0e7"]);
        for [low, high] in [[0.0, 1e-140], [-1e140, 1e140], [5.0, 5.000_001], [1e-9, 3.3]] {
            let found = ticks([low, high], 5);
            assert!((1..=7).contains(&found.len()), "{low} {high}: {found:?}");
            assert!(found.iter().all(|(v, _)| (low..=high).contains(v) || (v - high).abs() < 1e-6 * (high - low)));
        }
    }

    #[test]
    fn ranges_have_a_width() {
        assert_eq!(range([3.0, -1.0].into_iter()), [-1.0, 3.0]);
        for values in [vec![], vec![0.0], vec![5.0, 5.0], vec![-1e140]] {
            let [low, high] = range(values.iter().copied());
            assert!(high > low && values.iter().all(|v| (low..=high).contains(v)), "{values:?}");
        }
    }
}
