//! Inputs, and how they act on the equations: with an offset, a delay and a latency.

use super::document::Entry;
use super::names::{Names, in_si, undelayed};
use super::parts::ModelInput;
use super::sections::{Delayed, number_of, unit};
use crate::graph::Leaf;
use motorfit_core::Result;
use motorfit_core::units::Dimension;

/// How an input acts on the equations.
pub(super) struct Acting<'d> {
    name: String,
    dimension: Dimension,
    offset: Option<Entry<'d>>,
    /// Delay and latency.
    late: [Option<Entry<'d>>; 2],
}

impl Acting<'_> {
    pub fn is_delayed(&self) -> bool {
        self.late.iter().any(Option::is_some)
    }
}

/// Reads the inputs, and how they act.
pub(super) fn inputs<'d>(names: &mut Names<'d>) -> Result<(Vec<ModelInput>, Vec<Acting<'d>>)> {
    let document = names.document;
    let (mut inputs, mut acting) = (Vec::new(), Vec::new());
    for (number, entry) in (0_u16..).zip(document.section("inputs")?) {
        names.declare(&entry)?;
        let keys = ["unit", "column", "default", "offset", "delay", "latency", "description"];
        let [written, column, default, offset, delay, latency, _] = document.fields(&entry, keys)?;
        let unit = unit(document, written.as_ref())?;
        let dimension = unit.unit.dimension;
        let id = in_si(&mut names.scope.graph, Leaf::Input(number), &unit.unit);
        names.set(entry.key, id, dimension);
        let column = column.map(|column| document.text(&column).map(|(text, _)| text.to_owned())).transpose()?;
        let default = default.map(|default| document.number(&default)).transpose()?;
        inputs.push(ModelInput { name: entry.key.to_owned(), unit, column, default, is_offset: offset.is_some() });
        acting.push(Acting { name: entry.key.to_owned(), dimension, offset, late: [delay, latency] });
    }
    Ok((inputs, acting))
}

/// Gives the names of inputs the signals that act; returns the delayed ones. Nothing that uses an input may have been resolved.
pub(super) fn act<'d>(names: &mut Names<'d>, acting: Vec<Acting<'d>>) -> Result<Vec<Delayed<'d>>> {
    let mut delayed = Vec::new();
    for input in acting {
        let Some(mut value) = names.scope.names.get(&input.name).copied() else { continue };
        if let Some(offset) = &input.offset {
            let what = format!("the offset of {}", input.name);
            let offset = number_of(names, offset, input.dimension, &what)?;
            value.id = names.scope.graph.add(value.id, offset);
            names.set(&input.name, value.id, input.dimension);
        }
        if input.is_delayed() {
            let leaf = Leaf::Memory(u16::try_from(delayed.len()).unwrap_or(u16::MAX));
            names.scope.names.insert(undelayed(&input.name), value);
            let id = names.scope.graph.leaf(leaf);
            names.set(&input.name, id, input.dimension);
            delayed.push((input.name, input.late));
        }
    }
    Ok(delayed)
}
