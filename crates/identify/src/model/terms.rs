//! Choice of the optional terms of a model.

use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_model::Model;

/// Choice of the optional terms of a model.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum ModelTerms {
    /// All terms of its text.
    #[default]
    All,
    /// The listed terms; an empty list is the model without them.
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
