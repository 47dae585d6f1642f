//! A finished run as a line of JSON, and back.

use super::manifest::Job;
use super::study::Study;
use super::toml::as_key;
use crate::identify::Fitted;
use crate::motor::{Parameter, Parameters};
use crate::text::{hexadecimal, printable_json};
use crate::{Error, ErrorKind};
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

/// A value for each parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[expect(non_snake_case, reason = "the names of the parameters")]
pub struct Of<T> {
    R: T,
    L: T,
    K: T,
    B: T,
    J: T,
}

impl<T: Copy> Of<T> {
    fn new([r, l, k, b, j]: [T; 5]) -> Self {
        Self { R: r, L: l, K: k, B: b, J: j }
    }

    /// In the order of [`Parameter::ALL`].
    #[must_use]
    pub fn to_array(&self) -> [T; 5] {
        [self.R, self.L, self.K, self.B, self.J]
    }
}

/// How much of current and speed is explained.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FitPercent {
    /// Of the current.
    pub current: Option<f64>,
    /// Of the speed.
    pub speed: Option<f64>,
}

/// What a run found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// All five, those held included; `None` where there is no result.
    pub parameters: Option<Of<f64>>,
    /// Standard errors; `None` without a polish.
    pub std_error: Option<Of<Option<f64>>>,
    /// 95 % intervals.
    pub ci95: Option<Of<Option<[f64; 2]>>>,
    /// Bounds that parameters stand at.
    pub at_bound: Option<Of<Option<Side>>>,
    /// The cost in the run's criterion, by the oracle.
    pub cost: Option<f64>,
    /// How much of the signals is explained.
    pub fit_percent: Option<FitPercent>,
    /// Candidates evaluated, or iterations of Steiglitz–McBride.
    pub evaluations: u64,
    /// Why it ended; `failed` without a result.
    pub stop: Stop,
    /// cpu or gpu.
    pub device: Device,
    /// f32 or f64.
    pub precision: Precision,
    /// Codes of warnings.
    pub warnings: Vec<String>,
    /// Why there is no result.
    pub error: Option<Failure>,
}

/// A side of a bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The lower.
    Min,
    /// The upper.
    Max,
}

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// All generations were evaluated.
    BudgetSpent,
    /// An iteration came to its end.
    Converged,
    /// There is no result.
    Failed,
}

/// What evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Device {
    /// The processor.
    Cpu,
    /// A GPU.
    Gpu,
}

/// With which numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single.
    F32,
    /// Double.
    F64,
}

/// Why a run has no result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// `data`: the recording could not be read, which another run may; `not_identified`; `usage`.
    pub kind: String,
    /// In words.
    pub message: String,
    /// What to do.
    pub remedy: String,
}

impl Outcome {
    /// Of a run that failed.
    #[must_use]
    pub fn failed(error: &Error, root: &str) -> Self {
        let kind = match error.kind() {
            ErrorKind::Data => "data",
            ErrorKind::NotIdentified => "not_identified",
            ErrorKind::Device => "device",
            ErrorKind::Usage => "usage",
        };
        // Where the files lie is no part of a result.
        let message = error.text().respelled(as_key).to_string().replace(root, "");
        let remedy = error.hint().respelled(as_key).to_string();
        Self {
            parameters: None,
            std_error: None,
            ci95: None,
            at_bound: None,
            cost: None,
            fit_percent: None,
            evaluations: 0,
            stop: Stop::Failed,
            device: Device::Cpu,
            precision: Precision::F64,
            warnings: Vec::new(),
            error: Some(Failure { kind: kind.to_owned(), message, remedy }),
        }
    }

    /// Of parameters at a cost.
    #[must_use]
    pub fn found(parameters: &Parameters, cost: f64, evaluations: u64, stop: Stop) -> Self {
        Self {
            parameters: Some(Of::new(parameters.to_array())),
            std_error: None,
            ci95: None,
            at_bound: None,
            cost: Some(cost).filter(|cost| cost.is_finite()),
            fit_percent: None,
            evaluations,
            stop,
            device: Device::Cpu,
            precision: Precision::F64,
            warnings: Vec::new(),
            error: None,
        }
    }

