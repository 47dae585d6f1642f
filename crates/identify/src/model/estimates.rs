//! Estimates of the parameters of a model.

use crate::estimates::ParameterEstimate;
use motorfit_core::coordinate::Coordinate;
use motorfit_estimate::Refined;
use motorfit_evaluate::model::ModelProblem;
use motorfit_model::Model;

/// Returns true if a parameter ended at a bound at which it has no effect.
pub(super) fn is_idle(model: &Model, of: &ParameterEstimate) -> bool {
    let Some((side, [min, max])) = of.at_bound.zip(of.bounds) else { return false };
    let parameter = model.parameters().iter().find(|parameter| parameter.name == of.name);
    let neutral = parameter.and_then(|parameter| parameter.neutral);
    let range = Coordinate { min, max, is_logarithmic: false, lowest: f64::NEG_INFINITY, neutral };
    range.is_idle(if side == "min" { min } else { max })
}

/// Returns the estimates in the order of the model.
pub(super) fn estimates(problem: &ModelProblem, values: &[f64], refined: Option<&Refined>) -> Vec<ParameterEstimate> {
    let space = problem.space();
    let mut estimates = Vec::new();
    for (number, parameter) in problem.model().parameters().iter().enumerate() {
        let named = |value| ParameterEstimate {
            description: parameter.description.clone(),
            value,
            ..ParameterEstimate::named(&parameter.name, &parameter.unit.text)
        };
        if let Some(value) = space.fixed[number] {
            estimates.push(ParameterEstimate { fixed: true, ..named(Some(value)) });
        }
        for (n, axis) in space.free.iter().enumerate().filter(|(_, axis)| axis.parameter == number) {
            let uncertainty = refined.map(|refined| &refined.uncertainty);
            let is_open = uncertainty.is_some_and(|of| of.open[n]);
            estimates.push(ParameterEstimate {
                bounds: Some([axis.min, axis.max]),
                recording: axis.recording,
                std_error: uncertainty.and_then(|of| of.std_error[n]),
                ci95: uncertainty.and_then(|of| of.ci95[n]),
                at_bound: refined.and_then(|refined| refined.at_bound[n]),
                ..named((!is_open).then_some(values[n]))
            });
        }
    }
    estimates
}
