//! The main job: recordings in, R, L, K, B, J out, with how sure they are.
//!
//! A method finds a first optimum: Steiglitz–McBride, or a population search that minimizes the criterion over the
//! space, every generation evaluated at once. The polish refines it to the maximum-likelihood estimate. Both are held
//! against a search of the whole box.

mod checks;
mod device;
mod figures;
mod method;
mod outlook;
mod search;
mod spec;
mod verify;
mod warnings;

pub use device::{DeviceSpec, PrecisionSpec};
pub use method::{Method, Polish};
pub use outlook::{Outlook, outlook};
pub use spec::{Identification, IdentifySpec, Searched};
pub use verify::{Status, Verification};
pub use warnings::{Warning, record_warnings};

use crate::estimate::{Estimate, RefineOptions, Refined, SmFailure, refine};
use crate::evaluate::{Problem, Scalar};
use crate::motor::{Axis, Space};
use crate::optimize::{Progress, Stop};
use crate::record::Record;
use crate::{Error, ErrorKind, Result};
use search::{Found, around, population, steiglitz_mcbride, taken};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;
use verify::{Claim, Verified, verify};

/// Identifies one motor from one or more recordings (several: one joint fit).
///
/// # Errors
/// As [`identify_with`].
pub fn identify(records: &[Record], spec: &IdentifySpec) -> Result<Identification> {
    identify_with(records, spec, &mut |_| ControlFlow::Continue(()))
}

/// Like [`identify`], watched: `observe` sees every generation and may end the search, whose best is then refined.
///
/// # Errors
/// `Usage` for a spec that cannot be; `NotIdentified` when a signal is constant, nothing drives the motor, nothing
/// counts in the criterion, there are fewer measured values than parameters, every candidate diverges, or the
/// recordings cannot tell a parameter that is asked for.
pub fn identify_with(
    records: &[Record],
    spec: &IdentifySpec,
    observe: &mut (dyn FnMut(&Progress) -> ControlFlow<()> + Send),
) -> Result<Identification> {
    let pool = spec.threads.map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build()).transpose();
    let pool = pool.map_err(|e| Error::usage(format!("threads cannot be started: {e}"), "Give fewer --threads."))?;
    // All of it runs inside the pool: its threads then need no waking between generations.
    match pool {
        Some(pool) => pool.install(|| run(records, spec, observe)),
        None => rayon::scope(|_| run(records, spec, observe)),
    }
}

