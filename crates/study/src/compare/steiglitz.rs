//! Steiglitz–McBride in a comparison. It has no seeds, so its spread is computed over records with new noise.

use super::engine::cost_of;
use super::spec::{CompareSpec, ComparisonSetting};
use super::subject::ComparisonSubject;
use motorfit_core::Result;
use motorfit_core::clock::Instant;
use motorfit_estimate::steiglitz_mcbride;
use motorfit_evaluate::criterion::Noise;
use motorfit_evaluate::experiment::{Excitation, noise_of, simulated, with_noise};
use motorfit_identify::Identification;
use motorfit_motor::Parameters;
use motorfit_record::Record;
use rayon::prelude::*;

/// Results of Steiglitz–McBride.
#[derive(Debug, Clone, PartialEq)]
pub struct Steiglitz {
    /// Estimate from the first recording, or the reason why there is none.
    pub estimate: std::result::Result<Parameters, String>,
    /// Estimates from the records with new noise on which the method did not fail.
    pub spread: Vec<Parameters>,
    /// Number of records with new noise; 0 if none could be made.
    pub records: usize,
    /// Standard deviations of the added noise: current \[A\] and speed \[rad/s\].
    pub sigma: [f64; 2],
    /// Time of one estimate, the median of five \[s\].
    pub seconds: f64,
}

impl Steiglitz {
    pub(super) fn of(
        subject: &ComparisonSubject,
        spec: &CompareSpec,
        reference: Option<&Identification>,
    ) -> Result<Self> {
        let attempt = |record: &Record| -> Result<std::result::Result<Parameters, String>> {
            let found = steiglitz_mcbride(record, spec.model)?;
            Ok(found.map(|estimate| estimate.parameters).map_err(|failure| failure.message().to_owned()))
        };
        let first = &subject.records[0];
        let estimate = attempt(first)?;
        let mut seconds = [0.0; 5];
        for seconds in &mut seconds {
            let begun = Instant::now();
            attempt(first)?.ok();
            *seconds = begun.elapsed().as_secs_f64();
        }
        seconds.sort_by(f64::total_cmp);
        let alone = Self { estimate, spread: Vec::new(), records: 0, sigma: [0.0; 2], seconds: seconds[2] };
        let noiseless = if spec.noise_records == 0 { None } else { noiseless(subject, spec, reference)? };
        let Some((clean, sigma)) = noiseless else { return Ok(alone) };
        let again = |n: u64| -> Result<Option<Parameters>> {
            let seed = spec.seed.wrapping_mul(1_000_003).wrapping_add(n);
            Ok(attempt(&with_noise(&clean, sigma, seed)?)?.ok())
        };
        let spread: Vec<Option<Parameters>> =
            (0..spec.noise_records as u64).into_par_iter().map(again).collect::<Result<_>>()?;
        Ok(Self { spread: spread.into_iter().flatten().collect(), records: spec.noise_records, sigma, ..alone })
    }

    /// Returns the cost of the estimate in the criterion of a setting; `None` without one.
    pub(super) fn cost(
        &self,
        subject: &ComparisonSubject,
        spec: &CompareSpec,
        setting: &ComparisonSetting,
    ) -> Option<f64> {
        cost_of(&subject.records, spec, setting, self.estimate.as_ref().ok()?)
    }
}

/// Returns the record without noise and the standard deviations of the noise to add; `None` if the motor does not start
/// at rest or has no refined estimate.
fn noiseless(
    subject: &ComparisonSubject,
    spec: &CompareSpec,
    reference: Option<&Identification>,
) -> Result<Option<(Record, [f64; 2])>> {
    let first = &subject.records[0];
    if subject.truth().is_some() {
        return Ok(Some((first.clone(), noise_of(first, Noise::Decibels(spec.noise_db)))));
    }
    let Some(found) = reference else { return Ok(None) };
    let [Some(current), Some(speed)] = found.residual_sigma[..] else { return Ok(None) };
    if found.initial.first().is_some_and(|state| state.iter().any(|v| *v != 0.0)) {
        return Ok(None);
    }
    let samples = first.samples().clone();
    let excitation = Excitation { time_s: samples.time_s, voltage: samples.voltage, torque: samples.torque };
    Ok(Some((simulated(&found.parameters, &excitation, spec.model.discretization)?, [current, speed])))
}
