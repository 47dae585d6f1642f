//! The table of feedforward characteristics.

use super::identified::{window, with_error};
use super::table::{Table, dash};
use crate::analysis::{Characteristic, Characteristics};
use crate::identify::Identification;
use crate::motor::Input;

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
