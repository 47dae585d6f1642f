//! Reading and preparation of files in one call, and the parsers of their options.

use super::heading::Quantity;
use super::import::{ReadOptions, parse_number, read, read_bytes, read_joined};
use super::prepare::{Offset, Preparation, check_rate};
use super::record::Record;
use motorfit_core::setting::{Setting, text};
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use std::path::{Path, PathBuf};

/// Options for reading and preparing files.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reading {
    /// Options of the import.
    pub options: ReadOptions,
    /// Preparation of each recording.
    pub preparation: Preparation,
}

impl Reading {
    /// Reads and prepares the recordings of a file, or the one recording joined from several files `A+B`.
    ///
    /// # Errors
    /// Returns `Usage` for a rate below 1e-6 Hz or not finite, or a decimation of 0. Propagates the errors of [`read`],
    /// [`read_joined`] and [`Preparation::apply`].
    pub fn records(&self, path: &Path) -> Result<Vec<Record>> {
        self.check()?;
        let read = match joined(path) {
            Some(parts) => read_joined(&parts, &self.options)?,
            None => read(path, &self.options)?,
        };
        self.prepared(read)
    }

    /// Reads and prepares the recordings in the bytes of a file; `path` is their origin and is named in errors.
    ///
    /// # Errors
    /// Returns `Usage` for a rate below 1e-6 Hz or not finite, or a decimation of 0. Propagates the errors of
    /// [`read_bytes`] and [`Preparation::apply`].
    pub fn records_from_bytes(&self, bytes: &[u8], path: Option<&Path>) -> Result<Vec<Record>> {
        self.check()?;
        self.prepared(read_bytes(bytes, path, &self.options)?)
    }

    /// Checks rates and decimation before anything is read.
    fn check(&self) -> Result<()> {
        for rate in [self.options.rate_hz, self.preparation.rate_hz].into_iter().flatten() {
            check_rate(rate)?;
        }
        if self.preparation.decimate == Some(0) {
            return Err(Error::usage(text!([Decimate] " is 0"), "Give a whole number of at least 1."));
        }
        Ok(())
    }

    fn prepared(&self, read: Vec<Record>) -> Result<Vec<Record>> {
        let mut records = Vec::with_capacity(read.len());
        for record in read {
            // Without a time column the rate has already defined the times.
            let timed = record.source().columns.iter().any(|column| column.quantity == Quantity::Time);
            let rate_hz = self.preparation.rate_hz.filter(|_| timed);
            let preparation = Preparation { rate_hz, ..self.preparation.clone() };
            if preparation.is_identity() {
                records.push(record);
            } else {
                records.extend(preparation.apply(&record)?);
            }
        }
        Ok(records)
    }

    /// Returns the files that a path names: one, or those joined by `A+B`.
    #[must_use]
    pub fn files(path: &Path) -> Vec<PathBuf> {
        joined(path).unwrap_or_else(|| vec![path.to_path_buf()])
    }
}

/// Returns the files of `A+B`; `None` if a file has that name or a name is empty.
fn joined(path: &Path) -> Option<Vec<PathBuf>> {
    let text = path.to_str().filter(|text| text.contains('+') && !path.exists())?;
    let parts: Vec<PathBuf> = text.split('+').map(PathBuf::from).collect();
    parts.iter().all(|part| !part.as_os_str().is_empty()).then_some(parts)
}

/// Parses `FROM:TO` \[s\]; either time may be omitted.
///
/// # Errors
/// Returns `Usage` if the text has another form, or the first time is not before the second.
pub fn parse_crop(text: &str) -> Result<[Option<f64>; 2]> {
    let Some((from, to)) = text.split_once(':') else {
        let message = text!([Crop](": \"{}\" is not FROM:TO", excerpt(text)));
        return Err(Error::usage(message, text!("Write " [Crop = "0.2:1.5"] " (seconds).")));
    };
    let number = |text: &str| if text.trim().is_empty() { Ok(None) } else { number(text, Setting::Crop).map(Some) };
    let range = [number(from)?, number(to)?];
    if let [Some(from), Some(to)] = range
        && from >= to
    {
        return Err(Error::usage(text!([Crop] ": {from} to {to} holds nothing"), "Give the earlier time first."));
    }
    Ok(range)
}

/// Parses a number, naming the setting in the error.
fn number(text: &str, of: Setting) -> Result<f64> {
    parse_number(text, false)
        .map_err(|found| Error::usage(text!({of} ": {found}"), "Use a decimal point and SI units."))
}

/// Parses `auto` or a list of offsets, as in `current=0.02,speed=-0.1`.
///
/// # Errors
/// Returns `Usage` if the text is neither, or names an unknown or repeated signal.
pub fn parse_offset(text: &str) -> Result<Offset> {
    if text.trim() == "auto" {
        return Ok(Offset::Auto);
    }
    let mut list: Vec<(Quantity, f64)> = Vec::new();
    for item in text.split(',').filter(|item| !item.trim().is_empty()) {
        let Some((key, value)) = item.split_once('=').map(|(key, value)| (key.trim(), value.trim())) else {
            let hint = text!("Write " [Offset = "auto"] ", or " [Offset = "current=0.02,speed=-0.1"] ".");
            return Err(Error::usage(text!([Offset](": \"{}\" is not KEY=VALUE", excerpt(item))), hint));
        };
        let known = [Quantity::Voltage, Quantity::Current, Quantity::Speed, Quantity::Torque];
        let Some(quantity) = known.into_iter().find(|q| q.key() == key) else {
            let message = text!([Offset](": \"{}\" is not a signal", excerpt(key)));
            return Err(Error::usage(message, "Give voltage, current, speed or load_torque."));
        };
        if list.iter().any(|(q, _)| *q == quantity) {
            return Err(Error::usage(text!([Offset] " gives {quantity} twice"), "Give each signal once."));
        }
        list.push((quantity, number(value, Setting::Offset)?));
    }
    Ok(Offset::Given(list))
}
