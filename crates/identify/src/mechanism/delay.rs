//! Selection of a delay between the voltage and the measured velocity. It is negative if the voltage is logged after it acts.

use crate::ParameterEstimate;
use crate::model::{ModelIdentification, ModelProgress, ModelSpec, identify_model};
use motorfit_core::Result;
use motorfit_core::numeric::count;
use motorfit_core::text::significant;
use motorfit_evaluate::model::ModelRecording;
use motorfit_model::Model;
use motorfit_optimize::Stop;
use motorfit_record::warning::Warning;
use std::ops::ControlFlow;

/// Decrease of the Bayesian information criterion from which a gravity or a delay is assumed: very strong evidence (Kass and
/// Raftery, 1995).
pub const BIC_MIN: f64 = 10.0;

/// Number of periods by which the voltage is taken earlier where it may have been logged late.
const PERIODS: f64 = 2.0;

/// A result with or without a delay.
pub(super) struct Selected {
    pub found: ModelIdentification,
    /// Settings of the fit.
    pub spec: ModelSpec,
    /// Recordings of the fit; the voltage is a period earlier if the delay is negative.
    pub recordings: Vec<ModelRecording>,
    /// Decrease of the Bayesian information criterion by the delay.
    pub gain: f64,
}

/// Identifies a mechanism without a delay, with one, and with one of a voltage that was logged a period late, and selects by the Bayesian
/// information criterion.
pub(super) fn with_delay(
    model: &Model,
    recordings: Vec<ModelRecording>,
    (settings, period): (&ModelSpec, f64),
    observe: &mut dyn FnMut(ModelProgress) -> ControlFlow<()>,
) -> Result<Selected> {
    let spec = ModelSpec { fixed: vec![("td".to_owned(), 0.0)], ..settings.clone() };
    let found = identify_model(model, &recordings, &spec, observe)?;
    let mut best = Selected { found, spec, recordings, gain: 0.0 };
    if best.found.stop == Stop::Interrupted {
        return Ok(best);
    }
    let delayed = identify_model(model, &best.recordings, settings, observe)?;
    let (stop, seconds) = (delayed.stop, best.found.seconds + delayed.seconds);
    let evaluations = best.found.evaluations + delayed.evaluations;
    best.gain = gain(&best.found, &delayed, &best.recordings);
    if best.gain > BIC_MIN {
        (best.found, best.spec) = (delayed, settings.clone());
    }
    (best.found.stop, best.found.seconds, best.found.evaluations) = (stop, seconds, evaluations);
    let delay = best.found.estimates.iter().find(|of| of.name == "td").and_then(|of| of.value);
    if stop == Stop::Interrupted || delay.is_some_and(|delay| delay > period) {
        return Ok(best);
    }
    // Robots that read their sensors before they set the voltage log that of the period before. With two periods the delay is not at
    // its bound.
    let lead = PERIODS * period;
    let earlier: Vec<ModelRecording> =
        best.recordings.iter().map(|of| with_earlier_input(of, [lead, 0.5 * period])).collect();
    let mut advanced = identify_model(model, &earlier, settings, observe)?;
    let more = gain(&best.found, &advanced, &earlier);
    let (seconds, evaluations) = (seconds + advanced.seconds, evaluations + advanced.evaluations);
    let is_found = |of: &ParameterEstimate| of.name == "td" && of.std_error.is_some() && of.at_bound.is_none();
    let has_delay = advanced.estimates.iter().any(is_found);
    if more > BIC_MIN && has_delay && advanced.stop != Stop::Interrupted {
        correct_delay(&mut advanced, lead);
        best =
            Selected { found: advanced, spec: settings.clone(), recordings: earlier, gain: best.gain.max(0.0) + more };
    }
    (best.found.seconds, best.found.evaluations) = (seconds, evaluations);
    Ok(best)
}

/// Returns the decrease of the Bayesian information criterion from one result to another with one parameter more.
fn gain(before: &ModelIdentification, after: &ModelIdentification, recordings: &[ModelRecording]) -> f64 {
    let independent = |output: usize| {
        let one = |of: &ModelRecording| count(of.count(output)) * of.effective_sample_ratio;
        recordings.iter().map(one).sum::<f64>()
    };
    let of = |found: &ModelIdentification| {
        let one = |(output, sigma): (usize, &Option<f64>)| Some(2.0 * independent(output) * (*sigma)?.max(1e-300).ln());
        found.residual_sigma.iter().enumerate().filter_map(one).sum::<f64>()
    };
    of(before) - of(after) - independent(0).max(1.0).ln()
}

/// Returns a recording with its first input earlier by a time \[s\]; `slack` absorbs the jitter of the clock.
fn with_earlier_input(recording: &ModelRecording, [by_s, slack]: [f64; 2]) -> ModelRecording {
    let mut earlier = recording.clone();
    let (time, mut at) = (&recording.time_s, 0);
    let (Some(input), Some(from)) = (earlier.inputs.first_mut(), recording.inputs.first()) else { return earlier };
    for (value, now) in input.iter_mut().zip(time) {
        while time.get(at + 1).is_some_and(|next| *next < now + by_s + slack) {
            at += 1;
        }
        *value = from[at];
    }
    earlier
}

/// Subtracts the time by which the voltage was taken earlier from the delay of a result, and warns if the delay is negative.
fn correct_delay(found: &mut ModelIdentification, by_s: f64) {
    let Some(delay) = found.estimates.iter_mut().find(|estimate| estimate.name == "td") else { return };
    delay.value = delay.value.map(|value| value - by_s);
    delay.ci95 = delay.ci95.map(|ci| ci.map(|end| end - by_s));
    let Some(late) = delay.value.filter(|value| *value < 0.0).map(|value| significant(-1e3 * value, 3)) else { return };
    let message = format!("the voltage is logged {late} ms after it acts; the fit corrects for this");
    let remedy = "Log the voltage that is set in the same period as the velocity that is read.";
    found.warnings.push(Warning { remedy: Some(remedy.into()), ..Warning::new("late_voltage", message) });
}
