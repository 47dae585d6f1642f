//! The job for all but the linear motor with both channels: extensions, missing channels, parameters that the recordings
//! do not tell.
//!
//! Motors near the right one come from Steiglitz–McBride at several lags, or from what a channel alone shows; extensions
//! from grids along their axes; the refinement of the best of these starts is the estimate.

use super::channels::{Stand, guess};
use super::extended::{Extension, With, best_start, climb, explained, extended_space, is_far, lagged, led};
use super::search::{Found, evaluated, population};
use super::spec::{Identification, IdentifySpec};
use super::verify::deviations;
use super::warnings::{self, Warning};
use super::{Attempt, Polish, assemble, checks, complete, friction, held, mechanical, refine_widening, residuals};
use crate::Result;
use crate::estimate::{Refined, SmFailure, fit_problem, global_reference};
use crate::evaluate::Problem;
use crate::motor::{Axis, Input, Parameter, Scope, Space};
use crate::optimize::Progress;
use crate::record::Record;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

/// Whether a spec asks for more than the linear motor.
pub(super) fn is_extended(spec: &IdentifySpec) -> bool {
    spec.with != With::default() || !spec.space.features().is_linear() || !spec.per_recording.is_empty()
}

pub(super) fn run(
    records: &[Record],
    spec: &IdentifySpec,
    stand: Option<Stand>,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Identification> {
    let mut warnings = warnings::warnings_of(records, spec);
    let started = Instant::now();
    let unknown = stand.as_ref().map_or_else(Vec::new, |stand| stand.unknown.clone());
    if let Some(stand) = &stand {
        warnings.retain(|warning| warning.code != stand.warning.code);
        warnings.insert(0, stand.warning.clone());
    }
    let spec = &IdentifySpec { space: stand.as_ref().map_or(&spec.space, |s| &s.space).clone(), ..spec.clone() };
    let asked = asked_space(records, spec)?;
    checks::before(records, spec, &Problem::new(records, spec.model, asked, spec.criterion)?)?;
    let (motors, space) = near(records, spec, stand.as_ref())?;
    let (with, ladder) = match &spec.with {
        With::These(list) => (list.clone(), None),
        With::Auto => climb(records, spec, &space, &motors).map(|(with, ladder)| (with, Some(ladder)))?,
    };
    let space = extended_space(records, spec, &space, (&with, &motors[0]))?;
    if spec.with != With::Auto {
        check_per_recording(spec, &space)?;
    }
    let mut attempt = attempt(records, spec, (&space, &motors), observe)?;
    let dropped = drop_unknown(records, spec, &mut attempt, &unknown)?;
    checks::after(records, spec, &attempt.space, &attempt.refined, &mut warnings)?;
    let verification = attempt.verified(records, spec, None)?;
    warnings.append(&mut attempt.found.warnings);
    let plain = fit_problem(records, &attempt.space, spec.model)?;
    warnings.append(&mut friction::differs(records, spec, &plain, &attempt));
    let mut result = Identification { verification, ladder, ..assemble(records, spec, attempt)? };
    let features = result.space.features();
    let stood = unknown.into_iter().filter(|p| !p.is_extension() || features.has(*p));
    result.unidentified = stood.chain(dropped.iter().copied()).collect();
    result.unidentified.sort_by_key(|p| *p as usize);
    result.unidentified.dedup();
    checks::fit(records, spec, result.fit_percent)?;
    warnings.extend(dropped.into_iter().map(not_told));
    warnings.extend(warnings::of_result(&result, &Err(SmFailure::PoorFit)));
    warnings.extend(held::of_current(records, spec, &result));
    warnings.extend(mechanical::input_noise(records, &result));
    result.warnings = warnings;
    complete(records, spec, &mut result)?;
    result.seconds = started.elapsed().as_secs_f64();
    Ok(result)
}

/// What will be free for sure: of a motor that is held as a whole, its extensions.
fn asked_space(records: &[Record], spec: &IdentifySpec) -> Result<Space> {
    match (&spec.with, held_motor(&spec.space)) {
        (With::These(list), Some(motor)) => extended_space(records, spec, &spec.space, (list, &motor)),
        (With::Auto, Some(_)) => {
            let message = "every parameter is held, and --with auto compares fits of the linear motor with others";
            Err(crate::Error::usage(message, "Name the extensions, as in --with load, or leave a parameter free."))
        }
        _ => Ok(spec.space.clone()),
    }
}

/// R, L, K, B and J, where all are held.
fn held_motor(space: &Space) -> Option<[f64; 5]> {
    let held = |p: Parameter| space.fixed().iter().find(|(of, ..)| *of == p).map(|(.., value)| *value);
    let [r, l, k, b, j] = Parameter::ALL.map(held);
    Some([r?, l?, k?, b?, j?])
}

/// What each recording is to have for itself must be free in the model.
fn check_per_recording(spec: &IdentifySpec, space: &Space) -> Result<()> {
    let free = |p: &Parameter| space.free().iter().any(|axis| axis.parameter == *p);
    let Some(parameter) = spec.per_recording.iter().find(|p| !free(p)) else { return Ok(()) };
    let symbol = parameter.symbol();
    let extension = Extension::ALL.into_iter().find(|e| e.parameters().contains(parameter));
    let is_held = space.fixed().iter().any(|(of, ..)| of == parameter);
    let (what, remedy) = match extension {
        _ if is_held => ("is held", format!("Leave {symbol} out of --per-recording, or do not hold it.")),
        Some(extension) => ("is not in the model", format!("Add --with {}, or leave {symbol} out.", extension.name())),
        None => ("is not in the model", format!("Leave {symbol} out of --per-recording.")),
    };
    Err(crate::Error::usage(format!("--per-recording: {symbol} {what}"), remedy))
}

/// The space of a search with the extensions of a spec.
pub(super) fn search_space(records: &[Record], spec: &IdentifySpec) -> Result<Space> {
    let With::These(list) = &spec.with else {
        let message = "--with auto chooses by fits, and there are none here";
        return Err(crate::Error::usage(message, "Name the extensions, as in --with coulomb,dead-time."));
    };
    let (motors, space) = near(records, spec, None)?;
    let space = extended_space(records, spec, &space, (list, &motors[0]))?;
    check_per_recording(spec, &space)?;
    Ok(space)
}

/// Motors near the right one, the likeliest first, and the space of the linear motor around them.
fn near(records: &[Record], spec: &IdentifySpec, stand: Option<&Stand>) -> Result<(Vec<[f64; 5]>, Space)> {
    if let Some(stand) = stand {
        return Ok((vec![stand.motor], stand.space.clone()));
    }
    if let Some(motor) = held_motor(&spec.space) {
        return Ok((vec![motor], spec.space.clone()));
    }
    let mut motors = lagged(records, spec);
    motors.extend(guess(records, spec));
    if motors.is_empty() {
        let linear = linear(&spec.space)?;
        let found = global_reference(records, &linear, spec.model, &deviations(records))?;
        motors.push(found.refined.parameters.to_array());
    }
    let around = |axis: &Axis| {
        let values = || motors.iter().filter_map(|motor| motor.get(axis.parameter as usize));
        if axis.parameter.is_extension() || !spec.auto_bounds.contains(&axis.parameter) {
            return *axis;
        }
        let [low, high] = [values().copied().fold(f64::INFINITY, f64::min), values().copied().fold(0.0, f64::max)];
        Axis { min: 0.1 * low, max: 10.0 * high, ..*axis }
    };
    let space = Space::new(spec.space.free().iter().map(around).collect(), spec.space.fixed().to_vec())?;
    Ok((motors, space))
}

/// A space without extensions.
fn linear(space: &Space) -> Result<Space> {
    let free = space.free().iter().filter(|axis| !axis.parameter.is_extension()).copied().collect();
    let fixed = space.fixed().iter().filter(|(parameter, _, _)| !parameter.is_extension()).copied().collect();
    Space::new(free, fixed)
}

/// The best of the starts, refined; a population search where that is asked for, or where they all fit badly.
fn attempt(
    records: &[Record],
    spec: &IdentifySpec,
    (space, motors): (&Space, &[[f64; 5]]),
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Attempt> {
    let problem = Arc::new(Problem::new(records, spec.model, space.clone(), spec.criterion)?);
    let plain = fit_problem(records, space, spec.model)?;
    let sigma = deviations(records);
    let mut searched = |starts: Vec<Vec<f64>>| -> Result<Attempt> {
        let found = population(&problem, spec, observe)?;
        // A search's best, and where it leads along each way to explain what is late.
        let own = std::iter::once(found.values.clone()).chain(led(&problem, &found.values)?);
        let starts: Vec<Vec<f64>> = own.chain(starts).collect();
        refined(spec, (&problem, &plain), found, (&starts, &sigma))
    };
    if spec.method.is_search() || spec.polish == Polish::None {
        return searched(Vec::new());
    }
    let starts = explained(&problem, motors)?;
    let found = evaluated(&problem, spec, starts.first().cloned().unwrap_or_default())?;
    let attempt = refined(spec, (&problem, &plain), found, (&starts, &sigma))?;
    let affordable = problem.active().saturating_mul(spec.population * spec.generations) <= AFFORDABLE;
    let doubtful = affordable && is_far(&problem, &attempt.refined);
    if !doubtful && !attempt.is_poor(records)? {
        return Ok(attempt);
    }
    let other = searched(starts)?;
    let better = other.refined.weighted(&sigma) < attempt.refined.weighted(&sigma);
    Ok(if better { other } else { attempt })
}

/// Candidate-steps that a search may take where it is not asked for: about a second.
const AFFORDABLE: usize = 1_000_000_000;
/// What was found, with the refinement of the best start.
fn refined(
    spec: &IdentifySpec,
    (problem, plain): (&Arc<Problem>, &Problem),
    found: Found,
    (starts, sigma): (&[Vec<f64>], &[[f64; 2]]),
) -> Result<Attempt> {
    let rough = best_start(plain, starts, sigma);
    let values = rough.map_or_else(|| found.values.clone(), |rough| rough.values);
    let (refined, space) = refine_widening(plain, spec, problem.space(), &values)?;
    Ok(Attempt { found, problem: problem.clone(), refined, space })
}

/// Parameters that may be found to be unknown, one after the other.
const DROPPED: usize = 6;

/// Holds parameters of which the recordings tell nothing, each by itself, where they are: what else there is stays.
/// What a motor that stands for others leaves open, `stood`, is unknown anyway.
pub(super) fn drop_unknown(
    records: &[Record],
    spec: &IdentifySpec,
    attempt: &mut Attempt,
    stood: &[Parameter],
) -> Result<Vec<Parameter>> {
    let mut dropped = Vec::new();
    while dropped.len() < DROPPED && spec.polish == Polish::LevenbergMarquardt {
        let Some(parameter) = checks::unknown_alone(spec, &attempt.space, &attempt.refined) else { break };
        let shared = |axis: &Axis| axis.parameter == parameter && axis.scope == Scope::Shared;
        let Some(place) = attempt.space.free().iter().position(shared) else { break };
        if attempt.space.free().len() == 1 {
            break;
        }
        let value = attempt.refined.values[place];
        let (refined, space) = holding(records, spec, attempt, (place, value))?;
        // One of the motor is unknown by itself only if it may as well be elsewhere. At a bound that is said of an
        // inductance alone that is too small for the clock to show, and of friction that a current shows nothing of.
        let at_bound = attempt.refined.at_bound[place].is_some();
        let elsewhere = if at_bound { ELSEWHERE } else { std::f64::consts::E } * value;
        let small = match parameter {
            Parameter::L => elsewhere < refined.parameters.r * shortest(records),
            // Without a voltage the inertia is told all the same.
            Parameter::B => attempt.problem.input() == Input::Current && attempt.refined.at_bound[place] == Some("min"),
            _ => false,
        };
        if !parameter.is_extension() && !stood.contains(&parameter) {
            let (other, _) = holding(records, spec, attempt, (place, elsewhere))?;
            if (at_bound && !small) || !is_same(&space, &refined, &other) {
                break;
            }
        }
        attempt.found.values.remove(place);
        (attempt.refined, attempt.space) = (refined, space);
        let problem = Problem::new(records, spec.model, attempt.space.clone(), spec.criterion)?;
        attempt.problem = Arc::new(problem);
        dropped.push(parameter);
    }
    Ok(dropped)
}

fn shortest(records: &[Record]) -> f64 {
    records.iter().map(Record::period_s).fold(f64::INFINITY, f64::min)
}

/// How far from a bound a parameter is put to see whether it matters.
const ELSEWHERE: f64 = 10.0;
/// Others may move by this many standard errors when it does not.
const MOVED: f64 = 1.0;

/// The refinement with one parameter held at a value.
fn holding(
    records: &[Record],
    spec: &IdentifySpec,
    attempt: &Attempt,
    (place, value): (usize, f64),
) -> Result<(Refined, Space)> {
    let (mut free, mut fixed) = (attempt.space.free().to_vec(), attempt.space.fixed().to_vec());
    let mut values = attempt.refined.values.clone();
    fixed.push((free[place].parameter, Scope::Shared, value));
    free.remove(place);
    values.remove(place);
    let space = Space::new(free, fixed)?;
    refine_widening(&fit_problem(records, &space, spec.model)?, spec, &space, &values)
}

/// Whether two fits are the same within their standard errors, made as much larger as correlated residuals count less.
/// What is late is not asked: an inductance delays as it does.
fn is_same(space: &Space, one: &Refined, other: &Refined) -> bool {
    let allowed = MOVED * residuals::inflation(&one.uncertainty).sqrt();
    let errors = one.uncertainty.std_error.iter().zip(space.free());
    let pairs = one.values.iter().zip(&other.values).zip(errors);
    let near = |((a, b), (error, axis)): ((&f64, &f64), (&Option<f64>, &Axis))| {
        let is_late = Extension::LATE.iter().any(|late| late.parameters().contains(&axis.parameter));
        is_late
            || error.is_none_or(|error| {
                (axis.coordinate(*a) - axis.coordinate(*b)).abs() * axis.slope(*a) <= allowed * error
            })
    };
    pairs.into_iter().all(near)
}

pub(super) fn not_told(parameter: Parameter) -> Warning {
    let message = format!(
        "the recordings do not tell {}, the {}: the others hold whatever it is; record faster, or under a voltage that \
         changes more",
        parameter.symbol(),
        parameter.name()
    );
    Warning::new("not_identifiable", message)
}
