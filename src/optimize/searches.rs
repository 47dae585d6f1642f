//! The table of population searches, and a search with the values of its settings.

use super::population::SearchSettings;
use super::run::Optimizer;
use super::table::{Hyperparameter, Search, SearchOptions, Values};
use super::{genetic, gwo, jaya, pso, random};
use crate::setting::text;
use crate::text::{excerpt, listed};
use crate::{Error, Result};
use std::fmt;

/// The table of population searches, in the order in which they are listed. The first one serves where none is asked for.
pub const SEARCHES: [&Search; 5] = [&gwo::SEARCH, &jaya::SEARCH, &genetic::SEARCH, &pso::SEARCH, &random::SEARCH];

/// A search with the values of its settings.
#[derive(Clone, Copy)]
pub struct Tuned {
    /// The search.
    pub search: &'static Search,
    values: Values,
}

impl fmt::Debug for Tuned {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&(self.search.debug)(&self.values))
    }
}

impl PartialEq for Tuned {
    fn eq(&self, other: &Self) -> bool {
        self.search.name == other.search.name && self.values == other.values
    }
}

impl From<&'static Search> for Tuned {
    /// Takes the usual values.
    fn from(search: &'static Search) -> Self {
        Self { search, values: (search.usual)() }
    }
}

impl<O: SearchOptions> From<O> for Tuned {
    fn from(options: O) -> Self {
        Self { search: O::SEARCH, values: options.values() }
    }
}

impl Tuned {
    /// Changes a setting.
    ///
    /// # Errors
    /// `Usage` when the search has no such setting, or it cannot be this.
    pub fn set(&mut self, name: &str, value: &str) -> Result<()> {
        let settings = self.search.settings;
        let place = settings.iter().position(|setting| setting.name == name);
        let place = place.ok_or_else(|| unknown_setting(name, value))?;
        self.values.0[place] = settings[place].read(value)?;
        settings[place].check(self.search, self.values.0[place])
    }

    /// Returns the value of the setting at a place of the row, as it is written.
    #[must_use]
    pub fn shown(&self, place: usize) -> String {
        self.search.settings[place].shown(self.values.0[place])
    }

    /// Returns the settings that are not the usual ones, each with its value as it is written.
    #[must_use]
    pub fn changed(&self) -> Vec<(&'static str, String)> {
        let usual = (self.search.usual)();
        let places = self.search.settings.iter().enumerate();
        let changed = places.filter(|(place, _)| self.values.0[*place].to_bits() != usual.0[*place].to_bits());
        changed.map(|(place, setting)| (setting.name, self.shown(place))).collect()
    }

    /// Begins a run.
    ///
    /// # Errors
    /// `Usage` for a box or settings that cannot be.
    pub fn begin(&self, setup: SearchSettings) -> Result<Box<dyn Optimizer>> {
        let mut settings = self.search.settings.iter().zip(self.values.0);
        settings.try_for_each(|(setting, value)| setting.check(self.search, value))?;
        (self.search.begin)(setup, &self.values)
    }
}

/// Returns the error of a setting that a method has not; its hint lists those of all searches.
#[must_use]
pub fn unknown_setting(name: &str, value: &str) -> Error {
    let with_settings = SEARCHES.into_iter().filter(|search| !search.settings.is_empty());
    let one = |(n, search): (usize, &Search)| {
        let settings: Vec<String> = search.settings.iter().map(Hyperparameter::form).collect();
        let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
        format!("{} {}{}", search.name, if n == 0 { "has " } else { "" }, listed(&settings, "and"))
    };
    let all = with_settings.enumerate().map(one).collect::<Vec<_>>().join("; ");
    let message = text!([Set](" \"{}={}\" is no setting of this method", excerpt(name), excerpt(value)));
    Error::usage(message, format!("{all}."))
}
