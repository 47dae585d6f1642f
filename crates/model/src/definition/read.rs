//! Reading of a model: sections in the order in which they need each other.

use super::check;
use super::document::{Document, Entry};
use super::inputs::{act, inputs};
use super::model::Model;
use super::names::Names;
use super::parts::{DerivedQuantity, Equation, InitialState, ModelOutput, ModelState, NodeId};
use super::sections::{constants, definitions, delays, number_of, parameters, required, unit};
use crate::graph::{Id, Leaf};
use crate::role::Role;
use motorfit_core::Result;
use motorfit_core::named::Named as _;
use motorfit_core::text::{nearest, quoted};
use motorfit_core::units::Dimension;

/// Largest number of items of a section.
pub(crate) const DECLARED_MAX: usize = 64;

/// Sections whose items are names or equations.
const SECTIONS: [&str; 9] =
    ["inputs", "constants", "parameters", "signals", "let", "states", "outputs", "derived", "export"];

impl Model {
    /// Reads a model from its text.
    ///
    /// # Errors
    /// Returns `Data` with line and column if the text is not TOML, a section, key or name is unknown, an expression cannot be read,
    /// units do not fit, or the model exceeds a limit of size.
    pub fn parse(text: &str) -> Result<Self> {
        let document = Document::parse(text)?;
        let name = heading(&document)?;
        let mut names = Names::new(&document);
        let (inputs, acting) = inputs(&mut names)?;
        let constants = constants(&mut names)?;
        let (parameters, terms) = parameters(&mut names)?;
        let states = document.section("states")?;
        for (number, state) in (0_u16..).zip(&states) {
            names.declare(state)?;
            let [written] = document.fields(state, ["unit", "d", "initial", "description"]).map(|[unit, ..]| [unit])?;
            let unit = unit(&document, written.as_ref())?.unit;
            // States count from the zero of their unit: 25 degC is far from 0 K, about which affine parts would be poor.
            let graph = &mut names.scope.graph;
            let (leaf, offset) = (graph.leaf(Leaf::State(number)), graph.constant(unit.offset));
            let id = graph.add(leaf, offset);
            names.set(state.key, id, unit.dimension);
        }
        let of_inputs = acting.iter().filter(|input| input.is_delayed()).count();
        let signals = definitions(&mut names, of_inputs)?;
        names.scope.delayed = of_inputs + signals.len();
        let mut delayed = act(&mut names, acting)?;
        delayed.extend(signals);
        for section in ["signals", "let"] {
            for entry in document.section(section)? {
                names.resolve(entry.key)?;
                check::signal(&names, section, &entry)?;
            }
        }
        let delayed = delays(&mut names, delayed)?;
        let (outputs, measured) = outputs(&mut names)?;
        let states = states.iter().map(|entry| state(&mut names, entry, &measured)).collect::<Result<_>>()?;
        let derived = derived(&mut names)?;
        let roles = roles(&mut names)?;
        let (graph, reactions, laws) = (names.scope.graph, names.scope.reactions, names.scope.laws);
        let equations = equations(&document)?;
        let text = text.to_owned();
        let model = Self {
            text,
            name,
            graph,
            constants,
            parameters,
            terms,
            inputs,
            delayed,
            laws,
            states,
            reactions,
            outputs,
            equations,
            derived,
            roles,
        };
        check::model(&document, &model)?;
        super::terms::check(&document, &model)?;
        Ok(model)
    }
}

