//! Files as prepared recordings: how they are read and what is done to them, in one thing.

use super::prepare::check_rate;
use super::{Offset, Preparation, Quantity, ReadOptions, Record, parse_number, read, read_bytes, read_joined};
use crate::setting::{Setting, text};
use crate::text::excerpt;
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// Options of reading and preparing files.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reading {
    /// Options of reading.
    pub options: ReadOptions,
    /// The preparation of each recording.
    pub preparation: Preparation,
}

impl Reading {
    /// The recordings of a file, or of `A+B`, which makes one recording of several.
    ///
    /// # Errors
    /// As [`read`], [`read_joined`] and [`Preparation::apply`].
    pub fn records(&self, path: &Path) -> Result<Vec<Record>> {
        self.check()?;
        let read = match joined(path) {
            Some(parts) => read_joined(&parts, &self.options)?,
            None => read(path, &self.options)?,
        };
        self.prepared(read)
    }

    /// The recordings of a file's bytes.
    ///
    /// # Errors
    /// As [`read_bytes`] and [`Preparation::apply`].
    pub fn records_of(&self, bytes: &[u8]) -> Result<Vec<Record>> {
        self.check()?;
        self.prepared(read_bytes(bytes, None, &self.options)?)
    }

    /// Numbers that are none, before anything is read.
    fn check(&self) -> Result<()> {
        for rate in [self.options.rate_hz, self.preparation.rate_hz].into_iter().flatten() {
            check_rate(rate)?;
        }
        if self.preparation.decimate == Some(0) {
            return Err(Error::usage(text!([Decimate] " is 0"), "Give a whole number from 1 on."));
        }
        Ok(())
    }

    fn prepared(&self, read: Vec<Record>) -> Result<Vec<Record>> {
        let mut records = Vec::with_capacity(read.len());
        for record in read {
            // Without a time column the rate has been used up.
            let timed = record.source().columns.iter().any(|column| column.quantity == Quantity::Time);
            let rate_hz = self.preparation.rate_hz.filter(|_| timed);
            let preparation = Preparation { rate_hz, ..self.preparation.clone() };
            if preparation.is_nothing() {
                records.push(record);
            } else {
                records.extend(preparation.apply(&record)?);
            }
        }
        Ok(records)
    }

    /// The files that a path names: one, or the parts of `A+B`.
    #[must_use]
    pub fn files(path: &Path) -> Vec<PathBuf> {
        joined(path).unwrap_or_else(|| vec![path.to_path_buf()])
    }
}

/// The files of `A+B`, unless a file has that name.
fn joined(path: &Path) -> Option<Vec<PathBuf>> {
    let text = path.to_str().filter(|text| text.contains('+') && !path.exists())?;
    let parts: Vec<PathBuf> = text.split('+').map(PathBuf::from).collect();
    parts.iter().all(|part| !part.as_os_str().is_empty()).then_some(parts)
}

/// Reads `FROM:TO` \[s\], either of which may be open.
///
/// # Errors
/// `Usage` when it is not.
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

fn number(text: &str, of: Setting) -> Result<f64> {
    parse_number(text, false)
        .map_err(|found| Error::usage(text!({of} ": {found}"), "Use a decimal point and SI units."))
}

/// Reads `auto`, or `current=0.02,speed=…`.
///
/// # Errors
/// `Usage` when it is neither.
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
            let message = text!([Offset](": \"{}\" is no signal", excerpt(key)));
            return Err(Error::usage(message, "Give voltage, current, speed or load_torque."));
        };
        if list.iter().any(|(q, _)| *q == quantity) {
            return Err(Error::usage(text!([Offset] " gives {quantity} twice"), "Give each once."));
        }
        list.push((quantity, number(value, Setting::Offset)?));
    }
    Ok(Offset::Given(list))
}
