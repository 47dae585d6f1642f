//! The sections that declare names: constants, parameters, signals, definitions.

use super::document::{Document, Entry, VALUE_MAX};
use super::names::{Definition, Names, in_si};
use super::parts::{DelayedSignal, ModelConstant, ModelParameter, ModelTerm, WrittenUnit};
use super::terms;
use crate::graph::{Id, Leaf};
use motorfit_core::Result;
use motorfit_core::text::quoted;
use motorfit_core::units::{Dimension, Unit, parse_unit};

/// Reads the unit of an item; without one it is a number.
pub(super) fn unit(document: &Document<'_>, entry: Option<&Entry<'_>>) -> Result<WrittenUnit> {
    let Some(entry) = entry else { return Ok(WrittenUnit { text: "1".to_owned(), unit: Unit::ONE }) };
    let (text, place) = document.text(entry)?;
    match parse_unit(text) {
        Ok(unit) => Ok(WrittenUnit { text: text.trim().to_owned(), unit }),
        Err(error) => {
            let hint = "Write units such as \"ohm\", \"V*s/rad\", \"N*m\", \"kg*m^2\", \"rad/s\" or \"1\".";
            Err(document.error(place.start + error.at, error.message, hint))
        }
    }
}

pub(super) fn constants(names: &mut Names<'_>) -> Result<Vec<ModelConstant>> {
    let document = names.document;
    let mut constants = Vec::new();
    for entry in document.section("constants")? {
        names.declare(&entry)?;
        let (value, unit) = match Document::number_of(entry.value) {
            Some(value) => (value, Unit::ONE),
            None => {
                let [value, written, _] = document.fields(&entry, ["value", "unit", "description"])?;
                let value = required(document, &entry, value, "value")?;
                (document.number(&value)?, unit(document, written.as_ref())?.unit)
            }
        };
        let value = value * unit.factor + unit.offset;
        let id = names.scope.graph.constant(value);
        names.set(entry.key, id, unit.dimension);
        constants.push(ModelConstant { name: entry.key.to_owned(), value, dimension: unit.dimension });
    }
    Ok(constants)
}

/// Reads the parameters and their terms.
pub(super) fn parameters(names: &mut Names<'_>) -> Result<(Vec<ModelParameter>, Vec<ModelTerm>)> {
    let document = names.document;
    let (mut parameters, mut declared) = (Vec::new(), Vec::new());
    for (number, entry) in (0_u16..).zip(document.section("parameters")?) {
        names.declare(&entry)?;
        let keys = ["unit", "min", "max", "log", "value", "neutral", "term", "per_recording", "description"];
        let [written, min, max, log, value, neutral, term, per_recording, description] =
            document.fields(&entry, keys)?;
        let unit = unit(document, written.as_ref())?;
        let flag = |entry: Option<&Entry<'_>>| entry.map_or(Ok(false), |entry| document.flag(entry));
        let is_logarithmic = flag(log.as_ref())?;
        let (min, max) = bounds(document, &entry, [min, max], is_logarithmic)?;
        let value = value.map(|given| usual(document, (&entry, &given), [min, max])).transpose()?;
        let id = in_si(&mut names.scope.graph, Leaf::Parameter(number), &unit.unit);
        names.set(entry.key, id, unit.unit.dimension);
        let description = description.map(|text| document.text(&text).map(|(text, _)| text.to_owned()));
        declared.push(terms::declared(document, term.as_ref())?);
        parameters.push(ModelParameter {
            name: entry.key.to_owned(),
            unit,
            min,
            max,
            is_logarithmic,
            value,
            neutral: terms::neutral(document, neutral.as_ref())?,
            is_per_recording: flag(per_recording.as_ref())?,
            description: description.transpose()?.unwrap_or_default(),
        });
    }
    let terms = terms::terms(document, &parameters, &declared)?;
    Ok((parameters, terms))
}

