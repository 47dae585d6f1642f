//! Reading and checking of the keys of a study.

use super::entries::{AddedNoise, Entry, Seeds};
use super::limits::Limits;
use super::toml::{Document, Item};
use crate::settings::{self, Fault, Given, Kind, READING, Value, parse, row};
use motorfit_core::named::named;
use motorfit_core::setting::Setting;
use motorfit_core::{Error, Result};
use motorfit_identify::device::{DeviceSpec, OnLoss};
use motorfit_identify::{IdentifySpec, Method};
use motorfit_motor::Discretization;
use motorfit_optimize::SEARCHES;
use motorfit_record::Reading;
use std::ops::Range;
use std::path::Path;
use toml::de::{DeTable, DeValue};

named! {
    /// Bounds that are given by name.
    enum DefaultBounds (default Auto) {
        /// Bounds of Table 2.
        Table2 = "table2",
        /// A decade to each side of the Steiglitz–McBride estimate.
        Auto = "auto",
    }
}

named! {
    /// Device that takes over when a lost device cannot be reopened.
    enum Fallback (default None) {
        /// None: the sweep ends with the error.
        None = "none",
        /// CPU.
        Cpu = "cpu",
    }
}

/// Settings of an identification that apply to all runs.
pub(super) const OF_ALL_RUNS: [Setting; 6] = [
    Setting::Device,
    Setting::Precision,
    Setting::Evaluator,
    Setting::Discretization,
    Setting::Initial,
    Setting::TimeOrigin,
];
/// Settings of which each model takes the entries for its own parameters.
pub(super) const OF_MODELS: [Setting; 3] = [Setting::Bounds, Setting::Fix, Setting::PerRecording];

/// Table of a study.
pub(super) struct Keys<'a> {
    pub document: Document<'a>,
    pub table: &'a DeTable<'a>,
}

