//! Masks: stretches of time, and samples that findings name.

use crate::record::diagnose::{findings, undersampled_stretches};
use crate::record::{Excluded, Quantity, Record};
use crate::setting::text;
use crate::text::{counted, excerpt};
use crate::{Error, Result};
use std::ops::Range;

/// Samples of a recording that do not count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mask {
    /// Everything that diagnoses find: outliers and saturated current do not count, nor stretches in which the voltage changes
    /// faster than it is
    /// sampled; an input that is reset at the end is cut off, and where the drive is disabled the recording is cut.
    Auto,
    /// The channels (current, speed) from one time to another \[s\].
    Time {
        /// Which channels.
        channels: [bool; 2],
        /// From when \[s\].
        from: f64,
        /// To when \[s\].
        to: f64,
    },
}

/// Reads `auto`, `0.5:0.6`, `current@0.5:0.6`, separated by commas.
///
/// # Errors
/// `Usage` when an item is none of these.
pub fn parse_masks(items: &[String]) -> Result<Vec<Mask>> {
    items.iter().map(|item| item.trim()).filter(|item| !item.is_empty()).map(one).collect()
}

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
        if text.trim().is_empty() { Ok(open) } else { crate::record::parse_number(text, false).map_err(&bad) }
    };
    let (from, to) = (number(from, f64::NEG_INFINITY)?, number(to, f64::INFINITY)?);
    if from >= to {
        return Err(bad(format!("\"{}\" ends before it begins", excerpt(range))));
    }
    Ok(Mask::Time { channels, from, to })
}

/// Samples that a stretch must have to be a recording.
const STRETCH_MIN: usize = 20;

/// Masks a recording; pieces come of one that is cut.
pub(super) fn apply(masks: &[Mask], record: Record) -> Result<Vec<Record>> {
    let mut notes = Vec::new();
    let mut record = record;
    if masks.contains(&Mask::Auto)
        && let Some((repaired, samples)) = record.with_repaired_input()
    {
        notes.push(format!("replaced by the voltage around: {}", counted(samples, "single sample")));
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
            Mask::Auto => automatic(&record, &mut excluded, &mut cuts, &mut notes),
        }
    }
    let mut record = Record { excluded, ..record };
    if !cuts.is_empty() {
        return cut(&record, &cuts, &notes);
    }
    let counting = record.counting();
    if !counting.is_empty() && !counting.iter().any(|c| c[0] || c[1]) {
        let message = text!([Mask] " leaves no sample that counts");
        return Err(Error::usage(message, "Mask less; times are those of the recording."));
    }
    record.source.notes.append(&mut notes);
    Ok(vec![record])
}

/// The pieces between cuts.
fn cut(record: &Record, cuts: &[Range<usize>], notes: &[String]) -> Result<Vec<Record>> {
    let mut pieces = Vec::new();
    let mut start = 0;
    for cut in cuts {
        pieces.push(start..cut.start.max(start));
        start = cut.end.max(start);
    }
    pieces.push(start..record.len());
    pieces.retain(|piece| piece.len() >= STRETCH_MIN);
    if pieces.is_empty() {
        let message = text!([Mask = "auto"] " leaves nothing of the recording");
        return Err(Error::data(message, text!("Leave " [Mask = "auto"] " out, or record again.")));
    }
    let count = pieces.len();
    let piece = |(n, range)| {
        let mut piece = record.cut_to(range, "cut")?;
        piece.source.notes.extend_from_slice(notes);
        Ok(Record { source: piece.source.stretch(n, count), ..piece })
    };
    pieces.into_iter().enumerate().map(piece).collect()
}

/// Both channels of some samples.
fn whole(place: Range<usize>) -> Excluded {
    Excluded { start: place.start, end: place.end, channels: [true; 2] }
}

impl Record {
    /// Returns a copy in which stretches whose voltage changes faster than it is sampled do not count; `None` where there are
    /// none.
    pub(crate) fn without_undersampled(&self) -> Option<Self> {
        let is_masked = |place: &Excluded| self.excluded.iter().any(|e| e.start <= place.start && place.end <= e.end);
        let places = undersampled_stretches(self).into_iter().map(whole);
        let more: Vec<Excluded> = places.filter(|place| !is_masked(place)).collect();
        let excluded = self.excluded.iter().chain(&more).copied().collect();
        (!more.is_empty()).then(|| Self { excluded, ..self.clone() })
    }
}

/// Adds the samples that findings exclude.
fn automatic(record: &Record, excluded: &mut Vec<Excluded>, cuts: &mut Vec<Range<usize>>, notes: &mut Vec<String>) {
    for finding in findings(record) {
        let samples: usize = finding.places.iter().map(ExactSizeIterator::len).sum();
        // A sensor at its end hides the current alone; a drive at its limit gives another voltage than it says.
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
