//! Feedback gains of a mechanism from its feedforward characteristics kV and kA: the linear–quadratic regulators of velocity and of
//! position, sampled with the period of the controller and compensated for a delay of the measurement.
//!
//! The plant is `dω/dt = (v − kV ω)/kA`, `dx/dt = ω`. The regulator minimizes `Σ x²/ex² + ω²/eω² + v²/r²` (Bryson's rule) with the
//! largest acceptable errors ex and eω and the largest voltage r. A delay D of the measurement is compensated as in WPILib's
//! `LinearQuadraticRegulator::LatencyCompensate`: the gain is multiplied by `(A − B K)^(D/T)`, which predicts the state over the delay.

use nalgebra::{Matrix2, SMatrix};

/// Properties of a motor controller on which the units of its gains depend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Controller {
    /// Name of the controller.
    pub name: &'static str,
    /// Description.
    pub text: &'static str,
    /// Output of the controller for one volt.
    pub output_per_volt: f64,
    /// Units of velocity of the controller for one unit per second.
    pub velocity_per_unit: f64,
    /// Period of its control loop \[s\].
    pub period_s: f64,
    /// True if the derivative gain is per second, false if it is per period.
    pub is_normalized: bool,
    /// Delay of its measurement of the velocity \[s\].
    pub delay_s: f64,
}

/// Creates a row of [`CONTROLLERS`] from output, factor of the velocity, period \[ms\], normalization and delay \[ms\].
const fn controller(
    (name, text): (&'static str, &'static str),
    (output_per_volt, velocity_per_unit): (f64, f64),
    is_normalized: bool,
    [period, delay]: [f64; 2],
) -> Controller {
    let (period_s, delay_s) = (period / 1e3, delay / 1e3);
    Controller { name, text, output_per_volt, velocity_per_unit, period_s, is_normalized, delay_s }
}

/// The controllers of robots, with the properties that SysId assumes.
pub static CONTROLLERS: [Controller; 7] = [
    controller(("wpilib", "A loop of WPILib on the robot's computer, in volts"), (1.0, 1.0), true, [20.0, 0.0]),
    controller(("ctre-v6", "Phoenix 6: Talon FX with voltage output"), (1.0, 1.0), true, [1.0, 1.0]),
    controller(("ctre-v5", "Phoenix 5: Talon SRX, Falcon with v5"), (1023.0 / 12.0, 0.1), false, [1.0, 81.5]),
    controller(("ctre-cancoder", "A CANcoder of Phoenix 5"), (1.0 / 12.0, 60.0), true, [1.0, 81.5]),
    controller(("rev-neo", "SPARK with the encoder of a NEO"), (1.0 / 12.0, 60.0), false, [1.0, 112.0]),
    controller(("rev-encoder", "SPARK with another encoder"), (1.0 / 12.0, 60.0), false, [1.0, 81.5]),
    controller(("venom", "Venom"), (4096.0 / 12.0, 60.0), false, [1.0, 5.0]),
];

/// Weights of a regulator, in the units of the characteristics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedbackWeights {
    /// Largest acceptable error of the position.
    pub position: f64,
    /// Largest acceptable error of the velocity.
    pub velocity: f64,
    /// Largest voltage \[V\].
    pub volts: f64,
}

/// Gains of a regulator in the units of its controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedbackGains {
    /// Output per error.
    pub kp: f64,
    /// Output per rate of the error; 0 for a velocity.
    pub kd: f64,
}

/// Acceleration per voltage below which a mechanism without inertia is assumed, kA \[V·s² per unit\].
const KA_MIN: f64 = 1e-7;

/// Returns the gain of a regulator of the velocity; `None` if the characteristics are no mechanism or the compensation has no real
/// solution. Without inertia the gain is 0.
#[must_use]
pub fn velocity_feedback(
    [kv, ka]: [f64; 2],
    weights: &FeedbackWeights,
    controller: &Controller,
) -> Option<FeedbackGains> {
    if !is_mechanism([kv, ka]) {
        return None;
    }
    let scale = controller.output_per_volt / controller.velocity_per_unit;
    if ka < KA_MIN {
        return Some(FeedbackGains { kp: 0.0, kd: 0.0 });
    }
    let (decay, _, rise) = responses(kv, ka, controller.period_s);
    let (a, b) = (SMatrix::<f64, 1, 1>::new(decay), SMatrix::<f64, 1, 1>::new(rise));
    let cost = SMatrix::<f64, 1, 1>::new(weights.velocity.powi(-2));
    let gain = regulator(&a, &b, &cost, weights.volts.powi(-2))?[0];
    let closed = decay - rise * gain;
    // The power of a number that is not positive is not real.
    let predicted = match controller.delay_s > 0.0 {
        true if closed <= 0.0 => return None,
        true => gain * closed.powf(controller.delay_s / controller.period_s),
        false => gain,
    };
    Some(FeedbackGains { kp: predicted * scale, kd: 0.0 })
}

