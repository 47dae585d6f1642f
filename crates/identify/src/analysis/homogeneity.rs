//! Likelihood-ratio test of whether all recordings of a joint fit are of one motor (S. S. Wilks, 1938).
//!
//! Each recording is refined alone from the joint optimum. With g the decrease of its sum of squares in units of the residual
//! variance of the separate fit, divided by the variance inflation of correlated residuals, and N its effective sample size,
//! the gain of a recording is twice the log-likelihood ratio `N ln(1 + g/N)`. If all recordings are of one motor, the sum of
//! the gains follows χ². Its degrees of freedom are the number of parameters that the separate fits have more than the joint
//! one.

use super::friction::{FRICTION, friction_differs};
use motorfit_core::coordinate::Coordinate;
use motorfit_core::numeric::chi_square_limit;
use motorfit_core::text::significant;
use motorfit_estimate::{Fitted, Refined, Separate, separate_fits};
use motorfit_evaluate::Problem;
use motorfit_motor::{Axis, Parameter, Scope};
use motorfit_record::Record;
use motorfit_record::warning::{Location, Warning, name_of};

/// Largest number of recordings that are tested.
const RECORDINGS_MAX: usize = 20;
/// Smallest relative difference of a parameter that matters in practice.
const PART_MIN: f64 = 0.05;
/// Smallest relative decrease of the residual deviation that matters without a significant difference of any parameter.
const SMALLER: f64 = 0.1;
/// Largest relative standard error of a parameter that a recording alone shows: the interval of a less certain one is no normal one.
const SHOWN: f64 = 0.3;
/// 99.5 % quantile of the normal distribution.
const QUANTILE: f64 = 2.58;

/// A free parameter of a joint fit, of the motor or of a user's model.
pub(crate) struct Compared {
    pub name: String,
    pub unit: String,
    pub coordinate: Coordinate,
    /// True if the recordings share it and identify it.
    pub is_compared: bool,
}

/// The words for a joint fit in messages.
pub(crate) struct Words {
    /// Name of the machine: motor or machine.
    pub machine: &'static str,
    /// Names of the recordings.
    pub names: Vec<String>,
}

/// A joint fit with the fit of each recording alone.
struct JointFit<'a> {
    words: Words,
    axes: Vec<Compared>,
    shared: &'a Refined,
    own: Vec<Separate>,
}

/// The difference of a parameter between one recording and the others.
struct Difference {
    /// Number of the parameter.
    axis: usize,
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
    let compared = |axis: &Axis| Compared {
        name: axis.parameter.symbol().to_owned(),
        unit: axis.parameter.unit().to_owned(),
        coordinate: axis.range(),
        is_compared: axis.scope == Scope::Shared && !open.contains(&axis.parameter),
    };
    let axes = plain.space().free().iter().map(compared).collect();
    let named = |(n, record): (usize, &Record)| match &record.source().path {
        Some(_) => name_of(record),
        None => format!("recording {}", n + 1),
    };
    let words = Words { machine: "motor", names: records.iter().enumerate().map(named).collect() };
    let Some((warning, differing)) = differing(plain, shared, axes, words) else { return warnings };
    let is_friction = |n: &usize| FRICTION.contains(&plain.space().free()[*n].parameter);
    if warnings.is_empty() || !differing.iter().all(is_friction) {
        warnings.push(warning);
    }
    warnings
}

/// Returns the warning of a joint fit whose recordings are not of one machine, with the parameters that differ; `None` if they are, or if
/// there is one recording.
pub(crate) fn differing(
    problem: &dyn Fitted,
    shared: &Refined,
    axes: Vec<Compared>,
    words: Words,
) -> Option<(Warning, Vec<usize>)> {
    if !(2..=RECORDINGS_MAX).contains(&problem.recordings()) {
        return None;
    }
    let fit = JointFit { words, axes, shared, own: separate_fits(problem, shared)? };
    let (odd, differences) = fit.odd()?;
    Some((fit.warning(odd, &differences), differences.iter().map(|of| of.axis).collect()))
}