/// Checks the keys of the text and returns the name of the model.
fn heading(document: &Document<'_>) -> Result<String> {
    let (mut format, mut name) = (None, None);
    for entry in document.entries() {
        match entry.key {
            "format" => format = Some(entry),
            "name" => name = Some(document.text(&entry)?.0.to_owned()),
            "description" => drop(document.text(&entry)?),
            key if SECTIONS.contains(&key) => {
                let count = document.section(key)?.len();
                if count > DECLARED_MAX {
                    let message = format!("{key} has {count} items, expected at most {DECLARED_MAX}");
                    return Err(document.error(entry.at, message, "Leave out what the recordings cannot show."));
                }
            }
            key => {
                let hint = match nearest(key, &SECTIONS) {
                    Some(near) => format!("Did you mean \"{near}\"?"),
                    None => format!("The keys are format, name, description and the sections {}.", SECTIONS.join(", ")),
                };
                return Err(document.error(entry.at, format!("{} is not a section of a model", quoted(key)), hint));
            }
        }
    }
    match format {
        Some(entry) if Document::number_of(entry.value) == Some(1.0) => {}
        Some(entry) => {
            return Err(document.error(entry.value.span().start, "the format is not known", "Write format = 1."));
        }
        None => return Err(document.error(0, "the format is missing", "Write format = 1 in the first line.")),
    }
    Ok(name.unwrap_or_else(|| "model".to_owned()))
}

/// Reads the outputs; also returns the node of each in SI units.
fn outputs(names: &mut Names<'_>) -> Result<(Vec<ModelOutput>, Vec<Id>)> {
    let document = names.document;
    let (mut outputs, mut nodes): (Vec<ModelOutput>, Vec<Id>) = Default::default();
    for entry in document.section("outputs")? {
        if outputs.iter().any(|output| output.name == entry.key) {
            return Err(document.error(
                entry.at,
                format!("{} is there twice", quoted(entry.key)),
                "Name it otherwise.",
            ));
        }
        let keys = ["value", "unit", "column", "gain", "offset", "filter", "delay", "average", "description"];
        let [value, written, column, gain, offset, filter, delay, average, _] = document.fields(&entry, keys)?;
        let value = required(document, &entry, value, "value")?;
        let unit = unit(document, written.as_ref())?;
        let what = format!("output {}", entry.key);
        let id = names.value(&value, Some(unit.unit.dimension), &what, false)?.id;
        if names.scope.graph.leaves(&[id]).iter().any(|leaf| matches!(leaf, Leaf::Reaction(_))) {
            let hint = "Reactions are known at the end of a step only. Give the output without the stick function.";
            return Err(document.error(value.value.span().start, "an output depends on stick", hint));
        }
        nodes.push(id);
        let mut number = |of: Option<Entry<'_>>, dimension: Dimension, what: &str| {
            of.map(|of| number_of(names, &of, dimension, what)).transpose()
        };
        let gain = number(gain, Dimension::ONE, "the gain of an output")?;
        let offset = number(offset, unit.unit.dimension, "the offset of an output")?;
        let filter = number(filter, Dimension::TIME, "the filter of an output")?;
        let delay = number(delay, Dimension::TIME, "the delay of an output")?;
        let average = number(average, Dimension::ONE, "the average")?;
        let column = column.map(|column| document.text(&column).map(|(text, _)| text.to_owned())).transpose()?;
        let graph = &mut names.scope.graph;
        let (factor, zero) = (graph.constant(1.0 / unit.unit.factor), graph.constant(unit.unit.offset));
        let shifted = graph.subtract(id, zero);
        let gained = gain.map_or(shifted, |gain| graph.multiply(gain, shifted));
        let value = offset.map_or(gained, |offset| graph.add(gained, offset));
        let value = graph.multiply(factor, value);
        outputs.push(ModelOutput { name: entry.key.to_owned(), unit, column, value, filter, delay, average });
    }
    Ok((outputs, nodes))
}

/// Reads the quantities that the model derives from its parameters.
fn derived(names: &mut Names<'_>) -> Result<Vec<DerivedQuantity>> {
    let document = names.document;
    let mut all = Vec::new();
    for entry in document.section("derived")? {
        let [value, written, _] = document.fields(&entry, ["value", "unit", "description"])?;
        let value = required(document, &entry, value, "value")?;
        let unit = unit(document, written.as_ref())?;
        let what = format!("the derived quantity {}", entry.key);
        let id = number_of(names, &value, unit.unit.dimension, &what)?;
        let graph = &mut names.scope.graph;
        let (factor, zero) = (graph.constant(1.0 / unit.unit.factor), graph.constant(unit.unit.offset));
        let shifted = graph.subtract(id, zero);
        all.push(DerivedQuantity { name: entry.key.to_owned(), unit, value: graph.multiply(factor, shifted) });
    }
    Ok(all)
}