impl<'a> Keys<'a> {
    pub(super) fn get(&self, key: &'a str) -> Option<Item<'a>> {
        let value = self.table.iter().find(|(name, _)| *name.get_ref() == key).map(|(_, value)| value)?;
        Some(Item { document: self.document, key, value })
    }

    /// Returns the span of a key's value; the start of the text if the key is absent.
    pub(super) fn span(&self, key: &'a str) -> Range<usize> {
        self.get(key).map(|item| item.value.span()).unwrap_or_default()
    }

    pub(super) fn list<T: PartialEq>(
        &self,
        key: &'a str,
        one: impl Fn(Item<'a>) -> Result<T>,
        usual: T,
    ) -> Result<Vec<T>> {
        self.get(key).map_or_else(|| Ok(vec![usual]), |item| item.list(one))
    }

    fn needed(&self, key: &'a str, remedy: impl FnOnce() -> String) -> Result<Item<'a>> {
        self.get(key).ok_or_else(|| self.document.error(0..0, format!("lacks the key \"{key}\""), remedy()))
    }

    pub(super) fn name(&self, path: &Path) -> Result<String> {
        let stem = || path.file_stem().map_or_else(|| "study".to_owned(), |stem| stem.to_string_lossy().into_owned());
        self.get("name").map_or_else(|| Ok(stem()), |name| name.text("\"night\""))
    }

    pub(super) fn recordings(&self) -> Result<Vec<Entry>> {
        let recordings = self.needed("recordings", || "Add recordings = [\"line/*.csv\"].".to_owned())?;
        recordings.list(|entry| {
            let DeValue::Table(table) = entry.value.get_ref() else {
                return Ok(Entry::Files(entry.text("\"line/*.csv\"")?));
            };
            self.document.check_keys(table, &["motor", "files", "validate"], "A motor")?;
            let own = Keys { document: self.document, table };
            let remedy = "Write {motor = \"m1\", files = [\"a.csv\"]}.";
            let needed = |key| own.get(key).ok_or_else(|| entry.error(format!("a motor lacks \"{key}\""), remedy));
            let files = needed("files")?;
            Ok(Entry::Motor {
                name: needed("motor")?.text("\"m1\"")?,
                files: files.words("[\"a.csv\"]")?,
                validate: own.words("validate", "[\"held-out.csv\"]")?,
            })
        })
    }

    pub(super) fn methods(&self) -> Result<Vec<Method>> {
        let names = SEARCHES.map(|search| search.name);
        let remedy = || format!("Add methods = [\"auto\"], or others of sm, {}.", names.join(", "));
        let mut methods = self.needed("methods", remedy)?.list(Item::choice::<Method>)?;
        for item in self.words("set", "[\"ga.mutation=0.1\"]")? {
            let wrong = |error: &Error| self.document.located(self.span("set"), error);
            let (name, value) = parse::pair(&item, Setting::Set, "ga.mutation=0.1").map_err(|e| wrong(&e))?;
            let (method, key) = name.split_once('.').unwrap_or(("", name));
            let Some(found) = methods.iter_mut().find(|m| m.name() == method) else {
                let message = format!("set: \"{}\" is not among the methods", motorfit_core::text::excerpt(method));
                return Err(wrong(&Error::usage(message, "Write METHOD.KEY=VALUE of a method of the study.")));
            };
            found.set(key, value).map_err(|e| wrong(&e))?;
        }
        Ok(methods)
    }

    /// Returns the texts of a list, none if the key is absent.
    pub(super) fn words(&self, key: &'a str, expected: &str) -> Result<Vec<String>> {
        self.get(key).map_or_else(|| Ok(Vec::new()), |item| item.words(expected))
    }

    pub(super) fn noise(&self) -> Result<Vec<AddedNoise>> {
        let one = |item: Item<'_>| {
            let name = item.text("\"40dB\"")?;
            let noise = (name != "none").then(|| parse::noise(&name).map_err(|error| item.located(&error)));
            Ok(AddedNoise { noise: noise.transpose()?, name })
        };
        self.list("noise", one, AddedNoise { name: "none".to_owned(), noise: None })
    }

    pub(super) fn seeds(&self) -> Result<Seeds> {
        let Some(item) = self.get("seeds") else { return Ok(Seeds::Range(1, 1)) };
        let Some(text) = item.value.get_ref().as_str() else { return Ok(Seeds::List(item.distinct(Item::count)?)) };
        let ends = text
            .split_once("..")
            .map(|(a, b)| (a.trim().parse::<u64>(), b.trim().trim_start_matches('=').parse::<u64>()));
        match ends {
            Some((Ok(first), Ok(last))) if first <= last => Ok(Seeds::Range(first, last)),
            _ => Err(item.error(
                format!("seeds: \"{}\" is not a range", motorfit_core::text::excerpt(text)),
                "Write seeds = \"1..50\" (both included), or a list of numbers.",
            )),
        }
    }

    /// Reads the settings that are present in the table by the common rules of all front ends. `symbols` are those of the parameters.
    pub(super) fn given(&self, settings: &[Setting], symbols: &[&str]) -> Result<Given> {
        let mut given = Given::default();
        let quoted = |names: &[&str]| format!("\"{}\"", names.join("\", \""));
        for row in settings.iter().filter_map(|setting| row(*setting)) {
            let Some(item) = self.get(row.setting.name()) else { continue };
            let value = match row.kind {
                Kind::Switch => Value::Switch(item.flag()?),
                Kind::Number => Value::Number(item.number()?),
                Kind::Count => Value::Count(item.count()?),
                Kind::Word => Value::Text(item.text(&quoted(&[row.example]))?),
                Kind::Choice(rows) => {
                    Value::Text(item.text(&quoted(&rows.iter().map(|(name, _)| *name).collect::<Vec<_>>()))?)
                }
                Kind::List => Value::List(match row.setting {
                    Setting::Bounds => bounds(item, symbols)?,
                    Setting::Fix => {
                        parameters(item, symbols, |symbol, value| Ok(format!("{symbol}={}", value.number()?)))?
                    }
                    _ => item.words(&format!("[\"{}\"]", row.example))?,
                }),
            };
            given.put(row.setting, value);
        }
        Ok(given)
    }

    /// Adds the line of a setting to its error.
    pub(super) fn at(&self, fault: &Fault) -> Error {
        self.document.located(self.span(fault.setting.name()), &fault.error)
    }

    /// Returns the settings that apply to all runs.
    pub(super) fn spec(&self) -> Result<IdentifySpec> {
        settings::problem(&self.given(&OF_ALL_RUNS, &[])?).map_err(|fault| self.at(&fault))
    }

    /// Returns true if the study names models with the key `with`.
    pub(super) fn names_with(&self) -> bool {
        self.get("with").is_some()
    }

    pub(super) fn split(&self) -> Result<Option<f64>> {
        let Some(item) = self.get("split") else { return Ok(None) };
        match item.number()? {
            fraction if fraction > 0.0 && fraction < 1.0 => Ok(Some(fraction)),
            other => {
                let hint = "Give a fraction between 0 and 1, as in split = 0.7.";
                Err(item.error(format!("split is {other}"), hint))
            }
        }
    }

    /// Returns the acceptance limits of the motors; none if the key is absent.
    pub(super) fn limits(&self, symbols: &[&str]) -> Result<Limits> {
        let Some(item) = self.get("limits") else { return Ok(Limits::default()) };
        let list = Limits::parse(&ranges(item, symbols)?);
        list.map_err(|error| {
            item.error(error.message().to_string(), "Write limits = {R = [0.8, 1.0]}, the lower limit first.")
        })
    }

    pub(super) fn on_loss(&self, spec: &IdentifySpec) -> Result<OnLoss> {
        let Some(item) = self.get("fallback") else { return Ok(OnLoss::Reopen) };
        let fallback: Fallback = item.choice()?;
        if spec.device == DeviceSpec::Cpu {
            return Err(item.error("fallback has no effect with device = \"cpu\"", "Leave it out."));
        }
        Ok(if fallback == Fallback::Cpu { OnLoss::ReopenOrCpu } else { OnLoss::Reopen })
    }

    pub(super) fn reading(&self, discretization: Discretization) -> Result<Reading> {
        let mut given = self.given(&READING, &[])?;
        given.put(Setting::Discretization, Value::Text(discretization.name().to_owned()));
        settings::reading(&given).map_err(|fault| self.at(&fault))
    }
}

/// Returns the values of a table of parameters, in the order of the file.
fn parameters<T>(item: Item<'_>, symbols: &[&str], one: impl Fn(&str, Item<'_>) -> Result<T>) -> Result<Vec<T>> {
    let Item { document, key, value } = item;
    let Some(table) = value.get_ref().as_table() else {
        let example = match key {
            "fix" => "{R = 0.92}",
            "limits" => "{R = [0.8, 1.0]}",
            _ => "\"table2\", \"auto\" or {R = [0.1, 1.0]}",
        };
        return Err(item.error(format!("{key} is not a table"), format!("Write {key} = {example}.")));
    };
    document.check_keys(table, symbols, key)?;
    let mut entries: Vec<_> = table.iter().collect();
    entries.sort_by_key(|(name, _)| name.span().start);
    entries.into_iter().map(|(symbol, value)| one(symbol.get_ref(), Item { value, ..item })).collect()
}

/// Returns the bounds as a list of texts.
fn bounds(item: Item<'_>, symbols: &[&str]) -> Result<Vec<String>> {
    if item.value.get_ref().as_str().is_some() {
        return Ok(vec![item.choice::<DefaultBounds>()?.name().to_owned()]);
    }
    ranges(item, symbols)
}

/// Returns a table of ranges as a list of texts.
fn ranges(item: Item<'_>, symbols: &[&str]) -> Result<Vec<String>> {
    let key = item.key;
    parameters(item, symbols, |symbol, value| {
        let [min, max] = value.list(Item::number)?[..] else {
            let remedy = format!("Write {key} = {{{symbol} = [0.1, 1.0]}}.");
            return Err(value.error(format!("{key}: {symbol} is not [MIN, MAX]"), remedy));
        };
        Ok(format!("{symbol}={min}:{max}"))
    })
}
