//! TOML with the places of its values, so that an error names the line, and unknown keys the nearest known one.

use crate::named::Named;
use crate::setting::{Form, Reference, Setting, Text};
use crate::text::{excerpt, nearest};
use crate::{Error, Result};
use std::collections::HashSet;
use std::hash::Hash;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Spells a setting as a key of a study with its value: `fix = {K = 0.05}`. Operations are the caller's to spell.
pub(super) fn as_key(reference: &Reference) -> Option<String> {
    let Reference::Setting(setting, value) = reference else { return None };
    let name = setting.name().to_owned();
    let Some(value) = value else { return Some(name) };
    Some(match setting.form() {
        // A list of models is a factor, a model one text.
        _ if *setting == Setting::With => format!("{name} = \"{value}\""),
        Form::Switch | Form::Number => format!("{name} = {value}"),
        Form::Word => format!("{name} = \"{value}\""),
        Form::List => format!("{name} = [\"{}\"]", value.replace(',', "\", \"")),
        Form::Values => format!("{name} = {{{}}}", value.replace('=', " = ").replace(',', ", ")),
    })
}

/// A text of TOML, for errors that name its lines.
#[derive(Clone, Copy)]
pub(super) struct Document<'a> {
    pub text: &'a str,
    pub path: &'a Path,
}

impl<'a> Document<'a> {
    /// Its table.
    pub(super) fn table(self) -> Result<DeTable<'a>> {
        let parsed = DeTable::parse(self.text).map_err(|error| {
            let span = error.span().unwrap_or_default();
            let first = error.message().lines().next().unwrap_or_default();
            self.error(span, format!("is no TOML: {}", excerpt(first)), "Write KEY = VALUE, texts in \"quotes\".")
        })?;
        Ok(parsed.into_inner())
    }

    /// An error at a place.
    pub(super) fn error(self, span: Range<usize>, message: impl Into<Text>, hint: impl Into<Text>) -> Error {
        let before = self.text.get(..span.start).unwrap_or_default();
        let line = before.matches('\n').count() as u64 + 1;
        Error::usage(message, hint).in_file(self.path).at_line(line)
    }

    /// The same error with its place, its settings spelled as keys.
    pub(super) fn located(self, span: Range<usize>, error: &Error) -> Error {
        self.error(span, error.message().respelled(as_key), error.hint().respelled(as_key))
    }

    /// Keys that are not known are errors.
    pub(super) fn check_keys(self, table: &DeTable<'_>, known: &[&str], of: &str) -> Result<()> {
        let Some(key) = table.keys().find(|key| !known.contains(&&**key.get_ref())) else { return Ok(()) };
        let remedy = match nearest(key.get_ref(), known) {
            Some(near) => format!("Did you mean \"{near}\"?"),
            None => format!("{of} has {}.", known.join(", ")),
        };
        Err(self.error(key.span(), format!("unknown key \"{}\"", excerpt(key.get_ref())), remedy))
    }
}

/// A value with its place and its key, which errors name.
#[derive(Clone, Copy)]
pub(super) struct Item<'a> {
    pub document: Document<'a>,
    pub key: &'a str,
    pub value: &'a Spanned<DeValue<'a>>,
}

impl Item<'_> {
    /// An error at its place.
    pub(super) fn error(self, message: impl Into<Text>, hint: impl Into<Text>) -> Error {
        self.document.error(self.value.span(), message, hint)
    }

    /// An error with its place, its settings spelled as keys.
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

    /// A whole number, 0 or more.
    pub(super) fn count(self) -> Result<u64> {
        let number = self.value.get_ref().as_integer();
        let number = number.and_then(|n| u64::from_str_radix(&n.as_str().replace('_', ""), n.radix()).ok());
        number.ok_or_else(|| self.mismatch("a whole number"))
    }

    /// A whole number, 1 or more.
    pub(super) fn positive(self) -> Result<usize> {
        match usize::try_from(self.count()?) {
            Ok(0) => Err(self.error(format!("{} is 0", self.key), "Give at least 1.")),
            size => size.map_err(|_| self.mismatch("a smaller number")),
        }
    }

    /// A finite number.
    pub(super) fn number(self) -> Result<f64> {
        let text = match self.value.get_ref() {
            DeValue::Integer(number) if number.radix() == 10 => number.as_str().to_owned(),
            DeValue::Float(number) => number.as_str().to_owned(),
            _ => return Err(self.mismatch("a number")),
        };
        let number = text.replace('_', "").parse().ok().filter(|v: &f64| v.is_finite());
        number.ok_or_else(|| self.mismatch("a finite number"))
    }

    /// The values of a short list, or one value as a list of its own; none twice.
    pub(super) fn list<T: PartialEq>(self, one: impl Fn(Self) -> Result<T>) -> Result<Vec<T>> {
        self.each(one, |list, value| !list.contains(value))
    }

    /// Likewise of a list of any length.
    pub(super) fn distinct<T: Hash + Eq + Copy>(self, one: impl Fn(Self) -> Result<T>) -> Result<Vec<T>> {
        let mut known = HashSet::new();
        self.each(one, |_, value| known.insert(*value))
    }

    /// Likewise where `is_new` finds each value new to those before it.
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

    /// Texts of a list.
    pub(super) fn words(self, expected: &str) -> Result<Vec<String>> {
        self.list(|word| word.text(expected))
    }

    /// The row of a table that a value names.
    pub(super) fn choice<T: Named>(self) -> Result<T> {
        let text = self.text(&format!("\"{}\"", T::names().join("\", \"")))?;
        T::named(self.key, &text).map_err(|error| self.located(&error))
    }
}
