//! Facts about the signals of recordings.

use motorfit_core::numeric::{mean, noise_sigma, rms, standard_deviation};
use motorfit_motor::response;
use motorfit_record::{Quantity, Record};
use serde::Serialize;

/// Statistics of a signal, in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SignalStatistics {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// Population standard deviation.
    pub std: f64,
    /// Estimated standard deviation of the white noise.
    pub noise_sigma: f64,
}

impl SignalStatistics {
    /// Computes the statistics of a signal.
    #[must_use]
    pub fn of(signal: &[f64]) -> Self {
        Self {
            min: signal.iter().copied().fold(f64::INFINITY, f64::min),
            max: signal.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            mean: mean(signal),
            rms: rms(signal),
            std: standard_deviation(signal),
            noise_sigma: noise_sigma(signal),
        }
    }
}

/// Facts about one signal of a recording, in the SI unit of its quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalFacts {
    /// Quantity of the signal.
    pub quantity: Quantity,
    /// Statistics of the signal.
    pub statistics: SignalStatistics,
    /// Peak, settling and steady state of an output; `None` for inputs.
    pub response: Option<motorfit_motor::StepResponse>,
    /// True if three standard deviations of the noise exceed the settling band, so that there is no settling time.
    pub settling_hidden: bool,
}

impl SignalFacts {
    /// Computes the facts of all signals; `band` is the settling band as a fraction of the steady state.
    #[must_use]
    pub fn of(record: &Record, band: f64) -> Vec<Self> {
        let facts = |(quantity, signal): (Quantity, &[f64])| {
            let output = matches!(quantity, Quantity::Current | Quantity::Speed) && quantity != record.driver();
            let mut response = if output { response(&record.samples().time_s, signal, band) } else { None };
            let statistics = SignalStatistics::of(signal);
            let settling_hidden = response.is_some_and(|r| 3.0 * statistics.noise_sigma > band * r.steady_state.abs());
            if let (Some(response), true) = (&mut response, settling_hidden) {
                response.settling_time_s = None;
            }
            Self { quantity, statistics, response, settling_hidden }
        };
        signals(record).map(facts).collect()
    }
}

/// Returns the signals of a recording.
pub(super) fn signals(record: &Record) -> impl Iterator<Item = (Quantity, &[f64])> {
    let samples = record.samples();
    let all = [
        (Quantity::Voltage, Some(&samples.voltage).filter(|voltage| !voltage.is_empty())),
        (Quantity::Torque, samples.torque.as_ref()),
        (Quantity::Current, samples.current.as_ref()),
        (Quantity::Speed, samples.speed.as_ref()),
    ];
    all.into_iter().filter_map(|(quantity, signal)| Some((quantity, signal?.as_slice())))
}
