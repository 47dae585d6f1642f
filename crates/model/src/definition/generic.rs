//! Terms that any model can have: delays of its inputs, sensors that are late, offsets, a constant load.
//!
//! Each is an option of inputs, signals or outputs with new parameters, so that the model with it is a text of its own.

use super::document::Document;
use super::draft::{Draft, quote};
use super::model::Model;
use super::parts::{ModelInput, WrittenUnit};
use crate::graph::{Id, Leaf};
use motorfit_core::Result;
use motorfit_core::named::{Named as _, named};

/// Heading of the input that is a load torque: a disturbance, which no drive delays.
const LOAD_TORQUE: &str = "load_torque";

/// The signals of a model that a term acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum On {
    /// All inputs but a load torque, and delayed signals.
    Inputs,
    /// All outputs, by one parameter.
    Outputs,
    /// All outputs, each by a parameter of its own, in the unit of the output if the row has none.
    EachOutput,
    /// The load torque.
    Load,
}

/// A row: the option that is added to what it acts on, and its parameter.
#[derive(Debug, Clone, Copy)]
struct Row {
    on: On,
    key: &'static str,
    parameter: &'static str,
    /// Unit; `None` for that of the signal, in which the bounds are in SI units.
    unit: Option<&'static str>,
    bounds: [f64; 2],
    neutral: f64,
    is_per_recording: bool,
}

