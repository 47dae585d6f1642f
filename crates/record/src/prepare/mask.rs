//! Masks: segments of time, and samples with findings, that are excluded from the criterion or cut out.

use super::spikes::spikes;
use crate::diagnose::{findings, undersampled_segments};
use crate::heading::Quantity;
use crate::record::{Excluded, Record};
use motorfit_core::setting::text;
use motorfit_core::text::{counted, excerpt};
use motorfit_core::{Error, Result};
use std::ops::Range;

/// Rule that excludes samples of a recording from the criterion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mask {
    /// The findings of the diagnostics. Outliers, a saturated current and segments with an undersampled voltage are
    /// excluded; outliers of the voltage are replaced. An input that is reset at the end is cut off, and segments with a
    /// disabled drive are cut out. Of the outputs of a user's model single wrong samples are excluded, from all outputs.
    Auto,
    /// A segment of time of some channels.
    Time {
        /// True for each excluded channel, in the order current, speed.
        channels: [bool; 2],
        /// First time \[s\].
        from: f64,
        /// Last time \[s\].
        to: f64,
    },
}

/// Parses masks, each `auto`, `0.5:0.6` or `current@0.5:0.6` (seconds); either time may be omitted.
///
/// # Errors
/// Returns `Usage` if an item has another form, or its first time is not before the second.
pub fn parse_masks(items: &[String]) -> Result<Vec<Mask>> {
    items.iter().map(|item| item.trim()).filter(|item| !item.is_empty()).map(one).collect()
}

/// Parses one mask.
fn one(item: &str) -> Result<Mask> {
    let bad = |what: String| {
        let hint =
            text!("Write " [Mask = "auto"] ", " [Mask = "0.5:0.6"] " or " [Mask = "current@0.5:0.6"] " (seconds).");
        Error::usage(text!([Mask] ": {what}"), hint)
    };
    if item == "auto" {
        return Ok(Mask::Auto);
    }
    let (channels, range) = match item.split_once('@') {
        None => ([true; 2], item),
        Some(("current", range)) => ([true, false], range),
        Some(("speed", range)) => ([false, true], range),
        Some((other, _)) => return Err(bad(format!("\"{}\" is neither current nor speed", excerpt(other)))),
    };
    let Some((from, to)) = range.split_once(':') else {
        return Err(bad(format!("\"{}\" is not FROM:TO", excerpt(range))));
    };
    let number = |text: &str, open: f64| {
        if text.trim().is_empty() { Ok(open) } else { crate::import::parse_number(text, false).map_err(&bad) }
    };
    let (from, to) = (number(from, f64::NEG_INFINITY)?, number(to, f64::INFINITY)?);
    if from >= to {
        return Err(bad(format!("\"{}\" ends before it begins", excerpt(range))));
    }
    Ok(Mask::Time { channels, from, to })
}

/// Fewest samples of a segment that is kept as a recording.
const SEGMENT_MIN: usize = 20;

/// Applies masks to a recording, which may be cut into several.
pub(super) fn apply(masks: &[Mask], record: Record) -> Result<Vec<Record>> {
    let mut notes = Vec::new();
    let mut record = record;
    if masks.contains(&Mask::Auto)
        && !record.is_of_model()
        && let Some((repaired, samples)) = record.with_repaired_input()
    {
        notes.push(format!("replaced by the surrounding voltage: {}", counted(samples, "single sample")));
        record = repaired;
    }
    let mut excluded = record.excluded().to_vec();
    let mut cuts = Vec::new();
    for mask in masks {
        match mask {
            Mask::Time { channels, from, to } => {
                let Range { start, end } = record.between(*from, *to);
                if start < end {
                    excluded.push(Excluded { start, end, channels: *channels });
                }
                notes.push(format!("masked: {} samples", end.saturating_sub(start)));
            }
            Mask::Auto if record.is_of_model() => {
                let found = spikes(&record);
                let samples: usize = found.iter().map(ExactSizeIterator::len).sum();
                excluded.extend(found.into_iter().map(whole));
                notes.push(format!("masked: outliers of the outputs, {}", counted(samples, "sample")));
            }
            Mask::Auto => automatic(&record, &mut excluded, &mut cuts, &mut notes),
        }
    }
    let mut record = Record { excluded, ..record };
    if !cuts.is_empty() {
        return cut(&record, &cuts, &notes);
    }
    let counting = record.counting();
    if !counting.is_empty() && !counting.iter().any(|c| c[0] || c[1]) {
        let message = text!([Mask] " excludes every sample");
        return Err(Error::usage(message, "Mask fewer samples; times are those of the recording."));
    }
    record.source.notes.append(&mut notes);
    Ok(vec![record])
}