/// Reads the bounds of a parameter.
fn bounds(
    document: &Document<'_>,
    entry: &Entry<'_>,
    [min, max]: [Option<Entry<'_>>; 2],
    is_logarithmic: bool,
) -> Result<(f64, f64)> {
    let (min_at, max_at) = (required(document, entry, min, "min")?, required(document, entry, max, "max")?);
    let (min, max) = (document.number(&min_at)?, document.number(&max_at)?);
    if min >= max || min.abs().max(max.abs()) > VALUE_MAX {
        let message = format!("the bounds of {} are {min} and {max}", entry.key);
        let hint = "Give a min below the max, both at most 1e30.";
        return Err(document.error(max_at.value.span().start, message, hint));
    }
    if is_logarithmic && min <= 0.0 {
        let message = format!("{} has log = true and the lower bound {min}", entry.key);
        return Err(document.error(min_at.value.span().start, message, "Give a min above 0, or leave log out."));
    }
    Ok((min, max))
}

/// Reads the usual value of a parameter.
fn usual(document: &Document<'_>, (entry, given): (&Entry<'_>, &Entry<'_>), [min, max]: [f64; 2]) -> Result<f64> {
    let value = document.number(given)?;
    if (min..=max).contains(&value) {
        return Ok(value);
    }
    let message = format!("the value {value} of {} is outside its bounds", entry.key);
    Err(document.error(given.value.span().start, message, "Give a value between min and max."))
}

/// A name that is delayed, with the entries of its delay and its latency.
pub(super) type Delayed<'d> = (String, [Option<Entry<'d>>; 2]);

/// Defines the names of signals and of `let`; returns those of delayed signals, whose numbers begin with `first`.
pub(super) fn definitions<'d>(names: &mut Names<'d>, first: usize) -> Result<Vec<Delayed<'d>>> {
    let document = names.document;
    let mut delayed = Vec::new();
    for entry in document.section("signals")? {
        names.declare(&entry)?;
        let [value, written, delay, latency, _] =
            document.fields(&entry, ["value", "unit", "delay", "latency", "description"])?;
        let value = required(document, &entry, value, "value")?;
        let dimension = written.as_ref().map(|written| unit(document, Some(written))).transpose()?;
        let (expression, place) = names.parse(&value)?;
        let is_delayed = delay.is_some() || latency.is_some();
        let number = u16::try_from(first + delayed.len()).unwrap_or(u16::MAX);
        if is_delayed {
            delayed.push((entry.key.to_owned(), [delay, latency]));
        }
        let dimension = dimension.map(|unit| unit.unit.dimension);
        let delayed = is_delayed.then_some(number);
        names.define(entry.key, Definition { expression, place, dimension, is_signal: true, delayed });
    }
    for entry in document.section("let")? {
        names.declare(&entry)?;
        let (expression, place) = names.parse(&entry)?;
        names.define(entry.key, Definition { expression, place, dimension: None, is_signal: false, delayed: None });
    }
    Ok(delayed)
}

/// Reads delay and latency of the delayed inputs and signals, whose names are resolved.
pub(super) fn delays(names: &mut Names<'_>, of: Vec<Delayed<'_>>) -> Result<Vec<DelayedSignal>> {
    let mut delayed = Vec::new();
    for (name, times) in of {
        let [delay, latency] = times
            .map(|time| time.map(|time| number_of(names, &time, motorfit_core::units::Dimension::TIME, "a delay")));
        let zero = names.scope.graph.constant(0.0);
        let value = names.scope.names.get(&super::names::undelayed(&name)).map_or(zero, |quantity| quantity.id);
        let (delay, latency) = (delay.transpose()?.unwrap_or(zero), latency.transpose()?.unwrap_or(zero));
        delayed.push(DelayedSignal { name, value, delay, latency });
    }
    Ok(delayed)
}

/// Returns a field that must be there.
pub(super) fn required<'d>(
    document: &Document<'_>,
    entry: &Entry<'_>,
    field: Option<Entry<'d>>,
    key: &str,
) -> Result<Entry<'d>> {
    field.ok_or_else(|| {
        let message = format!("{} has no {key}", quoted(entry.key));
        document.error(entry.at, message, format!("Add {key} = … to it."))
    })
}

/// Returns the value of an entry with a dimension that depends on parameters at most.
pub(super) fn number_of(names: &mut Names<'_>, entry: &Entry<'_>, dimension: Dimension, what: &str) -> Result<Id> {
    let id = names.value(entry, Some(dimension), what, false)?.id;
    if names.scope.graph.is_fixed(id) {
        return Ok(id);
    }
    let message = format!("{what} depends on inputs or states");
    Err(names.document.error(entry.value.span().start, message, "Use constants and parameters only."))
}
