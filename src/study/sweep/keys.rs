//! The keys of a study, one by one: what they may be and what they mean.

use super::study::{AddedNoise, Entry, Level, Seeds};
use super::toml::{Document, Value};
use crate::criterion::Criterion;
use crate::evaluate::{Initial, Model};
use crate::identify::{DeviceSpec, IdentifySpec, Method, OnLoss, PrecisionSpec, With, values};
use crate::motor::{Discretization, Parameter, Space};
use crate::named::{Named, named};
use crate::optimize::SEARCHES;
use crate::record::{Offset, Preparation, ReadOptions, Reading, parse_columns, parse_crop, parse_masks, parse_offset};
use crate::setting::Setting;
use crate::{Error, Result};
use std::path::Path;
use toml::de::{DeTable, DeValue};

/// A parameter with its bounds.
type Bounded = (Parameter, f64, f64);

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

    /// What a text means by another reader, its errors at their place.
    fn read<T>(&self, key: &str, expected: &str, read: impl Fn(&str) -> Result<T>) -> Result<Option<T>> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let text = self.document.text(key, value, expected)?;
        read(&text).map(Some).map_err(|error| self.document.located(value.span(), &error))
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

    /// What holds for all runs.
    pub(super) fn spec(&self) -> Result<IdentifySpec> {
        let document = self.document;
        let discretization = self.choice::<Discretization>("discretization")?;
        let initial = self.choice::<Initial>("initial")?;
        let precision = self.choice::<PrecisionSpec>("precision")?;
        let time_origin_s = self.get("time_origin").map(|v| document.number("time_origin", v)).transpose()?;
        Ok(IdentifySpec {
            model: Model { discretization: discretization.unwrap_or_default(), initial: initial.unwrap_or_default() },
            criterion: Criterion { time_origin_s, ..Criterion::default() },
            device: self.read("device", "\"cpu\"", str::parse)?.unwrap_or_default(),
            precision: precision.unwrap_or_default(),
            ..IdentifySpec::default()
        })
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
        let (bounds, auto_bounds) = self.bounds()?;
        let fixed = self.parameters("fix", |value, parameter| Ok((parameter, document.number("fix", value)?)))?;
        let own = values::named(&self.words("per_recording", "[\"TL\"]")?, Setting::PerRecording)
            .map_err(|error| document.located(span("per_recording"), &error))?;
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
            let bounds: Vec<Bounded> = bounds.iter().filter(|(p, ..)| has(with, *p)).copied().collect();
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

    /// Bounds that are given, and the parameters whose bounds follow the Steiglitz–McBride estimate.
    fn bounds(&self) -> Result<(Vec<Bounded>, Vec<Parameter>)> {
        let all = Parameter::ALL.to_vec();
        let Some(value) = self.get("bounds") else { return Ok((Vec::new(), all)) };
        if value.get_ref().as_str().is_some() {
            let bounds: UsualBounds = self.document.choice("bounds", value)?;
            return Ok((Vec::new(), if bounds == UsualBounds::Auto { all } else { Vec::new() }));
        }
        let given = self.parameters("bounds", |value, parameter| {
            let pair = self.document.list("bounds", value, |v| self.document.number("bounds", v))?;
            let [min, max] = pair[..] else {
                let symbol = parameter.symbol();
                let remedy = format!("Write bounds = {{{symbol} = [0.1, 1.0]}}.");
                return Err(self.document.error(value.span(), format!("bounds: {symbol} is not [MIN, MAX]"), remedy));
            };
            Ok((parameter, min, max))
        })?;
        let follows = all.into_iter().filter(|p| !given.iter().any(|(of, _, _)| of == p)).collect();
        Ok((given, follows))
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
        let document = self.document;
        let rate_hz = self.get("rate").map(|v| document.number("rate", v)).transpose()?;
        if let (Some(value), Some(rate)) = (self.get("rate"), rate_hz)
            && rate <= 0.0
        {
            return Err(document.error(
                value.span(),
                format!("rate is {rate}"),
                "Give samples per second, more than 0.",
            ));
        }
        let decimate = self.get("decimate").map(|v| self.positive("decimate", v)).transpose()?;
        let masks = self.words("mask", "[\"auto\"]")?;
        let wrong =
            |error: &Error| document.located(self.get("mask").map(toml::Spanned::span).unwrap_or_default(), error);
        Ok(Reading {
            options: ReadOptions {
                columns: self.read("columns", "\"current=I:mA\"", parse_columns)?.unwrap_or_default(),
                rate_hz,
                sheet: self.text("sheet", "\"Sheet1\"")?,
                gaps: self.choice("gaps")?.unwrap_or_default(),
                drop_repeats: self.get("drop_repeats").map(|v| document.flag("drop_repeats", v)).transpose()?
                    == Some(true),
            },
            preparation: Preparation {
                crop: self.read("crop", "\"0.2:1.5\"", parse_crop)?.unwrap_or_default(),
                offset: self.read("offset", "\"auto\"", parse_offset)?.unwrap_or(Offset::None),
                mask: parse_masks(&masks).map_err(|error| wrong(&error))?,
                rate_hz,
                decimate,
                filter: self.read("filter", "\"butterworth:100\"", str::parse)?,
                sampled_input: Some(discretization.uses_next_input()),
            },
        })
    }
}
