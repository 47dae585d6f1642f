//! Finished runs as lines of JSON, written and parsed.

use super::estimates::{OutputFits, RunEstimate, RunEstimates, some_or_nulls};
use super::limits::Limits;
use super::runs::Job;
use super::study::Study;
use super::toml::as_key;
use super::trust::RunTrust;
use motorfit_core::Error;
use motorfit_core::text::{hexadecimal, printable_json};
use motorfit_identify::Identification;
use motorfit_identify::analysis::Characteristics;
use motorfit_identify::model::ModelIdentification;
use motorfit_motor::Input;
use motorfit_optimize::Stop;
use motorfit_record::Severity;
use motorfit_record::warning::Warning;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use sha2::{Digest as _, Sha256};

/// A name from a fixed set. The alias keeps serde from borrowing the reference from the line.
type Name = &'static str;

/// Outcome of a run as stored on its line.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Parameter estimates; `None` without a result.
    #[serde(flatten, serialize_with = "some_or_nulls")]
    pub estimates: Option<RunEstimates>,
    /// Cost in the criterion of the run, evaluated by the oracle.
    pub cost: Option<f64>,
    /// Fit of the outputs \[%\].
    pub fit_percent: Option<OutputFits>,
    /// Fit of the held-out recordings; `None` in studies without any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub validation: Option<HeldOutFit>,
    /// Number of candidates evaluated, or of iterations of Steiglitz–McBride.
    pub evaluations: u64,
    /// Stopping criterion; `None` without a result, which is `failed` on the line.
    #[serde(serialize_with = "stop", deserialize_with = "read_stop")]
    pub stop: Option<Stop>,
    /// Device kind, `cpu` or `gpu`.
    #[serde(deserialize_with = "read_name")]
    pub device: Name,
    /// Precision, `f32` or `f64`.
    #[serde(deserialize_with = "read_name")]
    pub precision: Name,
    /// Codes of the warnings.
    pub warnings: Vec<String>,
    /// Level of trust; `None` without a result and on lines of earlier versions of the program.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trust: Option<RunTrust>,
    /// Reason why there is no result.
    pub error: Option<Failure>,
}

/// Fit of held-out recordings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeldOutFit {
    /// Fit of the outputs \[%\].
    pub fit_percent: OutputFits,
}

const FAILED: &str = "failed";

fn stop_name(stop: Option<Stop>) -> &'static str {
    stop.map_or(FAILED, Stop::name)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn stop<S: Serializer>(stop: &Option<Stop>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(stop_name(*stop))
}

fn read_stop<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Stop>, D::Error> {
    let name = String::deserialize(deserializer)?;
    let known = Stop::ALL.into_iter().find(|stop| stop.name() == name);
    if known.is_none() && name != FAILED { Err(D::Error::custom("an unknown reason")) } else { Ok(known) }
}

fn read_name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Name, D::Error> {
    let name = String::deserialize(deserializer)?;
    let known = ["cpu", "gpu", "f64", "f32"].into_iter().find(|known| *known == name);
    known.ok_or_else(|| D::Error::custom("an unknown name"))
}

/// Reason why a run has no result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// Kind of the error: `data`, `not_identified`, `device` or `usage`. Runs with `data` are repeated.
    pub kind: String,
    /// Error message.
    pub message: String,
    /// Remedy.
    pub remedy: String,
}

impl Outcome {
    /// Creates the outcome of a run that failed; `root`, the folder of the recordings, is removed from the message.
    #[must_use]
    pub fn failed(error: &Error, root: &str) -> Self {
        // Results do not depend on the location of the files.
        let message = error.text().respelled(as_key).to_string().replace(root, "");
        let remedy = error.hint().respelled(as_key).to_string();
        let kind = error.kind().name().to_owned();
        let error = Some(Failure { kind, message, remedy });
        Self { device: "cpu", precision: "f64", error, ..Self::default() }
    }

