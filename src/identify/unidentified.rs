//! Parameters that recordings do not identify: each is fixed where it is, so that the others stay.

use super::checks::unknown_alone;
use super::prepare::Prepared;
use super::refine::{Fit, refine_widening};
use crate::Result;
use crate::analysis::variance_inflation;
use crate::estimate::Refined;
use crate::motor::{Axis, Extension, Input, Parameter, Scope, Space};
use crate::record::Record;
use crate::warning::Warning;

/// Parameters that may be found to be unknown, one after the other.
const DROPPED: usize = 6;

/// Holds parameters of which the recordings tell nothing, each by itself, where they are: what else there is stays.
/// What a motor that stands for others leaves open, `stood`, is unknown anyway.
pub(super) fn fix_unidentified(prepared: &Prepared<'_>, attempt: &mut Fit) -> Result<Vec<Parameter>> {
    let (records, spec, stood) = (prepared.records, prepared.spec.as_ref(), prepared.open());
    let mut dropped = Vec::new();
    while dropped.len() < DROPPED && spec.is_polished() {
        let Some(parameter) = unknown_alone(spec, &attempt.space, &attempt.refined) else { break };
        let shared = |axis: &Axis| axis.parameter == parameter && axis.scope == Scope::Shared;
        let Some(place) = attempt.space.free().iter().position(shared) else { break };
        if attempt.space.free().len() == 1 {
            break;
        }
        let value = attempt.refined.values[place];
        let (refined, space) = fixed_at(prepared, attempt, place, value)?;
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
            let (other, _) = fixed_at(prepared, attempt, place, elsewhere)?;
            if (at_bound && !small) || !is_same(&space, &refined, &other) {
                break;
            }
        }
        attempt.found.values.remove(place);
        (attempt.refined, attempt.space) = (refined, space);
        attempt.problem = prepared.searched(attempt.space.clone());
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
fn fixed_at(prepared: &Prepared<'_>, attempt: &Fit, place: usize, value: f64) -> Result<(Refined, Space)> {
    let (mut free, mut fixed) = (attempt.space.free().to_vec(), attempt.space.fixed().to_vec());
    let mut values = attempt.refined.values.clone();
    fixed.push((free[place].parameter, Scope::Shared, value));
    free.remove(place);
    values.remove(place);
    let space = Space::new(free, fixed)?;
    refine_widening(&prepared.fitted(&space), &prepared.spec, &space, &values)
}

/// Whether two fits are the same within their standard errors, made as much larger as correlated residuals count less.
/// What is late is not asked: an inductance delays as it does.
fn is_same(space: &Space, one: &Refined, other: &Refined) -> bool {
    let allowed = MOVED * variance_inflation(&one.uncertainty).sqrt();
    let errors = one.uncertainty.std_error.iter().zip(space.free());
    let pairs = one.values.iter().zip(&other.values).zip(errors);
    let near = |((a, b), (error, axis)): ((&f64, &f64), (&Option<f64>, &Axis))| {
        let is_late = Extension::of(axis.parameter).is_some_and(Extension::is_late);
        is_late
            || error.is_none_or(|error| {
                (axis.coordinate(*a) - axis.coordinate(*b)).abs() * axis.slope(*a) <= allowed * error
            })
    };
    pairs.into_iter().all(near)
}

pub(super) fn not_told(parameter: Parameter) -> Warning {
    let (symbol, name) = (parameter.symbol(), parameter.name());
    let message = format!(
        "the recordings do not tell {symbol}, the {name}: the others hold whatever it is; record faster, or under a voltage \
         that changes more"
    );
    Warning::new("not_identifiable", message)
}
