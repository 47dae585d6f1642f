//! The selection of a model as a table.

use super::Table;
use crate::identify::{Identification, SelectionStep};
use crate::motor::Extension;
use crate::text::significant;

/// The models that were tried, in their order.
#[must_use]
pub fn selection_table(selection: &[SelectionStep]) -> Table {
    let heads = ["extensions", "free", "current [%]", "speed [%]", "criterion", ""];
    let mut table = Table::new("ladder", "Models that were tried", &heads);
    for step in selection {
        let [current, speed] =
            step.fit_percent.map(|fit| fit.map_or_else(|| "\u{2013}".to_owned(), |fit| format!("{fit:.2}")));
        let gain = step.gain.map_or_else(String::new, |gain| significant(gain, 3));
        let taken = if step.taken { "taken" } else { "" };
        table.row(vec![named(step), step.free.to_string(), current, speed, gain, taken.to_owned()]);
    }
    table.note(
        "Fits in percent. Criterion: Schwarz's, with as many samples as the residuals have independent ones, less that of \
         the model one extension smaller; the lowest is taken while it is well below zero.",
    );
    table
}

fn named(step: &SelectionStep) -> String {
    if step.with.is_empty() {
        return "none".to_owned();
    }
    step.with.iter().map(|e| e.name()).collect::<Vec<_>>().join(", ")
}

/// The selection in a line: what was taken, and how many models were tried.
#[must_use]
pub fn selection_text(found: &Identification) -> Option<String> {
    let selection = found.selection.as_ref()?;
    let taken: Vec<&str> = found.extensions().into_iter().map(Extension::name).collect();
    let what = if taken.is_empty() { "no extension".to_owned() } else { taken.join(", ") };
    Some(format!("{what}; {} models were tried (-v shows them)", selection.len()))
}
