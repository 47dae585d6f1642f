//! Likelihood-ratio test of whether all recordings of a joint fit are of one motor (S. S. Wilks, 1938).
//!
//! Each recording is refined alone from the joint optimum. With g the decrease of its sum of squares in units of the residual
//! variance of the separate fit, divided by the variance inflation of correlated residuals, and N its effective sample size,
//! the gain of a recording is twice the log-likelihood ratio `N ln(1 + g/N)`. If all recordings are of one motor, the sum of
//! the gains follows χ². Its degrees of freedom are the number of parameters that the separate fits have more than the joint
//! one.

use super::friction::{FRICTION, friction_differs};
use super::residuals::variance_inflation;
use motorfit_core::numeric::{chi_square_limit, count};
use motorfit_core::text::significant;
use motorfit_estimate::{Refined, refine_on};
use motorfit_evaluate::Problem;
use motorfit_motor::{Axis, Parameter, Scope, Space};
use motorfit_record::Record;
use motorfit_record::warning::{Location, Warning, name_of};
use rayon::prelude::*;

/// Largest number of recordings that are tested.
const RECORDINGS_MAX: usize = 20;
/// Smallest relative difference of a parameter that matters in practice.
const PART_MIN: f64 = 0.05;
/// Smallest relative decrease of the residual deviation that matters without a significant difference of any parameter.
const SMALLER: f64 = 0.1;
/// 99.5 % quantile of the normal distribution.
const QUANTILE: f64 = 2.58;

/// The fit of one recording alone.
struct Own {
    axes: Vec<Axis>,
    refined: Refined,
    /// Twice the log-likelihood ratio of the separate fit to the joint one.
    gain: f64,
    /// Variance inflation by the correlation of the residuals.
    inflation: f64,
}

/// The difference of a parameter between one recording and the others.
struct Difference {
    parameter: Parameter,
    /// Estimate from the recording.
    own: f64,
    /// Weighted mean of the estimates from the other recordings.
    others: f64,
    /// Distance between the two \[standard errors\].
    distance: f64,
}

/// Returns the warnings of a joint fit whose recordings are not of one motor. `plain` is the problem of the fit, `shared` its
/// refinement, and `open` are the parameters that the recordings do not identify.
pub(crate) fn homogeneity(records: &[Record], plain: &Problem, shared: &Refined, open: &[Parameter]) -> Vec<Warning> {
    let mut warnings = friction_differs(records, plain, shared);
    if !(2..=RECORDINGS_MAX).contains(&records.len()) {
        return warnings;
    }
    let own: Option<Vec<Own>> = (0..records.len()).into_par_iter().map(|n| alone(plain, shared, n)).collect();
    let Some((odd, differences)) = own.as_ref().and_then(|own| differing(plain, shared, own, open)) else {
        return warnings;
    };
    let by_friction = differences.iter().all(|difference| FRICTION.contains(&difference.parameter));
    if warnings.is_empty() || !by_friction {
        let gain = own.as_ref().map_or(0.0, |own| own[odd].gain);
        warnings.push(warning(records, odd, &differences, gain));
    }
    warnings
}

/// Refines one recording alone, from the joint optimum.
fn alone(plain: &Problem, shared: &Refined, recording: usize) -> Option<Own> {
    let index = u32::try_from(recording).ok()?;
    let (space, all) = (plain.space(), plain.space().free().iter().zip(&shared.values));
    let of = all.filter(|(axis, _)| axis.scope.covers(index));
    let (axes, start): (Vec<Axis>, Vec<f64>) =
        of.map(|(axis, value)| (Axis { scope: Scope::Shared, ..*axis }, *value)).unzip();
    let fixed = space.fixed().iter().filter(|(_, scope, _)| scope.covers(index));
    let fixed = fixed.map(|(parameter, _, value)| (*parameter, Scope::Shared, *value)).collect();
    let problem = plain.only(recording).with_space(Space::new(axes.clone(), fixed).ok()?);
    let refined = refine_on(&problem, &start, None).ok()?;
    let inflation = variance_inflation(&refined.uncertainty);
    let sums = |of: &Refined, n: usize| {
        of.squares[n].iter().zip(refined.sigmas[0]).map(|(squares, sigma)| squares / (sigma * sigma)).sum::<f64>()
    };
    let gain = (sums(shared, recording) - sums(&refined, 0)).max(0.0) / inflation;
    // With an estimated σ twice the log-likelihood ratio is `N ln(1 + g/N)`, which is less than the decrease g.
    let signals = &plain.signals()[recording];
    let values = (0..2).filter(|c| signals.has(*c)).map(|c| signals.count(c)).sum::<usize>();
    let effective = (count(values) / inflation).max(1.0);
    Some(Own { axes, gain: effective * (gain / effective).ln_1p(), refined, inflation })
}

