//! Recordings that are given twice: each would count as two, and standard errors would be too small.

use crate::record::Record;
use crate::setting::text;
use crate::warning::{Warning, name_of};
use crate::{Error, Result};

/// Checks that no recording is given twice, under whichever name.
///
/// # Errors
/// `Data` that names both.
pub(super) fn check_repeated(records: &[Record]) -> Result<()> {
    let pairs =
        records.iter().enumerate().flat_map(|(n, one)| records[..n].iter().enumerate().map(move |o| (o, (n, one))));
    let Some(((first, one), (second, other))) = pairs.into_iter().find(|((_, a), (_, b))| is_same(a, b)) else {
        return Ok(());
    };
    let [one, other] = [(first, one), (second, other)].map(|(n, record)| match &record.source().path {
        Some(_) => name_of(record),
        None => format!("recording {}", n + 1),
    });
    let what = if one == other {
        format!("{one} is given twice")
    } else {
        format!("{one} and {other} are the same recording")
    };
    let message = format!("{what}: it would count as two, and the standard errors would be too small by √2");
    Err(Error::data(message, text!("Give it once; to test a fit, hold a part of a recording out with " [Split] ".")))
}

/// Returns the warning for recordings that are fitted and held out.
pub(super) fn validation_repeats(records: &[Record], held_out: &[Record]) -> Option<Warning> {
    let repeated: Vec<String> =
        held_out.iter().filter(|held| records.iter().any(|record| is_same(record, held))).map(name_of).collect();
    let message = format!(
        "{} is fitted and held out: the fit of what was fitted shows nothing about other recordings",
        repeated.join(", ")
    );
    (!repeated.is_empty()).then(|| Warning::new("validation_repeats", message))
}

/// Returns whether two recordings have the same input, and an output with the same noise.
fn is_same(one: &Record, other: &Record) -> bool {
    if one.len() != other.len() {
        return false;
    }
    let mut common = one.measured().into_iter().zip(other.measured()).filter_map(|(a, b)| Some((a?, b?))).peekable();
    // A signal that stands still is the same in all recordings at rest.
    let moves = |signal: &[f64]| signal.windows(2).any(|w| w[0].to_bits() != w[1].to_bits());
    let is_moving = common.peek().is_some_and(|(a, _)| moves(a));
    is_moving && common.all(|(a, b)| a == b) && one.input() == other.input()
}
