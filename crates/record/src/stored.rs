//! Serialization of recordings between processes: a JSON header and little-endian f64 values, exact to the last bit.
//!
//! The format is bound to one version of the program and is not meant for files that are kept.

use super::measured_at::MeasuredAt;
use super::record::{Excluded, Record};
use super::samples::{NamedSignal, SAMPLES_MAX, Samples};
use super::source::Source;
use motorfit_core::{Error, Result};
use serde::{Deserialize, Serialize};

/// First bytes, with the version of the format.
const MAGIC: &[u8] = b"motorfit record 4\n";

/// Header before the values.
#[derive(Serialize, Deserialize)]
struct Head {
    source: Source,
    excluded: Vec<Excluded>,
    measured_at: Vec<MeasuredAt>,
    independent: f64,
    interpolated: bool,
    /// Lengths of time, voltage, load torque, current, speed and slope; `None` for a signal that was not recorded.
    lengths: [Option<usize>; 6],
    /// Number of each signal of a model, and true if it is an input; each has the length of the time.
    named: Vec<(usize, bool)>,
}

impl Record {
    /// Serializes the recording.
    ///
    /// # Errors
    /// Returns `Data` if the path is not valid Unicode.
    pub fn to_stored(&self) -> Result<Vec<u8>> {
        let Samples { time_s, voltage, torque, current, speed, named } = &self.samples;
        let signals =
            [Some(time_s), Some(voltage), torque.as_ref(), current.as_ref(), speed.as_ref(), Some(&self.slope)];
        let head = Head {
            source: self.source.clone(),
            excluded: self.excluded.clone(),
            measured_at: self.measured_at.clone(),
            independent: self.independent,
            interpolated: self.interpolated,
            lengths: signals.map(|signal| signal.map(Vec::len)),
            named: named.iter().map(|signal| (signal.number, signal.is_input)).collect(),
        };
        let head = serde_json::to_string(&head)
            .map_err(|error| Error::data(format!("the recording cannot be serialized: {error}"), "Rename its file."))?;
        let mut bytes = [MAGIC, head.as_bytes(), b"\n"].concat();
        let values = signals.iter().copied().flatten().chain(named.iter().map(|signal| &signal.values));
        values.flatten().for_each(|v| bytes.extend_from_slice(&v.to_le_bytes()));
        Ok(bytes)
    }

    /// Deserializes a recording and checks it as a new one.
    ///
    /// # Errors
    /// Returns `Data` if the bytes are not a valid recording of this version.
    pub fn from_stored(bytes: &[u8]) -> Result<Self> {
        let wrong = || Error::data("these are not the bytes of a recording of this version", "Read its file again.");
        let text = bytes.strip_prefix(MAGIC).ok_or_else(wrong)?;
        let end = text.iter().position(|b| *b == b'\n').ok_or_else(wrong)?;
        let head: Head = serde_json::from_slice(&text[..end]).map_err(|_| wrong())?;
        let mut numbers = text[end + 1..].as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes));
        let total: usize = head.lengths.iter().flatten().map(|length| (*length).min(SAMPLES_MAX + 1)).sum();
        let named = head.named.len().saturating_mul(head.lengths[0].unwrap_or(0).min(SAMPLES_MAX + 1));
        if numbers.len() != total.saturating_add(named) || !(text.len() - end - 1).is_multiple_of(8) {
            return Err(wrong());
        }
        let mut next = |of: usize| head.lengths[of].map(|length| numbers.by_ref().take(length).collect::<Vec<f64>>());
        let (time_s, voltage) = (next(0).ok_or_else(wrong)?, next(1).ok_or_else(wrong)?);
        let samples = Samples { time_s, voltage, torque: next(2), current: next(3), speed: next(4), named: Vec::new() };
        let (slope, count) = (next(5).unwrap_or_default(), samples.time_s.len());
        let named = head.named.iter().map(|&(number, is_input)| {
            let values = numbers.by_ref().take(count).collect();
            NamedSignal { number, is_input, values }
        });
        let samples = Samples { named: named.collect(), ..samples };
        let fits = slope.is_empty() || slope.len() == count && slope.iter().all(|v| v.is_finite());
        let inside = head.excluded.iter().all(|e| e.start < e.end && e.end <= count);
        let lines = head.source.lines.is_empty() || head.source.lines.len() == count;
        let share = head.independent > 0.0 && head.independent <= 1.0;
        let measured = head.measured_at.iter().all(|of| of.samples.len() == count);
        if !(fits && inside && lines && share && measured) {
            return Err(wrong());
        }
        let Head { source, excluded, measured_at, independent, interpolated, .. } = head;
        Ok(Self { excluded, measured_at, independent, slope, interpolated, ..Self::from_file(samples, source, true)? })
    }
}