/// Returns the gains of a regulator of the position; `None` as for [`velocity_feedback`].
#[must_use]
pub fn position_feedback(
    [kv, ka]: [f64; 2],
    weights: &FeedbackWeights,
    controller: &Controller,
) -> Option<FeedbackGains> {
    if !is_mechanism([kv, ka]) {
        return None;
    }
    let period = controller.period_s;
    let steps = controller.delay_s / period;
    if ka < KA_MIN {
        // The velocity follows the voltage at once, and is the input.
        let (a, b) = (SMatrix::<f64, 1, 1>::new(1.0), SMatrix::<f64, 1, 1>::new(period));
        let cost = SMatrix::<f64, 1, 1>::new(weights.position.powi(-2));
        let gain = regulator(&a, &b, &cost, weights.volts.powi(-2))?[0];
        let kp = kv * gain * (1.0 - period * gain).powf(steps) * controller.output_per_volt;
        return kp.is_finite().then_some(FeedbackGains { kp, kd: 0.0 });
    }
    let (decay, moved, rise) = responses(kv, ka, period);
    let forced = if kv > 0.0 { (period - moved) / kv } else { 0.5 * period * period / ka };
    let a = Matrix2::new(1.0, moved, 0.0, decay);
    let b = SMatrix::<f64, 2, 1>::new(forced, rise);
    let cost = Matrix2::new(weights.position.powi(-2), 0.0, 0.0, weights.velocity.powi(-2));
    let gain = regulator(&a, &b, &cost, weights.volts.powi(-2))?;
    let gain = if steps > 0.0 { gain * power(&(a - b * gain), steps)? } else { gain };
    let per_period = if controller.is_normalized { 1.0 } else { 1.0 / period };
    let [kp, kd] = [gain[0], gain[1] * per_period].map(|gain| gain * controller.output_per_volt);
    (kp.is_finite() && kd.is_finite()).then_some(FeedbackGains { kp, kd })
}

/// Returns true if kV and kA are those of a mechanism.
fn is_mechanism([kv, ka]: [f64; 2]) -> bool {
    kv >= 0.0 && ka >= 0.0 && (kv + ka).is_finite()
}

/// Returns the decay of a velocity over a period, the distance that a unit of velocity moves in it, and the velocity that a volt
/// gives in it.
fn responses(kv: f64, ka: f64, period: f64) -> (f64, f64, f64) {
    let x = kv / ka * period;
    // (1 − exp(−x))/x without cancellation.
    let mean = if x > 1e-12 { -(-x).exp_m1() / x } else { 1.0 - 0.5 * x };
    ((-x).exp(), period * mean, period * mean / ka)
}

/// Largest number of doublings; each squares the closed loop, so that a few dozen reach any accuracy.
const DOUBLINGS: usize = 60;

/// Returns the gain of the discrete-time linear–quadratic regulator, by the structure-preserving doubling algorithm for the algebraic
/// Riccati equation (Chu, Fan, Lin and Wang, 2004); `None` if there is none.
fn regulator<const N: usize>(
    a: &SMatrix<f64, N, N>,
    b: &SMatrix<f64, N, 1>,
    cost: &SMatrix<f64, N, N>,
    effort: f64,
) -> Option<SMatrix<f64, 1, N>> {
    let identity = SMatrix::<f64, N, N>::identity();
    let (mut f, mut g, mut p) = (*a, b * b.transpose() / effort, *cost);
    for _ in 0..DOUBLINGS {
        let inverse = (identity + g * p).try_inverse()?;
        let next_p = p + f.transpose() * p * inverse * f;
        let next_g = g + f * inverse * g * f.transpose();
        f = f * inverse * f;
        let change = (next_p - p).norm();
        (p, g) = (next_p, next_g);
        if change <= 1e-14 * p.norm() {
            break;
        }
    }
    let weight = effort + (b.transpose() * p * b)[0];
    let gain = b.transpose() * p * a / weight;
    gain.iter().all(|gain| gain.is_finite()).then_some(gain)
}

