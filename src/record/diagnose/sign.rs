//! A channel whose sign is reversed.

use super::Finding;
use super::statistics::mean;
use super::view::View;
use crate::record::Quantity;

/// A sum of products beyond this part of the sum of their sizes has a sign: far from what noise or braking does.
const SURE: f64 = 0.3;

/// From rest, a motor without load takes energy in (Σ v i > 0), its torque accelerates it (Σ i ω > 0), and so it turns
/// as the voltage says (Σ v ω > 0).
pub(super) fn sign_reversed(view: &View<'_>, findings: &mut Vec<Finding>) {
    if view.loaded || view.volts_peak == 0.0 {
        return;
    }
    let current = view.current.as_ref().filter(|c| c.range > 0.0).map_or(&[][..], |c| c.values);
    let speed = view.speed.as_ref().filter(|c| c.range > 0.0).map_or(&[][..], |c| c.values);
    let voltage = view.voltage;
    // A voltage acts from its sample on: what answers it is seen in the next.
    let [vi, iw, vw] =
        [(voltage, &*answer(current)), (current, speed), (voltage, &*answer(speed))].map(|(a, b)| sign_of(a, b));
    let reversed = match (vi, iw, vw) {
        // An offset of the sensor has a product with the voltage but no change with it.
        (-1, -1, 1) | (-1, 0, 0) if against(voltage, current) => Quantity::Current,
        // Far above its bandwidth a motor runs against its voltage, but not in its running sum.
        (1, -1, -1) => Quantity::Speed,
        (0, 0, -1) if against(voltage, speed) && sign_of(&sums(voltage), &sums(speed)) == -1 => Quantity::Speed,
        (-1, 1, -1) => Quantity::Voltage,
        _ => return,
    };
    findings.push(
        Finding::new(
            "sign_reversed",
            format!("the sign of the {reversed} is reversed: it runs against what the other columns say"),
            "Swap its sign: --columns QUANTITY=HEADING*-1.",
        )
        .of(reversed),
    );
}

/// The sign of Σ a b; 0 where it is small.
fn sign_of(a: &[f64], b: &[f64]) -> i32 {
    let (sum, size) = a.iter().zip(b).fold((0.0, 0.0), |(sum, size), (a, b)| (sum + a * b, size + (a * b).abs()));
    if sum < -SURE * size { -1 } else { i32::from(sum > SURE * size) }
}

/// Each value with the next one.
fn answer(values: &[f64]) -> Vec<f64> {
    let last = values.last().map(|v| 2.0 * v);
    values.windows(2).map(|w| w[0] + w[1]).chain(last).collect()
}

/// Whether a signal changes against the voltage: an offset of its sensor does not.
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

/// The running sum.
fn sums(values: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    values
        .iter()
        .map(|v| {
            sum += v;
            sum
        })
        .collect()
}
