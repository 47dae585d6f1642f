//! The keys of a study, one by one: what they may be and what they mean.

use super::study::{AddedNoise, Entry, Level, Seeds};
use super::toml::{Document, Value};
use crate::device::{DeviceSpec, OnLoss};
use crate::identify::{IdentifySpec, Method};
use crate::motor::With;
use crate::motor::{Discretization, Parameter, Space};
use crate::named::{Named, named};
use crate::optimize::SEARCHES;
use crate::record::Reading;
use crate::setting::Setting;
use crate::settings::{self, Fault, Given, Kind, READING, row, values};
use crate::{Error, Result};
use std::path::Path;
use toml::de::{DeTable, DeValue};

named! {
    /// Bounds that are not given by parameter.
    enum UsualBounds (default Auto) {
        /// Those of the paper's Table 2.
        Table2 = "table2",
        /// A decade to each side of the Steiglitz–McBride estimate.
        Auto = "auto",
    }
}

named! {
    /// What evaluates where a lost device does not come back.
    enum Fallback (default None) {
        /// Nothing: the sweep ends with the error.
        None = "none",
        /// The CPU.
        Cpu = "cpu",
    }
}

/// The settings of an identification that hold for all runs.
pub(super) const OF_ALL_RUNS: [Setting; 5] =
    [Setting::Device, Setting::Precision, Setting::Discretization, Setting::Initial, Setting::TimeOrigin];
/// Those of which each model takes what it has.
pub(super) const OF_MODELS: [Setting; 3] = [Setting::Bounds, Setting::Fix, Setting::PerRecording];

/// The keys of a study.
pub(super) struct Keys<'a> {
    pub document: Document<'a>,
    pub table: &'a DeTable<'a>,
}

