//! Parts of an identification as text: feedforward characteristics, residual tests and the noise floor.

use motorfit_core::text::{engineering, significant};
use motorfit_estimate::ReferenceKind;
use motorfit_identify::analysis::{
    Characteristic, Characteristics, NoiseFloor, Regression, ResidualTest, ResidualTests,
};
use motorfit_identify::{Identification, Status};

/// Returns the identifiable characteristics as labelled lines, then the regression over the widest window if there is one.
#[must_use]
pub fn characteristics_lines(found: &Identification) -> Vec<(&'static str, String)> {
    let of = |list: &[(&str, &str, Option<Characteristic>)]| {
        let one = |(name, unit, c): &(&str, &str, Option<Characteristic>)| {
            c.map(|c| format!("{} {} {unit}", name.replace('_', " "), with_error(c)))
        };
        list.iter().filter_map(one).collect::<Vec<_>>().join(", ")
    };
    let named = Characteristics::named_of(found);
    let mut lines = match Characteristics::of(found) {
        // The others are in the table of estimates.
        Some(_) if !found.identified.is_empty() => vec![(found.input.name(), of(&named[4..5]))],
        Some(_) => vec![(found.input.name(), of(&named[..4])), ("", of(&named[4..]))],
        None => Vec::new(),
    };
    if let Some(r) = found.regressions.last() {
        // Noise and inductance bias a regression by many of its standard errors, which are therefore not shown.
        let values = [("kS", named[0].1, r.ks), ("kV", named[1].1, r.kv), ("kA", named[2].1, r.ka)];
        let values = values.map(|(name, unit, c)| (name, unit, Some(c.without_error())));
        let how = format!("by regression on differences over {}, biased by noise and inductance", window(r));
        lines.push(("", format!("{} {how}", of(&values))));
    }
    lines
}

pub(super) fn window(regression: &Regression) -> String {
    format!("{} ({} samples)", engineering(regression.window_s, "s", 3), regression.window_samples)
}

/// Formats a value to five significant digits, with its standard error if it has one.
pub(super) fn with_error(c: Characteristic) -> String {
    let error = c.std_error.map_or(String::new(), |e| format!(" \u{b1} {}", significant(e, 2)));
    format!("{}{error}", significant(c.value, 5))
}

/// Returns the verdicts over recordings whether the residuals are white and independent of the inputs, shape `[2][outputs]`; a dash
/// marks an output without a test.
#[must_use]
pub fn verdicts(tests: &[ResidualTests], outputs: usize) -> [Vec<String>; 2] {
    let of = |verdict: &dyn Fn(&ResidualTest) -> Option<bool>| {
        let one = |output: usize| {
            let verdicts: Vec<bool> = tests.iter().filter_map(|t| verdict(t.get(output)?.as_ref()?)).collect();
            match (verdicts.iter().filter(|good| !**good).count(), verdicts.len()) {
                (_, 0) => "\u{2013}".to_owned(),
                (0, _) => "yes".to_owned(),
                (_, 1) => "no".to_owned(),
                (bad, all) => format!("no in {bad} of {all}"),
            }
        };
        (0..outputs).map(one).collect()
    };
    [of(&|test| Some(test.whiteness.is_white)), of(&|test| test.voltage.map(|v| v.is_independent))]
}

/// Describes the verification of a result.
#[must_use]
pub fn verdict<M>(found: &Identification<M>) -> String {
    let check = &found.verification;
    let reference = match check.reference {
        Some(ReferenceKind::VariableProjection) => "a global search (variable projection)",
        Some(_) => "refinements from starts spread over the bounds",
        None => "no reference",
    };
    let gap = check.cost_gap.map_or(String::new(), |gap| format!(" {} %", significant(100.0 * gap, 2)));
    let reached = match check.reference {
        Some(ReferenceKind::MultiStart) => format!(" ({} of {} starts)", check.arrivals, check.starts),
        _ => String::new(),
    };
    match check.status {
        Status::Agrees if check.cost_gap.is_some_and(|gap| gap > 1e-6) => {
            format!("agrees with {reference}: the same optimum, with a weighted sum of squares{gap} above the lowest")
        }
        Status::Agrees => format!("agrees with {reference}{reached}"),
        Status::SearchStuck if check.refined_agrees && found.uncertainty.is_some() => format!(
            "search stuck at a weighted sum of squares{gap} above the lowest; the refinement agrees with {reference}"
        ),
        Status::SearchStuck => {
            format!("search stuck at a weighted sum of squares{gap} above that of a better optimum, from {reference}")
        }
        Status::ReferenceFailed if check.cost_gap.is_some_and(|gap| gap < -1e-6) => {
            format!("reference failed: {reference} ended in a worse optimum")
        }
        Status::ReferenceFailed => format!("inconclusive: {reference} did not agree on one optimum{reached}"),
        Status::NotApplicable => "not verified: no reference is available for this fit".to_owned(),
    }
}

/// Describes the noise floor.
#[must_use]
pub fn noise_floor_text(found: &NoiseFloor) -> String {
    let channels = ["current", "speed"].into_iter().zip(found.best_achievable_percent);
    let to: Vec<String> = channels.filter_map(|(name, p)| Some(format!("{name} {:.2} %", p?))).collect();
    let count: usize = found.groups.iter().map(Vec::len).sum();
    format!(
        "{count} recordings with the same input limit the fit to {}; no model is expected to fit better",
        to.join(", ")
    )
}
