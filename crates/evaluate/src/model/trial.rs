//! Problems whose integration method is chosen and tried.

use super::method::{ModelMethod, SUBSTEPS_MAX, StepChange};
use super::problem::{ModelProblem, ModelSettings};
use super::recording::ModelRecording;
use super::space::{ModelAxis, ModelSpace};
use super::stiffness::STIFFNESS_MAX;
use motorfit_core::candidates::Candidates;
use motorfit_core::numeric::{order_statistic, rms, standard_deviation, whole};
use motorfit_core::{Error, Result};
use motorfit_model::{IntegrationMethod, Model};
use rand::{RngExt as _, SeedableRng as _};

/// Numbers of random candidates and of those among them whose trajectories are compared.
const NEAR: (usize, usize) = (512, 12);
/// Samples of the recording on which methods are tried.
const SAMPLES_TRIED: usize = 2000;
/// Largest median, and largest 80 % quantile, of the error of a trajectory relative to the deviation of the signal.
const ERROR_MEDIAN: f64 = 3e-4;
const ERROR_MOST: f64 = 3e-3;
/// Factor of these errors for friction that sticks: the moments of rest depend on the steps however short they are.
const STICKING: f64 = 10.0;
/// Largest numbers of substeps that are tried; the refinement takes more where they matter.
const SUBSTEPS_TRIED: usize = 16;
const SUBSTEPS_STICKING: usize = 4;

impl ModelProblem {
    /// Makes the problem of a model on recordings.
    ///
    /// # Errors
    /// Returns `Usage` if there are no recordings or no free parameters, `Data` if no output varies, a signal has another length than the
    /// time, or the model is too large.
    pub fn new(
        model: &Model,
        space: ModelSpace,
        recordings: Vec<ModelRecording>,
        settings: ModelSettings,
    ) -> Result<Self> {
        if recordings.is_empty() {
            return Err(Error::usage("there are no recordings", "Give at least one recording."));
        }
        for recording in &recordings {
            check(model, recording)?;
        }
        check_space(model, &space, recordings.len())?;
        let guess = ModelMethod::of(model, &space, &recordings);
        let method = match settings.method {
            Some((method, substeps)) => ModelMethod { method, substeps, ..guess },
            None => tried(guess, model, (&space, &recordings), settings)?,
        };
        let problem = Self::with_method(model, space, recordings, (settings, method))?;
        if problem.counted() == 0 {
            return Err(Error::data("no measured output varies", "Record while the inputs change."));
        }
        Ok(problem)
    }

    /// Returns the problem with another search space and the same steps.
    ///
    /// # Errors
    /// Returns `Usage` if the space does not suit the model.
    pub fn with_space(&self, space: ModelSpace) -> Result<Self> {
        check_space(self.model(), &space, self.recordings())?;
        Ok(Self { space, ..self.clone().renumbered() })
    }

    /// Returns the problem with another number of substeps.
    ///
    /// # Errors
    /// Returns `Data` if the steps become too large for a program.
    pub fn with_substeps(&self, substeps: usize) -> Result<Self> {
        let method = ModelMethod { substeps: substeps.clamp(1, SUBSTEPS_MAX), ..*self.method() };
        let recordings = (0..self.recordings()).map(|n| self.recording(n).clone()).collect();
        Self::with_method(self.model(), self.space().clone(), recordings, (self.settings, method))
    }

    /// Returns the problem on some of its recordings, evenly spread, with about as many samples as given; `None` if it has no more, or a
    /// parameter belongs to one recording.
    #[doc(hidden)]
    pub fn with_fewer_samples(&self, samples: usize) -> Result<Option<Self>> {
        let all: usize = (0..self.recordings()).map(|n| self.recording(n).len()).sum();
        let stride = all.div_ceil(samples.max(1));
        if stride <= 1 || self.recordings() == 1 || self.space.free.iter().any(|axis| axis.recording.is_some()) {
            return Ok(None);
        }
        let recordings: Vec<ModelRecording> =
            (0..self.recordings()).step_by(stride).map(|n| self.recording(n).clone()).collect();
        let part = Self::with_method(self.model(), self.space().clone(), recordings, (self.settings, self.method))?;
        // The recordings left out may be those in which an output varies.
        Ok(Some(part).filter(|part| part.counted() > 0))
    }

    /// Returns the problem with its steps marked as too long, or short enough, for the accuracy of the estimates, which changed by so much
    /// in the last halving.
    #[must_use]
    pub fn with_rough_steps(mut self, is_rough: bool, change: Option<StepChange>) -> Self {
        (self.method.is_rough, self.method.change) = (is_rough, change);
        self
    }
}

/// Returns the method with as many substeps as it needs for accuracy: trajectories of candidates that are near the measured signals
/// are compared with those of half the step.
fn tried(
    guess: ModelMethod,
    model: &Model,
    (space, recordings): (&ModelSpace, &[ModelRecording]),
    settings: ModelSettings,
) -> Result<ModelMethod> {
    if guess.is_exact() {
        return Ok(guess);
    }
    let part: Vec<ModelRecording> = recordings.iter().take(1).map(|of| of.first(SAMPLES_TRIED)).collect();
    let problem =
        |method: ModelMethod| ModelProblem::with_method(model, space.clone(), part.clone(), (settings, method));
    let mut tries = vec![guess];
    let most = if model.reactions() > 0 { SUBSTEPS_STICKING } else { SUBSTEPS_TRIED };
    // Instants of sampled laws remain at substeps.
    let unit = if model.laws.is_empty() { 1 } else { guess.substeps };
    for substeps in [2, 4, 8, 16]
        .map(|substeps| substeps * unit)
        .into_iter()
        .filter(|substeps| *substeps > guess.substeps && *substeps <= most)
    {
        tries.push(ModelMethod { substeps, ..guess });
    }
    let explicit = whole((guess.stiffness.per_step / STIFFNESS_MAX).ceil().min(1e6)).max(1);
    if guess.method == IntegrationMethod::Exponential && !guess.stiffness.is_affine && explicit <= SUBSTEPS_MAX {
        tries.push(ModelMethod { method: IntegrationMethod::RungeKutta, substeps: explicit, ..guess });
    }
    for method in &tries {
        let own = problem(*method)?;
        let Some(candidates) = near(&own)? else { continue };
        let finer = problem(ModelMethod { substeps: 2 * method.substeps, ..*method })?;
        if is_accurate(&own, &finer, &candidates) {
            return Ok(*method);
        }
    }
    Ok(ModelMethod { is_rough: true, ..guess })
}

