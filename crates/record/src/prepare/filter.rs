//! Low-pass filters: Butterworth and Chebyshev type I, as cascades of second-order sections.
//!
//! The poles are those of the analog prototype (A. V. Oppenheim, R. W. Schafer, *Discrete-Time Signal Processing*, appendix
//! B), mapped by the bilinear transformation with a prewarped cut-off; the zeros are at half the sampling rate. The gain at
//! zero frequency is 1 for every filter, so that constant signals do not change.

use motorfit_core::numeric::count;
use motorfit_core::setting::text;
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use std::f64::consts::PI;
use std::str::FromStr;

/// A low-pass filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowPass {
    /// Type of the filter.
    pub kind: FilterKind,
    /// Order, from 1 to 12.
    pub order: usize,
    /// Cut-off frequency \[Hz\]: a Butterworth filter has a gain of −3 dB there, a Chebyshev filter has the edge of its
    /// passband ripple there.
    pub cutoff_hz: f64,
}

/// Type of a low-pass filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FilterKind {
    /// Butterworth: maximally flat in the passband.
    Butterworth,
    /// Chebyshev type I: a steeper edge, with ripple in the passband.
    Chebyshev {
        /// Ripple in the passband \[dB\], above 0 and at most 6.
        ripple_db: f64,
    },
}

/// Highest order of a filter.
pub(super) const ORDER_MAX: usize = 12;
/// Largest ripple of a Chebyshev filter \[dB\].
const RIPPLE_MAX_DB: f64 = 6.0;
/// Default ripple of a Chebyshev filter \[dB\].
const RIPPLE_DB: f64 = 0.5;

impl FromStr for LowPass {
    type Err = Error;

    /// Parses `butterworth:50` or `chebyshev:50:4:0.5`: type, cut-off \[Hz\], order (default 4), ripple \[dB\] (default 0.5).
    fn from_str(text: &str) -> Result<Self> {
        let bad = |what: String| {
            let hint = text!(
                "Write " [Filter = "butterworth:CUTOFF_HZ[:ORDER]"] " or chebyshev:CUTOFF_HZ[:ORDER[:RIPPLE_DB]], \
                 as in chebyshev:50:4:0.5."
            );
            Error::usage(text!([Filter] ": {what}"), hint)
        };
        let mut parts = text.split(':');
        let name = parts.next().unwrap_or_default().trim().to_lowercase();
        let number = |part: Option<&str>, otherwise: f64| match part {
            None => Ok(otherwise),
            Some(part) => crate::import::parse_number(part, false).map_err(&bad),
        };
        let cutoff_hz = number(parts.next(), f64::NAN)?;
        let order = number(parts.next(), 4.0)?;
        let ripple = parts.next();
        let kind = match (name.as_str(), ripple) {
            ("butterworth", None) => FilterKind::Butterworth,
            ("chebyshev" | "chebyshev1", ripple) => FilterKind::Chebyshev { ripple_db: number(ripple, RIPPLE_DB)? },
            ("butterworth", Some(_)) => return Err(bad("a Butterworth filter has no ripple".to_owned())),
            _ => return Err(bad(format!("\"{}\" is not a filter", excerpt(&name)))),
        };
        if parts.next().is_some() {
            return Err(bad(format!("\"{}\" has too many parts", excerpt(text))));
        }
        if !(cutoff_hz.is_finite() && cutoff_hz > 0.0) {
            return Err(bad(format!("\"{}\" has no positive cut-off", excerpt(text))));
        }
        let orders = 1..=ORDER_MAX;
        let Some(order) = orders.into_iter().find(|n| (count(*n) - order).abs() < 1e-9) else {
            return Err(bad(format!("order {order}, expected a whole number from 1 to {ORDER_MAX}")));
        };
        if let FilterKind::Chebyshev { ripple_db } = kind
            && !(ripple_db > 0.0 && ripple_db <= RIPPLE_MAX_DB)
        {
            return Err(bad(format!("ripple {ripple_db} dB, expected more than 0 and at most {RIPPLE_MAX_DB}")));
        }
        Ok(Self { kind, order, cutoff_hz })
    }
}

/// Second-order section `(b0 + b1 z⁻¹ + b2 z⁻²)/(1 + a1 z⁻¹ + a2 z⁻²)`.
#[derive(Debug, Clone, Copy)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

