//! Test of whether all recordings of a joint fit are of one machine.

use crate::analysis::{Compared, JointFit, RECORDINGS_MAX};
use motorfit_estimate::{Refined, separate_fits};
use motorfit_evaluate::model::{ModelAxis, ModelProblem};
use motorfit_record::warning::Warning;

/// Returns the warning of a joint fit whose recordings are not of one machine; `None` if they are, or if there is one recording.
pub(super) fn homogeneity(problem: &ModelProblem, refined: &Refined) -> Option<Warning> {
    if !(2..=RECORDINGS_MAX).contains(&problem.recordings()) {
        return None;
    }
    let own = separate_fits(problem, refined)?;
    let compared = |(axis, error): (&ModelAxis, &Option<f64>)| {
        let parameter = &problem.model().parameters()[axis.parameter];
        Compared {
            name: parameter.name.clone(),
            unit: parameter.unit.text.clone(),
            coordinate: axis.range(),
            is_compared: axis.recording.is_none() && error.is_some(),
        }
    };
    let axes: Vec<Compared> = problem.space().free.iter().zip(&refined.uncertainty.std_error).map(compared).collect();
    let names: Vec<String> = (0..problem.recordings()).map(|n| problem.recording(n).label(n)).collect();
    let (rank, sigmas) = (refined.uncertainty.rank, &refined.sigmas);
    JointFit { machine: "machine", names: &names, axes: &axes, rank, sigmas, own: &own }.differing().map(|(of, _)| of)
}