/// Returns the recording that differs most with the parameters that differ; `None` if all recordings are of one motor.
fn differing(plain: &Problem, shared: &Refined, own: &[Own], open: &[Parameter]) -> Option<(usize, Vec<Difference>)> {
    let rank: usize = own.iter().map(|own| own.refined.uncertainty.rank).sum();
    let freedom = rank.checked_sub(shared.uncertainty.rank).filter(|freedom| *freedom > 0)?;
    let total: f64 = own.iter().map(|own| own.gain).sum();
    if total <= chi_square_limit(freedom) {
        return None;
    }
    let named = |odd: usize| -> Vec<Difference> {
        let shared = plain.space().free().iter().filter(|axis| axis.scope == Scope::Shared);
        let identified = shared.filter(|axis| !open.contains(&axis.parameter));
        identified.filter_map(|axis| difference(axis, own, odd)).collect()
    };
    // The outlying recording is farther from the mean of the others than any other is from a mean that includes the outlier.
    let distance = |differences: &[Difference]| differences.iter().map(|d| d.distance).fold(0.0, f64::max);
    let by_gain = |a: &usize, b: &usize| own[*a].gain.total_cmp(&own[*b].gain);
    let largest = (0..own.len()).max_by(by_gain)?;
    let found = (0..own.len()).map(|n| (n, named(n))).filter(|(n, _)| own.len() > 2 || *n == largest);
    let found = found.max_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
    found.filter(|(_, differences)| !differences.is_empty()).or_else(|| {
        let is_smaller = |channel: usize| {
            own[largest].refined.sigmas[0][channel] < (1.0 - SMALLER) * shared.sigmas[largest][channel]
        };
        (0..2).any(is_smaller).then(|| (largest, Vec::new()))
    })
}

/// Returns the difference of a parameter between one recording and the mean of the others, weighted by inverse variances;
/// `None` if it is not significant or too small to matter.
fn difference(axis: &Axis, own: &[Own], odd: usize) -> Option<Difference> {
    let estimate = |of: &Own| {
        let index = of.axes.iter().position(|own| own.parameter == axis.parameter)?;
        let (value, error) = (of.refined.values[index], of.refined.uncertainty.std_error[index]?);
        Some((axis.coordinate(value), error / axis.slope(value) * of.inflation.sqrt()))
    };
    let (value, error) = estimate(&own[odd])?;
    let others: Vec<(f64, f64)> = (0..own.len()).filter(|n| *n != odd).filter_map(|n| estimate(&own[n])).collect();
    let weight: f64 = others.iter().map(|(_, error)| error.powi(-2)).sum();
    let mean = others.iter().map(|(value, error)| value * error.powi(-2)).sum::<f64>() / weight;
    let distance = (value - mean).abs() / error.hypot(weight.sqrt().recip());
    let [one, other] = [value, mean].map(|at| axis.value(at));
    let matters = (one - other).abs() > PART_MIN * one.abs().max(other.abs());
    (distance > QUANTILE && matters).then_some(Difference {
        parameter: axis.parameter,
        own: one,
        others: other,
        distance,
    })
}

fn warning(records: &[Record], odd: usize, differences: &[Difference], gain: f64) -> Warning {
    let name = match &records[odd].source().path {
        Some(_) => name_of(&records[odd]),
        None => format!("recording {}", odd + 1),
    };
    let one = |Difference { parameter, own, others, .. }: &Difference| {
        let (symbol, unit) = (parameter.symbol(), parameter.unit());
        let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
        format!("{symbol} is {}{unit} in it and {} in the others", significant(*own, 3), significant(*others, 3))
    };
    let list: Vec<String> = differences.iter().map(one).collect();
    let what = if list.is_empty() { "other parameters fit it better".to_owned() } else { list.join(", ") };
    let message = format!(
        "the recordings are not of one motor under one condition: {name} differs most, {what}; the joint fit is a \
         compromise, and its standard errors are too small"
    );
    let remedy = "Fit the recordings one by one; check whether the motor, its temperature or its load changed.";
    Warning {
        place: Some(Location { recording: Some(name), figures: vec![("gain", gain)], ..Location::default() }),
        remedy: Some(remedy.into()),
        ..Warning::new("recordings_differ", message)
    }
}
