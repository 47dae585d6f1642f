//! TOML values with their positions, so that errors have the line and unknown keys are answered with the nearest known
//! key.

use motorfit_core::named::Named;
use motorfit_core::setting::{Form, Reference, Setting, Text};
use motorfit_core::text::{excerpt, nearest};
use motorfit_core::{Error, Result};
use std::collections::HashSet;
use std::hash::Hash;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Spells a setting as a key of a study with its value, as in `fix = {K = 0.05}`; `None` for commands.
pub(super) fn as_key(reference: &Reference) -> Option<String> {
    let Reference::Setting(setting, value) = reference else { return None };
    let name = setting.name().to_owned();
    let Some(value) = value else { return Some(name) };
    Some(match setting.form() {
        // A list would be a factor with several models; one model is one text.
        _ if *setting == Setting::With => format!("{name} = \"{value}\""),
        Form::Switch | Form::Number => format!("{name} = {value}"),
        Form::Word => format!("{name} = \"{value}\""),
        Form::List => format!("{name} = [\"{}\"]", value.replace(',', "\", \"")),
        Form::Values => format!("{name} = {{{}}}", value.replace('=', " = ").replace(',', ", ")),
    })
}

/// A TOML text with its path, for errors with line numbers.
#[derive(Clone, Copy)]
pub(super) struct Document<'a> {
    pub text: &'a str,
    pub path: &'a Path,
}

impl<'a> Document<'a> {
    /// Parses the text.
    pub(super) fn table(self) -> Result<DeTable<'a>> {
        let parsed = DeTable::parse(self.text).map_err(|error| {
            let span = error.span().unwrap_or_default();
            let first = error.message().lines().next().unwrap_or_default();
            self.error(
                span,
                format!("is not valid TOML: {}", excerpt(first)),
                "Write KEY = VALUE, with texts in \"quotes\".",
            )
        })?;
        Ok(parsed.into_inner())
    }

    /// Creates an error at the line of a span.
    pub(super) fn error(self, span: Range<usize>, message: impl Into<Text>, hint: impl Into<Text>) -> Error {
        let before = self.text.get(..span.start).unwrap_or_default();
        let line = before.matches('\n').count() as u64 + 1;
        Error::usage(message, hint).in_file(self.path).at_line(line)
    }

    /// Adds the line of a span to an error and spells its settings as keys.
    pub(super) fn located(self, span: Range<usize>, error: &Error) -> Error {
        self.error(span, error.message().respelled(as_key), error.hint().respelled(as_key))
    }

    /// Returns an error at the first unknown key.
    pub(super) fn check_keys(self, table: &DeTable<'_>, known: &[&str], of: &str) -> Result<()> {
        let Some(key) = table.keys().find(|key| !known.contains(&&**key.get_ref())) else { return Ok(()) };
        let remedy = match nearest(key.get_ref(), known) {
            Some(near) => format!("Did you mean \"{near}\"?"),
            None => format!("{of} has {}.", known.join(", ")),
        };
        Err(self.error(key.span(), format!("unknown key \"{}\"", excerpt(key.get_ref())), remedy))
    }
}

/// A value with its key and its position, for errors.
#[derive(Clone, Copy)]
pub(super) struct Item<'a> {
    pub document: Document<'a>,
    pub key: &'a str,
    pub value: &'a Spanned<DeValue<'a>>,
}

impl Item<'_> {
    /// Creates an error at the line of the value.
    pub(super) fn error(self, message: impl Into<Text>, hint: impl Into<Text>) -> Error {
        self.document.error(self.value.span(), message, hint)
    }

    /// Adds the line of the value to an error and spells its settings as keys.
    pub(super) fn located(self, error: &Error) -> Error {
        self.document.located(self.value.span(), error)
    }

    fn mismatch(self, expected: &str) -> Error {
        let found = match self.value.get_ref() {
            DeValue::String(text) => format!("\"{}\"", excerpt(text)),
            DeValue::Integer(number) => excerpt(number.as_str()),
            DeValue::Float(number) => excerpt(number.as_str()),
            other => format!("a value of type {}", other.type_str()),
        };
        let key = self.key;
        self.error(format!("{key}: found {found}, expected {expected}"), format!("Write {key} = {expected}."))
    }

    pub(super) fn text(self, expected: &str) -> Result<String> {
        self.value.get_ref().as_str().map(str::to_owned).ok_or_else(|| self.mismatch(expected))
    }

    pub(super) fn flag(self) -> Result<bool> {
        self.value.get_ref().as_bool().ok_or_else(|| self.mismatch("true or false"))
    }

    /// Returns an integer of at least 0.
    pub(super) fn count(self) -> Result<u64> {
        let number = self.value.get_ref().as_integer();
        let number = number.and_then(|n| u64::from_str_radix(&n.as_str().replace('_', ""), n.radix()).ok());
        number.ok_or_else(|| self.mismatch("a whole number"))
    }

    /// Returns an integer of at least 1.
    pub(super) fn positive(self) -> Result<usize> {
        match usize::try_from(self.count()?) {
            Ok(0) => Err(self.error(format!("{} is 0", self.key), "Give at least 1.")),
            size => size.map_err(|_| self.mismatch("a smaller number")),
        }
    }

    /// Returns a finite number.
    pub(super) fn number(self) -> Result<f64> {
        let text = match self.value.get_ref() {
            DeValue::Integer(number) if number.radix() == 10 => number.as_str().to_owned(),
            DeValue::Float(number) => number.as_str().to_owned(),
            _ => return Err(self.mismatch("a number")),
        };
        let number = text.replace('_', "").parse().ok().filter(|v: &f64| v.is_finite());
        number.ok_or_else(|| self.mismatch("a finite number"))
    }

    /// Returns the distinct values of a short list, or a single value as a list. Compares each value with all others.
    pub(super) fn list<T: PartialEq>(self, one: impl Fn(Self) -> Result<T>) -> Result<Vec<T>> {
        self.each(one, |list, value| !list.contains(value))
    }

    /// Returns the distinct values of a list of any length, or a single value as a list.
    pub(super) fn distinct<T: Hash + Eq + Copy>(self, one: impl Fn(Self) -> Result<T>) -> Result<Vec<T>> {
        let mut known = HashSet::new();
        self.each(one, |_, value| known.insert(*value))
    }

    /// Returns the values of a list, for each of which `is_new` must find that the preceding ones do not include it.
    fn each<T>(self, one: impl Fn(Self) -> Result<T>, mut is_new: impl FnMut(&[T], &T) -> bool) -> Result<Vec<T>> {
        let Some(values) = self.value.get_ref().as_array() else { return Ok(vec![one(self)?]) };
        let mut list = Vec::with_capacity(values.len());
        for value in values.iter() {
            let item = Self { value, ..self };
            let read = one(item)?;
            if !is_new(&list, &read) {
                return Err(item.error(format!("{} has a value twice", self.key), "Give each once."));
            }
            list.push(read);
        }
        if list.is_empty() {
            let message = format!("{} is empty", self.key);
            return Err(self.error(message, "Give at least one value, or leave the key out."));
        }
        Ok(list)
    }

    /// Returns the texts of a list.
    pub(super) fn words(self, expected: &str) -> Result<Vec<String>> {
        self.list(|word| word.text(expected))
    }

    /// Returns the row of a named table that the value names.
    pub(super) fn choice<T: Named>(self) -> Result<T> {
        let text = self.text(&format!("\"{}\"", T::names().join("\", \"")))?;
        T::named(self.key, &text).map_err(|error| self.located(&error))
    }
}
