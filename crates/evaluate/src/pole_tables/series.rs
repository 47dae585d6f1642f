//! Power series and sums of a recording that the sum of squared errors needs, whatever the motor.
//!
//! The states follow `x[m] = z[m] + D u[m]` and `z[m] = Φ z[m−1] + b v[m]` with `z[0] = b v[0] + x₀`, where v is the voltage of the sample
//! before, or its change. Then `Σ y[m] z[m] = p(Φ) b + q(Φ) x₀` with the power series `p(λ) = Σ c[k] λᵏ` of the correlation
//! `c[k] = Σ y[m] v[m−k]`, and `q(λ) = Σ y[m] λᵐ`. `Σ v[m] z[m−1]` and the last state are such sums too.

use super::sequences::SEQUENCES;
use motorfit_core::numeric::count;
use realfft::RealFftPlanner;

/// The sequence v, with b and D.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// The voltage: accurate if it changes faster than the motor. With a zero-order hold b is its gain, and D zero.
    Voltage,
    /// The changes of the voltage, with the gains at rest: accurate if it changes more slowly than the motor.
    Changes,
}

/// A recording of one motor on an even clock.
#[derive(Debug, Clone, Copy)]
pub(super) struct Recorded<'a> {
    pub step_s: f64,
    pub voltage: &'a [f64],
    /// Current and speed.
    pub measured: &'a [[f64; 2]],
    pub initial: [f64; 2],
    pub is_first_order_hold: bool,
}

/// Ratio of the sums of squares of the changes and of the voltage below which the changes are more accurate: measured with steps (0),
/// sines of three thousandths of the sampling rate (4e-4) and binary sequences of seven samples (0.1 and above).
const SLOW: f64 = 1e-2;

/// Sums of products over the recording.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Products {
    /// Σ y², of each channel.
    pub measured: [f64; 2],
    /// Σ y u, of each channel.
    pub with_voltage: [f64; 2],
    /// Σ u², Σ u v and Σ v².
    pub voltage: f64,
    pub mixed: f64,
    pub sequence: f64,
    /// u[0], v[0] and the last u.
    pub first_voltage: f64,
    pub first: f64,
    pub last_voltage: f64,
}

/// The power series and sums of a recording in one form.
#[derive(Debug)]
pub(super) struct Series {
    pub form: Form,
    pub is_first_order_hold: bool,
    pub step_s: f64,
    pub samples: usize,
    pub initial: [f64; 2],
    pub products: Products,
    /// Standard deviation of the rounding errors of the coefficients, of the first set.
    pub rounding: [f64; SEQUENCES],
    /// Coefficients of the series with current, speed, v, and of the last state; then the same of the free motion, if there is one.
    pub sets: Vec<Vec<[f64; SEQUENCES]>>,
}

impl Series {
    /// Computes the series in the more accurate form.
    pub fn new(of: &Recorded<'_>) -> Self {
        let square = |value: f64| value * value;
        let size: f64 = of.voltage.iter().map(|u| square(*u)).sum();
        let changes: f64 = of.voltage.windows(2).map(|u| square(u[1] - u[0])).sum();
        Self::in_form(of, if changes < SLOW * size { Form::Changes } else { Form::Voltage })
    }

