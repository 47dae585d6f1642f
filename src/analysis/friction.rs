//! Tests whether friction differs between the recordings of a joint fit.
//!
//! The fit is done again with friction free in each recording. Twice the gain in log likelihood, the fall of the weighted
//! sum of squares, follows χ² with one degree less than there are recordings where friction is the same in all
//! (S. S. Wilks 1938). Residuals that are correlated from sample to sample count less: the gain is divided by
//! `(1 + ρ)/(1 − ρ)`.

use super::residuals::variance_inflation;
use crate::estimate::{Refined, refine_on};
use crate::evaluate::Problem;
use crate::motor::{Axis, Parameter, Scope, Space};
use crate::numeric::chi_square_limit;
use crate::record::Record;
use crate::text::significant;
use crate::warning::{Place, Warning, name_of};

/// The parameters that are friction.
pub(super) const FRICTION: [Parameter; 2] = [Parameter::B, Parameter::Coulomb];
/// A difference of less than this factor is none that matters.
const FACTOR_MIN: f64 = 1.1;
/// More recordings are not looked through.
const RECORDINGS_MAX: u32 = 20;
/// Ratio of the bounds of one recording's friction to the friction of all.
const REACH: f64 = 1e3;

/// The warnings of a joint fit whose recordings have different friction. `plain` is the problem of the fit, `shared` its
/// refinement.
pub(super) fn friction_differs(records: &[Record], plain: &Problem, shared: &Refined) -> Vec<Warning> {
    let several = u32::try_from(records.len()).is_ok_and(|count| (2..=RECORDINGS_MAX).contains(&count));
    if !several {
        return Vec::new();
    }
    FRICTION.into_iter().filter_map(|parameter| of_parameter(records, parameter, plain, shared)).collect()
}

fn of_parameter(records: &[Record], parameter: Parameter, plain: &Problem, shared: &Refined) -> Option<Warning> {
    let (space, start, first) = apart(plain.space(), &shared.values, parameter, records.len())?;
    let own = refine_on(&plain.with_space(space), &start, None).ok()?;
    let more = variance_inflation(&own.uncertainty).max(variance_inflation(&shared.uncertainty));
    let gain = (shared.weighted(&own.sigmas) - own.weighted(&own.sigmas)) / more;
    let [low, high] = extremes(&own, first, records.len()).filter(|_| gain > chi_square_limit(records.len() - 1))?;
    let (name, unit) = (parameter.name(), parameter.unit());
    let [least, most] = [low, high].map(|n| significant(own.values[first + n], 3));
    let [one, other] = [low, high].map(|n| name_of(&records[n]));
    let message = format!(
        "{name} differs between the recordings: {least} {unit} in {one}, {most} in {other}; that of the fit is a mean of what \
         the motor did, and the standard errors are too small"
    );
    let figures = vec![("lowest", own.values[first + low]), ("highest", own.values[first + high]), ("gain", gain)];
    let remedy = "Fit the recordings one by one, or record them alike: warm, with the same load, at like speeds.";
    Some(Warning {
        place: Some(Place { recording: Some("all recordings".to_owned()), figures, ..Place::default() }),
        remedy: Some(remedy.into()),
        ..Warning::new("friction_differs", message)
    })
}

/// The space with a parameter free in each recording, values to start from, and the place of the first of them; `None`
/// where it is not one shared by all.
fn apart(space: &Space, values: &[f64], parameter: Parameter, count: usize) -> Option<(Space, Vec<f64>, usize)> {
    let all = || space.free().iter().copied().zip(values.iter().copied());
    let (own, value) = all().find(|(axis, _)| axis.parameter == parameter && axis.scope == Scope::Shared)?;
    let (mut free, mut start): (Vec<Axis>, Vec<f64>) = all().filter(|(axis, _)| *axis != own).unzip();
    let first = free.len();
    for recording in 0..u32::try_from(count).ok()? {
        let scope = Scope::Recording(recording);
        let [min, max] = if parameter.is_extension() { [own.min, own.max] } else { [value / REACH, value * REACH] };
        free.push(Axis { scope, min, max, ..own });
        start.push(value);
    }
    Some((Space::new(free, space.fixed().to_vec()).ok()?, start, first))
}

/// The recordings with the lowest and the highest value of those that tell it, where their intervals are apart and the
/// values by a factor that matters.
fn extremes(own: &Refined, first: usize, count: usize) -> Option<[usize; 2]> {
    let interval = |n: usize| match own.at_bound[first + n] {
        Some(_) => Some([own.values[first + n]; 2]),
        None => own.uncertainty.ci95[first + n],
    };
    let told = || (0..count).filter_map(|n| Some((n, interval(n)?)));
    let (low, [_, below]) = told().min_by(|(_, a), (_, b)| a[1].total_cmp(&b[1]))?;
    let (high, [above, _]) = told().max_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]))?;
    let factor = own.values[first + high] / own.values[first + low];
    (above > below && factor > FACTOR_MIN).then_some([low, high])
}
