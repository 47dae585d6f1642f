//! Ordinary least squares of the voltage on velocity and acceleration, for each kind of gravity.
//!
//! The acceleration is the central difference of the velocity over two steps; the voltage is its mean over the same steps. Noise of
//! the velocity biases kA towards zero, so that the result is a start, not an estimate.

use super::checks::MOVING;
use super::kind::MechanismKind;
use super::signals::Signals;
use motorfit_core::numeric::{count, peak};
use motorfit_record::Record;
use nalgebra::{DMatrix, DVector};

/// Characteristics by regression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MechanismRegression {
    /// Gravity of the regression.
    pub kind: MechanismKind,
    /// Voltage against friction, kS \[V\].
    pub ks: f64,
    /// Voltage for velocity, kV.
    pub kv: f64,
    /// Voltage for acceleration, kA.
    pub ka: f64,
    /// Voltage against gravity, kG \[V\]; 0 without gravity.
    pub kg: f64,
    /// Angle of an arm above the horizontal where the measured angle is 0 \[rad\].
    pub offset: f64,
    /// Number of samples that move.
    pub samples: usize,
    /// Bayesian information criterion, for comparison between the kinds.
    pub bic: f64,
}

/// Smallest number of samples that move.
const SAMPLES_MIN: usize = 10;

/// Computes the regression of a kind over all recordings; `None` if too few samples move, the kind needs a position that was not
/// recorded, or the regressors are collinear.
#[must_use]
pub fn mechanism_regression(records: &[Record], kind: MechanismKind) -> Option<MechanismRegression> {
    let tests: Vec<Signals<'_>> = records.iter().filter_map(Signals::of).collect();
    let threshold = MOVING * tests.iter().map(|test| peak(test.velocity)).fold(0.0, f64::max);
    let (mut rows, mut volts): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let width = match kind {
        MechanismKind::Simple => 3,
        MechanismKind::Elevator => 4,
        MechanismKind::Arm => 5,
    };
    for test in &tests {
        for n in 1..test.len().saturating_sub(1) {
            let velocity = test.velocity[n];
            let (before, after) = (test.time_s[n] - test.time_s[n - 1], test.time_s[n + 1] - test.time_s[n]);
            let span = before + after;
            if velocity.abs() < threshold || span <= 0.0 {
                continue;
            }
            rows.extend([velocity.signum(), velocity, (test.velocity[n + 1] - test.velocity[n - 1]) / span]);
            match kind {
                MechanismKind::Simple => {}
                MechanismKind::Elevator => rows.push(1.0),
                MechanismKind::Arm => {
                    let angle = *test.position?.get(n)?;
                    rows.extend([angle.cos(), -angle.sin()]);
                }
            }
            volts.push((test.voltage[n - 1] * before + test.voltage[n] * after) / span);
        }
    }
    let samples = volts.len();
    if samples < SAMPLES_MIN.max(2 * width) {
        return None;
    }
    let (x, y) = (DMatrix::from_row_iterator(samples, width, rows), DVector::from_vec(volts));
    // Columns of unit length, so that the rank does not depend on units.
    let scale: Vec<f64> = x.column_iter().map(|column| column.norm()).collect();
    if scale.iter().any(|scale| !(*scale > 0.0 && scale.is_finite())) {
        return None;
    }
    let scaled = DMatrix::from_fn(samples, width, |row, column| x[(row, column)] / scale[column]);
    let decomposed = scaled.svd(true, true);
    if decomposed.rank(1e-6) < width {
        return None;
    }
    let solution = decomposed.solve(&y, 1e-12).ok()?;
    let of = |n: usize| solution.get(n).map_or(0.0, |value| value / scale[n]);
    let found = DVector::from_fn(width, |n, _| of(n));
    let squares = (&y - &x * &found).norm_squared().max(f64::MIN_POSITIVE);
    // Central differences share half of their noise with their neighbours; interpolated samples repeat others.
    let ratio = records.iter().map(Record::effective_sample_ratio).fold(1.0, f64::min);
    let independent = 0.5 * ratio * count(samples);
    let bic = independent * (squares / count(samples)).ln() + count(width) * independent.max(1.0).ln();
    let (kg, offset) = match kind {
        MechanismKind::Simple => (0.0, 0.0),
        MechanismKind::Elevator => (of(3), 0.0),
        // kG cos(θ + offset) = (kG cos offset) cos θ − (kG sin offset) sin θ
        MechanismKind::Arm => (of(3).hypot(of(4)), of(4).atan2(of(3))),
    };
    Some(MechanismRegression { kind, ks: of(0), kv: of(1), ka: of(2), kg, offset, samples, bic })
}
