//! The selection of the optional terms of a model, in words and as a table.

use crate::identified_tables::SELECTION_NOTE;
use crate::table::{Table, dash};
use motorfit_core::text::{decimals, significant};
use motorfit_identify::model::ModelIdentification;
use motorfit_model::Model;

/// Returns the table of the models that the selection fitted, in their order; `None` if the terms were given.
#[must_use]
pub fn model_selection_table(model: &Model, found: &ModelIdentification) -> Option<Table> {
    let selection = found.selection.as_ref()?;
    let fits = model.outputs().iter().map(|output| format!("{} [%]", output.name));
    let heads: Vec<String> = ["terms", "free"]
        .into_iter()
        .map(str::to_owned)
        .chain(fits)
        .chain(["ΔBIC".to_owned(), String::new()])
        .collect();
    let mut table = Table::new("selection", "Model selection", &heads.iter().map(String::as_str).collect::<Vec<_>>());
    for step in &selection.steps {
        let fits = step.fit_percent.iter().map(|fit| fit.map_or_else(dash, |fit| decimals(fit, 2)));
        let gain = step.gain.map_or_else(String::new, |gain| significant(gain, 3));
        let taken = if step.taken { "selected" } else { "" };
        let row = [listed(&step.with), step.free.to_string()].into_iter().chain(fits);
        table.row(row.chain([gain, taken.to_owned()]));
    }
    table.note(SELECTION_NOTE);
    Some(table)
}

/// Describes the selection in a line: the selected terms, and the number of models that were fitted; `None` if the terms were given.
#[must_use]
pub fn model_selection_text(found: &ModelIdentification) -> Option<String> {
    let selection = found.selection.as_ref()?;
    let tried = selection.steps.len();
    Some(format!("{}; {tried} models were compared (listed by -v)", listed(&selection.with)))
}

fn listed(terms: &[String]) -> String {
    if terms.is_empty() { "no optional term".to_owned() } else { terms.join(", ") }
}
