//! Transfer functions of the linear motor from the voltage to speed and current, with their poles.
//!
//! With zero initial state, `v = R i + L di/dt + K ω` and `J dω/dt = K i − B ω` give
//! `Ω/V = K/D`, `I/V = (J s + B)/D` and `D = L J s² + (R J + L B) s + R B + K²`.

use motorfit_motor::{Parameter, Parameters};

/// Transfer functions of a motor, normalized so that the constant coefficient of the denominator is 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransferFunctions {
    /// Steady-state gain from voltage to speed `K/(R B + K²)` \[rad/s/V\].
    pub speed_gain: f64,
    /// Steady-state gain from voltage to current `B/(R B + K²)` \[A/V\].
    pub current_gain: f64,
    /// Time constant of the zero of the current, `J/B` \[s\].
    pub current_zero: f64,
    /// Coefficients of s \[s\] and s² \[s²\] of the denominator.
    pub denominator: [f64; 2],
    /// Poles as real and imaginary parts \[rad/s\]; complex poles are a conjugate pair, with the positive imaginary part first.
    pub poles: [[f64; 2]; 2],
}

impl TransferFunctions {
    /// Returns the transfer functions of a motor; `None` unless R, L, K, B and J are positive and the numbers are finite.
    #[must_use]
    pub fn of(motor: &Parameters) -> Option<Self> {
        let [r, l, k, b, j] = Parameter::ALL.map(|p| motor.get(p));
        let constant = r * b + k * k;
        let denominator = [(r * j + l * b) / constant, l * j / constant];
        let [first, second] = denominator;
        // The larger real pole is that of the stable formula; the other follows from their product.
        let discriminant = first * first - 4.0 * second;
        let poles = if discriminant >= 0.0 {
            let sum = first + discriminant.sqrt();
            [[-2.0 / sum, 0.0], [-sum / (2.0 * second), 0.0]]
        } else {
            let (real, imaginary) = (-first / (2.0 * second), (-discriminant).sqrt() / (2.0 * second));
            [[real, imaginary], [real, -imaginary]]
        };
        let found =
            Self { speed_gain: k / constant, current_gain: b / constant, current_zero: j / b, denominator, poles };
        let is_finite = poles.iter().flatten().chain(&denominator).all(|v| v.is_finite());
        (is_finite && [r, l, k, b, j].into_iter().all(|v| v > 0.0)).then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poles_are_roots_of_the_denominator() {
        for values in
            [[0.92, 7.8e-3, 0.073, 6.8e-4, 1.36e-4], [2.5, 2e-3, 0.02, 1.2e-5, 1.5e-5], [1.0, 1e-9, 0.1, 1e-4, 1e-3]]
        {
            let [r, l, k, b, j] = values;
            let found = TransferFunctions::of(&Parameters { r, l, k, b, j }).unwrap();
            for [re, im] in found.poles {
                // D(s) at s = re + i im, relative to its largest term.
                let (square, double) = (re * re - im * im, 2.0 * re * im);
                let real = l * j * square + (r * j + l * b) * re + r * b + k * k;
                let imaginary = l * j * double + (r * j + l * b) * im;
                let size = (l * j * (re * re + im * im)).max(r * b + k * k);
                assert!(real.abs() < 1e-9 * size && imaginary.abs() < 1e-9 * size, "{re} {im}: {real} {imaginary}");
            }
            // In the steady state, v = R i + K ω and B ω = K i.
            let [i, w] = [found.current_gain, found.speed_gain];
            assert!((r * i + k * w - 1.0).abs() < 1e-12 && (b * w - k * i).abs() < 1e-12);
        }
        assert!(TransferFunctions::of(&Parameters { l: 0.0, ..Parameters::M2 }).is_none());
    }
}