/// Returns candidates in the bounds whose trajectories are nearest to the measured signals; `None` if all diverge.
fn near(problem: &ModelProblem) -> Result<Option<Vec<Vec<f64>>>> {
    let axes = &problem.space.free;
    if axes.is_empty() {
        let diverges =
            problem.simulate(&[], 0, problem.open_initial(0)).outputs.iter().flatten().any(|v| !v.is_finite());
        return Ok((!diverges).then(|| vec![Vec::new()]));
    }
    let mut numbers = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(2);
    let values: Vec<f64> = (0..NEAR.0 * axes.len()).map(|n| axes[n % axes.len()].at(numbers.random::<f64>())).collect();
    let mut costs = vec![0.0; NEAR.0];
    problem.costs(Candidates::new(&values, axes.len()), &mut costs)?;
    let mut order: Vec<usize> = (0..NEAR.0).filter(|n| costs[*n].is_finite()).collect();
    order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
    let of = |n: usize| values[n * axes.len()..(n + 1) * axes.len()].to_vec();
    Ok((!order.is_empty()).then(|| order.into_iter().take(NEAR.1).map(of).collect()))
}

/// Returns true if the trajectories of most candidates are those of half the step.
fn is_accurate(own: &ModelProblem, finer: &ModelProblem, candidates: &[Vec<f64>]) -> bool {
    let mut errors: Vec<f64> = Vec::new();
    for candidate in candidates {
        let [a, b] = [own, finer].map(|problem| problem.simulate(candidate, 0, problem.open_initial(0)).outputs);
        for (output, (a, b)) in a.iter().zip(&b).enumerate() {
            let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
            let measured = own.recording(0).counted(output).unwrap_or_else(|| b.clone());
            let size = standard_deviation(&measured).max(standard_deviation(b));
            let error = rms(&difference) / size;
            errors.push(if error.is_nan() { if size > 0.0 { f64::INFINITY } else { 0.0 } } else { error });
        }
    }
    let factor = if own.model().reactions() > 0 { STICKING } else { 1.0 };
    order_statistic(&mut errors, 0.5) < factor * ERROR_MEDIAN && order_statistic(&mut errors, 0.8) < factor * ERROR_MOST
}

/// Checks that a space gives every parameter of a model a value on every recording.
fn check_space(model: &Model, space: &ModelSpace, recordings: usize) -> Result<()> {
    let parameters = model.parameters().len();
    let fits = |axis: &ModelAxis| {
        let is_ordered = axis.min < axis.max && axis.min.is_finite() && axis.max.is_finite();
        let is_range = is_ordered && (axis.max - axis.min).is_finite() && (!axis.is_logarithmic || axis.min > 0.0);
        is_range && axis.parameter < parameters && axis.recording.is_none_or(|of| of < recordings)
    };
    let wrong = |message: String| {
        let hint = "Make the space with the constructor of the model's space, which knows its parameters.";
        Err(Error::usage(message, hint))
    };
    if space.fixed.len() != parameters || !space.free.iter().all(fits) {
        return wrong("the search space does not fit the model".to_owned());
    }
    for recording in 0..recordings {
        let values = space.values(&space.free.iter().map(|axis| axis.at(0.5)).collect::<Vec<f64>>(), recording);
        if let Some(n) = values.iter().position(|value| !value.is_finite()) {
            return wrong(format!("{} has neither bounds nor a finite value", model.parameters()[n].name));
        }
    }
    Ok(())
}

/// Checks that all signals have the length of the time.
fn check(model: &Model, recording: &ModelRecording) -> Result<()> {
    let samples = recording.len();
    let fits = recording.inputs.len() == model.inputs.len()
        && recording.measured.len() == model.outputs.len()
        && recording.inputs.iter().chain(recording.measured.iter().flatten()).all(|signal| signal.len() == samples)
        && (recording.step_s.len() == 1 || recording.step_s.len() == samples)
        && (recording.counting.is_empty() || recording.counting.len() == recording.measured.len())
        && recording.counting.iter().all(|counting| counting.len() == samples);
    let is_finite = |signal: &Vec<f64>| signal.iter().all(|value| value.is_finite());
    let has_numbers = recording.inputs.iter().chain(recording.measured.iter().flatten()).all(is_finite)
        && recording.step_s.iter().all(|step| *step > 0.0 && step.is_finite());
    let ratio = recording.effective_sample_ratio;
    if samples >= 2 && fits && has_numbers && ratio > 0.0 && ratio <= 1.0 {
        return Ok(());
    }
    let message = "the signals of a recording do not fit the model";
    Err(Error::data(
        message,
        "Give every input and output one finite value per sample, at least two samples, and positive steps.",
    ))
}