/// Reads the roles of values in the files of simulators.
fn roles(names: &mut Names<'_>) -> Result<Vec<(Role, Id)>> {
    let document = names.document;
    let mut roles = Vec::new();
    for entry in document.section("export")? {
        let role = Role::named("export", entry.key).map_err(|error| {
            let hint = error.hint().to_string();
            document.error(entry.at, format!("{} is not a role of a value in a simulator", quoted(entry.key)), hint)
        })?;
        roles.push((role, number_of(names, &entry, role.dimension(), role.name())?));
    }
    Ok(roles)
}

/// Reads a state; `measured` are the nodes of the outputs.
fn state(names: &mut Names<'_>, entry: &Entry<'_>, measured: &[Id]) -> Result<ModelState> {
    let document = names.document;
    let [written, derivative, initial, _] = document.fields(entry, ["unit", "d", "initial", "description"])?;
    let unit = unit(document, written.as_ref())?;
    let given = required(document, entry, derivative, "d")?;
    let rate = unit.unit.dimension.per(Dimension::TIME);
    let what = format!("the derivative of {}", entry.key);
    let derivative = names.value(&given, Some(rate), &what, true)?.id;
    let initial = match &initial {
        None => InitialState::Free,
        Some(initial) => self::initial(names, (entry.key, &unit.unit), initial, measured)?,
    };
    Ok(ModelState { name: entry.key.to_owned(), unit, derivative, initial })
}

fn initial(
    names: &mut Names<'_>,
    (state, unit): (&str, &motorfit_core::units::Unit),
    entry: &Entry<'_>,
    measured: &[Id],
) -> Result<InitialState> {
    let document = names.document;
    if let Some(value) = Document::number_of(entry.value) {
        let id = names.scope.graph.constant(value * unit.factor);
        return Ok(InitialState::Given(NodeId(id)));
    }
    match document.text(entry)?.0 {
        "free" => Ok(InitialState::Free),
        "measured" => {
            let own = names.scope.names.get(state).map(|quantity| quantity.id);
            let is_own = |id: &Id| Some(*id) == own;
            match measured.iter().position(is_own) {
                Some(output) => Ok(InitialState::Measured(output)),
                None => {
                    let message = format!("no output is the state {state}, so that its initial value is not measured");
                    let hint = "Write initial = \"free\", a number, or an expression of parameters.";
                    Err(document.error(entry.value.span().start, message, hint))
                }
            }
        }
        _ => {
            let what = format!("the initial value of {state}");
            let id = number_of(names, entry, unit.dimension, &what)?;
            let graph = &mut names.scope.graph;
            let offset = graph.constant(unit.offset);
            Ok(InitialState::Given(NodeId(graph.subtract(id, offset))))
        }
    }
}

/// Returns the equations as they are written.
fn equations(document: &Document<'_>) -> Result<Vec<Equation>> {
    let mut equations = Vec::new();
    for (section, key) in [("signals", "value"), ("let", ""), ("states", "d"), ("outputs", "value")] {
        for entry in document.section(section)? {
            let table = entry.value.get_ref().as_table();
            let value = table.and_then(|table| table.get(key)).unwrap_or(entry.value);
            let value = Entry { key: entry.key, at: entry.at, value };
            let mut text = document.expression(&value)?.0.to_owned();
            if let ("outputs", Some(table)) = (section, table) {
                let option = |key: &str| {
                    let value = table.get(key).map(|value| Entry { key: entry.key, at: entry.at, value });
                    value.map(|value| document.expression(&value).map(|(text, _)| text)).transpose()
                };
                text = option("gain")?.map_or(text.clone(), |gain| format!("({gain})*({text})"));
                text = option("offset")?.map_or(text.clone(), |offset| format!("{text} + ({offset})"));
            }
            equations.push(Equation { section, name: entry.key.to_owned(), text });
        }
    }
    Ok(equations)
}
