//! Tables of an identification: parameters, fit, feedforward characteristics, the selection of a model.

use super::identified::{window, with_error};
use super::table::{Table, dash};
use crate::analysis::{Characteristic, Characteristics};
use crate::identify::{Identification, IdentifySpec, SelectionStep};
use crate::motor::{Discretization, Extension, Input, Scope};
use crate::text::{decimals, significant};

/// The parameters with what is known of them.
pub(super) fn parameters_table(found: &Identification) -> Table {
    let heads = ["parameter", "value", "unit", "standard error", "95 % interval", "remark"];
    let mut table = Table::new("parameters", "Parameters", &heads);
    for e in found.estimates() {
        let p = e.parameter;
        let remark = match (e.value, e.at_bound) {
            (None, _) => "not identifiable".to_owned(),
            _ if e.fixed => "held".to_owned(),
            (_, Some(side)) => format!("at its {side}"),
            _ => String::new(),
        };
        let of = if let Scope::Recording(n) = e.scope {
            format!(" of recording {}", u64::from(n) + 1)
        } else {
            String::new()
        };
        table.row(vec![
            format!("{}, {}{of}", p.symbol(), p.name()),
            e.value.map_or_else(dash, |value| significant(value, 6)),
            p.unit().to_owned(),
            e.std_error.map_or_else(dash, |error| significant(error, 2)),
            e.ci95.map_or_else(dash, |[low, high]| format!("{} … {}", significant(low, 6), significant(high, 6))),
            remark,
        ]);
    }
    table
}

/// The fit of each channel.
pub(super) fn fit_table(found: &Identification, spec: &IdentifySpec) -> Table {
    let mut table = Table::new("fit", "Fit", &["channel", "fit [%]", "residual", "residual white"]);
    for (channel, (name, unit)) in [("current", "A"), ("speed", "rad/s")].into_iter().enumerate() {
        let white = found.uncertainty.as_ref().and_then(|u| u.whiteness[channel].as_ref());
        let white = white.map_or_else(dash, |w| if w.is_white { "yes" } else { "no" }.to_owned());
        let Some(fit) = found.fit_percent[channel] else { continue };
        let residual = found.residual_sigma[channel].map_or_else(dash, |s| format!("{} {unit}", significant(s, 3)));
        table.named_row(name, [decimals(fit, 3), residual, white]);
    }
    let (criterion, scale) = (spec.criterion.norm.name(), spec.criterion.scale.name());
    table.note(format!("Cost {} ({criterion}, scale {scale}).", significant(found.cost, 4)));
    table
}

/// The characteristics as a table.
pub(super) fn characteristics_table(found: &Identification) -> Table {
    let mut heads = vec!["characteristic".to_owned(), "unit".to_owned(), "output error".to_owned()];
    heads.extend(found.regressions.iter().map(|r| format!("regression over {}", window(r))));
    let mut table = Table::new("characteristics", "Feedforward characteristics (\u{b1} standard error)", &heads);
    let cell = |c: Option<Characteristic>| c.map_or_else(dash, with_error);
    for (n, (name, unit, by_error)) in Characteristics::named_of(found).into_iter().enumerate() {
        let by_regression = found.regressions.iter().map(|r| cell([r.ks, r.kv, r.ka].get(n).copied()));
        table.named_row(&name.replace('_', " "), [unit.to_owned(), cell(by_error)].into_iter().chain(by_regression));
    }
    let beside = match found.regressions.is_empty() {
        true => "A regression of the speed's differences has too little to tell them apart here.",
        false => {
            "The regression takes differences of the measured speed, which flatten what is fast; noise and inductance bias \
             it."
        }
    };
    let symbol = if found.input == Input::Current { "i" } else { "v" };
    table.note(format!(
        "{symbol} = kS sgn(\u{3c9}) + kG + kV \u{3c9} + kA d\u{3c9}/dt. By output error they follow from the parameters. {beside}"
    ));
    table
}

/// The models that were tried, in their order.
#[must_use]
pub fn selection_table(selection: &[SelectionStep]) -> Table {
    let heads = ["extensions", "free", "current [%]", "speed [%]", "criterion", ""];
    let mut table = Table::new("ladder", "Models that were tried", &heads);
    for step in selection {
        let [current, speed] = step.fit_percent.map(|fit| fit.map_or_else(dash, |fit| decimals(fit, 2)));
        let gain = step.gain.map_or_else(String::new, |gain| significant(gain, 3));
        let taken = if step.taken { "taken" } else { "" };
        let extensions = step.with.iter().map(|e| e.name()).collect::<Vec<_>>();
        let name = if extensions.is_empty() { "none".to_owned() } else { extensions.join(", ") };
        table.row([name, step.free.to_string(), current, speed, gain, taken.to_owned()]);
    }
    table.note(
        "Fits in percent. Criterion: Schwarz's, with as many samples as the residuals have independent ones, less that of \
         the model one extension smaller; the lowest is taken while it is well below zero.",
    );
    table
}

/// The selection in a line: what was taken, and how many models were tried.
#[must_use]
pub fn selection_text(found: &Identification) -> Option<String> {
    let tried = found.selection.as_ref()?.len();
    Some(format!("{}; {tried} models were tried (-v shows them)", selected(found)))
}

/// The model that was selected: its extensions, the voltage between samples, the samples that were left out.
pub(super) fn selected(found: &Identification) -> String {
    let taken: Vec<&str> = found.extensions().into_iter().map(Extension::name).collect();
    let what = if taken.is_empty() { "no extension".to_owned() } else { taken.join(", ") };
    let course = match found.model.discretization {
        Discretization::Foh => "; the voltage is a line between its samples",
        _ => "",
    };
    let samples: usize = found.left_out.iter().map(|of| of.samples).sum();
    let left_out = match samples {
        0 => String::new(),
        _ => format!("; {samples} samples left out, where the voltage is undersampled"),
    };
    format!("{what}{course}{left_out}")
}
