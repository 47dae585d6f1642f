//! The residuals of each recording, tested: whether they are white, and whether they depend on the voltage (or the
//! current, where that is the input).

use super::fitted::FittedMotor;
use super::residual_input_test::{Regressors, ResidualInputTest, Residuals, residual_input_test};
use crate::channels::Channels;
use crate::estimate::{INDEPENDENT_MIN, Uncertainty, Whiteness};
use crate::evaluate::Problem;
use crate::motor::{Axis, Scope};
use crate::record::{Record, driver};
use crate::text::significant;
use crate::warning::{Warning, name_of};
use nalgebra::DMatrix;
use serde_json::{Value, json};

/// The tests of the residuals of a channel of a recording.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ResidualTest {
    /// Against themselves.
    #[serde(flatten)]
    pub whiteness: Whiteness,
    /// Against the voltage; `None` where it does not change enough.
    pub voltage: Option<ResidualInputTest>,
}

/// The tests of current and speed of one recording.
pub type ResidualTests = [Option<ResidualTest>; 2];

/// Tests the residuals of every recording of a problem. `moved` are candidates that are off by one independent error of
/// the parameters each, where these are no part of what was fitted.
pub(crate) fn residual_tests(
    records: &[Record],
    problem: &Problem,
    values: &[f64],
    moved: &[Vec<f64>],
) -> Vec<ResidualTests> {
    let of = |(recording, record): (usize, &Record)| {
        let signals = &problem.signals()[recording];
        let simulated = |values: &[f64]| problem.simulate(values, recording, signals.initial);
        let model = simulated(values);
        let moved: Vec<[Vec<f64>; 2]> = moved.iter().map(|values| simulated(values)).collect();
        let mut regressors = None;
        [0, 1].map(|channel| {
            // What a filter has passed is correlated, whatever the model misses.
            let measured = record.measured()[channel].filter(|_| signals.independent >= INDEPENDENT_MIN)?;
            let counting: Vec<bool> = match record.excluded().is_empty() {
                true => Vec::new(),
                false => (0..record.len()).map(|n| signals.counts(channel, n)).collect(),
            };
            let less = |from: &[f64]| from.iter().zip(&model[channel]).map(|(a, b)| a - b).collect::<Vec<f64>>();
            let values = less(measured);
            // Where that test has nothing to say, neither has the other.
            let whiteness = Whiteness::of(&kept(&values, &counting), signals.rms(channel))?;
            let residuals = Residuals {
                values: &values,
                regressors: regressors.get_or_insert_with(|| Regressors::new(record.input())),
                counting: &counting,
                sensitivities: &moved.iter().map(|signals| less(&signals[channel])).collect::<Vec<_>>(),
            };
            Some(ResidualTest { whiteness, voltage: residual_input_test(&residuals) })
        })
    };
    records.iter().enumerate().map(of).collect()
}

/// The part `residuals` of a result: the worst of each channel, then all recordings.
pub(crate) fn document(tests: &[ResidualTests], uncertainty: &Uncertainty) -> Value {
    let part = |test: &ResidualInputTest| test.statistic / test.threshold;
    let worst = |channel: usize| {
        let all = tests.iter().filter_map(|tests| tests[channel]?.voltage);
        let voltage = all.max_by(|a, b| part(a).total_cmp(&part(b)));
        uncertainty.whiteness[channel].map(|whiteness| ResidualTest { whiteness, voltage })
    };
    let records = tests.iter().map(|tests| json!(Channels::from(*tests)));
    json!({"current": worst(0), "speed": worst(1), "records": records.collect::<Value>()})
}

/// The values that count.
fn kept(values: &[f64], counting: &[bool]) -> Vec<f64> {
    let counts = |n: usize| counting.get(n).copied().unwrap_or(true);
    values.iter().enumerate().filter(|(n, _)| counts(*n)).map(|(_, value)| *value).collect()
}

/// Candidates (values of what is shared) that are off by one independent error of the parameters each.
///
/// The errors are those of the coordinates, as far as they are known: the columns of a root of their covariance. Where the
/// residuals of the fit were correlated and the errors do not allow for that yet, they are larger, by as much as samples count
/// less.
pub(super) fn moved(found: &FittedMotor<'_>) -> Vec<Vec<f64>> {
    let Some(uncertainty) = found.uncertainty else { return Vec::new() };
    let (axes, values) = (found.space.free(), found.values);
    let sizes = [values.len(), uncertainty.std_error.len(), uncertainty.correlation.len()];
    if sizes != [axes.len(); 3] || uncertainty.correlation.iter().any(|row| row.len() != axes.len()) {
        return Vec::new();
    }
    let shared: Vec<usize> = (0..axes.len()).filter(|n| axes[*n].scope == Scope::Shared).collect();
    let known: Vec<(usize, f64)> =
        shared.iter().filter_map(|&n| Some((n, uncertainty.std_error[n]? / axes[n].slope(values[n])))).collect();
    let more = if uncertainty.widened_by > 1.0 { 1.0 } else { variance_inflation(uncertainty) };
    let covariance = DMatrix::from_fn(known.len(), known.len(), |a, b| {
        let ((row, of_row), (column, of_column)) = (known[a], known[b]);
        more * of_row * of_column * uncertainty.correlation[row][column].unwrap_or(0.0)
    });
    let Some(root) = covariance.cholesky() else { return Vec::new() };
    let root = root.l();
    let one = |column: usize| {
        let mut values = values.to_vec();
        let shifted = |axis: &Axis, value: f64, by: f64| axis.value(axis.coordinate(value) + by);
        known
            .iter()
            .enumerate()
            .for_each(|(row, (n, _))| values[*n] = shifted(&axes[*n], values[*n], root[(row, column)]));
        shared.iter().map(|n| values[*n]).collect()
    };
    (0..known.len()).map(one).collect()
}

/// By how much variances are larger than those of independent residuals, by the correlation from sample to sample.
pub(crate) fn variance_inflation(uncertainty: &Uncertainty) -> f64 {
    let lags = uncertainty.whiteness.iter().flatten().map(|white| white.lag1.clamp(0.0, 0.999));
    lags.map(|lag| (1.0 + lag) / (1.0 - lag)).fold(1.0, f64::max)
}

/// Of what is left, less than this part that the voltage explains does not matter \[%\].
const EXPLAINED_MIN: f64 = 1.0;

/// The warning for residuals that depend on the voltage.
pub(crate) fn residuals_follow_input(records: &[Record], tests: &[ResidualTests]) -> Option<Warning> {
    let follows = |test: &ResidualTest| test.voltage.filter(|v| !v.is_independent).map(|v| v.explained_percent);
    let mut list: Vec<String> = Vec::new();
    for (channel, name) in ["current", "speed"].into_iter().enumerate() {
        let each = tests.iter().zip(records);
        let each = each.filter_map(|(tests, record)| Some((follows(tests[channel].as_ref()?)?, record)));
        let Some((explained, record)) = each.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        if explained >= EXPLAINED_MIN {
            let place = if records.len() > 1 { format!(" in {}", name_of(record)) } else { String::new() };
            list.push(format!("{} % of what is left of the {name}{place}", significant(explained, 2)));
        }
    }
    let input = driver(records);
    let message = format!(
        "the model misses how the {input} acts: the {input} still explains {}; parameters may be off by more than their \
         errors",
        list.join(" and ")
    );
    (!list.is_empty()).then(|| Warning::new("residuals_follow_voltage", message))
}
