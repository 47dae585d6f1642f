//! Rule on a channel with the wrong sign.

use super::finding::Finding;
use super::view::View;
use crate::heading::Quantity;
use motorfit_core::numeric::{count, mean, running_sums};
use motorfit_core::setting::text;

/// Smallest |Σ a b| over Σ |a b| at which the sign of the sum is significant; noise and braking stay far below.
const SURE: f64 = 0.3;
/// Fewest samples for a regression.
const SAMPLES_MIN: usize = 100;

/// Detects a reversed channel from the dynamics or, if these are inconclusive, from the signs of products: from rest, a motor
/// without load takes in energy (Σ v i > 0), its torque accelerates it (Σ i ω > 0), and it turns in the direction of the
/// voltage (Σ v ω > 0).
pub(super) fn sign_reversed(view: &View<'_>, findings: &mut Vec<Finding>) {
    if view.by_current() {
        findings.extend(reversed_current(view));
        return;
    }
    if view.loaded || view.input.peak == 0.0 {
        return;
    }
    let current = view.current.as_ref().filter(|c| c.range > 0.0).map_or(&[][..], |c| c.values);
    let speed = view.speed.as_ref().filter(|c| c.range > 0.0).map_or(&[][..], |c| c.values);
    let voltage = view.input.values;
    // A voltage acts from its sample on, so its response includes the next sample.
    let [vi, iw, vw] =
        [(voltage, &*with_next(current)), (current, speed), (voltage, &*with_next(speed))].map(|(a, b)| sign_of(a, b));
    let sums = |values: &[f64]| running_sums(values.iter().copied());
    let by_products = || match (vi, iw, vw) {
        // A product can come from an offset of the sensor, a covariance with the voltage cannot.
        (-1, -1, 1) | (-1, 0, 0) if against(voltage, current) => Some(Quantity::Current),
        // Far above its bandwidth a motor moves against its voltage, but its angle does not move against the running sum.
        (1, -1, -1) => Some(Quantity::Speed),
        (0, 0, -1) if against(voltage, speed) && sign_of(&sums(voltage), &sums(speed)) == -1 => Some(Quantity::Speed),
        (-1, 1, -1) => Some(Quantity::Voltage),
        _ => None,
    };
    let Some(reversed) = by_dynamics(view).unwrap_or_else(by_products) else { return };
    let message = format!("the sign of the {reversed} is reversed: it contradicts the other columns");
    let heading = heading(view, reversed);
    let remedy = text!("Reverse its sign: " [Columns = "{}={heading}*-1", reversed.key()] ".");
    findings.push(Finding::new("sign_reversed", reversed, message, remedy));
}

/// Returns the heading of a column for a request; a placeholder if the column is unknown or its cells were converted.
fn heading<'a>(view: &'a View<'_>, quantity: Quantity) -> &'a str {
    let column = view.column(quantity).filter(|column| column.conversion.is_empty());
    column.map_or("HEADING", |column| column.heading.as_str())
}

/// Detects a current that is the input and slows the motor down: ∂ω⁺/∂i < 0 at the same ω.
fn reversed_current(view: &View<'_>) -> Option<Finding> {
    let speed = view.speed.as_ref().filter(|speed| speed.range > 0.0)?;
    if view.loaded || view.len() < SAMPLES_MIN || view.input.range == 0.0 {
        return None;
    }
    let message = "the sign of current or speed is reversed: the current slows the motor down";
    let heading = heading(view, Quantity::Current);
    let remedy = text!("Reverse the sign of one of them: " [Columns = "current={heading}*-1"] ".");
    let reversed = sign_of_first(mechanical(view.input.values, speed.values)) == Some(-1);
    reversed.then(|| Finding::new("sign_reversed", Quantity::Current, message, remedy))
}

/// Returns the rows of the mechanical equation: current and speed of each step, and the change of the speed over it.
fn mechanical<'a>(i: &'a [f64], w: &'a [f64]) -> impl Iterator<Item = ([f64; 3], f64)> + Clone + 'a {
    (0..w.len() - 1).map(|n| ([i[n] + i[n + 1], w[n], 0.0], w[n + 1] - w[n]))
}

