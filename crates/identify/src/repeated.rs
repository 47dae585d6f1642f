//! Detection of recordings that are given twice. They would count as independent, and the standard errors would be too small by
//! a factor of √2.

use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_evaluate::model::ModelRecording;
use motorfit_record::Record;
use motorfit_record::warning::{Warning, name_of};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};

/// The signals of a recording, of any machine, as they are compared.
pub(super) struct Compared<'a> {
    name: Option<String>,
    inputs: Vec<&'a [f64]>,
    outputs: Vec<Option<&'a [f64]>>,
}

impl<'a> From<&'a Record> for Compared<'a> {
    fn from(record: &'a Record) -> Self {
        let name = record.source().path.as_ref().map(|_| name_of(record));
        Self { name, inputs: vec![record.input()], outputs: record.measured().to_vec() }
    }
}

impl<'a> From<&'a ModelRecording> for Compared<'a> {
    fn from(recording: &'a ModelRecording) -> Self {
        let inputs = recording.inputs.iter().map(Vec::as_slice).collect();
        let outputs = recording.measured.iter().map(Option::as_deref).collect();
        Self { name: recording.name.clone(), inputs, outputs }
    }
}

/// Checks that no recording is given twice, also under different names.
///
/// # Errors
/// Returns `Data` with the names of both recordings.
pub(super) fn check_repeated<'a, R: 'a>(records: &'a [R]) -> Result<()>
where
    Compared<'a>: From<&'a R>,
{
    let all: Vec<Compared<'a>> = records.iter().map(Compared::from).collect();
    let mut known = Known::default();
    let repeated = all.iter().enumerate().find_map(|(n, record)| {
        let first = known.first_same(record);
        known.insert(n, record);
        Some([first?, n])
    });
    let Some(repeated) = repeated else { return Ok(()) };
    let [one, other] = repeated.map(|n| all[n].name.clone().unwrap_or_else(|| format!("recording {}", n + 1)));
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
pub(super) fn validation_repeats<'a, R: 'a>(records: &'a [R], held_out: &'a [R]) -> Option<Warning>
where
    Compared<'a>: From<&'a R>,
{
    let [fitted, held_out] = [records, held_out].map(|of| of.iter().map(Compared::from).collect::<Vec<_>>());
    let mut known = Known::default();
    fitted.iter().enumerate().for_each(|(n, record)| known.insert(n, record));
    let name = |held: &Compared<'_>| held.name.clone().unwrap_or_else(|| "the recording".to_owned());
    let repeated: Vec<String> = held_out.iter().filter(|held| known.first_same(held).is_some()).map(name).collect();
    let message = format!(
        "{} is both fitted and held out: the fit of a fitted recording does not validate the model",
        repeated.join(", ")
    );
    (!repeated.is_empty()).then(|| Warning::new("validation_repeats", message))
}

/// Recordings by digests of the inputs and each output that varies; only recordings with equal digests are compared.
#[derive(Default)]
struct Known<'a> {
    buckets: BTreeMap<(usize, u64), Vec<(usize, &'a Compared<'a>)>>,
}

impl<'a> Known<'a> {
    fn insert(&mut self, n: usize, record: &'a Compared<'a>) {
        for key in digests(record) {
            self.buckets.entry(key).or_default().push((n, record));
        }
    }

    /// Returns the index of the first recording that is the same as `record`.
    fn first_same(&self, record: &Compared<'_>) -> Option<usize> {
        let alike = digests(record).filter_map(|key| self.buckets.get(&key)).flatten();
        alike.filter(|(_, other)| is_same(other, record)).map(|(n, _)| *n).min()
    }
}

/// Number of samples in the digest of a signal.
const DIGEST_SAMPLES: usize = 64;

/// Returns the digest of each output that varies, with its number.
fn digests(record: &Compared<'_>) -> impl Iterator<Item = (usize, u64)> {
    let outputs = record.outputs.iter().enumerate();
    let moving = outputs.filter_map(|(output, signal)| signal.filter(|signal| moves(signal)).map(|own| (output, own)));
    moving.map(|(output, signal)| {
        let mut digest = DefaultHasher::new();
        signal.len().hash(&mut digest);
        for part in 0..DIGEST_SAMPLES {
            let at = signal.len() * part / DIGEST_SAMPLES;
            let inputs = record.inputs.iter().map(|input| input.get(at).copied().unwrap_or_default());
            // Adding zero gives −0 and +0 the same bits.
            inputs.chain([signal[at]]).for_each(|value| (value + 0.0).to_bits().hash(&mut digest));
        }
        (output, digest.finish())
    })
}

/// Returns true if a signal varies; a constant one is the same in all recordings at rest.
fn moves(signal: &[f64]) -> bool {
    signal.windows(2).any(|w| w[0].to_bits() != w[1].to_bits())
}

/// Returns true if two recordings have the same inputs and the same common outputs, of which the first varies.
fn is_same(one: &Compared<'_>, other: &Compared<'_>) -> bool {
    let mut common = one.outputs.iter().zip(&other.outputs).filter_map(|(a, b)| Some(((*a)?, (*b)?))).peekable();
    let is_moving = common.peek().is_some_and(|(a, _)| moves(a));
    is_moving && common.all(|(a, b)| a == b) && one.inputs == other.inputs
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
                    let first =
                        pairs.into_iter().find(|[a, b]| is_same(&(&records[*a]).into(), &(&records[*b]).into()));
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
