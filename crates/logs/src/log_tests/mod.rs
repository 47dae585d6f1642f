//! Tests of the readers with files written by independent tools (`tests/golden/formats`) and with damaged files.
#![allow(clippy::unwrap_used, clippy::float_cmp, reason = "a test may stop; exact equality is meant")]

mod tdms;
mod tdms_built;
mod ulog;

use super::log::{Log, Medium, Series};
use motorfit_core::{Error, Result};
use std::io::Cursor;

const RECORDING: &str = include_str!("../../../../tests/golden/formats/recording.csv");
type Open = fn(Box<dyn Medium>) -> Result<Box<dyn Log>>;

/// Opens a TDMS file.
fn open_tdms(medium: Box<dyn Medium>) -> Result<Box<dyn Log>> {
    super::tdms::open(medium, |name| name == "time")
}

/// Returns the columns of the recording.
fn recording() -> [Vec<f64>; 4] {
    let column =
        |at: usize| RECORDING.lines().skip(1).map(|line| line.split(',').nth(at).unwrap().parse().unwrap()).collect();
    [0, 1, 2, 3].map(column)
}

fn medium(bytes: &[u8]) -> Box<dyn Medium> {
    Box::new(Cursor::new(bytes.to_vec()))
}

/// Returns the error for a file that is refused.
fn refused(open: Open, bytes: &[u8]) -> Error {
    open(medium(bytes)).err().unwrap()
}

/// Returns the names of the channels with their fields: `channel: field, field`.
fn names(log: &dyn Log) -> Vec<String> {
    let names = log.channels().iter().map(|channel| {
        let fields: Vec<&str> = channel.fields.iter().map(|field| field.path.as_str()).collect();
        format!("{}: {}", channel.name, fields.join(", "))
    });
    names.collect()
}

/// Reads all fields of a channel.
fn channel(log: &mut dyn Log, name: &str) -> Series {
    let at = log.channels().iter().position(|channel| channel.name == name).unwrap();
    let channel = log.channels()[at].clone();
    let series = log.read(&[(at, (0..channel.fields.len()).collect())]).unwrap().pop().unwrap();
    assert_eq!(series.columns.len(), channel.fields.len());
    assert!(series.columns.iter().all(|column| column.len() as u64 == channel.count));
    let span_s = series.time_s.first().zip(series.time_s.last()).map(|(first, last)| [*first, *last]);
    assert_eq!(span_s, channel.span_s);
    series
}

/// Reads a field.
fn field(log: &mut dyn Log, name: &str, path: &str) -> Vec<f64> {
    let at = log.channels().iter().position(|channel| channel.name == name).unwrap();
    let field = log.channels()[at].fields.iter().position(|field| field.path == path).unwrap();
    log.read(&[(at, vec![field])]).unwrap().pop().unwrap().columns.pop().unwrap()
}

/// Returns the units of a channel.
fn units<'a>(log: &'a dyn Log, name: &str) -> Vec<Option<&'a str>> {
    let channel = log.channels().iter().find(|channel| channel.name == name).unwrap();
    channel.fields.iter().map(|field| field.unit.as_deref()).collect()
}