const fn row(on: On, [key, parameter]: [&'static str; 2], unit: Option<&'static str>, bounds: [f64; 2]) -> Row {
    Row { on, key, parameter, unit, bounds, neutral: 0.0, is_per_recording: false }
}

named! {
    /// A term that any model can have beside its own.
    pub enum GenericTerm: Row {
        /// A dead time: inputs that have no delay yet, other than a load torque, act later.
        DeadTime = "dead-time" => row(On::Inputs, ["delay", "dead_time"], Some("s"), [0.0, 0.05]),
        /// A start latency: a delay of the first movement of the inputs, estimated for each recording.
        Latency = "latency" => Row {
            is_per_recording: true,
            ..row(On::Inputs, ["latency", "latency"], Some("s"), [0.0, 0.2])
        },
        /// Sensors with a lag of first order, of one time constant.
        SensorFilter = "sensor-filter" => row(On::Outputs, ["filter", "sensor_filter"], Some("s"), [0.0, 0.05]),
        /// Sensors that output a moving average of samples.
        SensorAverage = "sensor-average" => Row {
            neutral: 1.0,
            ..row(On::EachOutput, ["average", "average"], Some("1"), [1.0, 50.0])
        },
        /// Offsets of the outputs.
        Offset = "offset" => row(On::EachOutput, ["offset", "offset"], None, [-10.0, 10.0]),
        /// A constant load torque, of a model with a load torque as input.
        Load = "load" => row(On::Load, ["offset", "load"], None, [-1.0, 1.0]),
    }
}

impl GenericTerm {
    /// Returns true if the term acts on anything of a model that does not have it already.
    #[must_use]
    pub fn applies(self, model: &Model) -> bool {
        Document::parse(&model.text).is_ok_and(|document| !targets(self, model, &Draft::of(&document)).is_empty())
    }
}

impl Model {
    /// Returns the generic terms that apply to the model; one whose name is that of a term of its own does not.
    #[must_use]
    pub fn generic_terms(&self) -> Vec<GenericTerm> {
        let is_own = |term: &GenericTerm| self.terms().iter().any(|own| own.name == term.name());
        GenericTerm::ALL.into_iter().filter(|term| !is_own(term) && term.applies(self)).collect()
    }

    /// Returns the model with generic terms. Each is an optional term of its name, after those of the model and in the order of the list,
    /// with parameters after those of the model; a name that the model has already gets a number. Terms that do not apply are left out.
    /// The text of the result is a model by itself; comments of the text are left out.
    ///
    /// # Errors
    /// Returns `Data` if the model exceeds a limit of size with them.
    pub fn with_generic(&self, terms: &[GenericTerm]) -> Result<Self> {
        let mut model = self.clone();
        for term in terms {
            let text = {
                let document = Document::parse(&model.text)?;
                let mut draft = Draft::of(&document);
                let targets = targets(*term, &model, &draft);
                if targets.is_empty() {
                    continue;
                }
                add(*term, &model, &mut draft, &targets);
                draft.text()
            };
            model = Self::parse(&text)?;
        }
        Ok(model)
    }
}

/// An item of a section that a term acts on, with its unit.
struct Target {
    section: &'static str,
    item: String,
    unit: WrittenUnit,
}

/// Returns what a term acts on in a model.
fn targets(term: GenericTerm, model: &Model, draft: &Draft) -> Vec<Target> {
    let Row { on, key, .. } = term.row();
    let is_load = |input: &ModelInput| input.column.as_deref().unwrap_or(&input.name) == LOAD_TORQUE;
    let one = model.parameters.first().map(|of| of.unit.clone());
    let lacking = |section| draft.without(section, key);
    match on {
        On::Outputs | On::EachOutput => {
            let names = lacking("outputs");
            let own = model.outputs.iter().filter(|output| names.contains(&output.name.as_str()));
            own.map(|of| Target { section: "outputs", item: of.name.clone(), unit: of.unit.clone() }).collect()
        }
        On::Inputs | On::Load => {
            let (names, leaves) = (lacking("inputs"), used(model));
            let in_signals = inputs_of_signals(model);
            let fits = |(n, input): &(usize, &ModelInput)| {
                let is_used = leaves.contains(&Leaf::Input(u16::try_from(*n).unwrap_or(u16::MAX)));
                let is_wanted = is_load(input) == (on == On::Load) && (on == On::Load || !in_signals.contains(n));
                names.contains(&input.name.as_str()) && is_used && is_wanted
            };
            let own = model.inputs.iter().enumerate().filter(fits);
            let own = own.map(|(_, of)| Target { section: "inputs", item: of.name.clone(), unit: of.unit.clone() });
            let signals = lacking("signals").into_iter().filter(|_| on == On::Inputs);
            let late = |name: &&str| model.delayed.iter().any(|of| of.name == **name);
            let signals = signals.filter(late).zip(std::iter::repeat(one).flatten());
            own.chain(signals.map(|(name, unit)| Target { section: "signals", item: name.to_owned(), unit })).collect()
        }
    }
}

/// Returns the leaves that the equations use.
fn used(model: &Model) -> Vec<Leaf> {
    let mut roots: Vec<Id> = model.states.iter().map(|state| state.derivative).collect();
    roots.extend(model.outputs.iter().map(|output| output.value));
    roots.extend(model.delayed.iter().map(|of| of.value));
    roots.extend(model.laws.iter().map(|law| law.value));
    roots.extend(model.reactions.iter().map(|of| of.limit));
    model.graph.leaves(&roots)
}

/// Returns the numbers of the inputs that act by delayed signals.
fn inputs_of_signals(model: &Model) -> Vec<usize> {
    let is_input = |name: &str| model.inputs.iter().any(|input| input.name == name);
    let signals = model.delayed.iter().filter(|of| !is_input(&of.name)).map(|of| of.value);
    let leaves = model.graph.leaves(&signals.collect::<Vec<Id>>());
    leaves.into_iter().filter_map(|leaf| if let Leaf::Input(n) = leaf { Some(usize::from(n)) } else { None }).collect()
}

/// Adds a term to the text of a model.
fn add(term: GenericTerm, model: &Model, draft: &mut Draft, targets: &[Target]) {
    let row = term.row();
    let of_model = unused(term.name(), "-", |name| model.terms.iter().any(|term| term.name == name));
    let mut parameter: Option<String> = None;
    for target in targets {
        let name = match &parameter {
            Some(shared) if row.on != On::EachOutput => shared.clone(),
            _ => {
                let wanted = if row.on == On::EachOutput {
                    format!("{}_{}", row.parameter, identifier(&target.item))
                } else {
                    row.parameter.to_owned()
                };
                let name = unused(&wanted, "_", |name| draft.has(name));
                draft.add("parameters", &name, &parameter_keys(term, &of_model, &target.unit));
                name
            }
        };
        draft.set(target.section, &target.item, row.key, &name);
        parameter = Some(name);
    }
}

/// Returns the keys of a parameter.
fn parameter_keys(term: GenericTerm, of_model: &str, signal: &WrittenUnit) -> Vec<(&'static str, String)> {
    let Row { unit, bounds: [min, max], neutral, is_per_recording, .. } = term.row();
    // The difference of two temperatures is one in kelvin.
    let (unit, factor) = match unit {
        Some(unit) => (unit, 1.0),
        None if signal.unit.offset != 0.0 => ("K", 1.0),
        None => (signal.text.as_str(), signal.unit.factor),
    };
    let number = |value: f64| format!("{value:?}");
    let mut keys = vec![("unit", quote(unit)), ("min", number(min / factor)), ("max", number(max / factor))];
    keys.extend([("neutral", number(neutral)), ("term", quote(of_model))]);
    if is_per_recording {
        keys.push(("per_recording", "true".to_owned()));
    }
    keys.push(("description", quote(term.text())));
    keys
}

/// Returns the name itself, or with the first number from 2 on with which it is not taken.
fn unused(name: &str, joint: &str, is_taken: impl Fn(&str) -> bool) -> String {
    let mut own = name.to_owned();
    let mut number = 2;
    while is_taken(&own) {
        own = format!("{name}{joint}{number}");
        number += 1;
    }
    own
}

/// Returns a name of an output as a part of a name in equations.
fn identifier(name: &str) -> String {
    let character = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    name.chars().take(40).map(character).collect()
}

#[cfg(test)]
#[path = "generic_tests.rs"]
mod tests;
