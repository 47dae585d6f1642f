//! Values of settings as a front end received them.

use motorfit_core::named::Named;
use motorfit_core::setting::Setting;
use motorfit_core::{Error, Result};

/// The value of a setting.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// On or off.
    Switch(bool),
    /// A number.
    Number(f64),
    /// A non-negative integer.
    Count(u64),
    /// A text, or the name of a choice.
    Text(String),
    /// A list of texts.
    List(Vec<String>),
}

/// An error in the value of a setting.
#[derive(Debug, Clone)]
pub struct Fault {
    /// The setting.
    pub setting: Setting,
    /// The error.
    pub error: Error,
}

impl From<Fault> for Error {
    fn from(fault: Fault) -> Self {
        fault.error
    }
}

/// Settings with their values. A setting that is missing takes its default.
#[derive(Debug, Clone, Default)]
pub struct Given(Vec<(Setting, Value)>);

impl Given {
    /// Adds a setting.
    pub fn put(&mut self, setting: Setting, value: Value) {
        self.0.push((setting, value));
    }

    /// Returns these settings followed by those of `other`; the first value of a setting counts.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        Self([&self.0[..], &other.0].concat())
    }

    /// Returns the settings without one.
    #[must_use]
    pub fn without(&self, setting: Setting) -> Self {
        Self(self.0.iter().filter(|(of, _)| *of != setting).cloned().collect())
    }

    fn get(&self, setting: Setting) -> Option<&Value> {
        self.0.iter().find(|(of, _)| *of == setting).map(|(_, value)| value)
    }

    /// Returns true if a setting was given.
    #[must_use]
    pub fn has(&self, setting: Setting) -> bool {
        self.get(setting).is_some()
    }

    /// Returns true if a switch is on.
    #[must_use]
    pub fn switch(&self, setting: Setting) -> bool {
        self.get(setting) == Some(&Value::Switch(true))
    }

    /// Returns the value of a numeric setting, `None` if it was not given.
    #[must_use]
    pub fn number(&self, setting: Setting) -> Option<f64> {
        if let Some(Value::Number(number)) = self.get(setting) { Some(*number) } else { None }
    }

    /// Returns the value of an integer setting, `None` if it was not given.
    #[must_use]
    pub fn count(&self, setting: Setting) -> Option<usize> {
        let Some(Value::Count(count)) = self.get(setting) else { return None };
        Some(usize::try_from(*count).unwrap_or(usize::MAX))
    }

    /// Returns the value of a text setting, `None` if it was not given.
    #[must_use]
    pub fn text(&self, setting: Setting) -> Option<&str> {
        if let Some(Value::Text(text)) = self.get(setting) { Some(text) } else { None }
    }

    /// Returns the texts of a list setting, empty if it was not given.
    #[must_use]
    pub fn list(&self, setting: Setting) -> &[String] {
        if let Some(Value::List(list)) = self.get(setting) { list } else { &[] }
    }

    /// Parses the value of a text setting with `read`, `None` if it was not given.
    ///
    /// # Errors
    /// Propagates the errors of `read`, with the setting.
    pub fn read<T>(
        &self,
        setting: Setting,
        read: impl FnOnce(&str) -> Result<T>,
    ) -> std::result::Result<Option<T>, Fault> {
        self.text(setting).map(|text| read(text).map_err(|error| Fault { setting, error })).transpose()
    }

    /// Parses the value of a list setting with `read`, which gets an empty list if it was not given.
    ///
    /// # Errors
    /// Propagates the errors of `read`, with the setting.
    pub fn items<T>(
        &self,
        setting: Setting,
        read: impl FnOnce(&[String]) -> Result<T>,
    ) -> std::result::Result<T, Fault> {
        read(self.list(setting)).map_err(|error| Fault { setting, error })
    }

    /// Parses a choice by its name, `None` if it was not given.
    ///
    /// # Errors
    /// Returns a usage error if no row of `T` has the name.
    pub fn choice<T: Named>(&self, setting: Setting) -> std::result::Result<Option<T>, Fault> {
        self.read(setting, |name| T::named(setting.name(), name))
    }
}
