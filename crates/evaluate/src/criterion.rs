//! Criteria: scalar costs of the output error between a measurement and a simulation.
//!
//! With the scaled residuals `e_c = (measured − simulated)/s_c` of the measured channels, N samples, step h and time t:
//! euclidean `√ΣΣe²` (root of Eq. 13), ISE `hΣΣe²`, IAE `hΣΣ|e|`, ITSE `hΣΣt e²`, ITAE `hΣΣt|e|`,
//! MSE `ΣΣe²/N` (Eq. 14, with N samples), NRMSE `√MSE`. Evaluators return one weighted sum per channel; this module
//! defines the weights and turns the sums into a cost, so that all evaluators share one definition.

use motorfit_core::named::named;
use motorfit_core::numeric::{count, noise_sigma, peak, rms, standard_deviation};
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use std::str::FromStr;

named! {
    /// A norm of the residuals. The row holds `true` if |e| is summed instead of e², and the reduction of the sum to a cost.
    #[non_exhaustive]
    pub enum Norm: (bool, Reduction) {
        /// Square root of the sum of squared errors.
        Euclidean = "euclidean" => (false, Reduction::Root),
        /// Integral of the squared error.
        Ise = "ise" => (false, Reduction::Integral),
        /// Integral of the absolute error.
        Iae = "iae" => (true, Reduction::Integral),
        /// Integral of the squared error multiplied by time.
        Itse = "itse" => (false, Reduction::IntegralOverTime),
        /// Integral of the absolute error multiplied by time.
        Itae = "itae" => (true, Reduction::IntegralOverTime),
        /// Mean squared error.
        Mse = "mse" => (false, Reduction::Mean),
        /// Square root of the mean squared error.
        Nrmse = "nrmse" => (false, Reduction::RootMean),
    }
}

named! {
    /// The divisor of the residuals of each channel.
    #[non_exhaustive]
    pub enum Scale (default Std) {
        /// No scaling: the divisor is 1.
        None = "none",
        /// The largest magnitude of the measured signal.
        Peak = "peak",
        /// The population standard deviation of the measured signal.
        Std = "std",
        /// The standard deviation of the measurement noise, given or estimated.
        Noise = "noise",
    }
}

/// Reduction of a sum of losses over N samples to a cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reduction {
    /// Square root of the sum.
    Root,
    /// Integral over time: the sum, each loss weighted by the step that follows its sample.
    Integral,
    /// Integral over time with each loss also multiplied by time.
    IntegralOverTime,
    /// The sum divided by N.
    Mean,
    /// Square root of the sum divided by N.
    RootMean,
}

#[expect(clippy::derivable_impls, reason = "the enum is made by its table")]
impl Default for Norm {
    fn default() -> Self {
        Self::Nrmse
    }
}

impl Norm {
    /// Returns true if the losses are multiplied by time, as in ITSE and ITAE.
    #[must_use]
    pub fn is_time_weighted(self) -> bool {
        self.row().1 == Reduction::IntegralOverTime
    }
}

/// A criterion: a norm, the scale of the channels and their options.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Criterion {
    /// The norm of the errors.
    pub norm: Norm,
    /// The scale of each channel.
    pub scale: Scale,
    /// Origin of time in ITSE and ITAE \[s\]; `None` is the start of the recording. Earlier samples have weight 0.
    pub time_origin_s: Option<f64>,
    /// The measurement noise, used by [`Scale::Noise`] only.
    pub noise: Noise,
}

impl FromStr for Criterion {
    type Err = Error;

    /// Parses `CRITERION:SCALE`, or `CRITERION` with the default scale, regardless of case.
    ///
    /// # Errors
    /// Returns a `Usage` error if either name is unknown.
    fn from_str(text: &str) -> Result<Self> {
        let default = Scale::default().name();
        let (norm, scale) = text.split_once(':').unwrap_or((text, default));
        let is = |name: &str, given: &str| name.eq_ignore_ascii_case(given.trim());
        let norm = Norm::ALL.into_iter().find(|one| is(one.name(), norm));
        let scale = Scale::ALL.into_iter().find(|one| is(one.name(), scale));
        let (Some(norm), Some(scale)) = (norm, scale) else {
            let message = format!("\"{}\" is not a criterion", excerpt(text));
            let [norms, scales] = [Norm::ALL.map(Norm::name).join(", "), Scale::ALL.map(Scale::name).join(", ")];
            let remedy =
                format!("Write CRITERION:SCALE, as in euclidean:peak; criteria are {norms}; scales are {scales}.");
            return Err(Error::usage(message, remedy));
        };
        Ok(Self { norm, scale, ..Self::default() })
    }
}