/// Returns the reversed channel, if any, by the signs of the dynamics, which hold for any excitation: a voltage raises the
/// current (∂i⁺/∂v > 0 at the same i and ω), a current raises the speed (∂ω⁺/∂i > 0 at the same ω).
///
/// Returns `None` if the signs are not significant.
fn by_dynamics(view: &View<'_>) -> Option<Option<Quantity>> {
    let (current, speed) = (view.current.as_ref()?, view.speed.as_ref()?);
    if current.range == 0.0 || speed.range == 0.0 || view.len() < SAMPLES_MIN {
        return None;
    }
    let (i, w) = (current.values, speed.values);
    let electrical = (0..view.len() - 1).map(|n| ([view.input.values[n], i[n], w[n]], i[n + 1] - i[n]));
    match (sign_of_first(electrical)?, sign_of_first(mechanical(i, w))?) {
        (-1, -1) => Some(Some(Quantity::Current)),
        (1, -1) => Some(Some(Quantity::Speed)),
        (-1, 1) => Some(Some(Quantity::Voltage)),
        _ => Some(None),
    }
}

/// Smallest magnitude of a coefficient, in standard errors, at which its sign is significant.
const ERRORS: f64 = 12.0;
/// Smallest coefficient of determination (R²) of the regression.
const EXPLAINED: f64 = 0.05;

/// Returns the sign of the first coefficient of a regression with a constant; `None` if it is not significant.
fn sign_of_first(rows: impl Iterator<Item = ([f64; 3], f64)> + Clone) -> Option<i32> {
    // Central moments of the three regressors and the response.
    let count = count(rows.clone().count());
    let mut means = [0.0; 4];
    for ([a, b, c], y) in rows.clone() {
        means.iter_mut().zip([a, b, c, y]).for_each(|(mean, v)| *mean += v / count);
    }
    let mut moments = [[0.0; 4]; 4];
    for ([a, b, c], y) in rows {
        let row = [a - means[0], b - means[1], c - means[2], y - means[3]];
        for (moments, a) in moments.iter_mut().zip(row) {
            moments.iter_mut().zip(row).for_each(|(moment, b)| *moment += a * b);
        }
    }
    let all = moments[3][3];
    // The other regressors are eliminated by Gauss–Jordan sweeps.
    for pivot in [2, 1] {
        let own = moments[pivot][pivot];
        if own <= 1e-12 * all.max(f64::MIN_POSITIVE) {
            continue;
        }
        let line = moments[pivot];
        for row in (0..4).filter(|row| *row != pivot) {
            let part = moments[row][pivot] / own;
            moments[row].iter_mut().zip(line).for_each(|(v, l)| *v -= part * l);
        }
    }
    let (xx, xy, yy) = (moments[0][0], moments[0][3], moments[3][3]);
    let slope = xy / xx;
    let sse = (yy - slope * xy).max(0.0);
    let error = (sse / (count - 4.0) / xx).sqrt();
    let sure = slope.is_finite() && slope.abs() > ERRORS * error && all - sse > EXPLAINED * all;
    sure.then_some(if slope < 0.0 { -1 } else { 1 })
}

/// Returns the sign of Σ a b; 0 if it is not significant.
fn sign_of(a: &[f64], b: &[f64]) -> i32 {
    let (sum, size) = a.iter().zip(b).fold((0.0, 0.0), |(sum, size), (a, b)| (sum + a * b, size + (a * b).abs()));
    if sum < -SURE * size { -1 } else { i32::from(sum > SURE * size) }
}

/// Returns the sum of each value and the next one; the last value counts twice.
fn with_next(values: &[f64]) -> Vec<f64> {
    let last = values.last().map(|v| 2.0 * v);
    values.windows(2).map(|w| w[0] + w[1]).chain(last).collect()
}

/// Returns true if a signal has a negative covariance with the voltage, to which an offset of its sensor does not contribute.
fn against(voltage: &[f64], values: &[f64]) -> bool {
    let (mean_v, mean) = (mean(voltage), mean(values));
    let varies = voltage.iter().any(|v| v.to_bits() != voltage[0].to_bits());
    let together: f64 = if varies {
        voltage.iter().zip(values).map(|(v, y)| (v - mean_v) * (y - mean)).sum()
    } else {
        voltage[0] * (mean - values.first().map_or(0.0, |first| *first))
    };
    together < 0.0
}
