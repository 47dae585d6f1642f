//! The text of a model as sections, items and keys, to be changed and written again.

use super::document::{Document, Entry};
use std::fmt::Write as _;
use toml::de::DeValue;

/// An item of a section: its keys with the texts of their values, or the text of a single value.
enum Item {
    Keys(Vec<(String, String)>),
    Value(String),
}

/// A text in parts, each value as it is written.
pub(super) struct Draft {
    head: Vec<(String, String)>,
    sections: Vec<(String, Vec<(String, Item)>)>,
}

impl Draft {
    /// Takes the text of a document apart; comments are left out.
    pub fn of(document: &Document<'_>) -> Self {
        let (mut head, mut sections) = (Vec::new(), Vec::new());
        for entry in document.entries() {
            let name = entry.key.to_owned();
            match document.section(entry.key) {
                Ok(items) => sections.push((name, items.iter().map(|one| (one.key.to_owned(), item(one))).collect())),
                Err(_) => head.push((name, written(entry.value.get_ref()))),
            }
        }
        Self { head, sections }
    }

    /// Returns the names of the items of a section that lack a key.
    pub fn without(&self, section: &str, key: &str) -> Vec<&str> {
        let items = self.sections.iter().filter(|(name, _)| name == section).flat_map(|(_, items)| items);
        let lacks = |item: &Item| matches!(item, Item::Keys(keys) if keys.iter().all(|(own, _)| own != key));
        items.filter(|(_, item)| lacks(item)).map(|(name, _)| name.as_str()).collect()
    }

    /// Returns true if any section has an item with this name.
    pub fn has(&self, name: &str) -> bool {
        self.sections.iter().any(|(_, items)| items.iter().any(|(own, _)| own == name))
    }

    /// Gives an item of a section a further key; the value is a text.
    pub fn set(&mut self, section: &str, item: &str, key: &str, text: &str) {
        let sections = self.sections.iter_mut().filter(|(name, _)| name == section);
        for (_, of) in sections.flat_map(|(_, items)| items).filter(|(name, _)| name == item) {
            if let Item::Keys(keys) = of {
                keys.push((key.to_owned(), quote(text)));
            }
        }
    }

    /// Adds an item to a section that exists; the values are written as they are.
    pub fn add(&mut self, section: &str, item: &str, keys: &[(&str, String)]) {
        let keys = keys.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
        if let Some((_, items)) = self.sections.iter_mut().find(|(name, _)| name == section) {
            items.push((item.to_owned(), Item::Keys(keys)));
        }
    }

    /// Returns the text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for (key, value) in &self.head {
            let _ = writeln!(text, "{} = {value}", name(key));
        }
        for (section, items) in &self.sections {
            let _ = writeln!(text, "\n[{}]", name(section));
            for (item, value) in items {
                let value = match value {
                    Item::Value(value) => value.clone(),
                    Item::Keys(keys) => table(keys),
                };
                let _ = writeln!(text, "{} = {value}", name(item));
            }
        }
        text
    }
}

fn item(entry: &Entry<'_>) -> Item {
    match entry.value.get_ref() {
        DeValue::Table(of) => Item::Keys(keys(of)),
        value => Item::Value(written(value)),
    }
}

fn keys(of: &toml::de::DeTable<'_>) -> Vec<(String, String)> {
    let mut keys: Vec<_> = of.iter().collect();
    keys.sort_by_key(|(key, _)| key.span().start);
    keys.into_iter().map(|(key, value)| (key.get_ref().to_string(), written(value.get_ref()))).collect()
}

fn table(keys: &[(String, String)]) -> String {
    let keys: Vec<String> = keys.iter().map(|(key, value)| format!("{} = {value}", name(key))).collect();
    format!("{{ {} }}", keys.join(", "))
}

/// Returns a value as it is written.
fn written(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => quote(text),
        DeValue::Integer(integer) => integer.to_string(),
        DeValue::Float(float) => float.to_string(),
        DeValue::Boolean(is_true) => is_true.to_string(),
        DeValue::Datetime(time) => time.to_string(),
        DeValue::Array(values) => {
            let values: Vec<String> = values.iter().map(|value| written(value.get_ref())).collect();
            format!("[{}]", values.join(", "))
        }
        DeValue::Table(of) => table(&keys(of)),
    }
}

/// Returns a text in quotation marks.
pub(super) fn quote(text: &str) -> String {
    let mut quoted = String::from("\"");
    for character in text.chars() {
        match character {
            '"' | '\\' => quoted.extend(['\\', character]),
            control if control.is_control() => {
                let _ = write!(quoted, "\\u{:04X}", u32::from(control));
            }
            other => quoted.push(other),
        }
    }
    quoted.push('"');
    quoted
}

/// Returns a key, in quotation marks where it needs them.
fn name(key: &str) -> String {
    let is_bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if is_bare { key.to_owned() } else { quote(key) }
}