    /// Creates the outcome of an identification; `held_out` are the fits of held-out recordings, if there are any.
    fn new<M>(found: &Identification<M>, held_out: Option<&[Option<f64>]>) -> Self {
        let fits = |fits: &[Option<f64>]| OutputFits::new(&found.outputs, fits);
        Self {
            estimates: Some(found.into()),
            cost: Some(found.cost).filter(|cost| cost.is_finite()),
            fit_percent: Some(fits(&found.fit_percent)),
            validation: held_out.map(|of| HeldOutFit { fit_percent: fits(of) }),
            evaluations: found.evaluations,
            stop: Some(found.stop),
            device: found.device.kind,
            precision: found.device.precision,
            warnings: codes(&found.warnings),
            trust: Some((&found.trust).into()),
            error: None,
        }
    }

    /// Creates the outcome of an identification of the DC motor, with the characteristics that have `limits`, and all of them where they
    /// and not the parameters are identified.
    #[must_use]
    pub fn of(found: &Identification, limits: &Limits) -> Self {
        let mut outcome = Self::new(found, found.validation.as_ref().map(|of| &of.fit_percent[..]));
        let is_limited = |name: &str| limits.of(name).is_some() || !found.identified.is_empty();
        if let (Some(estimates), Input::Voltage) = (&mut outcome.estimates, found.input) {
            let named = Characteristics::named_of(found).into_iter().filter(|(name, ..)| is_limited(name));
            estimates
                .derived
                .extend(named.filter_map(|(name, _, of)| Some(RunEstimate::derived(name, of?.value, of?.std_error))));
        }
        outcome
    }

    /// Creates the outcome of an identification with a model, with the derived quantities that have `limits`, and all of them where a
    /// parameter is not identified.
    #[must_use]
    pub fn of_model(found: &ModelIdentification, limits: &Limits) -> Self {
        let mut outcome = Self::new(found, Some(&found.held_out_percent[..]).filter(|fits| !fits.is_empty()));
        let is_open = found.estimates.iter().any(|e| e.value.is_none());
        let is_derived = |name: &str| found.model.derived().iter().any(|quantity| quantity.name == name);
        let is_limited = |name: &str| limits.of(name).is_some() || is_open;
        let own = found.identified.iter().filter(|of| is_derived(&of.name) && is_limited(&of.name));
        if let Some(estimates) = &mut outcome.estimates {
            estimates.derived.extend(own.map(|of| RunEstimate::derived(&of.name, of.value, Some(of.std_error))));
        }
        outcome
    }

    /// Returns the name of the stopping criterion on the line.
    #[must_use]
    pub fn stop_name(&self) -> &'static str {
        stop_name(self.stop)
    }
}

/// Returns the codes of the warnings that are reported.
fn codes(warnings: &[Warning]) -> Vec<String> {
    let reported = warnings.iter().filter(|warning| warning.severity == Severity::Report);
    reported.map(|warning| warning.code.to_owned()).collect()
}

/// The fields of a line by which its run is counted.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct Row {
    pub id: u64,
    pub error: Option<Failure>,
    #[serde(default)]
    pub trust: Option<RunTrust>,
}

impl Row {
    /// Returns true if the run must be repeated because its recording could not be read.
    pub(super) fn is_retried(&self) -> bool {
        self.error.as_ref().is_some_and(|failure| failure.kind == "data")
    }
}

/// A line of a results file without its time.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[doc(hidden)]
pub struct Line {
    pub id: u64,
    pub motor: String,
    pub method: String,
    pub polish: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub with: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    pub population: u64,
    pub generations: u64,
    pub criterion: String,
    pub scale: String,
    pub noise: String,
    pub seed: u64,
    #[serde(flatten)]
    pub outcome: Outcome,
}

