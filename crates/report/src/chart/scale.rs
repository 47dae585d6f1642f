//! Scales, ranges and ticks of axes.

use motorfit_core::numeric::{count, whole};
use motorfit_core::text::raised;

/// Largest magnitude that is drawn, and on a logarithmic axis the inverse of the smallest: differences and ratios of such numbers
/// are finite.
const DRAWN_MAX: f64 = 1e150;

/// Scale of an axis.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum AxisScale {
    /// Linear scale.
    #[default]
    Linear,
    /// Logarithmic scale; values that are not positive are not drawn.
    Log,
    /// Named rows, the first on top, of the second axis; row `n` is at `-n`.
    Rows(Vec<String>),
}

impl AxisScale {
    /// Returns the place of a value on the axis: the value, or its decimal logarithm; NaN if it is not drawn.
    pub(super) fn place(&self, value: f64) -> f64 {
        match self {
            Self::Log if (1.0 / DRAWN_MAX..=DRAWN_MAX).contains(&value) => value.log10(),
            Self::Linear | Self::Rows(_) if value.abs() <= DRAWN_MAX => value,
            _ => f64::NAN,
        }
    }

    /// Returns the places of at most about `most` round values in a range of places, with their labels.
    pub(super) fn ticks(&self, range: [f64; 2], most: u32) -> Vec<(f64, String)> {
        match self {
            Self::Linear => ticks(range, most),
            Self::Log => logarithmic(range, most),
            Self::Rows(_) => Vec::new(),
        }
    }
}

/// Returns the ticks of a logarithmic axis: powers of ten, or in less than two decades 1, 2 and 5 times powers of ten, or in a
/// small range those of a linear axis.
fn logarithmic([low, high]: [f64; 2], most: u32) -> Vec<(f64, String)> {
    let is_plain = low >= -3.5 && high <= 5.5;
    let power = |exponent: i32, factor: u8| match (is_plain, factor) {
        (true, _) => {
            let places = usize::try_from(-exponent).unwrap_or(0);
            format!("{:.places$}", f64::from(factor) * 10.0_f64.powi(exponent))
        }
        (false, 1) => format!("10{}", raised(exponent)),
        (false, _) => format!("{factor}\u{b7}10{}", raised(exponent)),
    };
    let exponents = || (-308_i32..=308).filter(|exponent| (low - 1.0..=high + 1.0).contains(&f64::from(*exponent)));
    let inside = |place: &f64| (low - 1e-9..=high + 1e-9).contains(place);
    if high - low >= 2.0 {
        let step = (1..616).find(|step| f64::from(*step) * f64::from(most) >= high - low).unwrap_or(616);
        let of = |exponent: i32| (f64::from(exponent), power(exponent, 1));
        return exponents().filter(|e| e.rem_euclid(step) == 0).map(of).filter(|(place, _)| inside(place)).collect();
    }
    let of = |exponent: i32| {
        [1, 2, 5].map(|factor| (f64::from(exponent) + f64::from(factor).log10(), power(exponent, factor)))
    };
    let round: Vec<(f64, String)> = exponents().flat_map(of).filter(|(place, _)| inside(place)).collect();
    if round.len() >= 2 {
        return round;
    }
    let ends = [low, high].map(|place| 10.0_f64.powf(place));
    ticks(ends, most)
        .into_iter()
        .map(|(value, label)| (value.log10(), label))
        .filter(|(place, _)| inside(place))
        .collect()
}

/// Returns the range of places of values on a scale; a constant or no value gives a range around it.
pub(super) fn range(scale: &AxisScale, values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
    if low > high {
        return [0.0, 1.0];
    }
    let size = low.abs().max(high.abs());
    match scale {
        // Half a decade to each side.
        AxisScale::Log if high - low <= 1e-9 => [low - 0.5, high + 0.5],
        _ if high - low > 1e-9 * size => [low, high],
        _ => [low - 0.1 * size - 1e-12, high + 0.1 * size + 1e-12],
    }
}

/// Returns ticks in a range at multiples of 1, 2 or 5 times a power of ten, at most `most` of them, with their labels.
fn ticks([low, high]: [f64; 2], most: u32) -> Vec<(f64, String)> {
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
pub(super) fn round_step(least: f64) -> f64 {
    let power = 10.0_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|step| step * power).find(|step| *step >= least).unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp, reason = "exact ends are meant")]

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
    fn logarithmic_ticks_are_powers_or_round_factors() {
        let labels =
            |range, most| AxisScale::Log.ticks(range, most).into_iter().map(|(_, label)| label).collect::<Vec<_>>();
        assert_eq!(labels([0.0, 4.0], 6), ["1", "10", "100", "1000", "10000"]);
        assert_eq!(
            labels([-12.2, 0.1], 5),
            ["10\u{207b}\u{b9}\u{b2}", "10\u{207b}\u{2079}", "10\u{207b}\u{2076}", "10\u{207b}\u{b3}", "10\u{2070}"]
        );
        assert_eq!(labels([-1.35, -0.2], 6), ["0.05", "0.1", "0.2", "0.5"]);
        assert_eq!(labels([-1.6, -1.55], 4).len(), 3, "{:?}", labels([-1.6, -1.55], 4));
        for (place, label) in AxisScale::Log.ticks([-1.6, -1.55], 4) {
            assert!((10.0_f64.powf(place) - label.parse::<f64>().unwrap()).abs() < 1e-9, "{label}");
        }
        assert!(
            AxisScale::Log.place(-1.0).is_nan()
                && AxisScale::Log.place(0.0).is_nan()
                && AxisScale::Log.place(f64::INFINITY).is_nan()
        );
        assert_eq!((AxisScale::Log.place(100.0), AxisScale::Linear.place(100.0)), (2.0, 100.0));
    }

    #[test]
    fn ranges_have_a_width() {
        let range = |values: &[f64]| super::range(&AxisScale::Linear, values.iter().copied());
        assert_eq!(range(&[3.0, -1.0]), [-1.0, 3.0]);
        assert_eq!(super::range(&AxisScale::Log, [0.0, 0.0].into_iter()), [-0.5, 0.5]);
        for values in [vec![], vec![0.0], vec![5.0, 5.0], vec![-1e140]] {
            let [low, high] = range(&values);
            assert!(high > low && values.iter().all(|v| (low..=high).contains(v)), "{values:?}");
        }
    }
}
