//! Cost maps of a user's model.

use super::map::{CostMap, MapParameter, Optimum, check};
use motorfit_core::setting::text;
use motorfit_core::text::{excerpt, listed, nearest};
use motorfit_core::{Error, Result};
use motorfit_evaluate::model::ModelRecording;
use motorfit_identify::BatchCosts;
use motorfit_identify::model::{ModelSpec, identify_model};
use motorfit_model::Model;
use std::ops::ControlFlow;

/// Identifies a model and evaluates the criterion on a grid of `side` × `side` points around the optimum, within the given bounds
/// of the two parameters or eight standard errors to each side. `names` are those of the free parameters.
///
/// # Errors
/// Propagates the errors of [`identify_model`] and [`BatchCosts::of_model`]. Returns a `Usage` error if the parameters are equal or one
/// of them is not free, or if `side` is not within 2 to 4096.
pub fn model_cost_map(
    (model, recordings): (&Model, &[ModelRecording]),
    spec: &ModelSpec,
    names: [&str; 2],
    side: usize,
) -> Result<CostMap> {
    check(names, side)?;
    let mut costs = BatchCosts::of_model(model, recordings.to_vec(), spec)?;
    let free = costs.problem().names();
    let place = |name: &str| {
        free.iter().position(|own| own == name).ok_or_else(|| {
            let own: Vec<&str> = free.iter().map(String::as_str).collect();
            let near = nearest(name, &own).map(|near| format!("Did you mean {near}?"));
            let hint = near.unwrap_or_else(|| format!("The free parameters are {}.", listed(&own, "and")));
            Error::usage(text!([Slice](": {} is not a free parameter of the model", excerpt(name))), hint)
        })
    };
    let places = [place(names[0])?, place(names[1])?];
    let found = identify_model(model, recordings, spec, &mut |_| ControlFlow::Continue(()))?;
    let parameter = |place: usize| {
        let of = &model.parameters()[found.space.free[place].parameter];
        let name = if of.description.is_empty() { &of.name } else { &of.description };
        MapParameter { symbol: free[place].clone(), name: name.clone(), unit: of.unit.text.clone() }
    };
    let range = |place: usize, _: f64, [low, high]: [f64; 2]| {
        let axis = &found.space.free[place];
        let name = &model.parameters()[axis.parameter].name;
        let is_given = spec.bounds.iter().any(|(of, _)| of == name);
        if is_given { [axis.min, axis.max] } else { [low.max(axis.min), high.min(axis.max)] }
    };
    let (uncertainty, parameters) = (found.uncertainty.as_ref(), places.map(parameter));
    let values = found.values.clone();
    Optimum { values, uncertainty, parameters, places, warnings: &found.warnings }.map(side, range, &mut costs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorfit_evaluate::criterion::{Criterion, Scale};
    use motorfit_evaluate::experiment::white_noise;
    use motorfit_model::BuiltIn;

    #[test]
    fn a_map_of_a_model_is_lowest_at_the_optimum() {
        let model = BuiltIn::DcMotor.model().unwrap();
        let time_s: Vec<f64> = (0..400).map(|n| f64::from(n) * 1e-3).collect();
        let voltage: Vec<f64> = (0..400).map(|n| if (n / 60) % 2 == 0 { 8.0 } else { -4.0 }).collect();
        let mut recording = ModelRecording::to_simulate(&model, time_s, vec![voltage, vec![0.0; 400]]).unwrap();
        let values = motorfit_motor::Parameters::M2.to_array();
        let settings = ModelSpec::default().settings();
        let space = motorfit_evaluate::model::ModelSpace::all_fixed(&values);
        let problem =
            motorfit_evaluate::model::ModelProblem::new(&model, space, vec![recording.clone()], settings).unwrap();
        let simulated = problem.simulate(&[], 0, &[]).outputs;
        let noisy = |n: u64, signal: &[f64]| {
            let noise = white_noise(signal.len(), 0.01 * motorfit_core::numeric::rms(signal), 5, n);
            signal.iter().zip(noise).map(|(value, noise)| value + noise).collect::<Vec<f64>>()
        };
        recording.measured = (0..).zip(&simulated).map(|(n, signal)| Some(noisy(n, signal))).collect();
        let criterion = Criterion { scale: Scale::Noise, ..Criterion::default() };
        let spec = ModelSpec { criterion, ..ModelSpec::default() };
        let map = model_cost_map((&model, &[recording.clone()]), &spec, ["R", "J"], 31).unwrap();
        let all = (0..31).flat_map(|row| (0..31).map(move |column| (row, column)));
        let lowest = all.min_by(|a, b| map.costs[a.0][a.1].total_cmp(&map.costs[b.0][b.1])).unwrap();
        // The noise is estimated from the signals, not from the residuals with which the optimum is weighted: one cell is half a
        // standard error.
        assert!(lowest.0.abs_diff(15) <= 1 && lowest.1.abs_diff(15) <= 1, "{lowest:?}");
        assert_eq!((map.ellipse.len(), map.parameters[0].unit.as_str()), (181, "ohm"));
        for names in [["R", "R"], ["R", "Rx"]] {
            assert!(model_cost_map((&model, &[recording.clone()]), &spec, names, 31).is_err(), "{names:?}");
        }
    }
}