/// Properties of the impulse response of a filter.
pub(super) struct Response {
    /// Sum of its squares: the ratio of output to input power for white noise.
    pub noise_power: f64,
    /// Length of the impulse response \[samples\]: later values are below a millionth of its norm.
    pub memory: usize,
}

/// Cascade of sections of a filter at one sampling rate.
#[derive(Debug, Clone)]
pub(super) struct Cascade(Vec<Section>);

impl LowPass {
    /// Checks that cut-off, order and ripple are in range.
    fn check(&self) -> Result<()> {
        let wrong = |message: String| Err(Error::usage(text!([Filter] ": {message}"), "Correct the filter."));
        if !(self.cutoff_hz.is_finite() && self.cutoff_hz > 0.0) {
            return wrong(format!("found a cut-off of {:?} Hz, expected a finite one above 0", self.cutoff_hz));
        }
        if !(1..=ORDER_MAX).contains(&self.order) {
            return wrong(format!("order {}, expected a whole number from 1 to {ORDER_MAX}", self.order));
        }
        match self.kind {
            FilterKind::Chebyshev { ripple_db } if !(ripple_db > 0.0 && ripple_db <= RIPPLE_MAX_DB) => {
                wrong(format!("ripple {ripple_db:?} dB, expected more than 0 and at most {RIPPLE_MAX_DB}"))
            }
            _ => Ok(()),
        }
    }

    /// Designs the filter for a sampling period \[s\].
    ///
    /// # Errors
    /// Returns `Usage` if cut-off, order or ripple are out of range, or the cut-off is not below 0.98 of half the sampling
    /// rate.
    pub(super) fn design(&self, period_s: f64) -> Result<Cascade> {
        self.check()?;
        let nyquist = 0.5 / period_s;
        if self.cutoff_hz >= 0.98 * nyquist {
            let message =
                format!("the cut-off of {} Hz is not below half the sampling rate, {nyquist} Hz", self.cutoff_hz);
            return Err(Error::usage(message, "Give a lower cut-off."));
        }
        // The bilinear transformation with T = 2: s = (1 − z⁻¹)/(1 + z⁻¹), w = tan(π f h).
        let w = (PI * self.cutoff_hz * period_s).tan();
        let order = count(self.order);
        let (sinh, cosh) = match self.kind {
            FilterKind::Butterworth => (1.0, 1.0),
            FilterKind::Chebyshev { ripple_db } => {
                let epsilon = (10f64.powf(ripple_db / 10.0) - 1.0).sqrt();
                let mu = (1.0 / epsilon).asinh() / order;
                (mu.sinh(), mu.cosh())
            }
        };
        let pole = |k: usize| {
            let angle = PI * count(2 * k + 1) / (2.0 * order);
            (w * sinh * angle.sin(), w * cosh * angle.cos())
        };
        let pairs = (0..self.order / 2).map(|k| {
            let (re, im) = pole(k);
            second_order(2.0 * re, re * re + im * im)
        });
        let single = (self.order % 2 == 1).then(|| first_order(pole(self.order / 2).0));
        Ok(Cascade(pairs.chain(single).collect()))
    }
}

/// Returns `c/(s² + b s + c)` under the bilinear transformation.
fn second_order(b: f64, c: f64) -> Section {
    let a0 = 1.0 + b + c;
    Section { b: [c / a0, 2.0 * c / a0, c / a0], a: [2.0 * (c - 1.0) / a0, (1.0 - b + c) / a0] }
}

/// Returns `c/(s + c)` under the bilinear transformation.
fn first_order(c: f64) -> Section {
    let a0 = 1.0 + c;
    Section { b: [c / a0, c / a0, 0.0], a: [(c - 1.0) / a0, 0.0] }
}

impl Cascade {
    /// Filters a signal that was constant at `before` up to its first sample.
    pub(super) fn apply(&self, signal: &[f64], before: f64) -> Vec<f64> {
        let mut signal = signal.to_vec();
        for Section { b, a } in &self.0 {
            // The steady state for a constant input; as the gain at zero frequency is 1, it is the same for every section.
            let mut state = [before * (1.0 - b[0]), before * (b[2] - a[1])];
            for x in &mut signal {
                let y = b[0] * *x + state[0];
                state = [b[1] * *x - a[0] * y + state[1], b[2] * *x - a[1] * y];
                *x = y;
            }
        }
        signal
    }

