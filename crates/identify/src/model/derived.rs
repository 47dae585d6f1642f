//! Quantities that a model derives from its parameters, where the recordings identify them: they do not change along unidentifiable
//! directions. Standard errors are by the delta method.

use crate::estimates::Combination;
use motorfit_estimate::{Uncertainty, student95};
use motorfit_evaluate::model::ModelProblem;

/// Change along an unidentifiable direction, relative to that which its parts would make alone, up to which a quantity does not change:
/// directions are known to about the square root of the rounding of an information matrix.
const CHANGES: f64 = 1e-3;

/// Returns the derived quantities that recordings identify, for the parameters that all recordings share.
pub(super) fn derived(problem: &ModelProblem, values: &[f64], uncertainty: &Uncertainty) -> Vec<Combination> {
    let (model, space) = (problem.model(), problem.space());
    let quantile = student95(problem.counted().saturating_sub(space.free.len()));
    let all = model.derived_values(&space.values(values, 0));
    let identified = |(quantity, (value, slopes)): (&motorfit_model::DerivedQuantity, (f64, Vec<f64>))| {
        let of_axis = |n: usize| {
            let axis = &space.free[n];
            slopes[axis.parameter] * axis.range().slope(values[n])
        };
        let slopes: Vec<f64> = (0..space.free.len()).map(of_axis).collect();
        let is_own = space.free.iter().zip(&slopes).any(|(axis, slope)| axis.recording.is_some() && *slope != 0.0);
        let changes = |direction: &Vec<f64>| {
            let parts = || slopes.iter().zip(direction).map(|(slope, step)| slope * step);
            parts().sum::<f64>().abs() > CHANGES * parts().map(f64::abs).sum::<f64>()
        };
        if is_own || uncertainty.unidentifiable.iter().any(changes) {
            return None;
        }
        let row = |(slope, row): (&f64, &Vec<f64>)| slope * slopes.iter().zip(row).map(|(a, b)| a * b).sum::<f64>();
        let std_error = slopes.iter().zip(&uncertainty.covariance).map(row).sum::<f64>().max(0.0).sqrt();
        let ci95 = [value - quantile * std_error, value + quantile * std_error];
        let (name, unit) = (quantity.name.clone(), quantity.unit.text.clone());
        let is_known = value.is_finite() && std_error.is_finite() && std_error > 0.0;
        is_known.then_some(Combination { name, value, unit, std_error, ci95 })
    };
    model.derived().iter().zip(all).filter_map(identified).collect()
}
