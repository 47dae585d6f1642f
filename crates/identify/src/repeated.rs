//! Detection of recordings that are given twice. They would count as independent, and the standard errors would be too small by
//! a factor of √2.

use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_record::Record;
use motorfit_record::warning::{Warning, name_of};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};

/// Checks that no recording is given twice, also under different names.
///
/// # Errors
/// Returns `Data` with the names of both recordings.
pub(super) fn check_repeated(records: &[Record]) -> Result<()> {
    let mut known = Known::default();
    let repeated = records.iter().enumerate().find_map(|(n, record)| {
        let first = known.first_same(record);
        known.insert(n, record);
        Some([first?, n])
    });
    let Some(repeated) = repeated else { return Ok(()) };
    let [one, other] = repeated.map(|n| match &records[n].source().path {
        Some(_) => name_of(&records[n]),
        None => format!("recording {}", n + 1),
    });
    let what = if one == other {
        format!("{one} is given twice")
    } else {
        format!("{one} and {other} are the same recording")
    };
    let message = format!("{what}: it would count as two, and the standard errors would be too small by √2");
    Err(Error::data(
        message,
        text!("Give it once; to validate a fit, hold out a part of a recording with " [Split] "."),
    ))
}

/// Returns the warning about recordings that are both fitted and held out.
pub(super) fn validation_repeats(records: &[Record], held_out: &[Record]) -> Option<Warning> {
    let mut known = Known::default();
    records.iter().enumerate().for_each(|(n, record)| known.insert(n, record));
    let repeated: Vec<String> = held_out.iter().filter(|held| known.first_same(held).is_some()).map(name_of).collect();
    let message = format!(
        "{} is both fitted and held out: the fit of a fitted recording does not validate the model",
        repeated.join(", ")
    );
    (!repeated.is_empty()).then(|| Warning::new("validation_repeats", message))
}

/// Recordings by digests of the input and each output that varies; only recordings with equal digests are compared.
#[derive(Default)]
struct Known<'a> {
    buckets: BTreeMap<(usize, u64), Vec<(usize, &'a Record)>>,
}

impl<'a> Known<'a> {
    fn insert(&mut self, n: usize, record: &'a Record) {
        for key in digests(record) {
            self.buckets.entry(key).or_default().push((n, record));
        }
    }

    /// Returns the index of the first recording that is the same as `record`.
    fn first_same(&self, record: &Record) -> Option<usize> {
        let alike = digests(record).filter_map(|key| self.buckets.get(&key)).flatten();
        alike.filter(|(_, other)| is_same(other, record)).map(|(n, _)| *n).min()
    }
}

/// Number of samples in the digest of a signal.
const DIGEST_SAMPLES: usize = 64;

/// Returns the digest of each output that varies, with its channel.
fn digests(record: &Record) -> impl Iterator<Item = (usize, u64)> {
    let outputs = record.measured().into_iter().enumerate();
    outputs.filter_map(|(channel, signal)| signal.filter(|signal| moves(signal)).map(|signal| (channel, signal))).map(
        |(channel, signal)| {
            let mut digest = DefaultHasher::new();
            signal.len().hash(&mut digest);
            for part in 0..DIGEST_SAMPLES {
                let at = signal.len() * part / DIGEST_SAMPLES;
                // Adding zero gives −0 and +0 the same bits.
                [record.input()[at], signal[at]].iter().for_each(|value| (value + 0.0).to_bits().hash(&mut digest));
            }
            (channel, digest.finish())
        },
    )
}

/// Returns true if a signal varies; a constant one is the same in all recordings at rest.
fn moves(signal: &[f64]) -> bool {
    signal.windows(2).any(|w| w[0].to_bits() != w[1].to_bits())
}

/// Returns true if two recordings have the same input and the same common outputs, of which the first varies.
fn is_same(one: &Record, other: &Record) -> bool {
    if one.len() != other.len() {
        return false;
    }
    let mut common = one.measured().into_iter().zip(other.measured()).filter_map(|(a, b)| Some((a?, b?))).peekable();
    let is_moving = common.peek().is_some_and(|(a, _)| moves(a));
    is_moving && common.all(|(a, b)| a == b) && one.input() == other.input()
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorfit_record::Samples;

    /// Makes a recording of 70 samples; a channel with factor 0 does not vary.
    fn record(current: Option<f64>, speed: Option<f64>, volts: f64) -> Record {
        let signal = |size: f64| (0..70).map(|n| size * f64::from(n % 7)).collect::<Vec<_>>();
        let time_s = (0..70).map(|n| 0.001 * f64::from(n)).collect();
        let samples = Samples {
            time_s,
            voltage: signal(volts),
            torque: None,
            current: current.map(signal),
            speed: speed.map(signal),
            ..Samples::default()
        };
        Record::new(samples).unwrap()
    }

    /// Compares the search by digests with a comparison of all pairs.
    #[test]
    fn the_first_pair_is_that_of_all_pairs() {
        let kinds = [
            record(Some(1.0), Some(1.0), 1.0),
            record(Some(1.0), None, 1.0),
            record(None, Some(1.0), 1.0),
            record(Some(0.0), Some(1.0), 1.0),
            record(Some(-0.0), Some(1.0), 1.0),
            record(Some(0.0), Some(2.0), 1.0),
            record(Some(1.0), Some(2.0), 1.0),
            record(Some(1.0), Some(1.0), 2.0),
            record(Some(2.0), Some(3.0), 1.0),
        ];
        let mut repeated = 0;
        for a in &kinds {
            for b in &kinds {
                for c in &kinds {
                    let records = [a.clone(), b.clone(), c.clone()];
                    let pairs = [[0, 1], [0, 2], [1, 2]];
                    let first = pairs.into_iter().find(|[a, b]| is_same(&records[*a], &records[*b]));
                    let said = check_repeated(&records).err().map(|error| error.to_string());
                    let named = first.map(|pair| pair.map(|n| format!("recording {}", n + 1)));
                    assert_eq!(said.is_some(), named.is_some(), "{named:?}");
                    if let (Some(said), Some([one, other])) = (said, named) {
                        assert!(
                            said.contains(&format!("{one} and {other} are the same")),
                            "{said}, not {one}, {other}"
                        );
                        repeated += 1;
                    }
                }
            }
        }
        assert!((100..700).contains(&repeated), "{repeated}");
    }
}
