//! The level of trust in a result with a user's model.

use super::estimates::is_idle;
use super::lacking::CODE;
use super::recordings::exclude;
use super::result::{ModelFit, ModelIdentification};
use super::spec::ModelSpec;
use super::step_accuracy::{inaccuracy, shorter_steps};
use crate::estimates::ParameterEstimate;
use crate::trust::{Facts, Reason, Subject, missed};
use crate::trust_level::{Trust, TrustLevel, TrustReason};
use crate::verify::Status;
use motorfit_core::numeric::upper_median;
use motorfit_core::setting::{Text, text};
use motorfit_core::text::{Shortest, counted, listed};
use motorfit_evaluate::model::ModelProblem;
use motorfit_record::warning::Warning;
use motorfit_record::{AssumedUnits, Severity};

use TrustLevel::{Check, Poor};

/// Findings about recordings that are mended before anything else, the gravest first.
const SPOILED: [&str; 4] = ["sign_reversed", "units", "voltage_without_current", "current_clipped"];

/// Number of samples up to which residuals are not tested for whiteness.
const SAMPLES_FEW: usize = 40;

/// Determines the level of trust in a result.
pub(super) fn trust(problem: &ModelProblem, spec: &ModelSpec, found: &ModelIdentification) -> Trust {
    let (is_polished, is_asked) = (spec.is_polished, !spec.fixed.is_empty());
    let outlying = outliers(problem, found);
    let sigma = |fit: &ModelFit| fit.residual_sigma.iter().map(|sigma| sigma.unwrap_or(0.0)).collect();
    let sigmas: Vec<Vec<f64>> = found.fits.iter().map(sigma).collect();
    let subject = Subject::new(found, is_asked);
    let excused = |warning: &&Warning| warning.code == "not_identifiable" && subject.is_excused();
    let assumed = (0..problem.recordings()).find_map(|n| problem.recording(n).assumed.clone());
    let facts = Facts {
        outputs: problem.model().outputs().iter().map(|output| output.name.clone()).collect(),
        recordings: (0..problem.recordings()).map(|n| problem.recording(n).label(n)).collect(),
        fit_percent: &found.fit_percent,
        missed: &missed(problem, &sigmas),
        tests: &found.residual_tests,
        is_polished,
        search: search(found, is_polished),
        warnings: found.warnings.iter().filter(|warning| !excused(warning)).collect(),
        more: more(problem, found, (is_polished, subject.is_excused(), outlying.as_ref().map(|(message, _)| message))),
        subject: subject.clone(),
        assumed: assumed.clone(),
    };
    let trust = facts.trust();
    // Wrong signals and samples spoil the fit and the tests of the residuals too.
    let graver = || found.warnings.iter().filter(|warning| warning.severity == Severity::Report);
    let spoiled = || {
        let found = SPOILED.iter().find_map(|code| graver().find(|warning| warning.code == *code));
        found.and_then(|warning| warning.remedy.clone()).or_else(|| Some(outlying.as_ref()?.1.clone()))
    };
    let next = trust.reasons.first().map(|reason| match spoiled() {
        Some(remedy) => remedy,
        None if reason.code == "not_accurate" => shorter_steps(problem),
        None if reason.code == "units_assumed" => assumed.as_ref().map_or_else(Text::default, AssumedUnits::step),
        None => lacking(problem, found, &trust.reasons).unwrap_or_else(|| next(found, reason.code)),
    });
    Trust { next, ..trust }
}

/// Returns the reason from the search of the bounds. Residuals that are noise do not exclude another optimum that leaves noise too.
fn search(found: &ModelIdentification, is_polished: bool) -> Option<Reason> {
    match found.verification.status {
        Status::SearchStuck => Some((Poor, "search_stuck", "a better optimum is known".into())),
        Status::ReferenceFailed => {
            let (starts, arrivals) = (found.verification.starts, found.verification.arrivals);
            let message = format!("only {arrivals} of {starts} starts lead to the lowest optimum");
            Some((Check, "search_inconclusive", message.into()))
        }
        Status::NotApplicable if is_polished => {
            Some((Check, "not_verified", "no other search confirms the optimum".into()))
        }
        _ => None,
    }
}

/// Returns the reasons of models alone.
fn more(
    problem: &ModelProblem,
    found: &ModelIdentification,
    (is_polished, is_excused, outliers): (bool, bool, Option<&String>),
) -> Vec<Reason> {
    let mut all: Vec<Reason> = Vec::new();
    let mut add = |level, code, message: Text| all.push((level, code, message));
    if (0..problem.recordings()).any(|n| problem.recording(n).effective_sample_ratio < 1.0) {
        let message = "the signals were filtered or resampled, which biases the estimates of nonlinear equations";
        add(Check, "filtered", message.into());
    }
    if let Some(message) = outliers {
        add(Check, "outliers", message.clone().into());
    }
    let most = found.fits.iter().flat_map(|fit| fit.simulated.first()).map(Vec::len).max().unwrap_or(0);
    if is_polished && most <= SAMPLES_FEW {
        add(Check, "few_samples", format!("{most} samples are too few to test the residuals").into());
    }
    if let Some(first) = found.combinations.first().filter(|_| !is_excused) {
        add(Check, "not_identifiable", first.clone().into());
    }
    let is_bound = |e: &&ParameterEstimate| e.at_bound.is_some() && !is_idle(&found.model, e);
    let bound: Vec<&str> = found.estimates.iter().filter(is_bound).map(|estimate| estimate.name.as_str()).collect();
    if !bound.is_empty() {
        let verb = if bound.len() == 1 { "ended at a bound" } else { "ended at bounds" };
        add(Check, "at_bound", format!("{} {verb}", listed(&bound, "and")).into());
    }
    if let Some(warning) = found.warnings.iter().find(|warning| warning.code == CODE) {
        add(Check, CODE, warning.message.clone());
    }
    if found.method.is_rough {
        add(Check, "not_accurate", inaccuracy(problem).into());
    }
    all
}

