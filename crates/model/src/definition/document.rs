//! The text of a model as TOML, with the place of every key and value.

use crate::expression::Fault;
use motorfit_core::text::{nearest, quoted};
use motorfit_core::{Error, Result};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Largest text of a model \[bytes\].
pub(crate) const TEXT_MAX: usize = 1 << 20;
/// Largest text of an expression \[bytes\].
pub(crate) const EXPRESSION_MAX: usize = 4096;
/// Largest value of a bound or a neutral value, in its unit.
pub(super) const VALUE_MAX: f64 = 1e30;

/// A parsed text.
pub(super) struct Document<'a> {
    text: &'a str,
    table: DeTable<'a>,
}

/// A key of a table with its value.
pub(super) struct Entry<'d> {
    pub key: &'d str,
    /// Byte of the key.
    pub at: usize,
    pub value: &'d Spanned<DeValue<'d>>,
}

impl<'a> Document<'a> {
    pub fn parse(text: &'a str) -> Result<Self> {
        if text.len() > TEXT_MAX {
            let message = format!("a model of {} bytes, expected at most {TEXT_MAX}", text.len());
            return Err(Error::data(message, "Give a file with the equations of one machine."));
        }
        match DeTable::parse(text) {
            Ok(table) => Ok(Self { text, table: table.into_inner() }),
            Err(error) => {
                let at = error.span().map_or(0, |span| span.start);
                let hint = "A model is TOML: sections such as [states], and a line name = value for each item.";
                Err(located(text, at, error.message(), hint))
            }
        }
    }

    /// Returns an error at a byte of the text.
    pub fn error(&self, at: usize, message: impl AsRef<str>, hint: impl AsRef<str>) -> Error {
        located(self.text, at, message.as_ref(), hint.as_ref())
    }

