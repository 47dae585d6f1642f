//! The main job: recordings in, R, L, K, B, J out, with how sure they are.
//!
//! A method finds a first optimum: Steiglitz–McBride, or a population search that minimizes the criterion over the
//! space, every generation evaluated at once. The polish refines it to the maximum-likelihood estimate. Both are held
//! against a search of the whole box.

mod channels;
mod characteristics;
mod checks;
mod costs;
mod device;
mod estimated;
mod extended;
mod feedforward;
mod figures;
mod fit;
mod friction;
mod general;
mod held;
mod input_test;
mod lockstep;
mod mechanical;
mod method;
mod outlook;
mod pace;
mod repeatability;
mod residuals;
mod search;
mod spec;
mod validate;
pub mod values;
mod verify;
mod warnings;

pub use crate::motor::Extension;
pub use characteristics::{
    Characteristic, Characteristics, Constants, Covariance, Named, characteristics, characteristics_by_current,
};
pub use costs::Costs;
pub use device::{DeviceSpec, OnLoss, PrecisionSpec};
pub use estimated::Estimated;
pub use extended::{Ladder, Rung, With};
pub use feedforward::{Regression, regression, regressions};
pub use fit::{Fitted, check, fit, fit_on, polished, search_space};
pub use held::{Between, between_samples, suspicions};
pub use input_test::{InputTest, Regressors, Residuals, input_test};
pub use lockstep::Lockstep;
pub use mechanical::needs_voltage;
pub use method::{Method, Polish};
pub use outlook::{Inspection, Outlook};
pub use pace::{AdapterPace, Pace, Paces, Work};
pub use repeatability::{Repeatability, repeatability};
pub use residuals::{ResidualTest, ResidualTests};
pub use spec::{Identification, IdentifySpec, Searched};
pub use validate::{HeldOut, Validation, validate};
pub use verify::{Status, Verification};
pub use warnings::{Place, Warning, record_warnings, warnings_of_records};

use crate::estimate::{Estimate, Refined, SmFailure, fit_problem, refine_on};
use crate::evaluate::{Problem, Scalar};
use crate::motor::{Axis, Space};
use crate::optimize::Progress;
use crate::record::Record;
use crate::setting::{Text, text};
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
    with_threads(spec.threads, || run(records, spec, observe))
}

/// Does `work` inside a pool of so many threads, `None` in that of the caller: its threads then need no waking between
/// one batch and the next.
///
/// # Errors
/// `Usage` when threads cannot be started, and those of `work`.
pub fn with_threads<T: Send>(threads: Option<usize>, work: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    let pool = threads.map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build()).transpose();
    let hint = || text!("Give fewer " [Threads] ".");
    let pool = pool.map_err(|e| Error::usage(format!("threads cannot be started: {e}"), hint()))?;
    match pool {
        Some(pool) => pool.install(work),
        None => rayon::scope(|_| work()),
    }
}