impl Keys<'_> {
    fn get(&self, key: &str) -> Option<&Value<'_>> {
        self.table.iter().find(|(name, _)| *name.get_ref() == key).map(|(_, value)| value)
    }

    fn text(&self, key: &str, expected: &str) -> Result<Option<String>> {
        self.get(key).map(|value| self.document.text(key, value, expected)).transpose()
    }

    pub(super) fn choice<T: Named>(&self, key: &str) -> Result<Option<T>> {
        self.get(key).map(|value| self.document.choice(key, value)).transpose()
    }

    pub(super) fn list<T: PartialEq>(
        &self,
        key: &str,
        one: &dyn Fn(&Value<'_>, &str) -> Result<T>,
        usual: T,
    ) -> Result<Vec<T>> {
        let Some(value) = self.get(key) else { return Ok(vec![usual]) };
        self.document.list(key, value, |value| one(value, key))
    }

    pub(super) fn positive(&self, key: &str, value: &Value<'_>) -> Result<usize> {
        match self.document.size(key, value)? {
            0 => Err(self.document.error(value.span(), format!("{key} is 0"), "Give at least 1.")),
            size => Ok(size),
        }
    }

    fn missing(&self, key: &str, remedy: &str) -> Error {
        self.document.error(0..0, format!("lacks the key \"{key}\""), remedy)
    }

    pub(super) fn name(&self, path: &Path) -> Result<String> {
        let stem = || path.file_stem().map_or_else(|| "study".to_owned(), |stem| stem.to_string_lossy().into_owned());
        Ok(self.text("name", "\"night\"")?.unwrap_or_else(stem))
    }

    pub(super) fn recordings(&self) -> Result<Vec<Entry>> {
        let document = self.document;
        let value =
            self.get("recordings").ok_or_else(|| self.missing("recordings", "Add recordings = [\"line/*.csv\"]."))?;
        document.list("recordings", value, |value| {
            let DeValue::Table(table) = value.get_ref() else {
                return Ok(Entry::Files(document.text("recordings", value, "\"line/*.csv\"")?));
            };
            document.check_keys(table, &["motor", "files", "validate"], "A motor")?;
            let own = Keys { document, table };
            let lacks = |key: &str| {
                document.error(
                    value.span(),
                    format!("a motor lacks \"{key}\""),
                    "Write {motor = \"m1\", files = [\"a.csv\"]}.",
                )
            };
            let files = own.get("files").ok_or_else(|| lacks("files"))?;
            Ok(Entry::Motor {
                name: own.text("motor", "\"m1\"")?.ok_or_else(|| lacks("motor"))?,
                files: document.list("files", files, |file| document.text("files", file, "[\"a.csv\"]"))?,
                validate: own.words("validate", "[\"held-out.csv\"]")?,
            })
        })
    }

    pub(super) fn methods(&self) -> Result<Vec<Method>> {
        let document = self.document;
        let value = self.get("methods").ok_or_else(|| {
            self.missing(
                "methods",
                &format!(
                    "Add methods = [\"sm\"], or others of {}, auto.",
                    SEARCHES.map(|search| search.name).join(", ")
                ),
            )
        })?;
        let mut methods = document.list("methods", value, |value| document.choice::<Method>("methods", value))?;
        for item in self.words("set", "[\"ga.mutation=0.1\"]")? {
            let wrong =
                |error: &Error| document.located(self.get("set").map(toml::Spanned::span).unwrap_or_default(), error);
            let (name, value) = values::pair(&item, Setting::Set, "ga.mutation=0.1").map_err(|e| wrong(&e))?;
            let (method, key) = name.split_once('.').unwrap_or(("", name));
            let Some(found) = methods.iter_mut().find(|m| m.name() == method) else {
                let message = format!("set: \"{}\" is not among the methods", crate::text::excerpt(method));
                return Err(wrong(&Error::usage(message, "Write METHOD.KEY=VALUE of a method of the study.")));
            };
            found.set(key, value).map_err(|e| wrong(&e))?;
        }
        Ok(methods)
    }

    /// Texts of a list, none where the key is not there.
    pub(super) fn words(&self, key: &str, expected: &str) -> Result<Vec<String>> {
        let Some(value) = self.get(key) else { return Ok(Vec::new()) };
        self.document.list(key, value, |value| self.document.text(key, value, expected))
    }

    pub(super) fn noise(&self, key: &str, value: &Value<'_>) -> Result<AddedNoise> {
        let name = self.document.text(key, value, "\"40dB\"")?;
        let noise = match name.as_str() {
            "none" => None,
            text => Some(values::noise(text).map_err(|error| self.document.located(value.span(), &error))?),
        };
        Ok(AddedNoise { name, noise })
    }

    pub(super) fn seeds(&self) -> Result<Seeds> {
        let Some(value) = self.get("seeds") else { return Ok(Seeds::Range(1, 1)) };
        let Some(text) = value.get_ref().as_str() else {
            return Ok(Seeds::List(self.document.list("seeds", value, |value| self.document.count("seeds", value))?));
        };
        let ends = text
            .split_once("..")
            .map(|(a, b)| (a.trim().parse::<u64>(), b.trim().trim_start_matches('=').parse::<u64>()));
        match ends {
            Some((Ok(first), Ok(last))) if first <= last => Ok(Seeds::Range(first, last)),
            _ => Err(self.document.error(
                value.span(),
                format!("seeds: \"{}\" is no range", crate::text::excerpt(text)),
                "Write seeds = \"1..50\" (both included), or a list of numbers.",
            )),
        }
    }

    /// The settings of a table that are there, read as everywhere else.
    fn given(&self, settings: &[Setting]) -> Result<Given> {
        let document = self.document;
        let mut given = Given::default();
        for row in settings.iter().filter_map(|setting| row(*setting)) {
            let key = row.setting.name();
            let Some(value) = self.get(key) else { continue };
            let quoted = |names: &[&str]| format!("\"{}\"", names.join("\", \""));
            let value = match row.kind {
                Kind::Switch => settings::Value::Switch(document.flag(key, value)?),
                Kind::Number => settings::Value::Number(document.number(key, value)?),
                Kind::Count => settings::Value::Count(document.count(key, value)?),
                Kind::Word => settings::Value::Text(document.text(key, value, &quoted(&[row.example]))?),
                Kind::Choice(rows) => {
                    let names: Vec<&str> = rows.iter().map(|(name, _)| *name).collect();
                    settings::Value::Text(document.text(key, value, &quoted(&names))?)
                }
                Kind::List => settings::Value::List(match row.setting {
                    Setting::Bounds => self.bounds(value)?,
                    Setting::Fix => self.parameters(key, |value, parameter| {
                        Ok(format!("{}={}", parameter.symbol(), document.number(key, value)?))
                    })?,
                    _ => self.words(key, &format!("[\"{}\"]", row.example))?,
                }),
            };
            given.put(row.setting, value);
        }
        Ok(given)
    }

    /// The error of a setting at its place.
    fn at(&self, fault: &Fault) -> Error {
        let span = self.get(fault.setting.name()).map(toml::Spanned::span).unwrap_or_default();
        self.document.located(span, &fault.error)
    }

    /// What holds for all runs.
    pub(super) fn spec(&self) -> Result<IdentifySpec> {
        settings::problem(&self.given(&OF_ALL_RUNS)?).map_err(|fault| self.at(&fault))
    }

    /// Whether the factor of models is there.
    pub(super) fn names_with(&self) -> bool {
        self.get("with").is_some()
    }

    /// The models, on top of what holds for all runs. Of a study that names models each takes the bounds, the held values
    /// and the parameters of recordings that it has; otherwise bounds and held values say what there is.
    pub(super) fn with(&self, spec: &IdentifySpec) -> Result<Vec<Level>> {
        let document = self.document;
        let span = |key: &str| self.get(key).map(toml::Spanned::span).unwrap_or_default();
        let one = |value: &Value<'_>, key: &str| {
            let text = document.text(key, value, "\"coulomb,dead-time\"")?;
            text.parse::<With>().map_err(|error| document.located(value.span(), &error))
        };
        let models = self.list("with", &one, With::default())?;
        let (given, at) = (self.given(&OF_MODELS)?, |fault: Fault| self.at(&fault));
        let bounds = given.items(Setting::Bounds, values::bounds).map_err(at)?;
        let auto_bounds = given.items(Setting::Bounds, values::auto_bounds).map_err(at)?;
        let fixed = given.items(Setting::Fix, |items| values::parameters(items, Setting::Fix)).map_err(at)?;
        let own =
            given.items(Setting::PerRecording, |items| values::named(items, Setting::PerRecording)).map_err(at)?;
        let is_given = |p: Parameter| bounds.iter().any(|(of, ..)| *of == p) || fixed.iter().any(|(of, _)| *of == p);
        let has = |with: &With, p: Parameter| with.may_have(p) || (!self.names_with() && is_given(p));
        let asked = bounds.iter().map(|(p, ..)| ("bounds", *p)).chain(fixed.iter().map(|(p, _)| ("fix", *p)));
        for (key, parameter) in asked.chain(own.iter().map(|p| ("per_recording", *p))) {
            if !models.iter().any(|with| has(with, parameter)) {
                let symbol = parameter.symbol();
                let remedy = format!("Name its extension in with, or leave {symbol} out.");
                return Err(document.error(span(key), format!("{key}: {symbol} is in no model of the study"), remedy));
            }
        }
        let level = |with: &With| {
            let bounds: Vec<(Parameter, f64, f64)> = bounds.iter().filter(|(p, ..)| has(with, *p)).copied().collect();
            let fixed: Vec<(Parameter, f64)> = fixed.iter().filter(|(p, _)| has(with, *p)).copied().collect();
            // What is held may be all of the motor where it has extensions.
            let space = if *with == With::default() { Space::table2_with } else { Space::table2_to_extend };
            let key = if self.get("bounds").is_some() { "bounds" } else { "fix" };
            let space = space(&bounds, &fixed).map_err(|error| document.located(span(key), &error))?;
            let per_recording = own.iter().copied().filter(|p| has(with, *p)).collect();
            let auto_bounds = auto_bounds.clone();
            let spec = IdentifySpec { space, auto_bounds, with: with.clone(), per_recording, ..spec.clone() };
            Ok(Level { name: with.to_string(), spec })
        };
        models.iter().map(level).collect()
    }

    pub(super) fn split(&self) -> Result<Option<f64>> {
        let Some(value) = self.get("split") else { return Ok(None) };
        let fraction = self.document.number("split", value)?;
        if !(fraction > 0.0 && fraction < 1.0) {
            let message = format!("split is {fraction}");
            return Err(self.document.error(
                value.span(),
                message,
                "Give a fraction between 0 and 1, as in split = 0.7.",
            ));
        }
        Ok(Some(fraction))
    }

    /// The values of a table by parameter, in the order of the file.
    fn parameters<T>(&self, key: &str, one: impl Fn(&Value<'_>, Parameter) -> Result<T>) -> Result<Vec<T>> {
        let Some(value) = self.get(key) else { return Ok(Vec::new()) };
        let Some(table) = value.get_ref().as_table() else {
            let example = if key == "fix" { "{R = 0.92}" } else { "\"table2\", \"auto\" or {R = [0.1, 1.0]}" };
            return Err(self.document.error(
                value.span(),
                format!("{key} is no table"),
                format!("Write {key} = {example}."),
            ));
        };
        let symbols: Vec<&str> =
            Parameter::ALL.into_iter().chain(Parameter::EXTENSIONS).map(Parameter::symbol).collect();
        self.document.check_keys(table, &symbols, key)?;
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(name, _)| name.span().start);
        entries.into_iter().map(|(name, value)| one(value, name.get_ref().parse()?)).collect()
    }

    /// Bounds as a list of texts.
    fn bounds(&self, value: &Value<'_>) -> Result<Vec<String>> {
        if value.get_ref().as_str().is_some() {
            let bounds: UsualBounds = self.document.choice("bounds", value)?;
            return Ok(vec![bounds.name().to_owned()]);
        }
        self.parameters("bounds", |value, parameter| {
            let symbol = parameter.symbol();
            let pair = self.document.list("bounds", value, |v| self.document.number("bounds", v))?;
            let [min, max] = pair[..] else {
                let remedy = format!("Write bounds = {{{symbol} = [0.1, 1.0]}}.");
                return Err(self.document.error(value.span(), format!("bounds: {symbol} is not [MIN, MAX]"), remedy));
            };
            Ok(format!("{symbol}={min}:{max}"))
        })
    }

    pub(super) fn on_loss(&self, spec: &IdentifySpec) -> Result<OnLoss> {
        let fallback: Fallback = self.choice("fallback")?.unwrap_or_default();
        if let (Some(value), DeviceSpec::Cpu) = (self.get("fallback"), &spec.device) {
            let message = "fallback has no effect with device = \"cpu\"";
            return Err(self.document.error(value.span(), message, "Leave it out."));
        }
        Ok(if fallback == Fallback::Cpu { OnLoss::ReopenOrCpu } else { OnLoss::Reopen })
    }

    pub(super) fn reading(&self, discretization: Discretization) -> Result<Reading> {
        let mut given = self.given(&READING)?;
        given.put(Setting::Discretization, settings::Value::Text(discretization.name().to_owned()));
        settings::reading(&given).map_err(|fault| self.at(&fault))
    }
}