impl Line {
    /// Creates the line of a run.
    pub(super) fn of(study: &Study, job: &Job, motor: &str, outcome: Outcome) -> Self {
        let f = &job.factors;
        Self {
            id: job.id,
            motor: motor.to_owned(),
            method: f.method.name().to_owned(),
            polish: f.polish.name().to_owned(),
            with: study.with_name(f).map(str::to_owned),
            model: study.model_name(f).map(str::to_owned),
            population: f.population as u64,
            generations: f.generations as u64,
            criterion: f.criterion.name().to_owned(),
            scale: f.scale.name().to_owned(),
            noise: study.noise[f.noise].name.clone(),
            seed: f.seed,
            outcome,
        }
    }
}

/// Separator of a result and its time. No JSON string contains it, because its quotes are not escaped.
const TIMING: &str = ",\"timing\":";

/// Returns the line of a run with its time and check sum.
pub(super) fn line(study: &Study, job: &Job, motor: &str, outcome: &Outcome, seconds: f64) -> String {
    let line = Line::of(study, job, motor, outcome.clone());
    let mut text = printable_json(&serde_json::to_string(&line).unwrap_or_default());
    text.pop();
    let timing = Timing { seconds, check: check(&text) };
    text + TIMING + &serde_json::to_string(&timing).unwrap_or_default() + "}\n"
}

/// The fields of a line after the result.
#[derive(Serialize, Deserialize)]
struct Timing {
    seconds: f64,
    /// Digest of the line up to here, by which a damaged line is detected.
    check: String,
}

fn check(text: &str) -> String {
    hexadecimal(&Sha256::digest(text).as_slice()[..4])
}

/// Splits a line into the result and its time \[s\]; `None` if the line is damaged.
pub(super) fn split(line: &str) -> Option<(String, f64)> {
    let at = line.rfind(TIMING)?;
    let (text, timing) = (&line[..at], line[at + TIMING.len()..].strip_suffix('}')?);
    let timing: Timing = serde_json::from_str(timing).ok()?;
    (timing.check == check(text)).then(|| (format!("{text}}}"), timing.seconds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::machine::ModelTexts;
    use crate::sweep::sample::sample;

    #[test]
    fn a_line_comes_back_and_its_time_comes_off() {
        let text = "methods = [\"sm\"]\nrecordings = [\"a\"]\nnoise = [\"none\"]";
        let study = Study::parse(text, std::path::Path::new("s.toml"), ModelTexts::Known(&[])).unwrap();
        let runs = super::super::runs::Runs::new(study.clone(), 1);
        let motor = "evil\",\"timing\":{}}\u{202e}\n";
        let outcome = sample();
        let line = line(&study, &runs.job(0), motor, &outcome, 0.5);
        assert!(line.ends_with("}\n") && line.matches('\n').count() == 1 && !line.contains('\u{202e}'));
        let (result, timing) = split(line.trim_end()).unwrap();
        assert!((timing - 0.5).abs() < 1e-12);
        let value: serde_json::Value = serde_json::from_str(&result).unwrap();
        assert_eq!(value["motor"], motor);
        assert!(value.get("timing").is_none());
        let row: Row = serde_json::from_str(line.trim_end()).unwrap();
        assert_eq!((row.id, row.error, row.trust.as_ref()), (0, None, outcome.trust.as_ref()));
        assert_eq!(serde_json::from_str::<Outcome>(line.trim_end()).unwrap(), outcome);
        let maps: Vec<&str> = value.as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(maps[10..16], ["parameters", "std_error", "ci95", "at_bound", "cost", "fit_percent"]);
        // Any changed character is detected, even if the line is still valid JSON.
        for at in 0..line.len() - 1 {
            let mut bytes = line.clone().into_bytes();
            bytes[at] = if bytes[at] == b'7' { b'8' } else { b'7' };
            let Ok(text) = String::from_utf8(bytes) else { continue };
            let same = split(text.trim_end()).is_some_and(|(other, _)| other != result);
            assert!(!same, "{text}");
        }
    }
}
