//! Optional terms of a model: parameters with a neutral value, at which the equations are those without them.

use super::document::{Document, Entry, VALUE_MAX};
use super::model::Model;
use super::parts::{ModelOutput, ModelParameter, ModelTerm};
use crate::graph::{Id, Leaf, evaluate};
use motorfit_core::text::{alternatives, excerpt, nearest, quoted};
use motorfit_core::{Error, Result};

/// Names of the choice of terms that are not names of a term.
const RESERVED: [&str; 3] = ["auto", "none", "all"];

/// Returns the names of the terms that a parameter declares, with the byte of each.
pub(super) fn declared<'d>(document: &Document<'_>, term: Option<&Entry<'d>>) -> Result<Vec<(&'d str, usize)>> {
    let Some(term) = term else { return Ok(Vec::new()) };
    let names = document.texts(term)?;
    for (n, (name, at)) in names.iter().enumerate() {
        let is_name = name.starts_with(|c: char| c.is_ascii_alphabetic())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
        if !is_name || name.len() > 64 || RESERVED.contains(name) {
            let message = format!("{} cannot be the name of a term", quoted(name));
            let hint =
                "Use ASCII letters, digits, - and _, a letter first, at most 64 characters; not auto, none or all.";
            return Err(document.error(*at, message, hint));
        }
        if names[..n].iter().any(|(before, _)| before == name) {
            return Err(document.error(*at, format!("the term {} is there twice", quoted(name)), "Name it once."));
        }
    }
    if names.is_empty() {
        return Err(document.error(
            term.value.span().start,
            "the list of terms is empty",
            "Name a term, or leave it out.",
        ));
    }
    Ok(names)
}

/// Reads the value at which a parameter has no effect.
pub(super) fn neutral(document: &Document<'_>, entry: Option<&Entry<'_>>) -> Result<Option<f64>> {
    let Some(entry) = entry else { return Ok(None) };
    let value = document.number(entry)?;
    if value.abs() > VALUE_MAX {
        let message = format!("the neutral value {value:e} is too large");
        return Err(document.error(entry.value.span().start, message, "Give a value of at most 1e30."));
    }
    Ok(Some(value))
}

/// Returns the terms of the parameters, in the order in which the text names them first. `declared` are the names of the terms of each
/// parameter; one with a neutral value that names none is a term of its own.
pub(super) fn terms(
    document: &Document<'_>,
    parameters: &[ModelParameter],
    declared: &[Vec<(&str, usize)>],
) -> Result<Vec<ModelTerm>> {
    let mut terms: Vec<(ModelTerm, usize)> = Vec::new();
    for (number, (parameter, names)) in parameters.iter().zip(declared).enumerate() {
        let own = (parameter.name.as_str(), 0);
        let is_own_term = names.is_empty() && parameter.neutral.is_some();
        for (name, at) in names.iter().chain(is_own_term.then_some(&own)) {
            match terms.iter_mut().find(|(term, _)| term.name == *name) {
                Some((term, _)) => term.parameters.push(number),
                None => terms.push((ModelTerm { name: (*name).to_owned(), parameters: vec![number] }, *at)),
            }
        }
    }
    let is_empty = |term: &ModelTerm| term.parameters.iter().all(|n| parameters[*n].neutral.is_none());
    if let Some((term, at)) = terms.iter().find(|(term, _)| is_empty(term)) {
        let message = format!("no parameter of the term {} has a neutral value", quoted(&term.name));
        let hint = "Add neutral = …, the value at which it has no effect, to a parameter of it, as in Ts = { …, neutral = 0 }.";
        return Err(document.error(*at, message, hint));
    }
    Ok(terms.into_iter().map(|(term, _)| term).collect())
}

