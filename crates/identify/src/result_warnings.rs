//! Warnings about the result of a fit of any machine.

use super::result::Identification;
use super::verify::Status;
use crate::analysis::{EXPLAINED_MIN, ResidualTest, poor_fit};
use motorfit_core::setting::text;
use motorfit_core::text::significant;
use motorfit_record::warning::Warning;

/// Smallest factor of the standard errors for correlated residuals that is named: 1.1 after rounding.
const WIDENED_MIN: f64 = 1.05;

/// Returns the warnings about the fit.
pub(super) fn of_fit<M>(found: &Identification<M>) -> Vec<Warning> {
    let mut warnings: Vec<Warning> = not_separated(found).into_iter().collect();
    warnings.extend(poor_fit(&found.outputs, &found.fit_percent));
    if !found.converged {
        let message = "the refinement has not converged: the result may only be near the optimum";
        warnings.push(Warning::new("not_converged", message));
    }
    warnings.extend(residuals_not_white(found));
    if found.verification.status == Status::SearchStuck {
        let times = significant(1.0 + found.verification.cost_gap.unwrap_or(f64::NAN), 3);
        let rescued = found.uncertainty.is_some() && found.verification.refined_agrees;
        let what = if rescued { "the refinement reached that optimum" } else { "the global search found that optimum" };
        let message = text!(
            "the search ended where the weighted sum of squares is {times} times that of the best optimum; {what}; use "
            [Method = "auto"] ", more " [Generations] " or another " [Seed]
        );
        warnings.push(Warning::new("search_stuck", message));
    }
    warnings
}

/// Returns the warning about a parameter that ended at a bound; `is_idle` if it has no effect there.
pub(super) fn at_bound(name: &str, side: &str, is_idle: bool) -> Warning {
    if is_idle {
        let message =
            format!("{name} ended at its {side} bound, where it has no effect: the recordings do not show it");
        return Warning::new("extension_idle", message);
    }
    let rest = "; otherwise the other estimates are valid only if it is right";
    Warning::new("at_bound", text!("{name} ended at its {side} bound; widen it with " [Bounds] {rest}))
}

/// Returns the warning about correlated residuals.
fn residuals_not_white<M>(found: &Identification<M>) -> Option<Warning> {
    let uncertainty = found.uncertainty.as_ref()?;
    let outputs = found.outputs.iter().zip(&uncertainty.whiteness);
    let coloured = outputs.filter_map(|(output, white)| Some((output, (*white)?))).filter(|(_, white)| !white.is_white);
    let list: Vec<String> =
        coloured.map(|(output, white)| format!("{} ({:.2} at lag 1)", output.name, white.lag1)).collect();
    let errors = match uncertainty.widened_by >= WIDENED_MIN {
        true => {
            let by = significant(uncertainty.widened_by, 2);
            format!("allow for that and are up to {by} times those of white residuals")
        }
        false => "need no widening for it".to_owned(),
    };
    let message = format!(
        "the residuals are correlated, {}: the model lacks an effect, or the sensors filter; the standard errors {errors}",
        list.join(", ")
    );
    (!list.is_empty()).then(|| Warning::new("residuals_not_white", message))
}

/// Returns the warning about alternative models that fit as well as the selected one; `None` without alternatives.
fn not_separated<M>(found: &Identification<M>) -> Option<Warning> {
    let fits = |fit: &[Option<f64>]| {
        let list = found.outputs.iter().zip(fit);
        list.filter_map(|(output, fit)| Some(format!("{} {:.2} %", output.name, (*fit)?)))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let others = found.alternatives.iter().map(|of| format!("{} ({})", of.with.join(", "), fits(&of.fit_percent)));
    let others: Vec<String> = others.collect();
    (!others.is_empty()).then(|| {
        let taken = found.with.join(", ");
        let message = format!(
            "the recordings do not distinguish the model {taken} ({}) from {}; its parameters are valid only if it is \
             the right one",
            fits(&found.fit_percent),
            others.join(" or ")
        );
        Warning::new("not_separated", message)
    })
}

/// Returns the warning about residuals that depend on an input. `outputs` and `input` are their names in a sentence, as `the current`.
pub(super) fn residuals_follow_input<M>(
    found: &Identification<M>,
    recordings: &[String],
    outputs: &[String],
    input: &str,
) -> Option<Warning> {
    let follows = |test: &ResidualTest| test.voltage.filter(|v| !v.is_independent).map(|v| v.explained_percent);
    let mut list: Vec<String> = Vec::new();
    for (number, output) in outputs.iter().enumerate() {
        let each = found.residual_tests.iter().zip(recordings);
        let each = each.filter_map(|(tests, name)| Some((follows(tests.get(number)?.as_ref()?)?, name)));
        let Some((explained, recording)) = each.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        if explained >= EXPLAINED_MIN {
            let place = if recordings.len() > 1 { format!(" in {recording}") } else { String::new() };
            list.push(format!("{} % of the residuals of {output}{place}", significant(explained, 2)));
        }
    }
    let message = format!(
        "the model lacks an effect of {input}, on which {} depend; the parameters may be biased by more than their standard errors",
        list.join(" and ")
    );
    (!list.is_empty()).then(|| Warning::new("residuals_follow_voltage", message))
}