    /// Returns the entries of the document.
    pub fn entries(&self) -> Vec<Entry<'_>> {
        entries(&self.table)
    }

    /// Returns the entries of a section in the order of the text; none if the section is missing.
    pub fn section(&self, name: &str) -> Result<Vec<Entry<'_>>> {
        match self.table.get(name) {
            None => Ok(Vec::new()),
            Some(value) => match value.get_ref().as_table() {
                Some(table) => Ok(entries(table)),
                None => {
                    Err(self.error(value.span().start, format!("{name} is not a section"), format!("Write [{name}].")))
                }
            },
        }
    }

    /// Returns the fields of an entry that is a table with the given keys, in the order of the keys.
    pub fn fields<'d, const N: usize>(&self, entry: &Entry<'d>, keys: [&str; N]) -> Result<[Option<Entry<'d>>; N]> {
        let Some(table) = entry.value.get_ref().as_table() else {
            let message = format!("{} is not a table", quoted(entry.key));
            let hint = format!("Write {} = {{ {} = … }}.", entry.key, keys[0]);
            return Err(self.error(entry.value.span().start, message, hint));
        };
        let mut found = [const { None }; N];
        for field in entries(table) {
            match keys.iter().position(|key| *key == field.key) {
                Some(n) => found[n] = Some(field),
                None => {
                    let hint = match nearest(field.key, &keys) {
                        Some(near) => format!("Did you mean \"{near}\"?"),
                        None => format!("The keys are {}.", keys.join(", ")),
                    };
                    let message = format!("{} is not a key of {}", quoted(field.key), quoted(entry.key));
                    return Err(self.error(field.at, message, hint));
                }
            }
        }
        Ok(found)
    }

    /// Returns the number of an entry; `None` if it is not a number.
    pub fn number_of(value: &Spanned<DeValue<'_>>) -> Option<f64> {
        let digits = match value.get_ref() {
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().to_owned(),
            DeValue::Float(float) => float.as_str().to_owned(),
            _ => return None,
        };
        digits.parse::<f64>().ok().filter(|value| value.is_finite())
    }

    /// Returns the number of an entry.
    pub fn number(&self, entry: &Entry<'_>) -> Result<f64> {
        Self::number_of(entry.value).ok_or_else(|| {
            let message = format!("{} is not a finite number", entry.key);
            self.error(entry.value.span().start, message, "Write a number such as 0.5 or 2e-3.")
        })
    }

    /// Returns the truth value of an entry.
    pub fn flag(&self, entry: &Entry<'_>) -> Result<bool> {
        entry.value.get_ref().as_bool().ok_or_else(|| {
            self.error(
                entry.value.span().start,
                format!("{} is neither true nor false", entry.key),
                "Write true or false.",
            )
        })
    }

    /// Returns the text of an entry and the byte at which it begins.
    pub fn text<'d>(&self, entry: &Entry<'d>) -> Result<(&'d str, Place)> {
        match entry.value.get_ref().as_str() {
            Some(text) => Ok((text, self.place(entry.value, text))),
            None => {
                let message = format!("{} is not a text", quoted(entry.key));
                Err(self.error(entry.value.span().start, message, "Put it in quotation marks."))
            }
        }
    }

    /// Returns the texts of an entry that is a text or a list of texts, each with the byte at which it begins.
    pub fn texts<'d>(&self, entry: &Entry<'d>) -> Result<Vec<(&'d str, usize)>> {
        let Some(list) = entry.value.get_ref().as_array() else {
            return self.text(entry).map(|(text, place)| vec![(text, place.start)]);
        };
        let item = |value: &'d Spanned<DeValue<'d>>| self.text(&Entry { key: entry.key, at: entry.at, value });
        list.iter().map(|value| item(value).map(|(text, place)| (text, place.start))).collect()
    }

    /// Returns an expression and its place: a text, or a number as a text.
    pub fn expression<'d>(&self, entry: &Entry<'d>) -> Result<(&'d str, Place)> {
        let number = match entry.value.get_ref() {
            DeValue::Integer(integer) => Some(integer.as_str()),
            DeValue::Float(float) => Some(float.as_str()),
            _ => None,
        };
        let (text, place) = match number {
            Some(digits) => (digits, Place { start: entry.value.span().start, is_exact: true }),
            None => self.text(entry)?,
        };
        if text.len() > EXPRESSION_MAX {
            let message = format!("an expression of {} bytes, expected at most {EXPRESSION_MAX}", text.len());
            return Err(self.error(place.start, message, "Name parts of it in [let]."));
        }
        Ok((text, place))
    }

    /// Returns the place of a text without its quotation marks.
    fn place(&self, value: &Spanned<DeValue<'_>>, text: &str) -> Place {
        let span = value.span();
        let raw = self.text.get(span.clone()).unwrap_or_default();
        // One mark, three marks, or three marks and a line break. With escapes no place within the text is known.
        let marks = [1, 3, 4, 5].into_iter().find(|marks| raw.get(*marks..).is_some_and(|rest| rest.starts_with(text)));
        let is_plain = marks.is_some_and(|marks| raw.len() <= text.len() + 2 * marks);
        Place { start: span.start + marks.unwrap_or(0), is_exact: is_plain }
    }

    /// Returns the error of a fault in an expression.
    pub fn fault(&self, place: Place, fault: &Fault) -> Error {
        let at = if place.is_exact { place.start + fault.at } else { place.start };
        self.error(at, &fault.message, &fault.hint)
    }
}

/// Place of a text in the document.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub start: usize,
    /// True if bytes of the text are bytes of the document.
    is_exact: bool,
}

/// Returns the entries of a table in the order of the text.
fn entries<'d>(table: &'d DeTable<'d>) -> Vec<Entry<'d>> {
    let entry = |(key, value): (&'d Spanned<std::borrow::Cow<'d, str>>, &'d Spanned<DeValue<'d>>)| Entry {
        key: key.get_ref().as_ref(),
        at: key.span().start,
        value,
    };
    let mut entries: Vec<Entry<'d>> = table.iter().map(entry).collect();
    entries.sort_by_key(|entry| entry.at);
    entries
}

/// Returns an error with line and column of a byte of `text`, both counted from 1.
fn located(text: &str, at: usize, message: &str, hint: &str) -> Error {
    let before = text.get(..at).unwrap_or(text);
    let line = before.matches('\n').count() as u64 + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    Error::data(message, hint).at_line(line).in_column(column.to_string())
}