impl JointFit<'_> {
    /// Returns the recording that differs most with the parameters that differ.
    fn odd(&self) -> Option<(usize, Vec<Difference>)> {
        let own = &self.own;
        let rank: usize = own.iter().map(|own| own.refined.uncertainty.rank).sum();
        let freedom = rank.checked_sub(self.shared.uncertainty.rank).filter(|freedom| *freedom > 0)?;
        let total: f64 = own.iter().map(|own| own.gain).sum();
        if total <= chi_square_limit(freedom) {
            return None;
        }
        let compared = |odd: usize| -> Vec<Difference> {
            let axes = (0..self.axes.len()).filter(|n| self.axes[*n].is_compared);
            axes.filter_map(|axis| self.difference(axis, odd)).collect()
        };
        // The outlying recording is farther from the mean of the others than any other is from a mean that includes the outlier.
        let distance = |differences: &[Difference]| differences.iter().map(|d| d.distance).fold(0.0, f64::max);
        let by_gain = |a: &usize, b: &usize| own[*a].gain.total_cmp(&own[*b].gain);
        let largest = (0..own.len()).max_by(by_gain)?;
        let found = (0..own.len()).map(|n| (n, compared(n))).filter(|(n, _)| own.len() > 2 || *n == largest);
        let found = found.max_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
        found.filter(|(_, differences)| !differences.is_empty()).or_else(|| {
            let pairs = own[largest].refined.sigmas[0].iter().zip(&self.shared.sigmas[largest]);
            let is_smaller = pairs.into_iter().any(|(alone, joint)| *alone < (1.0 - SMALLER) * joint);
            is_smaller.then(|| (largest, Vec::new()))
        })
    }

    /// Returns the difference of a parameter between one recording and the mean of the others, weighted by inverse variances;
    /// `None` if it is not significant or too small to matter.
    fn difference(&self, axis: usize, odd: usize) -> Option<Difference> {
        let coordinate = &self.axes[axis].coordinate;
        let estimate = |of: &Separate| {
            let index = of.axes.iter().position(|own| *own == axis)?;
            let (value, error) = (of.refined.values[index], of.refined.uncertainty.std_error[index]?);
            let is_sure = !coordinate.is_logarithmic || error < SHOWN * value.abs();
            let is_shown = is_sure && !of.refined.uncertainty.open[index];
            is_shown.then(|| (coordinate.of(value), error / coordinate.slope(value) * of.inflation.sqrt()))
        };
        let (value, error) = estimate(&self.own[odd])?;
        let others: Vec<(f64, f64)> =
            (0..self.own.len()).filter(|n| *n != odd).filter_map(|n| estimate(&self.own[n])).collect();
        let weight: f64 = others.iter().map(|(_, error)| error.powi(-2)).sum();
        let mean = others.iter().map(|(value, error)| value * error.powi(-2)).sum::<f64>() / weight;
        let distance = (value - mean).abs() / error.hypot(weight.sqrt().recip());
        let [own, others] = [value, mean].map(|at| coordinate.value(at));
        let matters = (own - others).abs() > PART_MIN * own.abs().max(others.abs());
        (distance > QUANTILE && matters).then_some(Difference { axis, own, others, distance })
    }

    fn warning(&self, odd: usize, differences: &[Difference]) -> Warning {
        let Words { machine, names } = &self.words;
        let name = &names[odd];
        let one = |Difference { axis, own, others, .. }: &Difference| {
            let Compared { name, unit, .. } = &self.axes[*axis];
            let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
            format!("{name} is {}{unit} in it and {} in the others", significant(*own, 3), significant(*others, 3))
        };
        let list: Vec<String> = differences.iter().map(one).collect();
        let what = if list.is_empty() { "other parameters fit it better".to_owned() } else { list.join(", ") };
        let message = format!(
            "the recordings are not of one {machine} under one condition: {name} differs most, {what}; the joint fit is a \
             compromise, and its standard errors are too small"
        );
        let remedy =
            format!("Fit the recordings one by one; check whether the {machine}, its temperature or its load changed.");
        let figures = vec![("gain", self.own[odd].gain)];
        Warning {
            place: Some(Location { recording: Some(name.clone()), figures, ..Location::default() }),
            remedy: Some(remedy.into()),
            ..Warning::new("recordings_differ", message)
        }
    }
}