    fn in_form(of: &Recorded<'_>, form: Form) -> Self {
        let (u, samples) = (of.voltage, of.voltage.len());
        let before = |m: usize| m.checked_sub(1).map_or(0.0, |before| u[before]);
        let sequence: Vec<f64> = match form {
            Form::Voltage => (0..samples).map(before).collect(),
            Form::Changes => (0..samples).map(|m| u[m] - before(m)).collect(),
        };
        let channel = |c: usize| of.measured.iter().map(|y| y[c]).collect::<Vec<f64>>();
        let measured = [0, 1].map(channel);
        let products = Products {
            measured: [0, 1].map(|c| product(&measured[c], &measured[c])),
            with_voltage: [0, 1].map(|c| product(&measured[c], u)),
            voltage: product(u, u),
            mixed: product(u, &sequence),
            sequence: product(&sequence, &sequence),
            first_voltage: u[0],
            first: sequence[0],
            last_voltage: u[samples - 1],
        };
        let [current, speed, own] = correlations([&measured[0], &measured[1], &sequence], &sequence);
        let is_transformed = sequence.iter().filter(|v| **v != 0.0).count() > FEW;
        let size = |sums: &[f64]| if is_transformed { TRANSFORMED * motorfit_core::numeric::rms(sums) } else { 0.0 };
        let rounding = [size(&current), size(&speed), size(&own), 0.0];
        let later = |signal: &[f64], k: usize| signal.get(k + 1).copied().unwrap_or(0.0);
        let forced = (0..samples).map(|k| [current[k], speed[k], later(&own, k), sequence[samples - 1 - k]]);
        let mut sets = vec![forced.collect::<Vec<_>>()];
        let is_moving = of.initial.iter().any(|x| *x != 0.0);
        let has_free_motion = is_moving || of.is_first_order_hold && u[0] != 0.0;
        if has_free_motion {
            let last = |k: usize| f64::from(u8::from(k + 1 == samples));
            sets.push((0..samples).map(|k| [measured[0][k], measured[1][k], later(&sequence, k), last(k)]).collect());
        }
        Self {
            form,
            is_first_order_hold: of.is_first_order_hold,
            step_s: of.step_s,
            samples,
            initial: of.initial,
            products,
            rounding,
            sets,
        }
    }

    /// Returns the memory \[bytes\].
    pub fn bytes(&self) -> usize {
        self.sets.iter().map(|rows| size_of_val(&rows[..])).sum()
    }

    /// Returns 2/T, by which poles are shifted.
    pub fn shift(&self) -> f64 {
        2.0 / (self.step_s * count(self.samples))
    }
}

/// Returns the sum of products, compensated (T. Ogita, S. M. Rump, S. Oishi 2005, Algorithm 5.3).
fn product(a: &[f64], b: &[f64]) -> f64 {
    let (mut sum, mut rest) = (0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        let product: f64 = a * b;
        let total: f64 = sum + product;
        let part = total - sum;
        rest += (sum - (total - part)) + (product - part) + a.mul_add(*b, -product);
        sum = total;
    }
    sum + rest
}

/// Number of values other than zero up to which correlations are summed directly.
const FEW: usize = 32;

/// Rounding errors of correlations by Fourier transforms, relative to their root mean square: transforms distribute errors over all.
const TRANSFORMED: f64 = 3.0 * f64::EPSILON;

/// Returns the correlations `c[k] = Σ y[m] v[m−k]` of three signals with a sequence.
fn correlations(signals: [&[f64]; 3], sequence: &[f64]) -> [Vec<f64>; 3] {
    let samples = sequence.len();
    let driven: Vec<usize> = (0..samples).filter(|m| sequence[*m] != 0.0).collect();
    if driven.len() <= FEW {
        return signals.map(|signal| {
            let mut sums = vec![0.0; samples];
            for m in &driven {
                for (sum, y) in sums.iter_mut().zip(&signal[*m..]) {
                    *sum += y * sequence[*m];
                }
            }
            sums
        });
    }
    let size = (2 * samples).next_power_of_two();
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, inverse) = (planner.plan_fft_forward(size), planner.plan_fft_inverse(size));
    let spectrum = |signal: &[f64]| {
        let mut padded = signal.to_vec();
        padded.resize(size, 0.0);
        let mut spectrum = forward.make_output_vec();
        // The lengths are those of the plan.
        let _ = forward.process(&mut padded, &mut spectrum);
        spectrum
    };
    let of_sequence = spectrum(sequence);
    signals.map(|signal| {
        let mut products = spectrum(signal);
        products.iter_mut().zip(&of_sequence).for_each(|(a, b)| *a *= b.conj());
        let mut sums = inverse.make_output_vec();
        // These are real but for rounding, and the transform refuses other numbers.
        products[0].im = 0.0;
        products[size / 2].im = 0.0;
        let _ = inverse.process(&mut products, &mut sums);
        sums.truncate(samples);
        sums.iter_mut().for_each(|sum| *sum /= count(size));
        sums
    })
}
