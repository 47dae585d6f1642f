//! Fits of the models that the model selection compares.

use super::bic::{self, is_far};
use super::extension_bounds::extended_space;
use super::prepare::Prepared;
use super::refine::refine_widening;
use super::start::Start;
use motorfit_core::{Error, ErrorKind, Result};
use motorfit_estimate::{best_start, delay_starts, global_reference, transferred, warm_start, warm_start_with_delays};
use motorfit_evaluate::Problem;
use motorfit_motor::{Axis, Extension, Parameter, Scope, Space};
use std::sync::Arc;

/// A fitted DC motor with extensions.
pub(super) type Fit = bic::Fit<Extension, Space>;

/// Relative decrease of the sum of squares from which another optimum counts as lower.
const LOWER: f64 = 1e-6;

/// Fits models to prepared recordings.
#[derive(Clone, Copy)]
pub(super) struct Models<'a> {
    pub prepared: &'a Prepared<'a>,
    pub start: &'a Start,
}

impl Models<'_> {
    /// Refines a model until convergence, from the start with the lowest sum of squares weighted by `sigma`. `base` is a space
    /// with the bounds of the motor's parameters.
    pub(super) fn thorough(
        &self,
        (base, sigma): (&Space, &[Vec<f64>]),
        with: &[Extension],
        starts: impl Fn(&Arc<Problem>) -> Result<Vec<Vec<f64>>>,
    ) -> Result<Fit> {
        let (problem, plain) = self.problems(base, with)?;
        let starts = starts(&problem)?;
        let rough = best_start(&plain, &starts, sigma);
        let values = rough.map(|refined| refined.values).or_else(|| starts.into_iter().next()).unwrap_or_default();
        self.refined(with, &plain, &values)
    }

    /// Refines a model until convergence and widens automatic bounds at which it ends.
    fn refined(&self, with: &[Extension], plain: &Problem, values: &[f64]) -> Result<Fit> {
        let (refined, space) = refine_widening(plain, &self.prepared.spec, plain.space(), values)?;
        Ok(Fit::new(with, space.clone(), &plain.with_space(space), refined))
    }

    /// Refines a rough fit until convergence.
    pub(super) fn finished(&self, rough: Fit) -> Fit {
        self.refined(&rough.with, &self.prepared.fitted(&rough.space), &rough.refined.values).unwrap_or(rough)
    }

    /// Refines a model in a few iterations under the weights of the smaller model `from`, starting from its optimum. If `with`
    /// adds a delay, the starts for delays are tried as well.
    pub(super) fn rough(&self, from: &Fit, with: &[Extension]) -> Result<Fit> {
        self.ended(from, with, true)
    }

    /// Refines a model in a few iterations, starting from the optimum of `from` only.
    pub(super) fn near(&self, from: &Fit, with: &[Extension]) -> Result<Fit> {
        self.ended(from, with, false)
    }

    /// Refines a model in a few iterations from the best of its starts.
    fn ended(&self, from: &Fit, with: &[Extension], with_delay_starts: bool) -> Result<Fit> {
        let (problem, plain) = self.problems(&from.space, with)?;
        let sigma = &from.refined.weights;
        let there = (&from.space, &from.refined.values[..]);
        let mut starts = vec![warm_start(&problem, there)?];
        starts.extend(warm_start_with_delays(&problem, there).transpose()?);
        if with_delay_starts && is_far(&self.prepared.fitted(&from.space), &from.refined) {
            starts.extend(delay_starts(&problem, &self.start.motors)?.into_iter().take(OWN_STARTS));
        }
        if with_delay_starts && with.iter().any(|e| e.is_delay_like() && !from.with.contains(e)) {
            starts.extend(
                delay_starts(&problem, &[from.space.parameters(&from.refined.values, 0).to_array()])?
                    .into_iter()
                    .take(DELAY_STARTS),
            );
        }
        let refined = best_start(&plain, &starts, sigma).ok_or_else(no_start)?;
        Ok(Fit::new(with, plain.space().clone(), &plain, refined))
    }

    /// Searches the complete box for a lower optimum if the residuals of a fit are far above the noise; `None` if there is
    /// none.
    pub(super) fn lower(&self, own: &Fit) -> Result<Option<Fit>> {
        let plain = self.prepared.fitted(&own.space);
        if !is_far(&plain, &own.refined) {
            return Ok(None);
        }
        let sigma = &own.refined.weights;
        let found = global_reference(&plain, sigma)?.refined;
        if found.weighted(sigma) >= own.refined.weighted(sigma) * (1.0 - LOWER) {
            return Ok(None);
        }
        self.refined(&own.with, &plain, &found.values).map(Some)
    }

    /// Returns the problem of the search and the problem of the fit.
    fn problems(&self, base: &Space, with: &[Extension]) -> Result<(Arc<Problem>, Problem)> {
        let Self { prepared, start } = *self;
        let motor = start.motors.first().copied().unwrap_or([1.0; 5]);
        let given = |p: Parameter| start.space.free().iter().any(|axis| axis.parameter == p);
        let own = base.free().iter().filter(|axis| given(axis.parameter)).copied().collect();
        let base = Space::new(own, start.space.fixed().to_vec())?;
        let space = extended_space(prepared.records, &prepared.spec, &base, (with, &motor))?;
        let plain = prepared.fitted(&space);
        Ok((prepared.searched(space), plain))
    }
}

/// Transfers the shared parameters of a fit to other recordings into the space of `problem`.
pub(super) fn shared(problem: &Arc<Problem>, from: &Fit) -> Vec<f64> {
    let shared = |(axis, value): (&Axis, &f64)| (axis.scope == Scope::Shared).then_some((*axis, *value));
    let (free, values): (Vec<Axis>, Vec<f64>) =
        from.space.free().iter().zip(&from.refined.values).filter_map(shared).unzip();
    match Space::new(free, Vec::new()) {
        Ok(space) => transferred(problem, (&space, &values)),
        Err(_) => transferred(problem, (&from.space, &from.refined.values)),
    }
}

fn no_start() -> Error {
    Error::new(
        ErrorKind::NotIdentified,
        "the refinement of this model fails from every start",
        "Name other extensions.",
    )
}

/// Number of starts from a model's own initial estimates, beside those from the optimum of a smaller model: where the residuals of that
/// are far above the noise, its optimum may lie in another basin.
const OWN_STARTS: usize = 2;
/// Number of starts for delays that are tried when an extension is added.
const DELAY_STARTS: usize = 2;
