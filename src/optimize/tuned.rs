//! A population search with the values of its settings.

use super::population::SearchSettings;
use super::run::Optimizer;
use super::table::{Search, SearchOptions, Values};
use crate::Result;
use std::fmt;

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
    /// Changes a setting; false where the search has none of this name.
    ///
    /// # Errors
    /// `Usage` when the setting cannot have this value.
    pub fn set(&mut self, name: &str, value: &str) -> Result<bool> {
        let settings = self.search.settings;
        let Some(place) = settings.iter().position(|setting| setting.name == name) else { return Ok(false) };
        self.values.0[place] = settings[place].read(value)?;
        settings[place].check(self.search, self.values.0[place])?;
        Ok(true)
    }

    /// Returns the value of the setting at a place of the row, as it is written.
    ///
    /// # Panics
    /// When the row has no such place, as slices do.
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
