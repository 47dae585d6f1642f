//! Datasets of runs: the recordings of a motor, read, prepared, split into fitted and held-out parts, with noise added
//! to the fitted ones if the study requests it.

use super::machine::{ModelLevel, OF_MOTOR};
use super::manifest::{File, Motor};
use super::planned::Sweep;
use motorfit_core::{Error, Result};
use motorfit_evaluate::criterion::Noise;
use motorfit_evaluate::experiment::{noise_of, white_noise, with_noise};
use motorfit_evaluate::model::ModelRecording;
use motorfit_identify::analysis::{split, warnings_of_records};
use motorfit_identify::{Diagnosed, Identification, IdentifySpec, add_validation, needs_voltage};
use motorfit_record::warning::Warning;
use motorfit_record::{Reading, Record};
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// A motor with one realization of the added noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Dataset {
    pub motor: usize,
    /// Index of the noise level in the study.
    pub noise: usize,
    /// Seed of the noise.
    pub seed: u64,
}

/// Recordings of a motor.
#[derive(Debug, Clone)]
pub(super) struct Recordings {
    pub fitted: Arc<Vec<Record>>,
    pub held_out: Arc<Vec<Record>>,
    /// Warnings about the fitted recordings, computed once for all runs.
    diagnosis: Arc<OnceLock<Vec<Warning>>>,
}

/// Recordings of a motor, or the error of reading them.
pub(super) type Read = Result<Recordings>;

/// Recordings of a motor as machines of the study read them, by the number of the machine.
pub(super) type Sets = Arc<BTreeMap<usize, Read>>;

/// Index and recordings of the motor read last, so that a motor with many noise realizations is read once.
pub(super) type Kept = Option<(usize, Sets)>;

impl Recordings {
    fn new(fitted: Vec<Record>, held_out: Arc<Vec<Record>>) -> Self {
        Self { fitted: Arc::new(fitted), held_out, diagnosis: Arc::default() }
    }

    /// Returns the fitted recordings with the warnings about them.
    pub fn diagnosed(&self) -> Diagnosed<'_> {
        (&self.fitted, self.diagnosis.get_or_init(|| warnings_of_records(&self.fitted)))
    }

    /// Adds the validation on the held-out recordings to a result.
    pub fn validated(&self, mut found: Identification, spec: &IdentifySpec) -> Result<Identification> {
        if !self.held_out.is_empty() {
            add_validation(&mut found, &self.held_out, spec)?;
        }
        Ok(found)
    }
}

impl Sweep {
    /// Reads the recordings of a motor for the machine with a number.
    fn read_for(&self, motor: usize, number: usize) -> Read {
        let model = self.study().model_levels().find(|level| level.number == number);
        model.map_or_else(|| self.read_motor(motor), |level| self.read(motor, &level.reading))
    }

    /// Returns the recordings of a motor for the machine with a number.
    pub(super) fn recordings_of(&self, sets: &Sets, motor: usize, number: usize) -> Read {
        sets.get(&number).cloned().unwrap_or_else(|| self.read_for(motor, number))
    }

    /// Reads the recordings of a motor for the DC motor.
    pub(super) fn read_motor(&self, motor: usize) -> Read {
        let recordings = self.read(motor, &self.study().reading)?;
        needs_voltage(&recordings.fitted)?;
        Ok(recordings)
    }

    /// Reads the recordings of a motor and checks their digests against the manifest.
    fn read(&self, motor: usize, reading: &Reading) -> Read {
        let Motor { files, validate, .. } = &self.manifest.motors[motor];
        let (fitted, mut held_out) = (self.read_all(files, reading)?, self.read_all(validate, reading)?);
        let fitted = match self.study().split {
            Some(fraction) => split(fitted, fraction, &mut held_out)?,
            None => fitted,
        };
        Ok(Recordings::new(fitted, Arc::new(held_out)))
    }

