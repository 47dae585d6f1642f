//! Shapes of the voltage of an experiment.

use motorfit_core::named::named;
use motorfit_core::numeric::count;
use std::f64::consts::{PI, TAU};

named! {
    /// Shape of a voltage over samples.
    pub enum Shape {
        /// Zero for the hold time, then the amplitude.
        Step = "step",
        /// Pseudorandom binary sequence of the shift register x⁹ + x⁵ + 1, each bit for the hold time.
        Prbs = "prbs",
        /// Levels of 1/3, 1, −2/3, 0, −1, 2/3 and 0 of the amplitude, each for the hold time, repeated.
        Stairs = "stairs",
        /// Sine whose period is the hold time.
        Sine = "sine",
        /// Sine whose frequency grows linearly from one period in all samples to one in the hold time.
        Chirp = "chirp",
    }
}

/// Levels of [`Shape::Stairs`] relative to the amplitude.
const STAIRS: [f64; 7] = [1.0 / 3.0, 1.0, -2.0 / 3.0, 0.0, -1.0, 2.0 / 3.0, 0.0];

impl Shape {
    /// Returns the voltage \[V\] of `samples` samples with an amplitude of `volts`. `hold` is the hold time in samples, at least 1.
    #[must_use]
    pub fn voltage(self, volts: f64, hold: usize, samples: usize) -> Vec<f64> {
        let hold = hold.max(1);
        let mut register = 0x1FF_u16;
        let mut bit = |n: usize| {
            if n > 0 && n.is_multiple_of(hold) {
                let feedback = (register ^ (register >> 4)) & 1;
                register = (register >> 1) | (feedback << 8);
            }
            if register & 1 == 1 { 1.0 } else { -1.0 }
        };
        let level = |n: usize| match self {
            Self::Step => f64::from(u8::from(n >= hold)),
            Self::Prbs => bit(n),
            Self::Stairs => STAIRS[n / hold % STAIRS.len()],
            Self::Sine => libm::sin(TAU * count(n) / count(hold)),
            Self::Chirp => {
                let (first, last, at) = (1.0 / count(samples), 1.0 / count(hold), count(n));
                libm::sin(TAU * first * at + PI * (last - first) * at * at / count(samples))
            }
        };
        (0..samples).map(level).map(|level| volts * level).collect()
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_cmp, reason = "exact equality is meant")]

    use super::*;
    use motorfit_core::named::Named as _;

    #[test]
    fn a_prbs_is_a_maximum_length_sequence() {
        let bits = Shape::Prbs.voltage(1.0, 1, 1022);
        // A maximum length sequence of nine bits repeats after 511, has one more of one sign, and is white: its periodic
        // autocorrelation is −1 except at 0.
        assert_eq!(bits[..511], bits[511..]);
        assert_eq!(bits[..511].iter().sum::<f64>().abs(), 1.0);
        for lag in 1..511 {
            let correlation: f64 = (0..511).map(|n| bits[n] * bits[n + lag]).sum();
            assert_eq!(correlation, -1.0, "lag {lag}");
        }
        let held = Shape::Prbs.voltage(2.0, 3, 30);
        assert!(held.chunks(3).zip(&bits).all(|(chunk, bit)| chunk == [2.0 * bit; 3]));
    }

    #[test]
    fn shapes_have_the_amplitude_and_the_hold_time() {
        assert_eq!(Shape::Step.voltage(10.0, 2, 4), [0.0, 0.0, 10.0, 10.0]);
        assert_eq!(Shape::Stairs.voltage(3.0, 1, 8), [1.0, 3.0, -2.0, 0.0, -3.0, 2.0, 0.0, 1.0]);
        let sine = Shape::Sine.voltage(5.0, 8, 9);
        assert!((sine[2] - 5.0).abs() < 1e-12 && sine[8].abs() < 1e-12, "{sine:?}");
        // The frequency of the chirp is the derivative of its phase: the last period has about the hold time.
        let chirp = Shape::Chirp.voltage(1.0, 10, 1000);
        let rising: Vec<usize> = (1..1000).filter(|&n| chirp[n - 1] < 0.0 && chirp[n] >= 0.0).collect();
        let [.., before, last] = rising[..] else { panic!("too few periods") };
        assert!((10..=11).contains(&(last - before)), "{rising:?}");
        for shape in Shape::all() {
            assert_eq!(shape.voltage(1.0, 0, 0), [0.0; 0]);
            assert!(shape.voltage(1.0, 0, 50).iter().all(|v| v.abs() <= 1.0));
        }
    }
}
