//! Cells of the tables of a comparison, and the names of its settings.

use crate::table::dash;
use motorfit_core::text::{decimals, significant};
use motorfit_identify::Method;
use motorfit_optimize::Coordinates;
use motorfit_study::compare::ComparisonSetting;

/// Describes a setting: criterion, scale, budget and changed hyperparameters.
#[must_use]
pub fn setting_name(setting: &ComparisonSetting) -> String {
    let criterion = setting.criterion.norm.name();
    let scale = setting.criterion.scale.name();
    let own: String = setting.methods.iter().filter_map(changed).map(|own| format!("; {own}")).collect();
    let coordinates = match setting.coordinates {
        Coordinates::None => String::new(),
        other => format!(", transform {other}"),
    };
    let (population, generations) = (setting.population, setting.generations);
    format!("{criterion}, scale {scale}, {population} agents × {generations} generations{coordinates}{own}")
}

/// Describes the hyperparameters of a method that differ from their defaults; `None` if none does.
fn changed(method: &Method) -> Option<String> {
    let changed = method.search()?.changed();
    let differing: Vec<String> = changed.into_iter().map(|(name, value)| format!("{name}: {value}")).collect();
    (!differing.is_empty()).then(|| format!("{} {}", method.name(), differing.join(", ")))
}

/// Formats a number for a cell; NaN is a dash.
pub(crate) fn cell(value: f64, digits: usize) -> String {
    match value {
        v if v.is_nan() => dash(),
        v if v.is_infinite() => "diverged".to_owned(),
        v => significant(v, digits),
    }
}

/// Formats a number with four decimals, zero without a sign.
pub(super) fn fixed(value: f64) -> String {
    let text = decimals(value, 4);
    if text == "-0.0000" { "0.0000".to_owned() } else { text }
}

/// Formats a percentage with two decimals, or with none from 100 % on.
pub(super) fn percent(value: f64) -> String {
    match value {
        v if v.is_nan() => dash(),
        v if v < 100.0 => decimals(v, 2),
        v => decimals(v, 0),
    }
}