    /// Returns the recordings of a motor for the machines with the given numbers, from `kept` if it has them.
    pub(super) fn read_or_kept(
        &self,
        motor: usize,
        numbers: impl IntoIterator<Item = usize>,
        kept: Option<&(usize, Sets)>,
    ) -> Sets {
        let known = kept.filter(|(of, _)| *of == motor);
        let mut sets = known.map_or_else(BTreeMap::new, |(_, sets)| BTreeMap::clone(sets));
        for number in numbers {
            sets.entry(number).or_insert_with(|| self.read_for(motor, number));
        }
        Arc::new(sets)
    }

    fn read_all(&self, files: &[File], reading: &Reading) -> Result<Vec<Record>> {
        let mut records = Vec::new();
        for file in files {
            let path = self.manifest.file(file);
            let read = reading.records(&path)?;
            let digest = read.first().and_then(|record| record.source().sha256.clone());
            if file.sha256.is_none() || digest != file.sha256 {
                let message = match file.sha256 {
                    None => "could not be read when the sweep was planned",
                    Some(_) => "has changed since the sweep was planned",
                };
                return Err(
                    Error::data(message, "Plan the study again in a new folder, or restore the file.").in_file(&path)
                );
            }
            records.extend(read);
        }
        Ok(records)
    }

    /// Returns the recordings of the DC motor with noise added to the fitted ones. The noise depends on the seed and the recording,
    /// not on the method.
    pub(super) fn with_noise(&self, sets: &Sets, of: Dataset) -> Read {
        let Dataset { motor, noise, seed } = of;
        let recordings = self.recordings_of(sets, motor, OF_MOTOR)?;
        let Some(noise) = self.study().noise[noise].noise else { return Ok(recordings) };
        let noisy =
            |(n, record): (usize, &Record)| with_noise(record, noise_of(record, noise), key(record, n, noise, seed));
        let fitted = recordings.fitted.iter().enumerate().map(noisy).collect::<Result<Vec<Record>>>()?;
        Ok(Recordings::new(fitted, recordings.held_out))
    }
}

/// Returns the fitted and the held-out recordings of a model, with noise added to the outputs of the fitted ones.
pub(super) fn of_model(
    recordings: &Recordings,
    level: &ModelLevel,
    (noise, seed): (Option<Noise>, u64),
) -> Result<[Vec<ModelRecording>; 2]> {
    let all =
        |records: &[Record]| records.iter().map(|r| ModelRecording::new(&level.model, r)).collect::<Result<Vec<_>>>();
    let (mut fitted, held_out) = (all(&recordings.fitted)?, all(&recordings.held_out)?);
    if let Some(noise) = noise {
        for (n, (record, recording)) in recordings.fitted.iter().zip(&mut fitted).enumerate() {
            add_noise(recording, noise, key(record, n, noise, seed));
        }
    }
    Ok([fitted, held_out])
}

/// Adds white Gaussian noise to the measured outputs of a model, with the standard deviation of the ratio to each output, or of its own
/// estimated noise; standard deviations of current and speed add none.
fn add_noise(recording: &mut ModelRecording, noise: Noise, seed: u64) {
    for (stream, signal) in (0..).zip(&mut recording.measured) {
        let Some(signal) = signal else { continue };
        let sigma = if let Noise::Sigma(_) = noise { 0.0 } else { noise.sigma(0, signal) };
        let added = white_noise(signal.len(), sigma, seed, stream);
        signal.iter_mut().zip(added).for_each(|(value, noise)| *value += noise);
    }
}

/// Returns the seed of the noise of a recording, different for each recording.
fn key(record: &Record, place: usize, noise: Noise, seed: u64) -> u64 {
    let digest = record.source().sha256.as_deref().unwrap_or_default();
    let digest = Sha256::digest(format!("{seed} {digest} {place} {noise:?}"));
    digest.iter().take(8).fold(0, |key, byte| (key << 8) | u64::from(*byte))
}