/// Returns the real power of a matrix by its eigenvalues; `None` if an eigenvalue is real and not positive, whose power is not real.
fn power(matrix: &Matrix2<f64>, exponent: f64) -> Option<Matrix2<f64>> {
    let (mean, determinant) = (0.5 * matrix.trace(), matrix.determinant());
    let square = mean * mean - determinant;
    // The power is `alpha + beta M` with the same eigenvectors.
    let (alpha, beta) = if square < 0.0 {
        let (radius, angle) = (determinant.sqrt(), (-square).sqrt().atan2(mean));
        let (grown, turned) = (radius.powf(exponent), exponent * angle);
        let beta = grown * turned.sin() / (-square).sqrt();
        (grown * turned.cos() - beta * mean, beta)
    } else {
        let root = square.sqrt();
        let [low, high] = [mean - root, mean + root];
        if low <= 0.0 {
            return None;
        }
        let (low_power, apart) = (low.powf(exponent), high - low);
        // The difference of the powers without cancellation.
        let beta = match apart > 0.0 {
            true => low_power * (exponent * (apart / low).ln_1p()).exp_m1() / apart,
            false => exponent * low_power / low,
        };
        (low_power - beta * low, beta)
    };
    Some(Matrix2::identity() * alpha + matrix * beta)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str) -> Controller {
        *CONTROLLERS.iter().find(|own| own.name == name).unwrap()
    }

    const WEIGHTS: FeedbackWeights = FeedbackWeights { position: 1.0, velocity: 1.5, volts: 7.0 };

    /// The gains of `make_feedback.py`, by WPILib's own regulator: controller, kV, kA, velocity kP, position kP and kD.
    const ORACLE: &str = include_str!("../../../../tests/golden/feedback.csv");

    #[test]
    fn gains_are_those_of_wpilib() {
        let mut rows = 0;
        for line in ORACLE.lines().filter(|line| !line.starts_with('#')).skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            let number = |n: usize| cells[n].parse::<f64>().unwrap();
            let controller = of(cells[0]);
            let characteristics = [number(1), number(2)];
            let velocity = velocity_feedback(characteristics, &WEIGHTS, &controller).unwrap();
            let position = position_feedback(characteristics, &WEIGHTS, &controller).unwrap();
            // The oracle's Riccati solver and matrix power have relative errors of up to 1e-8.
            for (own, expected) in [(velocity.kp, number(3)), (position.kp, number(4)), (position.kd, number(5))] {
                assert!((own - expected).abs() <= 1e-7 * expected.abs().max(1e-9), "{line}: {own} for {expected}");
            }
            rows += 1;
        }
        assert!(rows > 20, "{rows}");
    }

    #[test]
    fn mechanisms_without_inertia_or_without_meaning_have_no_gain() {
        let controller = of("wpilib");
        assert_eq!(velocity_feedback([3.0, 0.0], &WEIGHTS, &controller), Some(FeedbackGains { kp: 0.0, kd: 0.0 }));
        assert!(position_feedback([3.0, 0.0], &WEIGHTS, &controller).unwrap().kp > 0.0);
        for wrong in [[-1.0, 0.1], [1.0, -0.1], [f64::NAN, 0.1], [f64::INFINITY, 1.0]] {
            assert_eq!(velocity_feedback(wrong, &WEIGHTS, &controller), None);
            assert_eq!(position_feedback(wrong, &WEIGHTS, &controller), None);
        }
    }

    #[test]
    fn powers_of_matrices_compose() {
        for matrix in [Matrix2::new(0.9, 0.02, -0.5, 0.7), Matrix2::new(0.9, 0.3, 0.1, 0.8), Matrix2::identity() * 0.5]
        {
            let half = power(&matrix, 0.5).unwrap();
            assert!((half * half - matrix).norm() < 1e-12);
            assert!((power(&matrix, 3.0).unwrap() - matrix * matrix * matrix).norm() < 1e-12);
        }
        assert!(power(&Matrix2::new(-0.5, 0.0, 0.0, 0.5), 0.5).is_none());
    }
}
