//! Likelihood-ratio test of whether friction differs between the recordings of a joint fit (S. S. Wilks, 1938).
//!
//! The fit is repeated with one friction parameter per recording. If friction is the same in all, the decrease of the weighted
//! sum of squares follows χ² with one degree of freedom less than there are recordings. For correlated residuals the decrease
//! is divided by the variance inflation `(1 + ρ)/(1 − ρ)`, with ρ the correlation at lag 1.

use motorfit_core::numeric::chi_square_limit;
use motorfit_core::text::significant;
use motorfit_estimate::{Refined, refine_on};
use motorfit_evaluate::Problem;
use motorfit_motor::{Axis, Parameter, Scope, Space};
use motorfit_record::Record;
use motorfit_record::warning::{Location, Warning, name_of};

/// Friction parameters.
pub(super) const FRICTION: [Parameter; 2] = [Parameter::B, Parameter::Coulomb];
/// Smallest ratio of two friction values that matters in practice.
const FACTOR_MIN: f64 = 1.1;
/// Largest number of recordings that are tested.
const RECORDINGS_MAX: u32 = 20;
/// Ratio of the bounds of the viscous friction of one recording to that of the joint fit.
const REACH: f64 = 1e3;

/// Returns the warnings of a joint fit whose recordings have different friction. `plain` is the problem of the fit, `shared`
/// its refinement.
pub(super) fn friction_differs(records: &[Record], plain: &Problem, shared: &Refined) -> Vec<Warning> {
    let several = u32::try_from(records.len()).is_ok_and(|count| (2..=RECORDINGS_MAX).contains(&count));
    if !several {
        return Vec::new();
    }
    FRICTION.into_iter().filter_map(|parameter| of_parameter(records, parameter, plain, shared)).collect()
}

/// Tests one friction parameter.
fn of_parameter(records: &[Record], parameter: Parameter, plain: &Problem, shared: &Refined) -> Option<Warning> {
    let (space, start, first) = apart(plain.space(), &shared.values, parameter, records.len())?;
    let own = refine_on(&plain.with_space(space), &start, None).ok()?;
    let more = own.uncertainty.variance_inflation().max(shared.uncertainty.variance_inflation());
    let gain = (shared.weighted(&own.sigmas) - own.weighted(&own.sigmas)) / more;
    let [low, high] = extremes(&own, first, records.len()).filter(|_| gain > chi_square_limit(records.len() - 1))?;
    let (name, unit) = (parameter.name(), parameter.unit());
    let [least, most] = [low, high].map(|n| significant(own.values[first + n], 3));
    let [one, other] = [low, high].map(|n| name_of(&records[n]));
    let message = format!(
        "{name} differs between the recordings: {least} {unit} in {one}, {most} in {other}; the joint fit is a \
         compromise, and its standard errors are too small"
    );
    let figures = vec![("lowest", own.values[first + low]), ("highest", own.values[first + high]), ("gain", gain)];
    let remedy = "Fit the recordings one by one, or record them under one condition: warm, same load, similar speeds.";
    Some(Warning {
        place: Some(Location { recording: Some("all recordings".to_owned()), figures, ..Location::default() }),
        remedy: Some(remedy.into()),
        ..Warning::new("friction_differs", message)
    })
}

/// Returns the space with one value of a parameter per recording, the start values, and the index of the first of these axes;
/// `None` if the parameter is not free and shared by all recordings.
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

/// Returns the recording whose interval ends lowest and the one whose interval begins highest, among those that identify the
/// parameter; `None` if these intervals overlap or the values differ too little.
fn extremes(own: &Refined, first: usize, count: usize) -> Option<[usize; 2]> {
    let interval = |n: usize| match own.at_bound[first + n] {
        Some(_) => Some([own.values[first + n]; 2]),
        None => own.uncertainty.ci95[first + n],
    };
    let identified = || (0..count).filter_map(|n| Some((n, interval(n)?)));
    let (low, [_, below]) = identified().min_by(|(_, a), (_, b)| a[1].total_cmp(&b[1]))?;
    let (high, [above, _]) = identified().max_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]))?;
    let factor = own.values[first + high] / own.values[first + low];
    (above > below && factor > FACTOR_MIN).then_some([low, high])
}
