//! Score test (C. R. Rao, 1948) for a parameter that the model lacks. The derivatives at the optimum suffice; nothing is
//! fitted again.

use super::fit::Fit;
use super::fitted::Fitted;
use super::refined::Refined;
use nalgebra::{DMatrix, DVector};

/// The score of a parameter that a model lacks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Index of the parameter among the free axes.
    pub axis: usize,
    /// Score statistic: to first order the decrease of the weighted sum of squares when the parameter is freed; χ² with one
    /// degree of freedom if the model is complete.
    pub statistic: f64,
    /// Largest shift of another free parameter when this one is freed, in standard errors of the fit without it.
    pub shift: f64,
    /// Largest shift, in the same unit, for the largest value of this parameter that the recordings do not exclude.
    pub largest_undetected_shift: f64,
}

/// Ratio of the information on a parameter with the others free to that with the others fixed, below which the parameter is not
/// separable from them.
const SEPARABLE: f64 = 1e-8;
/// Distance from an estimate, in standard errors, beyond which values are excluded.
const EXCLUDED: f64 = 2.0;

/// Returns the scores of the free axes `tested` of a problem made by [`super::fit_problem`]. At `values` these axes have no
/// effect, and the others have the values of the optimum `of`. The statistic is zero if the bounds exclude the step or the
/// parameter is not separable.
pub fn scores(problem: &dyn Fitted, values: &[f64], of: &Refined, tested: &[usize]) -> Vec<Score> {
    let fit = Fit::new(problem);
    let Some(normal) = fit.normal(&fit.at(values, &of.initial)) else { return Vec::new() };
    let (matrix, gradient) = fit.weighted(&normal, &of.sigmas);
    let kept: Vec<usize> = (0..fit.unknowns).filter(|n| !tested.contains(n) && matrix[(*n, *n)] > 0.0).collect();
    // Scaling the diagonal to one conditions the matrix: the information on the parameters differs by powers of ten.
    let scale = DVector::from_iterator(kept.len(), kept.iter().map(|n| matrix[(*n, *n)].sqrt()));
    let own = DMatrix::from_fn(kept.len(), kept.len(), |a, b| matrix[(kept[a], kept[b])] / (scale[a] * scale[b]));
    let Some(own) = own.cholesky() else { return Vec::new() };
    let errors = own.inverse().map_diagonal(|v| v.sqrt());
    let axes = problem.axes();
    let score = |&axis: &usize| {
        let row =
            DVector::from_iterator(kept.len(), kept.iter().zip(scale.iter()).map(|(n, s)| matrix[(axis, *n)] / s));
        let rest = DVector::from_iterator(kept.len(), kept.iter().zip(scale.iter()).map(|(n, s)| gradient[*n] / s));
        let moved = own.solve(&row);
        let information = matrix[(axis, axis)] - row.dot(&moved);
        let slope = gradient[axis] - rest.dot(&moved);
        let step = slope / information;
        let is_separable = information > SEPARABLE * matrix[(axis, axis)];
        let is_parameter = |n: &usize| kept[*n] < axes.len();
        let per_step = (0..kept.len()).filter(is_parameter).map(|n| (moved[n] / errors[n]).abs()).fold(0.0, f64::max);
        let at = axes[axis].of(values[axis]);
        let room = [axes[axis].min, axes[axis].max].map(|bound| axes[axis].of(bound) - at);
        let open = |by: f64, room: f64| if is_separable { by.clamp(0.0, room) } else { room };
        let error = EXCLUDED / information.sqrt();
        let largest_undetected_shift = per_step * open(step + error, room[1]).max(open(error - step, -room[0]));
        if !is_separable || step > room[1] && room[1] <= 0.0 || step < room[0] && room[0] >= 0.0 {
            return Score { axis, statistic: 0.0, shift: 0.0, largest_undetected_shift };
        }
        Score { axis, statistic: slope * slope / information, shift: per_step * step.abs(), largest_undetected_shift }
    };
    tested.iter().map(score).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated::simulated;
    use crate::{fit_problem, refine_on};
    use motorfit_evaluate::Model;
    use motorfit_motor::{Axis, Parameter, Parameters, Scope, Space};
    use motorfit_record::{Record, Samples};
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};

    /// Returns a recording of the M2 motor with a constant load torque under several voltages of both signs, with noise.
    fn record(load: f64, seed: u64) -> Record {
        let levels = [0.0, 9.0, 2.0, -6.0, 4.0, -1.5, 10.5];
        let voltage = (0..1400).map(|n| levels[n / 200]).collect();
        let time_s = (0_u32..1400).map(|n| 1e-3 * f64::from(n)).collect();
        let clean = simulated(time_s, voltage, Some(vec![load; 1400]));
        let mut samples = Samples { torque: None, ..clean.samples().clone() };
        let mut numbers = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
        for (signal, sigma) in [(&mut samples.current, 0.05), (&mut samples.speed, 0.5)] {
            for value in signal.iter_mut().flatten() {
                let normal: f64 = StandardNormal.sample(&mut numbers);
                *value += sigma * normal;
            }
        }
        Record::new(samples).unwrap()
    }

    /// Returns the score of the load, the decrease of the cost by two fits, and the largest shift of a parameter between
    /// them in standard errors.
    fn tested(record: &Record) -> (Score, f64, f64) {
        let records = std::slice::from_ref(record);
        let motor = Parameters::M2.to_array();
        let axis = |p: Parameter| Axis {
            parameter: p,
            scope: Scope::Shared,
            min: 0.1 * motor[p as usize],
            max: 10.0 * motor[p as usize],
        };
        let free: Vec<Axis> = Parameter::ALL.into_iter().map(axis).collect();
        let load = Axis { parameter: Parameter::Load, scope: Scope::Shared, min: -0.05, max: 0.05 };
        let space = Space::new(free.clone(), Vec::new()).unwrap();
        let larger = Space::new(free.into_iter().chain([load]).collect(), Vec::new()).unwrap();
        let plain = fit_problem(records, &space, Model::default()).unwrap();
        let without = refine_on(&plain, &motor, None).unwrap();
        let plain = fit_problem(records, &larger, Model::default()).unwrap();
        let values: Vec<f64> = without.values.iter().copied().chain([0.0]).collect();
        let score = scores(&plain, &values, &without, &[5])[0];
        let with = refine_on(&plain, &values, Some(&without.sigmas)).unwrap();
        let shift = |n: usize| {
            let log_error = without.uncertainty.std_error[n].unwrap() / without.values[n];
            ((with.values[n] / without.values[n]).ln() / log_error).abs()
        };
        let decrease = without.weighted(&without.sigmas) - with.weighted(&without.sigmas);
        (score, decrease, (0..5).map(shift).fold(0.0, f64::max))
    }

    #[test]
    fn a_score_equals_the_decrease_by_another_fit() {
        for load in [2e-4, 1e-3, -2e-3] {
            let (score, decrease, shift) = tested(&record(load, 1));
            // Both agree to first order in the shift, which is a few percent of a parameter.
            assert!((score.statistic / decrease - 1.0).abs() < 0.05, "{load}: {score:?}, {decrease}");
            assert!((score.shift / shift - 1.0).abs() < 0.05, "{load}: {score:?}, {shift}");
        }
    }

    #[test]
    fn scores_of_absent_effects_follow_chi_square() {
        let all: Vec<f64> = (0..300).map(|seed| tested(&record(0.0, seed)).0.statistic).collect();
        let mean = motorfit_core::numeric::mean(&all);
        let beyond = all.iter().filter(|score| **score > 3.841).count();
        // The mean of 300 has a standard deviation of 0.08, the count beyond the 95 % quantile one of 3.8.
        assert!((mean - 1.0).abs() < 0.25 && (4..=27).contains(&beyond), "{mean}, {beyond} of 300");
    }
}
