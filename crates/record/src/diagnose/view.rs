//! Properties of a recording that several rules use, computed once.

use crate::heading::Quantity;
use crate::record::Record;
use crate::source::Column;
use motorfit_core::numeric::{count, differences, extremes, noise_sigma, order_statistic, peak, standard_deviation};
use std::ops::Range;

/// A signal with its statistics.
pub(super) struct Channel<'a> {
    /// Quantity of the signal.
    pub quantity: Quantity,
    /// Samples in SI units.
    pub values: &'a [f64],
    /// Largest absolute value.
    pub peak: f64,
    /// Largest less smallest value.
    pub range: f64,
    /// Standard deviation of the white noise.
    pub noise: f64,
    /// 5th percentile of the nonzero |differences|: the quantization step of a quantized signal; 0 for a constant one.
    pub quantum: f64,
}

impl<'a> Channel<'a> {
    fn new(quantity: Quantity, values: &'a [f64]) -> Self {
        let [low, high] = extremes(values);
        let mut steps: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).collect();
        let quantum = order_statistic(&mut steps, 0.05);
        Self { quantity, values, peak: peak(values), range: high - low, noise: noise_sigma(values), quantum }
    }

    /// Returns the level below which changes are indistinguishable from noise and quantization.
    pub(super) fn floor(&self) -> f64 {
        (5.0 * self.noise).max(2.5 * if self.is_fine() { 0.0 } else { self.quantum })
    }

    /// Returns true if quantization is negligible: the step is below a thousandth of the range.
    pub(super) fn is_fine(&self) -> bool {
        self.quantum < 1e-3 * self.range
    }
}

/// A segment of constant input.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ConstantInput {
    /// Samples of the segment.
    pub samples: Range<usize>,
    /// Mean of the input over the segment, in V or A.
    pub volts: f64,
}

/// A recording with the properties that several rules use.
pub(super) struct View<'a> {
    /// The recording.
    pub record: &'a Record,
    /// Time of each sample \[s\].
    pub time: &'a [f64],
    /// Voltage, or current if no voltage was recorded.
    pub input: Channel<'a>,
    /// Ratio of the standard deviation of the input's differences to that of the input: its rate of change; 0 if constant.
    pub roughness: f64,
    /// Ratio of the standard deviation of the input to its peak.
    pub volts_spread: f64,
    /// Segments of constant input, within six standard deviations of the noise and at most a tenth of the range.
    pub constant_inputs: Vec<ConstantInput>,
    /// Measured current.
    pub current: Option<Channel<'a>>,
    /// Measured speed.
    pub speed: Option<Channel<'a>>,
    /// True if a load torque was recorded that is not zero; it can cause motion and currents without voltage.
    pub loaded: bool,
}

/// Voltages up to this fraction of the peak count as 0: idle commands of drives and the noise of a measured 0 V.
const ZERO: f64 = 0.005;

impl<'a> View<'a> {
    pub(super) fn new(record: &'a Record) -> Self {
        let samples = record.samples();
        let voltage = record.input();
        let input = Channel::new(record.driver(), voltage);
        let own = standard_deviation(voltage);
        let tolerance = (6.0 * input.noise).min(0.1 * input.range).max(1e-9 * input.range);
        Self {
            record,
            time: &samples.time_s,
            volts_spread: if own > 0.0 { own / input.peak } else { 0.0 },
            roughness: if own > 0.0 { standard_deviation(&differences(voltage)) / own } else { 0.0 },
            constant_inputs: constant_inputs(voltage, tolerance),
            input,
            current: samples.current.as_deref().map(|values| Channel::new(Quantity::Current, values)),
            speed: samples.speed.as_deref().map(|values| Channel::new(Quantity::Speed, values)),
            loaded: samples.torque.as_ref().is_some_and(|torque| torque.iter().any(|t| *t != 0.0)),
        }
    }

    /// Returns the number of samples.
    pub(super) fn len(&self) -> usize {
        self.time.len()
    }

    /// Returns the sampling period \[s\].
    pub(super) fn period(&self) -> f64 {
        self.record.period_s()
    }

    /// Returns the measured current and speed, as far as recorded.
    pub(super) fn channels(&self) -> impl Iterator<Item = &Channel<'a>> {
        self.current.iter().chain(self.speed.iter())
    }

    /// Returns true if the voltage of sample `n` counts as 0.
    pub(super) fn is_zero(&self, n: usize) -> bool {
        self.input.values[n].abs() <= ZERO * self.input.peak
    }

    /// Returns the samples at the start of the recording at which the voltage is within 2 % of its peak from zero.
    pub(super) fn first_rest(&self) -> Range<usize> {
        // If the largest command is small, an idle command can be up to 2 % of it.
        let end = self.input.values.iter().position(|v| v.abs() > 4.0 * ZERO * self.input.peak);
        0..end.unwrap_or(self.len())
    }

    /// Returns the column of the file from which a quantity was read.
    pub(super) fn column(&self, quantity: Quantity) -> Option<&Column> {
        self.record.source().columns.iter().find(|column| column.quantity == quantity)
    }

    /// Returns the change of a position beside the speed over the integral of the speed.
    pub(super) fn position_ratio(&self) -> Option<f64> {
        self.record.source().position_ratio
    }

    /// Returns true if the input is the current.
    pub(super) fn by_current(&self) -> bool {
        self.record.driver() == Quantity::Current
    }

    /// Returns a change of the voltage as a fraction of its range.
    pub(super) fn part(&self, volts: f64) -> f64 {
        if self.input.range > 0.0 { volts.abs() / self.input.range } else { 0.0 }
    }
}

/// Divides an input into segments that stay within a tolerance of their first sample.
fn constant_inputs(voltage: &[f64], tolerance: f64) -> Vec<ConstantInput> {
    let mut found = Vec::new();
    let mut start = 0;
    let mut sum = 0.0;
    for (n, v) in voltage.iter().enumerate() {
        if (v - voltage[start]).abs() > tolerance {
            found.push(ConstantInput { samples: start..n, volts: sum / count(n - start) });
            (start, sum) = (n, 0.0);
        }
        sum += v;
    }
    found.push(ConstantInput { samples: start..voltage.len(), volts: sum / count(voltage.len() - start) });
    found
}
