//! Confidence intervals that allow for an unidentified parameter: the hull of the intervals over the points of its profile.

use super::profile::Point;
use motorfit_estimate::Refined;
use motorfit_motor::Axis;

/// Largest standard error, or distance of other optima, of an identified parameter, in the coordinate of its axis.
const SPREAD_MAX: f64 = 1.0;

/// The effect of a profile on another parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Moved {
    /// The parameter moves within its uncertainty.
    Within,
    /// The parameter moves beyond its uncertainty.
    Beyond,
    /// The parameter is not identifiable.
    Lost,
}

/// Widens the interval of a free parameter to the hull over the points of a profile and returns the effect of the profile.
pub(super) fn widen(refined: &mut Refined, index: usize, axis: &Axis, points: &[Point]) -> Moved {
    let (value, more) = (refined.values[index], refined.uncertainty.variance_inflation().sqrt());
    let uncertainty = &mut refined.uncertainty;
    let (Some(error), Some(interval)) = (uncertainty.std_error[index], uncertainty.ci95[index]) else {
        return if refined.at_bound[index].is_some() { Moved::Within } else { Moved::Lost };
    };
    let coordinate = |value: f64| axis.coordinate(value);
    let own = error / axis.slope(value);
    let quantile = (coordinate(interval[1]) - coordinate(value)) / own;
    let of = |point: &Point| {
        let Point { refined, .. } = point;
        refined.uncertainty.ci95[index].unwrap_or([refined.values[index]; 2])
    };
    let hull = points.iter().map(of).fold(interval, |hull, of| [hull[0].min(of[0]), hull[1].max(of[1])]);
    let half = 0.5 * (coordinate(hull[1]) - coordinate(hull[0])) / quantile;
    let farther = (hull[1] - value).max(value - hull[0]) / quantile;
    if hull.iter().zip(interval).any(|(hull, own)| hull.to_bits() != own.to_bits()) {
        uncertainty.ci95[index] = Some(hull);
        uncertainty.std_error[index] = Some(error.max(farther));
    }
    let distance = |point: &Point| (coordinate(point.refined.values[index]) - coordinate(value)).abs();
    let farthest = points.iter().map(distance).fold(0.0, f64::max);
    match (half.is_finite() && half < SPREAD_MAX, farthest > own * more) {
        (false, _) => Moved::Lost,
        (true, true) => Moved::Beyond,
        (true, false) => Moved::Within,
    }
}

/// Widens the interval of a free parameter to the hull of this interval and its copies centred at other values.
pub(super) fn shift(refined: &mut Refined, index: usize, axis: &Axis, values: &[f64]) -> Moved {
    let (value, uncertainty) = (refined.values[index], &mut refined.uncertainty);
    let (Some(error), Some([low, high])) = (uncertainty.std_error[index], uncertainty.ci95[index]) else {
        return Moved::Within;
    };
    let at = axis.coordinate(value);
    let ends = [axis.coordinate(low) - at, axis.coordinate(high) - at];
    let by = |of: fn(f64, f64) -> f64| values.iter().fold(0.0, |by, value| of(by, axis.coordinate(*value) - at));
    let moved = [by(f64::min), by(f64::max)];
    if moved[1] - moved[0] > SPREAD_MAX {
        return Moved::Lost;
    }
    let farthest = moved[1].max(-moved[0]);
    if farthest > 0.0 {
        let quantile = 0.5 * (ends[1] - ends[0]) / (error / axis.slope(value));
        uncertainty.ci95[index] = Some([axis.value(at + moved[0] + ends[0]), axis.value(at + moved[1] + ends[1])]);
        uncertainty.std_error[index] = Some(error + axis.slope(value) * farthest / quantile);
    }
    if farthest > ends[1] { Moved::Beyond } else { Moved::Within }
}
