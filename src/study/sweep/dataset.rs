//! Datasets of runs: a motor's recordings, read, prepared, divided in fitted and held-out parts, and perhaps
//! with noise added to what is fitted.

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

/// A motor under one drawing of noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Dataset {
    pub motor: usize,
    /// Place of the noise in the study, and the seed that draws it.
    pub noise: usize,
    pub seed: u64,
}

/// The recordings of a motor.
#[derive(Debug, Clone)]
pub(super) struct Recordings {
    pub fitted: Arc<Vec<Record>>,
    pub held_out: Arc<Vec<Record>>,
    /// The warnings about what is fitted, looked for once for all runs.
    diagnosis: Arc<OnceLock<Vec<Warning>>>,
}

/// The recordings of a motor, or why there are none.
pub(super) type Read = Result<Recordings>;

/// The motor that was read last, with its recordings: one with many drawings of noise is read once.
pub(super) type Kept = Option<(usize, Read)>;

impl Recordings {
    fn new(fitted: Vec<Record>, held_out: Arc<Vec<Record>>) -> Self {
        Self { fitted: Arc::new(fitted), held_out, diagnosis: Arc::default() }
    }

    /// Returns what is fitted with the warnings about it.
    pub fn diagnosed(&self) -> Diagnosed<'_> {
        (&self.fitted, self.diagnosis.get_or_init(|| warnings_of_records(&self.fitted)))
    }

    /// A result with how well it explains what was held out.
    pub fn validated(&self, found: Identification, spec: &IdentifySpec) -> Result<Identification> {
        if self.held_out.is_empty() {
            return Ok(found);
        }
        let validation = validate(&self.held_out, spec, &found)?;
        Ok(Identification { validation: Some(validation), ..found })
    }
}

impl Sweep {
    /// Reads the recordings of a motor; they must be those that were planned.
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

    /// The recordings of a motor, which may be the one that was kept.
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
                return Err(Error::data(message, "Plan the study again in a new folder, or bring the file back.")
                    .in_file(&path));
            }
            records.extend(read);
        }
        Ok(records)
    }

    /// The same with noise added to what is fitted: the same for every method, drawn by the seed and the recording.
    pub(super) fn with_noise(&self, recordings: &Read, noise: usize, seed: u64) -> Read {
        let Some(noise) = self.study().noise[noise].noise else { return recordings.clone() };
        let recordings = recordings.clone()?;
        let noisy =
            |(n, record): (usize, &Record)| with_noise(record, noise_of(record, noise), key(record, n, noise, seed));
        let fitted = recordings.fitted.iter().enumerate().map(noisy).collect::<Result<Vec<Record>>>()?;
        Ok(Recordings::new(fitted, recordings.held_out))
    }
}

/// The seed of a recording's noise: of another recording, another.
fn key(record: &Record, place: usize, noise: Noise, seed: u64) -> u64 {
    let digest = record.source().sha256.as_deref().unwrap_or_default();
    let digest = Sha256::digest(format!("{seed} {digest} {place} {noise:?}"));
    digest.iter().take(8).fold(0, |key, byte| (key << 8) | u64::from(*byte))
}