/// Returns the segments between cuts that are long enough, as recordings.
fn cut(record: &Record, cuts: &[Range<usize>], notes: &[String]) -> Result<Vec<Record>> {
    let mut pieces = Vec::new();
    let mut start = 0;
    for cut in cuts {
        pieces.push(start..cut.start.max(start));
        start = cut.end.max(start);
    }
    pieces.push(start..record.len());
    pieces.retain(|piece| piece.len() >= SEGMENT_MIN);
    if pieces.is_empty() {
        let message = text!([Mask = "auto"] " leaves nothing of the recording");
        return Err(Error::data(message, text!("Leave " [Mask = "auto"] " out, or record again.")));
    }
    let count = pieces.len();
    let piece = |(n, range)| {
        let mut piece = record.cut_to(range, "cut")?;
        piece.source.notes.extend_from_slice(notes);
        Ok(Record { source: piece.source.with_segment(n, count), ..piece })
    };
    pieces.into_iter().enumerate().map(piece).collect()
}

/// Excludes a range of samples of both channels.
fn whole(place: Range<usize>) -> Excluded {
    Excluded { start: place.start, end: place.end, channels: [true; 2] }
}

impl Record {
    /// Returns a copy that excludes the segments in which the voltage changes faster than it is sampled; `None` if there is
    /// no such segment that is not excluded already.
    #[doc(hidden)]
    pub fn without_undersampled(&self) -> Option<Self> {
        let is_masked = |place: &Excluded| self.excluded.iter().any(|e| e.start <= place.start && place.end <= e.end);
        let places = undersampled_segments(self).into_iter().map(whole);
        let more: Vec<Excluded> = places.filter(|place| !is_masked(place)).collect();
        let excluded = self.excluded.iter().chain(&more).copied().collect();
        (!more.is_empty()).then(|| Self { excluded, ..self.clone() })
    }
}

/// Adds the ranges that findings exclude or cut out, with notes.
fn automatic(record: &Record, excluded: &mut Vec<Excluded>, cuts: &mut Vec<Range<usize>>, notes: &mut Vec<String>) {
    for finding in findings(record) {
        let samples: usize = finding.places.iter().map(ExactSizeIterator::len).sum();
        // A saturated sensor affects the current only, and its finding counts samples. Under a current limit of the drive
        // the recorded voltage is wrong, which a mask of the current does not cure.
        let sensor = finding.figures.iter().any(|(name, _)| *name == "samples");
        match finding.code {
            "current_clipped" if sensor => {
                let off = |p: &Range<usize>| Excluded { start: p.start, end: p.end, channels: [true, false] };
                excluded.extend(finding.places.iter().map(off));
                notes.push(format!("masked: saturated current, {samples} samples"));
            }
            "outliers" => {
                let channels = [Quantity::Current, Quantity::Speed].map(|quantity| quantity == finding.quantity);
                excluded.extend(finding.places.iter().map(|p| Excluded { start: p.start, end: p.end, channels }));
                notes.push(format!("masked: outliers of the {}, {}", finding.quantity, counted(samples, "sample")));
            }
            "undersampled_input" if samples > 0 => {
                excluded.extend(finding.places.into_iter().map(whole));
                notes.push(format!("masked: undersampled voltage, {samples} samples"));
            }
            "voltage_without_current" => {
                cuts.extend(finding.places);
                notes.push(format!("cut out: the drive was off for {samples} samples"));
            }
            "input_reset" => {
                cuts.extend(finding.places.iter().map(|place| place.start..record.len()));
                notes.push("cut off: the input is reset at the end".to_owned());
            }
            _ => {}
        }
    }
    cuts.sort_by_key(|cut| cut.start);
}
