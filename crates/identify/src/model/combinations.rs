//! Names of the combinations of parameters that recordings cannot distinguish.

use motorfit_core::numeric::peak;
use motorfit_core::text::{listed, significant};
use motorfit_evaluate::model::ModelProblem;

/// Component, relative to the largest, from which a parameter takes part in a direction.
const PART: f64 = 0.05;
/// Relative difference within which steps of logarithms are equal.
const EQUAL: f64 = 0.02;

/// Returns a sentence on a direction of the coordinates along which the outputs do not change.
pub(super) fn described(problem: &ModelProblem, direction: &[f64]) -> String {
    let (model, space) = (problem.model(), problem.space());
    let largest = peak(direction);
    let name = |n: usize| {
        let axis = &space.free[n];
        let own = &model.parameters()[axis.parameter].name;
        axis.recording.map_or_else(|| own.clone(), |recording| format!("{own}[{recording}]"))
    };
    let parts: Vec<(String, f64, bool)> = direction
        .iter()
        .enumerate()
        .filter(|(_, step)| step.abs() > PART * largest)
        .map(|(n, step)| (name(n), *step, space.free[n].is_logarithmic))
        .collect();
    let names: Vec<&str> = parts.iter().map(|(name, ..)| name.as_str()).collect();
    let is_logarithmic = parts.iter().all(|(.., is_logarithmic)| *is_logarithmic);
    let smallest = parts.iter().map(|(_, step, _)| step.abs()).fold(f64::INFINITY, f64::min);
    let is_equal = parts.iter().all(|(_, step, _)| (step.abs() / smallest - 1.0).abs() < EQUAL);
    match (&parts[..], is_logarithmic && is_equal) {
        ([only], _) => format!("{} has no effect on the outputs", only.0),
        ([a, b], true) if a.1.signum() == b.1.signum() => {
            format!("{0} and {1} cannot be told apart: only the ratio {0}/{1} is identified", a.0, b.0)
        }
        ([a, b], true) => format!("{0} and {1} cannot be told apart: only the product {0}*{1} is identified", a.0, b.0),
        (_, true) if parts.iter().all(|part| part.1.signum() == parts[0].1.signum()) => {
            format!("{} cannot be told apart: only their ratios are identified", listed(&names, "and"))
        }
        _ => {
            let sign = parts.first().map_or(1.0, |part| part.1.signum());
            let steps: Vec<String> = parts.iter().map(|(_, step, _)| significant(sign * step / smallest, 2)).collect();
            let of = if is_logarithmic { "their logarithms" } else { "their coordinates" };
            format!(
                "{} cannot be told apart: steps of {of} in the ratio {} leave the outputs unchanged",
                listed(&names, "and"),
                steps.join(" : ")
            )
        }
    }
}
