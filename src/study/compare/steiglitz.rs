//! Steiglitz–McBride beside the searches. It has no seeds: its spread is over records with new noise.

use super::ranking::relative;
use super::{CompareSpec, Subject};
use crate::Result;
use crate::criterion::Noise;
use crate::estimate::steiglitz_mcbride;
use crate::experiment::{Excitation, noise_of, simulated, with_noise};
use crate::identify::Identification;
use crate::motor::{Parameter, Parameters};
use crate::numeric::{mean, sample_deviation};
use crate::record::Record;
use rayon::prelude::*;
use std::time::Instant;

/// What Steiglitz–McBride finds.
#[derive(Debug, Clone, PartialEq)]
pub struct Steiglitz {
    /// Its estimate from the first recording, or why there is none.
    pub estimate: std::result::Result<Parameters, String>,
    /// Its estimates from records with new noise; those that failed are left out.
    pub spread: Vec<Parameters>,
    /// How many records with new noise there were; 0 where none could be made.
    pub records: usize,
    /// σ of their noise: current \[A\] and speed \[rad/s\].
    pub sigma: [f64; 2],
    /// Seconds of one estimate: the median of five.
    pub seconds: f64,
}

impl Steiglitz {
    pub(super) fn of(subject: &Subject, spec: &CompareSpec, reference: Option<&Identification>) -> Result<Self> {
        let attempt = |record: &Record| -> Result<std::result::Result<Parameters, String>> {
            let found = steiglitz_mcbride(record, spec.model)?;
            Ok(found.map(|estimate| estimate.parameters).map_err(|failure| failure.message().to_owned()))
        };
        let first = &subject.records[0];
        let estimate = attempt(first)?;
        let mut seconds = Vec::new();
        for _ in 0..5 {
            let begun = Instant::now();
            attempt(first)?.ok();
            seconds.push(begun.elapsed().as_secs_f64());
        }
        seconds.sort_by(f64::total_cmp);
        if spec.noise_records == 0 {
            return Ok(Self { estimate, spread: Vec::new(), records: 0, sigma: [0.0; 2], seconds: seconds[2] });
        }
        let (clean, sigma) = match noiseless(subject, spec, reference)? {
            Some(pair) => pair,
            None => return Ok(Self { estimate, spread: Vec::new(), records: 0, sigma: [0.0; 2], seconds: seconds[2] }),
        };
        let again = |n: u64| -> Result<Option<Parameters>> {
            let seed = spec.seed.wrapping_mul(1_000_003).wrapping_add(n);
            Ok(attempt(&with_noise(&clean, sigma, seed)?)?.ok())
        };
        let spread: Vec<Option<Parameters>> =
            (0..spec.noise_records as u64).into_par_iter().map(again).collect::<Result<_>>()?;
        let spread = spread.into_iter().flatten().collect();
        Ok(Self { estimate, spread, records: spec.noise_records, sigma, seconds: seconds[2] })
    }
}

/// The record without noise and the noise to be added; `None` where the motor does not start at rest.
fn noiseless(
    subject: &Subject,
    spec: &CompareSpec,
    reference: Option<&Identification>,
) -> Result<Option<(Record, [f64; 2])>> {
    let first = &subject.records[0];
    if subject.truth.is_some() {
        return Ok(Some((first.clone(), noise_of(first, Noise::Decibels(spec.noise_db)))));
    }
    let Some(found) = reference else { return Ok(None) };
    let [Some(current), Some(speed)] = found.residual_sigma else { return Ok(None) };
    if found.initial.first().is_some_and(|state| state.iter().any(|v| *v != 0.0)) {
        return Ok(None);
    }
    let samples = first.samples().clone();
    let excitation = Excitation { time_s: samples.time_s, voltage: samples.voltage, torque: samples.torque };
    Ok(Some((simulated(&found.parameters, &excitation, spec.model.discretization)?, [current, speed])))
}

impl Steiglitz {
    /// Standard deviations of the parameters over the records with new noise.
    #[must_use]
    pub fn deviations(&self) -> [f64; 5] {
        Parameter::ALL.map(|p| sample_deviation(&self.values(p)))
    }

    /// Mean relative errors over them, in percent.
    #[must_use]
    pub fn errors(&self, expected: &Parameters) -> [f64; 5] {
        let error = |p: Parameter| -> Vec<f64> {
            self.values(p).into_iter().map(|value| relative(value, expected.get(p))).collect()
        };
        Parameter::ALL.map(|p| mean(&error(p)))
    }

    /// Relative errors of its estimate, and their means over the records with new noise, in percent; NaN without.
    #[must_use]
    pub fn all_errors(&self, expected: &Parameters) -> [[f64; 2]; 5] {
        let means = self.errors(expected);
        let own =
            |p: Parameter| self.estimate.as_ref().map_or(f64::NAN, |found| relative(found.get(p), expected.get(p)));
        Parameter::ALL.map(|p| [own(p), means[p as usize]])
    }

    fn values(&self, parameter: Parameter) -> Vec<f64> {
        self.spread.iter().map(|found| found.get(parameter)).collect()
    }
}