/// The measurement noise of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Noise {
    /// The standard deviation is estimated from each signal.
    #[default]
    Estimated,
    /// Standard deviations σ of current \[A\] and speed \[rad/s\]; `None` is estimated from the signal.
    Sigma([Option<f64>; 2]),
    /// Signal-to-noise ratio \[dB\]: `σ = rms·10^(−dB/20)` of each signal.
    Decibels(f64),
}

impl Noise {
    /// Returns the standard deviation σ of the noise of `channel` (0 current, 1 speed), in the unit of `signal`.
    #[must_use]
    pub fn sigma(&self, channel: usize, signal: &[f64]) -> f64 {
        match self {
            Self::Estimated => noise_sigma(signal),
            Self::Sigma(sigma) => sigma.get(channel).copied().flatten().unwrap_or_else(|| noise_sigma(signal)),
            Self::Decibels(decibels) => rms(signal) * 10f64.powf(-decibels / 20.0),
        }
    }
}

/// Largest finite cost. A candidate whose cost is larger or NaN has diverged; its cost is +∞.
pub const COST_MAX: f64 = 1e30;

impl Criterion {
    /// Returns true if |e| is summed rather than e².
    #[must_use]
    pub fn is_absolute(&self) -> bool {
        self.norm.row().0
    }

    /// Returns true if the sum approximates an integral over time.
    #[must_use]
    pub fn is_integral(&self) -> bool {
        matches!(self.norm.row().1, Reduction::Integral | Reduction::IntegralOverTime)
    }

    /// Returns the weight of the loss of a sample at `time_s` after the start of the recording \[s\], which is followed by
    /// a step of `step_s` \[s\].
    #[must_use]
    pub fn weight(&self, time_s: f64, step_s: f64) -> f64 {
        match self.norm.row().1 {
            Reduction::IntegralOverTime => (time_s - self.time_origin_s.unwrap_or(0.0)).max(0.0) * step_s,
            Reduction::Integral => step_s,
            _ => 1.0,
        }
    }

    /// Returns the factor of a channel's sum of losses for the divisor `s_c`: `1/s_c` or `1/s_c²`.
    #[must_use]
    pub fn factor(&self, divisor: f64) -> f64 {
        if self.is_absolute() { 1.0 / divisor } else { 1.0 / (divisor * divisor) }
    }

    /// Returns the cost for the total of the scaled sums of all channels over `samples` samples; +∞ if it is NaN or
    /// greater than [`COST_MAX`].
    #[must_use]
    pub fn cost(&self, total: f64, samples: usize) -> f64 {
        let cost = match self.norm.row().1 {
            Reduction::Root => total.sqrt(),
            Reduction::Integral | Reduction::IntegralOverTime => total,
            Reduction::Mean => total / count(samples),
            Reduction::RootMean => (total / count(samples)).sqrt(),
        };
        if cost <= COST_MAX { cost } else { f64::INFINITY }
    }

    /// Returns a total of the scaled sums above which the cost over `samples` samples is above `cost`: the inverse of
    /// [`Self::cost`] and a margin for its rounding.
    pub(crate) fn total_above(&self, cost: f64, samples: usize) -> f64 {
        let total = match self.norm.row().1 {
            Reduction::Root => cost * cost,
            Reduction::Integral | Reduction::IntegralOverTime => cost,
            Reduction::Mean => cost * count(samples),
            Reduction::RootMean => cost * cost * count(samples),
        };
        total * (1.0 + 1e-12) + f64::MIN_POSITIVE
    }

    /// Returns the divisor `s_c` of a channel (0 current, 1 speed), in the unit of the signal; not positive if the signal
    /// does not define it, as a constant signal under [`Scale::Std`].
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
