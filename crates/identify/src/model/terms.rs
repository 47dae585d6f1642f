//! Choice of the optional terms of a model, its own and generic ones.

use motorfit_core::named::Named as _;
use motorfit_core::setting::text;
use motorfit_core::text::{alternatives, excerpt, nearest};
use motorfit_core::{Error, Result};
use motorfit_model::{GenericTerm, Model};
use std::borrow::Cow;

/// Choice of the optional terms of a model.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum ModelTerms {
    /// All terms of its text.
    #[default]
    All,
    /// The listed terms of its text or generic ones; an empty list is the model without them.
    These(Vec<String>),
    /// Terms chosen by model selection.
    Auto,
}

impl ModelTerms {
    /// Parses names of terms, or one of `all`, `none` and `auto` alone; without items all terms are taken.
    ///
    /// # Errors
    /// Returns `Usage` if names are given beside one of these words.
    pub fn parse(items: &[String]) -> Result<Self> {
        let names: Vec<&str> = items.iter().map(|item| item.trim()).filter(|item| !item.is_empty()).collect();
        match names[..] {
            [] | ["all"] => return Ok(Self::All),
            ["none"] => return Ok(Self::These(Vec::new())),
            ["auto"] => return Ok(Self::Auto),
            _ => {}
        }
        if let Some(word) = names.iter().find(|name| ["all", "none", "auto"].contains(name)) {
            let message = text!([With = "{word}"] " stands for a choice of all terms, but other names are given too");
            return Err(Error::usage(message, format!("Give {word} alone, or only names of terms.")));
        }
        let mut list: Vec<String> = Vec::new();
        for name in names {
            if !list.iter().any(|own| own == name) {
                list.push(name.to_owned());
            }
        }
        Ok(Self::These(list))
    }

    /// Returns the names of the terms that are taken; `None` if they are selected by fits.
    #[must_use]
    pub fn taken(&self, model: &Model) -> Option<Vec<String>> {
        match self {
            Self::All => Some(model.terms().iter().map(|term| term.name.clone()).collect()),
            Self::These(list) => Some(list.clone()),
            Self::Auto => None,
        }
    }
}

/// Returns a model with the generic terms among some names; the others are terms of its own.
///
/// # Errors
/// Returns `Usage` if the model has no term of a name, and the errors of [`Model::with_generic`].
pub(super) fn with_generic<'m>(model: &'m Model, names: &[String]) -> Result<Cow<'m, Model>> {
    let is_own = |name: &str| model.terms().iter().any(|term| term.name == name);
    if names.iter().all(|name| is_own(name)) {
        return Ok(Cow::Borrowed(model));
    }
    let generic = model.generic_terms();
    for name in names.iter().filter(|name| !is_own(name)) {
        if generic.iter().any(|term| term.name() == name) {
            continue;
        }
        let own = model.terms().iter().map(|term| term.name.as_str());
        let all: Vec<&str> = own.chain(generic.iter().map(|term| term.name())).collect();
        let hint = match nearest(name, &all) {
            Some(near) => format!("Did you mean \"{near}\"?"),
            None if all.is_empty() => "It has no optional terms, and no generic ones apply to it.".to_owned(),
            None => format!("Its terms are {}.", alternatives(&all)),
        };
        return Err(Error::usage(format!("the model has no term \"{}\"", excerpt(name)), hint));
    }
    // In the order of their table, so that the text does not depend on that of the names.
    let list: Vec<GenericTerm> =
        generic.into_iter().filter(|term| names.iter().any(|name| name == term.name())).collect();
    model.with_generic(&list).map(Cow::Owned)
}
