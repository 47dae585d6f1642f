//! Test of whether all recordings of a joint fit are of one machine.

use crate::analysis::{Compared, Words, differing};
use motorfit_estimate::Refined;
use motorfit_evaluate::model::{ModelAxis, ModelProblem};
use motorfit_record::warning::Warning;

/// Returns the warning of a joint fit whose recordings are not of one machine; `None` if they are, or if there is one recording.
pub(super) fn homogeneity(problem: &ModelProblem, refined: &Refined) -> Option<Warning> {
    let compared = |(axis, error): (&ModelAxis, &Option<f64>)| {
        let parameter = &problem.model().parameters()[axis.parameter];
        Compared {
            name: parameter.name.clone(),
            unit: parameter.unit.text.clone(),
            coordinate: axis.range(),
            is_compared: axis.recording.is_none() && error.is_some(),
        }
    };
    let axes = problem.space().free.iter().zip(&refined.uncertainty.std_error).map(compared).collect();
    let names = (0..problem.recordings()).map(|n| problem.recording(n).label(n)).collect();
    differing(problem, refined, axes, Words { machine: "machine", names }).map(|(warning, _)| warning)
}