/// Checks that the equations are defined where the parameters have their neutral values.
pub(super) fn check(document: &Document<'_>, model: &Model) -> Result<()> {
    let usual: Vec<f64> = model.parameters.iter().map(ModelParameter::usual).collect();
    let fixed = parameter_nodes(model);
    let defined = |values: &[f64]| -> Vec<bool> {
        let leaf = |leaf| if let Leaf::Parameter(n) = leaf { values[usize::from(n)] } else { f64::NAN };
        evaluate(&model.graph, &fixed, &mut Vec::new(), &leaf).into_iter().map(f64::is_finite).collect()
    };
    let usually = defined(&usual);
    let check = |number: usize, values: &[f64], what: &str| {
        if usually.iter().zip(defined(values)).all(|(usually, now)| !usually || now) {
            return Ok(());
        }
        let at = document.section("parameters")?.get(number).map_or(0, |entry| entry.at);
        let hint = "Give a neutral value at which they are: a time constant or a divisor cannot be zero.";
        Err(document.error(at, format!("the equations are not defined where {what}"), hint))
    };
    let neutral = |n: usize| model.parameters[n].neutral;
    let optional: Vec<usize> = (0..usual.len()).filter(|n| neutral(*n).is_some()).collect();
    for n in &optional {
        let mut values = usual.clone();
        values[*n] = neutral(*n).unwrap_or(values[*n]);
        check(*n, &values, &format!("{} = {}", model.parameters[*n].name, values[*n]))?;
    }
    let values: Vec<f64> = (0..usual.len()).map(|n| neutral(n).unwrap_or(usual[n])).collect();
    optional.first().map_or(Ok(()), |n| check(*n, &values, "all terms are neutral"))
}

/// Returns the nodes of the equations that depend on parameters alone.
fn parameter_nodes(model: &Model) -> Vec<Id> {
    let mut roots: Vec<Id> = model.states.iter().map(|state| state.derivative).collect();
    roots.extend(model.outputs.iter().flat_map(ModelOutput::roots));
    roots.extend(model.delayed.iter().flat_map(|of| [of.value, of.delay, of.latency]));
    roots.extend(model.laws.iter().map(|law| law.value));
    roots.extend(model.reactions.iter().map(|of| of.limit));
    model.graph.needed(&roots).into_iter().filter(|id| model.graph.is_fixed(*id)).collect()
}

impl Model {
    /// Returns the optional terms in the order in which the text names them first.
    #[must_use]
    pub fn terms(&self) -> &[ModelTerm] {
        &self.terms
    }

    /// Returns the value at which each parameter is fixed, in its unit, if only the given terms are taken; `None` for one that is free.
    ///
    /// A parameter without terms is free, as is one of a term that is taken. Others have their neutral value, or where they have none
    /// their usual value: they have no effect then.
    ///
    /// # Errors
    /// Returns `Usage` if the model has no term of a name.
    pub fn fixed_without(&self, taken: &[&str]) -> Result<Vec<Option<f64>>> {
        for name in taken {
            self.require_term(name)?;
        }
        let is_free = |number: usize| {
            let mut of = self.terms.iter().filter(|term| term.parameters.contains(&number)).peekable();
            of.peek().is_none() || of.any(|term| taken.contains(&term.name.as_str()))
        };
        let fixed = |(number, of): (usize, &ModelParameter)| {
            (!is_free(number)).then(|| of.neutral.unwrap_or_else(|| of.usual()))
        };
        Ok(self.parameters.iter().enumerate().map(fixed).collect())
    }

    /// Returns an error if no term has this name.
    fn require_term(&self, name: &str) -> Result<()> {
        let names: Vec<&str> = self.terms.iter().map(|term| term.name.as_str()).collect();
        if names.contains(&name) {
            return Ok(());
        }
        let hint = match nearest(name, &names) {
            Some(near) => format!("Did you mean \"{near}\"?"),
            None if names.is_empty() => {
                "Give a parameter a neutral value, as in Tc = { …, neutral = 0 }, to make it optional.".to_owned()
            }
            None => format!("Its terms are {}.", alternatives(&names)),
        };
        Err(Error::usage(format!("the model has no term \"{}\"", excerpt(name)), hint))
    }
}

#[cfg(test)]
#[path = "terms_tests.rs"]
mod tests;