fn run(
    records: &[Record],
    spec: &IdentifySpec,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Identification> {
    let started = Instant::now();
    let problem = Problem::new(records, spec.model, spec.space.clone(), spec.criterion)?;
    checks::before(records, spec, &problem)?;
    let estimate = steiglitz_mcbride(records, spec)?;
    let space = match &estimate {
        Ok(estimate) => around(spec, estimate)?,
        Err(_) => spec.space.clone(),
    };
    let problem = Arc::new(Problem::new(records, spec.model, space, spec.criterion)?);
    let mut found = first(spec, &problem, &estimate, observe)?;
    let mut warnings = warnings::warnings_of(records, spec);
    warnings.append(&mut found.warnings);
    let (refined, space) = refine_found(records, spec, problem.space(), &found, estimate.is_ok())?;
    let claim = Claim {
        records,
        space: &space,
        model: spec.model,
        refined: &refined,
        searched: &found.values,
        unpolished: spec.polish == Polish::None,
        is_judged: spec.method.is_search() || spec.polish == Polish::None,
        estimate: estimate.as_ref().ok(),
    };
    let Verified { mut verification, better } = verify(&claim);
    let mut refined = refined;
    if let (Method::Auto, Polish::LevenbergMarquardt, Some(better)) = (spec.method, spec.polish, better) {
        // What was asked for is the best there is, wherever it was found.
        let options = RefineOptions { model: spec.model, sigma: None };
        refined = refine(records, &space, &better.values, &options)?;
        (verification.status, verification.cost_gap) = (Status::Agrees, Some(0.0));
    }
    checks::after(records, spec, &space, &refined, &mut warnings)?;
    let result = assemble(records, &problem, spec, found, (refined, space));
    let mut result = Identification { verification, ..result };
    if spec.polish == Polish::LevenbergMarquardt && warnings::poor_fit(result.fit_percent).is_some() {
        checks::reversed_sign(records)?;
    }
    warnings.extend(warnings::of_result(&result, &estimate));
    result.warnings = warnings;
    result.seconds = started.elapsed().as_secs_f64();
    Ok(result)
}

/// The verdict on parameters from elsewhere (one value per free axis of the spec's space), as if a search had found
/// them.
///
/// # Errors
/// As [`identify_with`].
pub fn verify_at(records: &[Record], spec: &IdentifySpec, values: &[f64]) -> Result<Verification> {
    let options = RefineOptions { model: spec.model, sigma: None };
    let refined = refine(records, &spec.space, values, &options)?;
    let estimate = steiglitz_mcbride(records, spec)?;
    let claim = Claim {
        records,
        space: &spec.space,
        model: spec.model,
        refined: &refined,
        searched: values,
        unpolished: spec.polish == Polish::None,
        is_judged: true,
        estimate: estimate.as_ref().ok(),
    };
    Ok(verify(&claim).verification)
}

/// The first optimum, by the method that is asked for or that serves.
fn first(
    spec: &IdentifySpec,
    problem: &Arc<Problem>,
    estimate: &std::result::Result<Estimate, SmFailure>,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Found> {
    match (spec.method, estimate) {
        (Method::SteiglitzMcBride, Err(failure)) => Err((*failure).into()),
        (Method::Auto | Method::SteiglitzMcBride, Ok(estimate)) => taken(estimate, spec, problem),
        _ => population(problem, spec, observe),
    }
}

/// Times that a box without an estimate in its middle is widened where the refinement ends at its bound.
const WIDENINGS: usize = 6;

/// The refinement of what was found, and the space it was refined in.
fn refine_found(
    records: &[Record],
    spec: &IdentifySpec,
    space: &Space,
    found: &Found,
    has_estimate: bool,
) -> Result<(Refined, Space)> {
    let options = RefineOptions { model: spec.model, sigma: None };
    let mut space = space.clone();
    let mut refined = refine(records, &space, &found.values, &options)?;
    let widens = spec.method == Method::Auto && !has_estimate;
    for _ in 0..WIDENINGS {
        let is_stuck =
            |(axis, side): (&Axis, &Option<&str>)| side.is_some() && spec.auto_bounds.contains(&axis.parameter);
        if !widens || !space.free().iter().zip(&refined.at_bound).any(is_stuck) {
            break;
        }
        let wider = |(axis, side): (&Axis, &Option<&str>)| match side {
            Some("min") if is_stuck((axis, side)) => Axis { min: 0.1 * axis.min, ..*axis },
            Some(_) if is_stuck((axis, side)) => Axis { max: 10.0 * axis.max, ..*axis },
            _ => *axis,
        };
        let free = space.free().iter().zip(&refined.at_bound).map(wider).collect();
        space = Space::new(free, space.fixed().to_vec())?;
        refined = refine(records, &space, &refined.values, &options)?;
    }
    Ok((refined, space))
}

fn assemble(
    records: &[Record],
    problem: &Problem,
    spec: &IdentifySpec,
    found: Found,
    (refined, space): (Refined, Space),
) -> Identification {
    let searched = Searched {
        method: found.method,
        is_fallback: spec.method == Method::Auto && found.method != "sm",
        parameters: problem.parameters(&found.values, 0),
        cost: Scalar::cost(problem, &found.values),
    };
    let polished = spec.polish == Polish::LevenbergMarquardt;
    let values = if polished { &refined.values } else { &found.values };
    let problem = if polished { problem.clone().starting_from(&refined.initial) } else { problem.clone() };
    Identification {
        parameters: problem.parameters(values, 0),
        cost: Scalar::cost(&problem, values),
        searched,
        space,
        initial: problem.signals().iter().map(|s| s.initial()).collect(),
        fit_percent: figures::fit_percent(records, &problem, values),
        residual_sigma: refined.sigma,
        uncertainty: polished.then_some(refined.uncertainty),
        verification: Verification::none(),
        warnings: Vec::new(),
        stop: if found.stop == Stop::Converged && polished && !refined.converged {
            Stop::BudgetSpent
        } else {
            found.stop
        },
        evaluations: found.evaluations,
        history: found.history,
        device_kind: found.device_kind,
        device: found.device,
        precision: found.precision,
        cost_difference: found.cost_difference,
        seconds: 0.0,
    }
}

fn not_identified(message: impl Into<String>, remedy: impl Into<String>) -> Error {
    Error::new(ErrorKind::NotIdentified, message, remedy)
}
