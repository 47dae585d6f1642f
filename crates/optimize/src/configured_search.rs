//! A population search together with the values of its settings.

use super::run::Optimizer;
use super::search_settings::SearchSettings;
use super::table::{Search, SearchOptions, Values};
use super::transformed_search::TransformedSearch;
use motorfit_core::Result;
use std::fmt;

/// A population search together with the values of its settings.
#[derive(Clone, Copy)]
pub struct ConfiguredSearch {
    /// The search.
    pub search: &'static Search,
    values: Values,
}

impl fmt::Debug for ConfiguredSearch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&(self.search.debug)(&self.values))
    }
}

impl PartialEq for ConfiguredSearch {
    fn eq(&self, other: &Self) -> bool {
        self.search.name == other.search.name && self.values == other.values
    }
}

impl From<&'static Search> for ConfiguredSearch {
    /// Makes a search with the default values of its settings.
    fn from(search: &'static Search) -> Self {
        Self { search, values: (search.defaults)() }
    }
}

impl<O: SearchOptions> From<O> for ConfiguredSearch {
    fn from(options: O) -> Self {
        Self { search: O::SEARCH, values: options.values() }
    }
}

impl ConfiguredSearch {
    /// Sets a setting from text; returns false if the search has no setting of this name.
    ///
    /// # Errors
    /// Returns `Usage` if the setting cannot have this value.
    pub fn set(&mut self, name: &str, value: &str) -> Result<bool> {
        let settings = self.search.settings;
        let Some(index) = settings.iter().position(|setting| setting.name == name) else { return Ok(false) };
        self.values.0[index] = settings[index].read(value)?;
        settings[index].check(self.search, self.values.0[index])?;
        Ok(true)
    }

    /// Returns the value of the setting of index `place`, formatted as in settings.
    ///
    /// # Panics
    /// Panics if the search has no setting of this index.
    #[must_use]
    pub fn shown(&self, place: usize) -> String {
        self.search.settings[place].shown(self.values.0[place])
    }

    /// Returns the names of the settings that differ from their defaults, with their values formatted as in settings.
    #[must_use]
    pub fn changed(&self) -> Vec<(&'static str, String)> {
        let defaults = (self.search.defaults)();
        let places = self.search.settings.iter().enumerate();
        let changed = places.filter(|(place, _)| self.values.0[*place].to_bits() != defaults.0[*place].to_bits());
        changed.map(|(place, setting)| (setting.name, self.shown(place))).collect()
    }

    /// Starts a run in the coordinates of the settings.
    ///
    /// # Errors
    /// Returns `Usage` if the box or the settings are invalid.
    pub fn begin(&self, setup: SearchSettings) -> Result<Box<dyn Optimizer>> {
        let mut settings = self.search.settings.iter().zip(self.values.0);
        settings.try_for_each(|(setting, value)| setting.check(self.search, value))?;
        TransformedSearch::begin(setup, |setup| (self.search.begin)(setup, &self.values))
    }
}