    /// Returns the noise power and the length of the impulse response.
    pub(super) fn response(&self) -> Response {
        let mut sum = 0.0;
        let mut last = 0;
        let mut quiet = 0;
        let mut states = vec![[0.0; 2]; self.0.len()];
        let mut input = 1.0;
        // Simulates until the response stays negligible; the bound holds for cut-offs down to a millionth of the rate.
        for n in 0..50_000_000 {
            let mut x = input;
            for (Section { b, a }, state) in self.0.iter().zip(&mut states) {
                let y = b[0] * x + state[0];
                *state = [b[1] * x - a[0] * y + state[1], b[2] * x - a[1] * y];
                x = y;
            }
            input = 0.0;
            sum += x * x;
            let is_quiet = x * x < 1e-12 * sum;
            quiet = if is_quiet { quiet + 1 } else { 0 };
            last = if is_quiet { last } else { n + 1 };
            if quiet > 1000 {
                break;
            }
        }
        Response { noise_power: sum, memory: last }
    }

    /// Returns the gain at a frequency.
    #[cfg(test)]
    fn gain(&self, frequency_hz: f64, period_s: f64) -> f64 {
        let angle = -2.0 * PI * frequency_hz * period_s;
        let at = |c: [f64; 3]| {
            let (re, im) =
                (c[1] * angle.cos() + c[2] * (2.0 * angle).cos(), c[1] * angle.sin() + c[2] * (2.0 * angle).sin());
            (c[0] + re).hypot(im)
        };
        self.0.iter().map(|Section { b, a }| at(*b) / at([1.0, a[0], a[1]])).product()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_match_the_analog_prototypes() {
        // Analog magnitudes at the prewarped frequency: Butterworth 1/√(1 + x²ⁿ), Chebyshev 1/√(1 + ε² T²(x)) relative to
        // zero frequency.
        let h = 1e-3;
        for (text, f) in [
            ("butterworth:50", 50.0),
            ("butterworth:80:3", 120.0),
            ("chebyshev:50:4:0.5", 20.0),
            ("chebyshev:40:5:1", 60.0),
            ("chebyshev:40:2:3", 300.0),
            ("butterworth:100:1", 10.0),
        ] {
            let filter: LowPass = text.parse().unwrap();
            let x = (PI * f * h).tan() / (PI * filter.cutoff_hz * h).tan();
            let n = count(filter.order);
            let expected = match filter.kind {
                FilterKind::Butterworth => 1.0 / (1.0 + x.powf(2.0 * n)).sqrt(),
                FilterKind::Chebyshev { ripple_db } => {
                    let epsilon = (10f64.powf(ripple_db / 10.0) - 1.0).sqrt();
                    let t = |x: f64| if x > 1.0 { (n * x.acosh()).cosh() } else { (n * x.acos()).cos() };
                    (1.0 + (epsilon * t(0.0)).powi(2)).sqrt() / (1.0 + (epsilon * t(x)).powi(2)).sqrt()
                }
            };
            let gain = filter.design(h).unwrap().gain(f, h);
            assert!((gain / expected - 1.0).abs() < 1e-9, "{text} at {f} Hz: {gain} {expected}");
        }
    }

    #[test]
    fn constants_pass_and_the_noise_power_is_the_mean_squared_gain() {
        let cascade = "chebyshev:60:6".parse::<LowPass>().unwrap().design(1e-3).unwrap();
        assert!(cascade.apply(&[3.0; 200], 3.0).iter().all(|y| (y - 3.0).abs() < 1e-9));
        // Parseval: the power of the impulse response is the mean of |gain|² over all frequencies.
        let mean = (0..5000).map(|k| cascade.gain((f64::from(k) + 0.5) * 0.1, 1e-3).powi(2)).sum::<f64>() / 5000.0;
        let noise_power = cascade.response().noise_power;
        assert!((noise_power / mean - 1.0).abs() < 1e-3, "{noise_power} {mean}");
    }

    #[test]
    fn invalid_filters_are_rejected() {
        for (text, part) in [
            ("bessel:50", "not a filter"),
            ("butterworth", "no positive cut-off"),
            ("butterworth:-5", "no positive cut-off"),
            ("butterworth:50:4:1", "no ripple"),
            ("chebyshev:50:2.5", "whole number"),
            ("chebyshev:50:20", "whole number"),
            ("chebyshev:50:4:0", "ripple"),
            ("chebyshev:50:4:1:1", "too many"),
        ] {
            let error = text.parse::<LowPass>().unwrap_err();
            assert!(error.to_string().contains(part), "{error}");
        }
        assert!("butterworth:600".parse::<LowPass>().unwrap().design(1e-3).is_err());
    }
}
