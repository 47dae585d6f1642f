//! Criteria: one number for how far a simulation is from a measurement.
//!
//! With `e_c = (measured − simulated)/s_c` over the channels present, N samples, step h and time t:
//! euclidean `√ΣΣe²` (root of the paper's Eq. 13), ISE `hΣΣe²`, IAE `hΣΣ|e|`, ITSE `hΣΣt e²`, ITAE `hΣΣt|e|`,
//! MSE `ΣΣe²/N` (Eq. 14, with N samples), NRMSE `√MSE`. Evaluators return one weighted sum per channel; this module
//! holds the weights that go in and the combination that comes out, so that every evaluator means the same.

use crate::named::named;
use crate::numeric::{count, noise_sigma, peak, rms, standard_deviation};
use crate::text::excerpt;
use crate::{Error, Result};
use std::str::FromStr;

named! {
    /// A norm of errors. A row says whether |e| is summed instead of e², and which cost the sum becomes.
    #[non_exhaustive]
    pub enum Norm: (bool, Total) {
        /// Square root of the sum of squares.
        Euclidean = "euclidean" => (false, Total::Root),
        /// Integral of the squared error.
        Ise = "ise" => (false, Total::Integral),
        /// Integral of the absolute error.
        Iae = "iae" => (true, Total::Integral),
        /// Integral of time times squared error.
        Itse = "itse" => (false, Total::IntegralOverTime),
        /// Integral of time times absolute error.
        Itae = "itae" => (true, Total::IntegralOverTime),
        /// Mean squared error.
        Mse = "mse" => (false, Total::Mean),
        /// Root of the mean squared error.
        Nrmse = "nrmse" => (false, Total::RootMean),
    }
}

named! {
    /// The divisor of each channel's error.
    #[non_exhaustive]
    pub enum Scale (default Std) {
        /// Nothing.
        None = "none",
        /// The largest |measured|.
        Peak = "peak",
        /// The population standard deviation of the measured signal.
        Std = "std",
        /// The standard deviation of the noise, given or estimated.
        Noise = "noise",
    }
}

/// The cost that a sum of losses over N samples becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Total {
    /// Its square root.
    Root,
    /// The sum; each loss is weighted by the step after it.
    Integral,
    /// The same, each loss weighted by time too.
    IntegralOverTime,
    /// The sum over N.
    Mean,
    /// The square root of that.
    RootMean,
}

#[expect(clippy::derivable_impls, reason = "the enum is made by its table")]
impl Default for Norm {
    fn default() -> Self {
        Self::Nrmse
    }
}

impl Norm {
    /// Returns whether errors are weighted by the time that has passed.
    #[must_use]
    pub fn is_time_weighted(self) -> bool {
        self.row().1 == Total::IntegralOverTime
    }
}

/// A criterion: its norm, its scale, and what these need.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Criterion {
    /// The norm of the errors.
    pub norm: Norm,
    /// The scale of each channel.
    pub scale: Scale,
    /// From when time counts in ITSE and ITAE \[s\]; `None` is the start of the recording. Samples before weigh 0.
    pub time_origin_s: Option<f64>,
    /// The noise for [`Scale::Noise`].
    pub noise: Noise,
}

impl FromStr for Criterion {
    type Err = Error;

    /// Reads `CRITERION:SCALE`, or a criterion with the usual scale.
    fn from_str(text: &str) -> Result<Self> {
        let usual = Scale::default().name();
        let (norm, scale) = text.split_once(':').unwrap_or((text, usual));
        let is = |name: &str, asked: &str| name.eq_ignore_ascii_case(asked.trim());
        let norm = Norm::ALL.into_iter().find(|one| is(one.name(), norm));
        let scale = Scale::ALL.into_iter().find(|one| is(one.name(), scale));
        let (Some(norm), Some(scale)) = (norm, scale) else {
            let message = format!("\"{}\" is no criterion", excerpt(text));
            let [norms, scales] = [Norm::ALL.map(Norm::name).join(", "), Scale::ALL.map(Scale::name).join(", ")];
            let remedy = format!("Write CRITERION:SCALE, as in euclidean:peak, of {norms}, and of {scales}.");
            return Err(Error::usage(message, remedy));
        };
        Ok(Self { norm, scale, ..Self::default() })
    }
}

/// The noise of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Noise {
    /// Estimated from each signal.
    #[default]
    Estimated,
    /// σ of current \[A\] and speed \[rad/s\]; `None` is estimated.
    Sigma([Option<f64>; 2]),
    /// `rms·10^(−dB/20)` of each signal.
    Decibels(f64),
}

impl Noise {
    /// σ of channel `channel` (0 current, 1 speed).
    #[must_use]
    pub fn sigma(&self, channel: usize, signal: &[f64]) -> f64 {
        match self {
            Self::Estimated => noise_sigma(signal),
            Self::Sigma(sigma) => sigma.get(channel).copied().flatten().unwrap_or_else(|| noise_sigma(signal)),
            Self::Decibels(decibels) => rms(signal) * 10f64.powf(-decibels / 20.0),
        }
    }
}

/// The largest cost that counts as one: beyond it, or without a number, a candidate has diverged and costs +∞.
pub const COST_MAX: f64 = 1e30;

impl Criterion {
    /// Returns whether |e| is added up rather than e².
    #[must_use]
    pub fn is_absolute(&self) -> bool {
        self.norm.row().0
    }

    /// Returns whether the sum approximates an integral over time.
    #[must_use]
    pub fn is_integral(&self) -> bool {
        matches!(self.norm.row().1, Total::Integral | Total::IntegralOverTime)
    }

    /// The weight of the sample at `time_s` (from the start of the recording) followed by a step of `step_s`.
    #[must_use]
    pub fn weight(&self, time_s: f64, step_s: f64) -> f64 {
        match self.norm.row().1 {
            Total::IntegralOverTime => (time_s - self.time_origin_s.unwrap_or(0.0)).max(0.0) * step_s,
            Total::Integral => step_s,
            _ => 1.0,
        }
    }

    /// Turns `s_c`, what a channel is divided by, into the factor of the channel's sum.
    #[must_use]
    pub fn factor(&self, divisor: f64) -> f64 {
        if self.is_absolute() { 1.0 / divisor } else { 1.0 / (divisor * divisor) }
    }

    /// The cost from the total of all scaled sums over `samples` samples; +∞ when it is no number or above 1e30.
    #[must_use]
    pub fn cost(&self, total: f64, samples: usize) -> f64 {
        let cost = match self.norm.row().1 {
            Total::Root => total.sqrt(),
            Total::Integral | Total::IntegralOverTime => total,
            Total::Mean => total / count(samples),
            Total::RootMean => (total / count(samples)).sqrt(),
        };
        if cost <= COST_MAX { cost } else { f64::INFINITY }
    }

    /// Returns the scale of a channel (0 current, 1 speed); not positive when the signal does not define it.
    #[must_use]
    pub fn divisor(&self, channel: usize, measured: &[f64]) -> f64 {
        match self.scale {
            Scale::None => 1.0,
            Scale::Peak => peak(measured),
            Scale::Std => standard_deviation(measured),
            Scale::Noise => self.noise.sigma(channel, measured),
        }
    }
}
