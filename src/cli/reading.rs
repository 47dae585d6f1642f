//! Recordings as every command reads them: files, what columns hold, preparation.

use super::args::{GapsName, Reading};
use super::values;
use motorfit::motor::Discretization;
use motorfit::record::{
    Gaps, Offset, Preparation, Quantity, ReadOptions, Record, Source, parse_columns, parse_masks, read, read_joined,
};
use motorfit::text::{engineering, excerpt, printable};
use motorfit::{Error, Result};
use std::path::{Path, PathBuf};

/// Reads and prepares all recordings; a voltage between samples goes on as `discretization` has it.
pub(super) fn records(paths: &[PathBuf], args: &Reading, discretization: Discretization) -> Result<Vec<Record>> {
    let options = options(args)?;
    let preparation = preparation(args, discretization)?;
    let mut records = Vec::new();
    for path in paths {
        let read = match joined(path) {
            Some(parts) => read_joined(&parts, &options)?,
            None => read(path, &options)?,
        };
        for record in read {
            // Without a time column the rate has been used up.
            let timed = record.source().columns.iter().any(|column| column.quantity == Quantity::Time);
            let rate_hz = preparation.rate_hz.filter(|_| timed);
            let preparation = Preparation { rate_hz, ..preparation.clone() };
            if preparation.is_nothing() {
                records.push(record);
            } else {
                records.extend(preparation.apply(&record)?);
            }
        }
    }
    Ok(records)
}

/// The files of `A+B`, unless a file has that name.
fn joined(path: &Path) -> Option<Vec<PathBuf>> {
    let text = path.to_str().filter(|text| text.contains('+') && !path.exists())?;
    let parts: Vec<PathBuf> = text.split('+').map(PathBuf::from).collect();
    parts.iter().all(|part| !part.as_os_str().is_empty()).then_some(parts)
}

fn options(args: &Reading) -> Result<ReadOptions> {
    if let Some(rate) = args.rate
        && !(rate.is_finite() && rate > 0.0)
    {
        return Err(Error::usage(format!("--rate is {rate}"), "Give samples per second, more than 0."));
    }
    Ok(ReadOptions {
        columns: parse_columns(args.columns.columns.as_deref().unwrap_or_default())?,
        rate_hz: args.rate,
        sheet: args.sheet.clone(),
        gaps: match args.gaps {
            GapsName::Error => Gaps::Error,
            GapsName::Keep => Gaps::Keep,
            GapsName::Split => Gaps::Split,
        },
        drop_repeats: args.drop_repeats,
    })
}

fn preparation(args: &Reading, discretization: Discretization) -> Result<Preparation> {
    if let Some(decimate @ 0) = args.decimate {
        return Err(Error::usage(format!("--decimate is {decimate}"), "Give a whole number from 1 on."));
    }
    Ok(Preparation {
        crop: args.crop.as_deref().map(crop).transpose()?.unwrap_or_default(),
        offset: args.offset.as_deref().map_or(Ok(Offset::None), offset)?,
        mask: parse_masks(&args.mask)?,
        rate_hz: args.rate,
        decimate: args.decimate,
        filter: args.filter.as_deref().map(str::parse).transpose()?,
        sampled_input: discretization.uses_next_input(),
    })
}

/// `FROM:TO`, either of which may be open.
fn crop(text: &str) -> Result<[Option<f64>; 2]> {
    let Some((from, to)) = text.split_once(':') else {
        return Err(Error::usage(
            format!("--crop: \"{}\" is not FROM:TO", excerpt(text)),
            "Write --crop 0.2:1.5 (seconds).",
        ));
    };
    let number = |text: &str| if text.trim().is_empty() { Ok(None) } else { values::number(text, "--crop").map(Some) };
    let range = [number(from)?, number(to)?];
    if let [Some(from), Some(to)] = range
        && from >= to
    {
        return Err(Error::usage(format!("--crop: {from} to {to} holds nothing"), "Give the earlier time first."));
    }
    Ok(range)
}

/// `auto`, or `current=0.02,speed=…`.
fn offset(text: &str) -> Result<Offset> {
    if text.trim() == "auto" {
        return Ok(Offset::Auto);
    }
    let mut list: Vec<(Quantity, f64)> = Vec::new();
    for item in text.split(',').filter(|item| !item.trim().is_empty()) {
        let (key, value) = values::pair(item, "--offset", "auto, or --offset current=0.02,speed=-0.1")?;
        let known = [Quantity::Voltage, Quantity::Current, Quantity::Speed, Quantity::Torque];
        let Some(quantity) = known.into_iter().find(|q| q.to_string().replace(' ', "_") == key) else {
            let message = format!("--offset: \"{}\" is no signal", excerpt(key));
            return Err(Error::usage(message, "Give voltage, current, speed or load_torque."));
        };
        if list.iter().any(|(q, _)| *q == quantity) {
            return Err(Error::usage(format!("--offset gives {quantity} twice"), "Give each once."));
        }
        list.push((quantity, values::number(value, "--offset")?));
    }
    Ok(Offset::Given(list))
}

/// The file of a recording, and which part of it.
pub(super) fn name(source: &Source) -> String {
    let path = source.path.as_ref().map_or_else(String::new, |path| path.display().to_string());
    source.part.as_ref().map_or(path.clone(), |part| format!("{path} ({part})"))
}

/// One line: file, samples, period, duration, columns with units; others for what was left out or prepared.
pub(super) fn understood(record: &Record) -> String {
    let source = record.source();
    let time = &record.samples().time_s;
    let columns: Vec<String> = source
        .columns
        .iter()
        .map(|c| {
            let conversion = if c.conversion.is_empty() { String::new() } else { format!(" {}", c.conversion) };
            format!("{}{conversion} [{}{}]", c.heading, c.unit, if c.unit_named { "" } else { " assumed" })
        })
        .collect();
    let mut text = printable(&format!(
        "{}: {} samples every {}, {}; {}",
        name(source),
        record.len(),
        engineering(record.period_s(), "s", 4),
        engineering(time[time.len() - 1] - time[0], "s", 4),
        columns.join(", ")
    ));
    for note in &source.notes {
        text.push_str(&format!("\n  {}", printable(note)));
    }
    text
}