/// Residuals beyond this multiple of their median magnitude are outliers: ten standard deviations of Gaussian noise.
const OUTLIER: f64 = 15.0;

/// Returns a description of the samples of an output that are far from the model, and the remedy that excludes them; `None` if there are
/// none. A model that lacks an effect has many large residuals, not a few.
fn outliers(problem: &ModelProblem, found: &ModelIdentification) -> Option<(String, Text)> {
    for (n, fit) in found.fits.iter().enumerate() {
        let recording = problem.recording(n);
        let outputs = problem.model().outputs().iter().enumerate();
        for (((number, output), simulated), measured) in outputs.zip(&fit.simulated).zip(&recording.measured) {
            let Some(measured) = measured else { continue };
            let size = |k: usize| (measured[k] - simulated[k]).abs();
            let counting: Vec<usize> = (0..measured.len()).filter(|k| recording.counts(number, *k)).collect();
            let median = upper_median(&mut counting.iter().map(|k| size(*k)).collect::<Vec<f64>>());
            let far: Vec<usize> = counting.iter().copied().filter(|k| size(*k) > OUTLIER * median).collect();
            let Some(&first) = far.first().filter(|_| median > 0.0 && far.len() <= measured.len() / 50) else {
                continue;
            };
            let time = |k: usize| Shortest(recording.time_s[k]);
            let samples = counted(far.len(), "sample");
            let verb = if far.len() == 1 { "is" } else { "are" };
            let message =
                format!("{samples} of {} {verb} far from the model, the first at {} s", output.name, time(first));
            let runs = far.chunk_by(|a, b| a + 1 == *b).map(|run| run[0]..run[run.len() - 1] + 1);
            return Some((message, exclude(recording, runs)));
        }
    }
    None
}

/// Returns the remedy where the model lacks one of its optional terms, or may lack one that a selection among them finds.
fn lacking(problem: &ModelProblem, found: &ModelIdentification, reasons: &[TrustReason]) -> Option<Text> {
    if let Some(warning) = found.warnings.iter().find(|warning| warning.code == CODE) {
        return warning.remedy.clone();
    }
    let may = |reason: &TrustReason| matches!(reason.code, "poor_fit" | "residuals" | "recording_missed");
    let is_chosen = found.selection.is_some() || found.with.len() >= problem.model().terms().len();
    (!is_chosen && reasons.iter().any(may)).then(|| text!("Use " [With = "auto"] "."))
}

/// Returns the next step for the first reason.
fn next(found: &ModelIdentification, code: &str) -> Text {
    match code {
        "poor_fit" | "residuals" => {
            "Add the effect that the model lacks, or check units and signs of the signals.".into()
        }
        "recordings_differ" => "Fit the recordings one by one.".into(),
        "recording_missed" => "Leave the recording out, or check its signals.".into(),
        "not_verified" => "Let the search run to its end.".into(),
        "search_stuck" | "search_inconclusive" => text!("Narrow the " [Bounds] ", or try another " [Seed] "."),
        "not_polished" => text!("Leave out " [Polish = "none"] "."),
        "not_converged" => "Check the bounds, or fix parameters that the recordings hardly show.".into(),
        "not_identifiable" => match found.estimates.iter().find(|e| !e.fixed && e.value.is_none()) {
            Some(first) => {
                text!("Fix one of them, as " [Fix = "{}=VALUE", first.name] ", or write the combination as one parameter.")
            }
            None => "Write the combination as one parameter.".into(),
        },
        "at_bound" => match found.estimates.iter().find(|e| e.at_bound.is_some()) {
            Some(first) => {
                text!("Widen its bounds, as " [Bounds = "{}=MIN:MAX", first.name] ", if other values are plausible.")
            }
            None => text!("Widen the " [Bounds] "."),
        },
        "filtered" => text!("Fit the recording without " [Rate] ", " [Decimate] " and " [Filter] "."),
        "few_samples" => "Record longer, or at a higher rate.".into(),
        _ => {
            let warning = found.warnings.iter().find(|warning| warning.code == code);
            let remedy = warning.and_then(|warning| warning.remedy.clone());
            remedy.unwrap_or_else(|| "Record longer, or at a higher rate.".into())
        }
    }
}