fn run(
    records: &[Record],
    spec: &IdentifySpec,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Identification> {
    let stand = channels::stand_in(records, spec)?;
    if stand.is_some() || general::is_extended(spec) {
        return general::run(records, spec, stand, observe);
    }
    let mut warnings = warnings::warnings_of(records, spec);
    let started = Instant::now();
    let problem = Problem::new(records, spec.model, spec.space.clone(), spec.criterion)?;
    checks::before(records, spec, &problem)?;
    let plain = fit_problem(records, &spec.space, spec.model)?;
    let estimate = steiglitz_mcbride(records, spec, &plain)?;
    let mut attempt = attempt(records, spec, (&estimate, &plain), observe)?;
    if spec.method == Method::Auto && estimate.is_ok() && attempt.is_poor(records)? {
        // An estimate that fits nothing is none: a search may know better.
        let other = self::attempt(records, spec, (&Err(SmFailure::PoorFit), &plain), observe)?;
        if other.refined.weighted(&attempt.refined.sigmas) < attempt.refined.weighted(&attempt.refined.sigmas) {
            attempt = other;
        }
    }
    let dropped = general::drop_unknown(records, spec, &mut attempt, &[])?;
    let verification = attempt.verified(records, spec, estimate.as_ref().ok())?;
    warnings.append(&mut attempt.found.warnings);
    checks::after(records, spec, &attempt.space, &attempt.refined, &mut warnings)?;
    warnings.append(&mut friction::differs(records, spec, &plain, &attempt));
    warnings.extend(dropped.iter().copied().map(general::not_told));
    let mut result = Identification { verification, unidentified: dropped, ..assemble(records, spec, attempt)? };
    checks::fit(records, spec, result.fit_percent)?;
    warnings.extend(warnings::of_result(&result, &estimate));
    warnings.extend(held::of_result(records, spec, &result));
    result.warnings = warnings;
    complete(records, spec, &mut result)?;
    result.seconds = started.elapsed().as_secs_f64();
    Ok(result)
}

/// What is said of a result whatever the motor: its warnings, regressions beside it, and how recordings repeat.
fn complete(records: &[Record], spec: &IdentifySpec, result: &mut Identification) -> Result<()> {
    let told = residuals::of_result(records, result).into_iter().chain(held::coarse(records, result));
    let told: Vec<Warning> = told.chain(warnings::long_dead_time(result)).collect();
    result.warnings.extend(told);
    result.regressions = regressions(records, Characteristics::of(result).map(|c| c.time_constant.value));
    result.repeatability = repeatability(&records.iter().collect::<Vec<_>>(), spec.model)?;
    Ok(())
}

/// A first optimum with its refinement.
struct Attempt {
    found: Found,
    /// The problem that was searched.
    problem: Arc<Problem>,
    refined: Refined,
    /// The space that it was refined in.
    space: Space,
}

impl Attempt {
    /// The verdict. Under `auto` what is better than it is taken instead: what was asked for is the best there is, wherever
    /// it was found.
    fn verified(
        &mut self,
        records: &[Record],
        spec: &IdentifySpec,
        estimate: Option<&Estimate>,
    ) -> Result<Verification> {
        let claim = Claim {
            records,
            space: &self.space,
            model: spec.model,
            refined: &self.refined,
            searched: &self.found.values,
            unpolished: spec.polish == Polish::None,
            is_judged: spec.method.is_search() || spec.polish == Polish::None,
            estimate,
        };
        let Verified { mut verification, better } = verify(&claim);
        if let (Method::Auto, Polish::LevenbergMarquardt, Some(better)) = (spec.method, spec.polish, better) {
            let plain = fit_problem(records, &self.space, spec.model)?;
            (self.refined, self.space) = refine_widening(&plain, spec, &self.space, &better.values)?;
            (verification.status, verification.cost_gap) = (Status::Agrees, Some(0.0));
        }
        Ok(verification)
    }

    /// Whether it stands at a bound, or its simulation explains less than half of what some channel does.
    fn is_poor(&self, records: &[Record]) -> Result<bool> {
        let problem = Problem::new(records, *self.problem.model(), self.space.clone(), *self.problem.criterion())?;
        let problem = problem.starting_from(&self.refined.initial);
        let (fit, _) = figures::of(records, &problem, &self.refined.values);
        // An extension that does nothing is no sign of a wrong optimum.
        let sides = self.space.free().iter().zip(&self.refined.at_bound);
        let stuck = sides.filter(|(axis, _)| !axis.parameter.is_extension()).any(|(_, side)| side.is_some());
        Ok(stuck || fit.iter().flatten().any(|percent| *percent < 50.0))
    }
}

fn attempt(
    records: &[Record],
    spec: &IdentifySpec,
    (estimate, plain): (&std::result::Result<Estimate, SmFailure>, &Problem),
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Attempt> {
    let space = match estimate {
        Ok(estimate) => around(spec, estimate)?,
        Err(_) => spec.space.clone(),
    };
    let problem = Arc::new(Problem::new(records, spec.model, space, spec.criterion)?);
    let found = first(spec, &problem, estimate, observe)?;
    let (refined, space) = refine_widening(plain, spec, problem.space(), &found.values)?;
    Ok(Attempt { found, problem, refined, space })
}

/// The verdict on parameters from elsewhere (one value per free axis of the spec's space), as if a search had found
/// them.
///
/// # Errors
/// As [`identify_with`].
pub fn verify_at(records: &[Record], spec: &IdentifySpec, values: &[f64]) -> Result<Verification> {
    let plain = fit_problem(records, &spec.space, spec.model)?;
    let refined = refine_on(&plain, values, None)?;
    let estimate = steiglitz_mcbride(records, spec, &plain)?;
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

/// Times that the bounds that nobody gave are widened where the refinement ends at them.
const WIDENINGS: usize = 4;

/// The refinement from some values, and the space that it was refined in. `plain` is the problem of a fit.
fn refine_widening(plain: &Problem, spec: &IdentifySpec, space: &Space, values: &[f64]) -> Result<(Refined, Space)> {
    let mut space = space.clone();
    let mut refined = refine_on(&plain.with_space(space.clone()), values, None)?;
    let widens = spec.polish == Polish::LevenbergMarquardt && !spec.method.is_search();
    for _ in 0..if widens { WIDENINGS } else { 0 } {
        let wider = |(axis, side): (&Axis, &Option<&str>)| match side {
            Some("min") if spec.auto_bounds.contains(&axis.parameter) => Axis { min: 0.1 * axis.min, ..*axis },
            Some(_) if spec.auto_bounds.contains(&axis.parameter) => Axis { max: 10.0 * axis.max, ..*axis },
            _ => *axis,
        };
        let free: Vec<Axis> = space.free().iter().zip(&refined.at_bound).map(wider).collect();
        if free == space.free() {
            break;
        }
        space = Space::new(free, space.fixed().to_vec())?;
        refined = refine_on(&plain.with_space(space.clone()), &refined.values, None)?;
    }
    Ok((refined, space))
}

fn assemble(records: &[Record], spec: &IdentifySpec, attempt: Attempt) -> Result<Identification> {
    let Attempt { found, problem, refined, space } = attempt;
    let searched = Searched {
        method: found.method,
        is_fallback: spec.method == Method::Auto && !matches!(found.method, "sm" | "grid"),
        parameters: problem.parameters(&found.values, 0),
        cost: Scalar::cost(&problem, &found.values),
    };
    let polished = spec.polish == Polish::LevenbergMarquardt;
    let values = if polished { &refined.values } else { &found.values };
    let problem = Problem::new(records, spec.model, space.clone(), spec.criterion)?;
    let problem = if polished { problem.starting_from(&refined.initial) } else { problem };
    let (fit_percent, residual) = figures::of(records, &problem, values);
    Ok(Identification {
        input: problem.input(),
        parameters: problem.parameters(values, 0),
        values: values.clone(),
        unidentified: Vec::new(),
        ladder: None,
        cost: Scalar::cost(&problem, values),
        searched,
        space,
        initial: problem.signals().iter().map(|s| s.initial()).collect(),
        fit_percent,
        residual_tests: if polished { residuals::tests(records, &problem, values, &[]) } else { Vec::new() },
        residual_sigma: if polished { refined.sigma } else { residual },
        converged: !polished || refined.converged,
        uncertainty: polished.then_some(refined.uncertainty),
        verification: Verification::none(),
        warnings: Vec::new(),
        stop: found.stop,
        evaluations: found.evaluations,
        history: found.history,
        device_kind: found.device_kind,
        device: found.device,
        precision: found.precision,
        cost_difference: found.cost_difference,
        validation: None,
        regressions: Vec::new(),
        repeatability: None,
        seconds: 0.0,
    })
}

fn not_identified(message: impl Into<Text>, remedy: impl Into<Text>) -> Error {
    Error::new(ErrorKind::NotIdentified, message, remedy)
}