    /// The same with how sure a fit is.
    #[must_use]
    pub fn with_fit(mut self, fitted: &Fitted) -> Self {
        let place = |p: Parameter| fitted.space.free().iter().position(|axis| axis.parameter == p);
        let side = |p: Parameter| match fitted.at_bound[place(p)?] {
            Some("min") => Some(Side::Min),
            Some(_) => Some(Side::Max),
            None => None,
        };
        self.at_bound = Some(Of::new(Parameter::ALL.map(side)));
        if let Some(uncertainty) = &fitted.uncertainty {
            self.std_error = Some(Of::new(Parameter::ALL.map(|p| uncertainty.std_error[place(p)?])));
            self.ci95 = Some(Of::new(Parameter::ALL.map(|p| uncertainty.ci95[place(p)?])));
        }
        let [current, speed] = fitted.fit_percent;
        self.fit_percent = Some(FitPercent { current, speed });
        self.warnings = fitted.warnings.iter().map(|code| (*code).to_owned()).collect();
        self
    }
}

/// What is read back of a line: its number, and what was found.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct Row {
    pub id: u64,
    #[serde(flatten)]
    pub outcome: Outcome,
}

impl Outcome {
    /// Whether another try may end otherwise: what failed was the recording.
    pub(super) fn is_retried(&self) -> bool {
        self.error.as_ref().is_some_and(|failure| failure.kind == "data")
    }
}

/// A line as it is written.
#[derive(Serialize)]
struct Line<'a> {
    id: u64,
    motor: &'a str,
    method: &'a str,
    polish: &'a str,
    population: usize,
    generations: usize,
    criterion: &'a str,
    scale: &'a str,
    noise: &'a str,
    seed: u64,
    #[serde(flatten)]
    outcome: &'a Outcome,
}

/// What stands between the result and its time: no text in JSON can hold it, for it has bare quotes.
const TIMING: &str = ",\"timing\":";

/// The line of a run, with its time.
pub(super) fn line(study: &Study, job: &Job, motor: &str, outcome: &Outcome, seconds: f64) -> String {
    let f = &job.factors;
    let line = Line {
        id: job.id,
        motor,
        method: f.method.name(),
        polish: f.polish.name(),
        population: f.population,
        generations: f.generations,
        criterion: f.criterion.name(),
        scale: f.scale.name(),
        noise: &study.noise[f.noise].name,
        seed: f.seed,
        outcome,
    };
    let mut text = printable_json(&serde_json::to_string(&line).unwrap_or_default());
    text.pop();
    let timing = Timing { seconds, check: check(&text) };
    text + TIMING + &serde_json::to_string(&timing).unwrap_or_default() + "}\n"
}

/// What stands behind a result in the file of a shard.
#[derive(Serialize, Deserialize)]
struct Timing {
    seconds: f64,
    /// Tells a damaged line.
    check: String,
}

fn check(text: &str) -> String {
    hexadecimal(&Sha256::digest(text).as_slice()[..4])
}

/// A line without its time, and its time; `None` for one that is damaged.
pub(super) fn split(line: &str) -> Option<(String, f64)> {
    let at = line.rfind(TIMING)?;
    let (text, timing) = (&line[..at], line[at + TIMING.len()..].strip_suffix('}')?);
    let timing: Timing = serde_json::from_str(timing).ok()?;
    (timing.check == check(text)).then(|| (format!("{text}}}"), timing.seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_comes_back_and_its_time_comes_off() {
        let text = "methods = [\"sm\"]\nrecordings = [\"a\"]\nnoise = [\"none\"]";
        let study = Study::parse(text, std::path::Path::new("s.toml")).unwrap();
        let runs = super::super::manifest::Runs::new(study.clone(), 1);
        let motor = "evil\",\"timing\":{}}\u{202e}\n";
        let mut outcome = Outcome::found(&Parameters::M2, 0.025, 4, Stop::Converged);
        outcome.ci95 = Some(Of::new([Some([0.1, 0.2]), None, Some([1e-9, 1e300]), None, None]));
        let line = line(&study, &runs.job(0), motor, &outcome, 0.5);
        assert!(line.ends_with("}\n") && line.matches('\n').count() == 1 && !line.contains('\u{202e}'));
        let (result, timing) = split(line.trim_end()).unwrap();
        assert!((timing - 0.5).abs() < 1e-12);
        let value: serde_json::Value = serde_json::from_str(&result).unwrap();
        assert_eq!(value["motor"], motor);
        assert!(value.get("timing").is_none());
        let row: Row = serde_json::from_str(line.trim_end()).unwrap();
        assert_eq!((row.id, row.outcome), (0, outcome));
        // Any other letter anywhere is noticed, also where the line stays good JSON.
        for at in 0..line.len() - 1 {
            let mut bytes = line.clone().into_bytes();
            bytes[at] = if bytes[at] == b'7' { b'8' } else { b'7' };
            let Ok(text) = String::from_utf8(bytes) else { continue };
            let same = split(text.trim_end()).is_some_and(|(other, _)| other != result);
            assert!(!same, "{text}");
        }
    }
}
