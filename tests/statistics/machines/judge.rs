//! The judgement of a model: machines are simulated, identified without options and compared with the truth.

use crate::machines::draw::{CHANGE, Clean, Machine, Numbers};
use motorfit::evaluate::model::ModelRecording;
use motorfit::identify::TrustLevel;
use motorfit::identify::Verification;
use motorfit::identify::model::{ModelIdentification, ModelSpec, identify_model};
use motorfit::model::{BuiltIn, Model};
use motorfit::numeric::count;
use std::ops::ControlFlow;
use std::time::Instant;

/// The estimate of a parameter, compared with the truth.
pub struct Compared {
    pub name: String,
    /// Relative error.
    pub error: Option<f64>,
    /// True if the 95 % interval contains the truth; `None` without an interval.
    pub is_covered: Option<bool>,
    /// Error in standard errors, for a logarithmic parameter that of the logarithm.
    pub deviations: Option<f64>,
}

/// The judgement of an identification.
pub struct Judged {
    pub machine: u64,
    /// True if neither the truth nor the optimum near it is better by more than [`TOLERANCE`].
    pub is_reached: bool,
    /// Twice the logarithm of the likelihood of the truth above that of the estimate: negative where the estimate is better.
    pub deviance: f64,
    /// Deviance of the optimum near the truth, where it was sought.
    pub near_truth: Option<f64>,
    pub parameters: Vec<Compared>,
    pub level: TrustLevel,
    pub reasons: Vec<&'static str>,
    /// Comparison with descents from other starts.
    pub verification: Verification,
    pub seconds: f64,
}

/// Largest loss of twice the logarithm of the likelihood for an optimum that counts as reached. With p parameters the optimum is better
/// than the truth by p on average.
pub const TOLERANCE: f64 = 0.5;

fn recording(model: &Model, machine: &Machine, measured: Vec<Vec<f64>>) -> ModelRecording {
    let samples = machine.inputs.len();
    ModelRecording {
        time_s: (0..samples).map(|n| count(n) * machine.period_s).collect(),
        step_s: vec![machine.period_s],
        inputs: (0..model.inputs().len()).map(|of| machine.inputs.iter().map(|row| row[of]).collect()).collect(),
        measured: measured.into_iter().map(Some).collect(),
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
    }
}

/// Returns bounds around the truth, from which a search ends in the optimum of the truth.
fn near(model: &Model, truth: &[f64]) -> Vec<(String, [f64; 2])> {
    let around = model.parameters().iter().zip(truth).map(|(of, truth)| {
        let linear = 0.045 * (of.max - of.min);
        let [min, max] = if of.is_logarithmic {
            [truth * (-0.15_f64).exp(), truth * 0.15_f64.exp()]
        } else {
            [truth - linear, truth + linear]
        };
        (of.name.clone(), [min.max(of.min), max.min(of.max)])
    });
    around.collect()
}

/// Returns the deviance of an estimate from the truth, whose residuals are the noise. The variance of each output is estimated.
fn deviance(found: &ModelIdentification, noise: &[Vec<f64>]) -> f64 {
    let of = |(sigma, noise): (&Option<f64>, &Vec<f64>)| {
        let variance = noise.iter().map(|value| value * value).sum::<f64>() / count(noise.len());
        count(noise.len()) * (sigma.unwrap().powi(2) / variance).ln()
    };
    found.residual_sigma.iter().zip(noise).map(of).sum()
}

fn compared(model: &Model, found: &ModelIdentification, truth: &[f64]) -> Vec<Compared> {
    let of = |(number, truth): (usize, &f64)| {
        let (parameter, estimate) = (&model.parameters()[number], &found.estimates[number]);
        assert_eq!(parameter.name, estimate.name);
        let deviations = estimate.value.zip(estimate.std_error).map(|(value, error)| {
            if parameter.is_logarithmic { (value / truth).ln() * value / error } else { (value - truth) / error }
        });
        Compared {
            name: estimate.name.clone(),
            error: estimate.value.map(|value| value / truth - 1.0),
            is_covered: estimate.ci95.map(|[low, high]| (low..=high).contains(truth)),
            deviations,
        }
    };
    truth.iter().enumerate().map(of).collect()
}

/// Simulates machine `number` of a model with noise, identifies it and compares the result with the truth.
pub fn judged(of: BuiltIn, draw: fn(&mut Numbers) -> Machine, number: u64) -> Judged {
    let model = of.model().unwrap();
    let mut numbers = Numbers::new(of.name(), number);
    let machine = draw(&mut numbers);
    let Clean { outputs, sigma, change, .. } = machine.simulated();
    assert!(change < CHANGE, "{} {number}: the integrator is off by {change} of the noise", of.name());
    let noise_of =
        |(signal, sigma): (&Vec<f64>, &f64)| -> Vec<f64> { signal.iter().map(|_| sigma * numbers.normal()).collect() };
    let noise: Vec<Vec<f64>> = outputs.iter().zip(&sigma).map(noise_of).collect();
    let measured =
        outputs.iter().zip(&noise).map(|(signal, noise)| signal.iter().zip(noise).map(|(a, b)| a + b).collect());
    let recordings = [recording(&model, &machine, measured.collect())];
    let run = |spec: &ModelSpec| identify_model(&model, &recordings, spec, &mut |_| ControlFlow::Continue(())).unwrap();
    let begin = Instant::now();
    let found = run(&ModelSpec::default());
    let seconds = begin.elapsed().as_secs_f64();
    let own = deviance(&found, &noise);
    let parameters = compared(&model, &found, &machine.truth);
    // An estimate that is better than the truth may still be another optimum than the best.
    let is_doubtful = own > TOLERANCE || parameters.iter().any(|of| of.deviations.is_none_or(|z| z.abs() > 5.0));
    let near_truth = is_doubtful.then(|| {
        let spec = ModelSpec { bounds: near(&model, &machine.truth), ..ModelSpec::default() };
        deviance(&run(&spec), &noise)
    });
    Judged {
        machine: number,
        is_reached: own <= near_truth.unwrap_or(0.0).min(0.0) + TOLERANCE,
        deviance: own,
        near_truth,
        parameters,
        level: found.trust.level,
        reasons: found.trust.reasons.iter().map(|reason| reason.code).collect(),
        verification: found.verification,
        seconds,
    }
}

impl std::fmt::Display for Judged {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let covered = self.parameters.iter().filter(|of| of.is_covered == Some(true)).count();
        let reached = if self.is_reached { "reached" } else { "missed" };
        write!(f, "{:3}: {reached}, deviance {:.2}", self.machine, self.deviance)?;
        if let Some(near) = self.near_truth {
            write!(f, " (near the truth {near:.2})")?;
        }
        write!(f, ", {covered} of {} covered, {}", self.parameters.len(), self.level.name())?;
        if !self.reasons.is_empty() {
            write!(f, " ({})", self.reasons.join(", "))?;
        }
        let Verification { status, starts, arrivals, .. } = &self.verification;
        write!(f, ", {} with {arrivals} of {starts} starts, {:.1} s", status.name(), self.seconds)?;
        for of in &self.parameters {
            match of.deviations {
                Some(z) if z.abs() > 2.5 => write!(f, ", {} off by {z:.1} σ", of.name)?,
                None => write!(f, ", {} without an error", of.name)?,
                Some(_) => {}
            }
        }
        Ok(())
    }
}
