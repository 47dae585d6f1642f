//! Datasets of runs: the recordings of a motor, read, prepared, split into fitted and held-out parts, with noise added
//! to the fitted ones if the study requests it.

use super::Sweep;
use super::manifest::{File, Motor};
use crate::analysis::{split, warnings_of_records};
use crate::criterion::Noise;
use crate::experiment::{noise_of, with_noise};
use crate::identify::{Diagnosed, Identification, IdentifySpec, needs_voltage, validate};
use crate::record::Record;
use crate::warning::Warning;
use crate::{Error, Result};
use sha2::{Digest as _, Sha256};
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

/// Index and recordings of the motor read last, so that a motor with many noise realizations is read once.
pub(super) type Kept = Option<(usize, Read)>;

impl Recordings {
    fn new(fitted: Vec<Record>, held_out: Arc<Vec<Record>>) -> Self {
        Self { fitted: Arc::new(fitted), held_out, diagnosis: Arc::default() }
    }

    /// Returns the fitted recordings with the warnings about them.
    pub fn diagnosed(&self) -> Diagnosed<'_> {
        (&self.fitted, self.diagnosis.get_or_init(|| warnings_of_records(&self.fitted)))
    }

    /// Adds the validation on the held-out recordings to a result.
    pub fn validated(&self, found: Identification, spec: &IdentifySpec) -> Result<Identification> {
        if self.held_out.is_empty() {
            return Ok(found);
        }
        let validation = validate(&self.held_out, spec, &found)?;
        Ok(Identification { validation: Some(validation), ..found })
    }
}

impl Sweep {
    /// Reads the recordings of a motor and checks their digests against the manifest.
    pub(super) fn read(&self, motor: usize) -> Read {
        let Motor { files, validate, .. } = &self.manifest.motors[motor];
        let (fitted, mut held_out) = (self.read_all(files)?, self.read_all(validate)?);
        needs_voltage(&fitted)?;
        let fitted = match self.study().split {
            Some(fraction) => split(fitted, fraction, &mut held_out)?,
            None => fitted,
        };
        Ok(Recordings::new(fitted, Arc::new(held_out)))
    }

    /// Returns the recordings of a motor, from `kept` if it has them.
    pub(super) fn read_or_kept(&self, motor: usize, kept: Option<&(usize, Read)>) -> Read {
        kept.filter(|(of, _)| *of == motor).map_or_else(|| self.read(motor), |(_, recordings)| recordings.clone())
    }

    fn read_all(&self, files: &[File]) -> Result<Vec<Record>> {
        let mut records = Vec::new();
        for file in files {
            let path = self.manifest.file(file);
            let read = self.study().reading.records(&path)?;
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

    /// Returns recordings with noise added to the fitted ones. The noise depends on the seed and the recording, not on
    /// the method.
    pub(super) fn with_noise(&self, recordings: &Read, noise: usize, seed: u64) -> Read {
        let Some(noise) = self.study().noise[noise].noise else { return recordings.clone() };
        let recordings = recordings.clone()?;
        let noisy =
            |(n, record): (usize, &Record)| with_noise(record, noise_of(record, noise), key(record, n, noise, seed));
        let fitted = recordings.fitted.iter().enumerate().map(noisy).collect::<Result<Vec<Record>>>()?;
        Ok(Recordings::new(fitted, recordings.held_out))
    }
}

/// Returns the seed of the noise of a recording, different for each recording.
fn key(record: &Record, place: usize, noise: Noise, seed: u64) -> u64 {
    let digest = record.source().sha256.as_deref().unwrap_or_default();
    let digest = Sha256::digest(format!("{seed} {digest} {place} {noise:?}"));
    digest.iter().take(8).fold(0, |key, byte| (key << 8) | u64::from(*byte))
}
