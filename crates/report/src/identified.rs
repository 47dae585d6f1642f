//! Parts of an identification as text: feedforward characteristics, residual tests and the noise floor.

use motorfit_core::text::{engineering, significant};
use motorfit_identify::Identification;
use motorfit_identify::analysis::{
    Characteristic, Characteristics, NoiseFloor, Regression, ResidualTest, ResidualTests,
};

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

/// Returns the verdicts over recordings whether the residuals are white and independent of the voltage, each for
/// current and speed; a dash marks a channel without a test.
#[must_use]
pub fn verdicts(tests: &[ResidualTests]) -> [String; 2] {
    let of = |verdict: &dyn Fn(&ResidualTest) -> Option<bool>| {
        let channel = |channel: usize| {
            let verdicts: Vec<bool> = tests.iter().filter_map(|t| verdict(t[channel].as_ref()?)).collect();
            match (verdicts.iter().filter(|good| !**good).count(), verdicts.len()) {
                (_, 0) => "\u{2013}".to_owned(),
                (0, _) => "yes".to_owned(),
                (_, 1) => "no".to_owned(),
                (bad, all) => format!("no in {bad} of {all}"),
            }
        };
        format!("{}, {}", channel(0), channel(1))
    };
    [of(&|test| Some(test.whiteness.is_white)), of(&|test| test.voltage.map(|v| v.is_independent))]
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
