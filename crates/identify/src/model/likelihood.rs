//! Profile likelihoods of the parameters of a model.

use super::pipeline::{ModelProgress, identify_model};
use super::result::ModelIdentification;
use super::spec::ModelSpec;
use crate::likelihood::{LikelihoodProfile, Profiled, check_polished, profiles};
use motorfit_core::Result;
use motorfit_core::setting::{Text, text};
use motorfit_estimate::Refined;
use motorfit_estimate::model::refine_model;
use motorfit_evaluate::model::{ModelAxis, ModelProblem, ModelRecording, ModelSettings};
use motorfit_model::Model;
use motorfit_optimize::Stop;
use std::ops::ControlFlow;

/// The problem of a fit with the initial states at the optimum.
struct Own<'a> {
    problem: &'a ModelProblem,
    initial: &'a [Vec<f64>],
}

/// Half of the range in which a parameter of one recording is held, relative to its value.
const HELD: f64 = 1e-12;

impl Profiled for Own<'_> {
    fn named(&self, place: usize) -> [String; 3] {
        let (model, space) = (self.problem.model(), self.problem.space());
        let of = &model.parameters()[space.free[place].parameter];
        [space.names(model).swap_remove(place), of.description.clone(), of.unit.text.clone()]
    }

    fn bounds(&self, place: usize) -> [f64; 2] {
        let ModelAxis { min, max, .. } = self.problem.space().free[place];
        [min, max]
    }

    fn rest(&self, place: usize, values: &[f64]) -> Vec<f64> {
        let mut rest = values.to_vec();
        if self.problem.space().free[place].recording.is_none() {
            rest.remove(place);
        }
        rest
    }

    fn search() -> Text {
        text!("Search with another " [Seed] ", or from values of your own, as " [Start = "NAME=VALUE"] ".")
    }

    fn fixed(&self, place: usize, value: f64, rest: &[f64], sigma: &[Vec<f64>]) -> Result<Refined> {
        let mut space = self.problem.space().clone();
        let axis = space.free[place].clone();
        let mut start = rest.to_vec();
        if axis.recording.is_none() {
            space.free.remove(place);
            space.fixed[axis.parameter] = Some(value);
        } else {
            // A space fixes a parameter of all recordings only.
            let margin = HELD * value.abs().max(f64::MIN_POSITIVE.sqrt());
            space.free[place] = ModelAxis { min: value - margin, max: value + margin, is_logarithmic: false, ..axis };
            start[place] = value;
        }
        refine_model(&self.problem.with_space(space)?, &start, self.initial, Some(sigma))
    }
}

/// Identifies the parameters of a model and computes the profile likelihood of each free one. A warning of the result says where a profile
/// found a lower sum of squares than that of the optimum. Where `observe` ends the search there are no profiles.
///
/// # Errors
/// Propagates the errors of [`identify_model`], and returns `Usage` without a refinement, which has no likelihood.
pub fn model_likelihood_profiles(
    model: &Model,
    recordings: &[ModelRecording],
    spec: &ModelSpec,
    observe: &mut dyn FnMut(ModelProgress) -> ControlFlow<()>,
) -> Result<(ModelIdentification, Vec<LikelihoodProfile>)> {
    check_polished(spec.is_polished)?;
    let mut found = identify_model(model, recordings, spec, observe)?;
    if found.stop == Stop::Interrupted {
        return Ok((found, Vec::new()));
    }
    let method = Some((found.method.method, found.method.substeps));
    let settings = ModelSettings { method, ..spec.settings() };
    let problem = ModelProblem::new(&found.machine.model, found.space.clone(), recordings.to_vec(), settings)?;
    let initial: Vec<Vec<f64>> = found.fits.iter().map(|fit| fit.initial.clone()).collect();
    let refined = refine_model(&problem, &found.values, &initial, None)?;
    let own = Own { problem: &problem, initial: &refined.initial };
    let profiles = profiles(&own, &refined, &mut found, None);
    Ok((found, profiles))
}
