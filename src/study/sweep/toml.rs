//! TOML with the places of its values, so that an error names the line, and unknown keys the nearest known one.

use crate::named::Named;
use crate::setting::{Form, Reference, Setting, Text};
use crate::text::{excerpt, nearest};
use crate::{Error, Result};
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value with its place.
pub(super) type Value<'a> = Spanned<DeValue<'a>>;

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
        for key in table.keys() {
            let name: &str = key.get_ref();
            if known.contains(&name) {
                continue;
            }
            let remedy = match nearest(name, known) {
                Some(near) => format!("Did you mean \"{near}\"?"),
                None => format!("{of} has {}.", known.join(", ")),
            };
            return Err(self.error(key.span(), format!("unknown key \"{}\"", excerpt(name)), remedy));
        }
        Ok(())
    }

    fn mismatch(self, key: &str, value: &Value<'_>, expected: &str) -> Error {
        let found = match value.get_ref() {
            DeValue::String(text) => format!("\"{}\"", excerpt(text)),
            DeValue::Integer(number) => excerpt(number.as_str()),
            DeValue::Float(number) => excerpt(number.as_str()),
            other => format!("a value of type {}", other.type_str()),
        };
        self.error(
            value.span(),
            format!("{key}: found {found}, expected {expected}"),
            format!("Write {key} = {expected}."),
        )
    }

    pub(super) fn text(self, key: &str, value: &Value<'_>, expected: &str) -> Result<String> {
        let text = value.get_ref().as_str().map(str::to_owned);
        text.ok_or_else(|| self.mismatch(key, value, expected))
    }

    pub(super) fn flag(self, key: &str, value: &Value<'_>) -> Result<bool> {
        value.get_ref().as_bool().ok_or_else(|| self.mismatch(key, value, "true or false"))
    }

    /// A whole number, 0 or more.
    pub(super) fn count(self, key: &str, value: &Value<'_>) -> Result<u64> {
        let number = value.get_ref().as_integer();
        let number = number.and_then(|n| u64::from_str_radix(&n.as_str().replace('_', ""), n.radix()).ok());
        number.ok_or_else(|| self.mismatch(key, value, "a whole number"))
    }

    pub(super) fn size(self, key: &str, value: &Value<'_>) -> Result<usize> {
        let size = usize::try_from(self.count(key, value)?).ok();
        size.ok_or_else(|| self.mismatch(key, value, "a smaller number"))
    }

    /// A finite number.
    pub(super) fn number(self, key: &str, value: &Value<'_>) -> Result<f64> {
        let text = match value.get_ref() {
            DeValue::Integer(number) if number.radix() == 10 => number.as_str().to_owned(),
            DeValue::Float(number) => number.as_str().to_owned(),
            _ => return Err(self.mismatch(key, value, "a number")),
        };
        let number = text.replace('_', "").parse().ok().filter(|v: &f64| v.is_finite());
        number.ok_or_else(|| self.mismatch(key, value, "a finite number"))
    }

    /// The values of a list, or one value as a list of its own; none twice.
    pub(super) fn list<T: PartialEq>(
        self,
        key: &str,
        value: &Value<'_>,
        one: impl Fn(&Value<'_>) -> Result<T>,
    ) -> Result<Vec<T>> {
        let Some(items) = value.get_ref().as_array() else { return Ok(vec![one(value)?]) };
        let mut list = Vec::with_capacity(items.len());
        for item in items.iter() {
            let read = one(item)?;
            if list.contains(&read) {
                return Err(self.error(item.span(), format!("{key} has a value twice"), "Give each once."));
            }
            list.push(read);
        }
        if list.is_empty() {
            return Err(self.error(
                value.span(),
                format!("{key} is empty"),
                "Give at least one value, or leave the key out.",
            ));
        }
        Ok(list)
    }

    /// The row of a table that a value names.
    pub(super) fn choice<T: Named>(self, key: &str, value: &Value<'_>) -> Result<T> {
        let text = self.text(key, value, &format!("\"{}\"", T::names().join("\", \"")))?;
        T::named(key, &text).map_err(|error| self.located(value.span(), &error))
    }
}
