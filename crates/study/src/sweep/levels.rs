//! Reading of the machines of a study: its models, extensions, bounds, fixed values and per-recording parameters.

use super::keys::{Keys, OF_ALL_RUNS, OF_MODELS};
use super::machine::{Level, MOTOR, ModelFile, ModelLevel, ModelTexts};
use super::toml::Item;
use crate::settings::{self, Fault, Given, READING, Value, parse};
use motorfit_core::setting::Setting;
use motorfit_core::{Error, Result};
use motorfit_identify::IdentifySpec;
use motorfit_identify::analysis::Characteristics;
use motorfit_model::Model;
use motorfit_motor::{Input, Parameter, Space, With};
use std::sync::Arc;

/// Machines of a study.
pub(super) struct Machines {
    /// Levels of the factor.
    pub levels: Vec<Level>,
    /// Texts of the models.
    pub files: Vec<ModelFile>,
}

/// Models of a study, named and read.
pub(super) struct Models {
    pub names: Vec<String>,
    models: Vec<Model>,
    files: Vec<ModelFile>,
    /// True if the DC motor is among the machines.
    pub has_motor: bool,
}

impl Models {
    /// Returns the symbols of all parameters.
    pub(super) fn symbols(&self) -> Vec<&str> {
        let motor = Parameter::ALL.into_iter().chain(Parameter::EXTENSIONS).filter(|_| self.has_motor);
        let mut symbols: Vec<&str> = motor.map(Parameter::symbol).collect();
        symbols.extend(self.models.iter().flat_map(Model::parameters).map(|parameter| parameter.name.as_str()));
        symbols
    }

    /// Returns the names that limits may have: parameters, and quantities that follow from them.
    pub(super) fn limited(&self) -> Vec<&str> {
        let characteristics = Characteristics::named(None, Input::Voltage).map(|(name, ..)| name);
        let mut names = self.symbols();
        names.extend(characteristics.into_iter().filter(|_| self.has_motor));
        names.extend(self.models.iter().flat_map(Model::derived).map(|quantity| quantity.name.as_str()));
        names
    }

    fn have(&self, symbol: &str) -> bool {
        self.models.iter().any(|model| has(model, symbol))
    }
}

fn has(model: &Model, symbol: &str) -> bool {
    model.parameters().iter().any(|parameter| parameter.name == symbol)
}

/// Returns the symbol of an item `R=0.1:1` or `TL`.
fn symbol(item: &str) -> &str {
    item.split_once('=').map_or(item, |(symbol, _)| symbol).trim()
}

/// Returns settings with the items that `is_kept` accepts.
fn filtered(given: &Given, is_kept: impl Fn(&str) -> bool) -> Given {
    let mut kept = Given::default();
    for setting in OF_MODELS.into_iter().filter(|setting| given.has(*setting)) {
        let items = given.list(setting).iter().filter(|item| is_kept(item)).cloned().collect();
        kept.put(setting, Value::List(items));
    }
    kept
}

impl<'a> Keys<'a> {
    /// Reads the models that the study names.
    pub(super) fn models(&self, texts: ModelTexts<'_>) -> Result<Models> {
        let names = self.words("model", "\"pmsm\" or \"machine.toml\"")?;
        let located = |error: Error| match texts {
            ModelTexts::Folder(_) => error,
            ModelTexts::Known(_) => self.document.located(self.span("model"), &error),
        };
        let own = names.iter().filter(|name| *name != MOTOR);
        let read = own.map(|name| texts.model(name).map_err(located)).collect::<Result<Vec<_>>>()?;
        let (models, files) = read.into_iter().unzip();
        let has_motor = names.is_empty() || names.iter().any(|name| name == MOTOR);
        Ok(Models { names, models, files, has_motor })
    }

    /// Returns the machines: the DC motor with each of its extensions, then the models. Each takes the bounds, fixed values and
    /// per-recording parameters that it has.
    pub(super) fn machines(&self, spec: &IdentifySpec, models: Models) -> Result<Machines> {
        let given = self.given(&OF_MODELS, &models.symbols())?;
        if self.names_with() && !models.has_motor {
            let message = "with extends the DC motor, which is not among the models";
            let hint = format!("Leave it out, or add \"{MOTOR}\", the DC motor, to model.");
            return Err(self.document.error(self.span("with"), message, hint));
        }
        let mut levels = match models.has_motor {
            true => self.with(spec, &given, &models)?,
            false => Vec::new(),
        };
        let names = models.names.iter().filter(|name| *name != MOTOR);
        for (number, (name, model)) in (1..).zip(names.zip(models.models)) {
            let model = self.model_level((number, name), model, (spec, &given), models.has_motor)?;
            levels.push(Level { with: MOTOR.to_owned(), spec: spec.clone(), model: Some(Arc::new(model)) });
        }
        Ok(Machines { levels, files: models.files })
    }

    fn model_level(
        &self,
        (number, name): (usize, &str),
        model: Model,
        (spec, of_models): (&IdentifySpec, &Given),
        has_motor: bool,
    ) -> Result<ModelLevel> {
        // Bounds by name, as of Table 2, are those of the motor.
        let is_own = |item: &str| has(&model, symbol(item)) || (!has_motor && !item.contains('='));
        let given = self.given(&OF_ALL_RUNS, &[])?.and(&filtered(of_models, is_own));
        let at = |fault: Fault| self.at(&fault);
        let mut reading = self.given(&READING, &[])?;
        reading.put(Setting::Discretization, Value::Text(spec.model.discretization.name().to_owned()));
        let reading = settings::model_reading(&reading, &model).map_err(at)?;
        let spec = settings::model_spec(&given).map_err(at)?;
        // The space is that of one recording where parameters belong to single ones; others are checked with each motor.
        spec.space(&model, 1).map_err(|error| self.document.located(self.span("model"), &error))?;
        Ok(ModelLevel { name: name.to_owned(), number, model, spec, reading })
    }

    /// Returns the DC motors. If the study names extensions, each takes the bounds, fixed values and per-recording parameters that
    /// it has; otherwise the bounds and fixed values define the motor.
    fn with(&self, spec: &IdentifySpec, of_models: &Given, models: &Models) -> Result<Vec<Level>> {
        let one = |item: Item<'_>| {
            let text = item.text("\"coulomb,dead-time\"")?;
            text.parse::<With>().map_err(|error| item.located(&error))
        };
        let motors = self.list("with", one, With::default())?;
        let is_of_motor = |item: &str| symbol(item).parse::<Parameter>().is_ok() || !item.contains('=');
        let (given, at) = (filtered(of_models, is_of_motor), |fault: Fault| self.at(&fault));
        let bounds = given.items(Setting::Bounds, parse::bounds).map_err(at)?;
        let auto_bounds = given.items(Setting::Bounds, parse::auto_bounds).map_err(at)?;
        let fixed = given.items(Setting::Fix, |items| parse::parameters(items, Setting::Fix)).map_err(at)?;
        let own = filtered(&given, |item| !models.have(item) || item.parse::<Parameter>().is_ok());
        let own = own.items(Setting::PerRecording, |items| parse::named(items, Setting::PerRecording)).map_err(at)?;
        let is_given = |p: Parameter| bounds.iter().any(|(of, ..)| *of == p) || fixed.iter().any(|(of, _)| *of == p);
        let has = |with: &With, p: Parameter| with.may_have(p) || (!self.names_with() && is_given(p));
        let asked = bounds.iter().map(|(p, ..)| ("bounds", *p)).chain(fixed.iter().map(|(p, _)| ("fix", *p)));
        for (key, parameter) in asked.chain(own.iter().map(|p| ("per_recording", *p))) {
            let symbol = parameter.symbol();
            if !motors.iter().any(|with| has(with, parameter)) && !models.have(symbol) {
                let message = format!("{key}: {symbol} is in no model of the study");
                let remedy = format!("Name its extension in with, or remove {symbol}.");
                return Err(self.document.error(self.span(key), message, remedy));
            }
        }
        let level = |with: &With| {
            let bounds: Vec<(Parameter, f64, f64)> = bounds.iter().filter(|(p, ..)| has(with, *p)).copied().collect();
            let fixed: Vec<(Parameter, f64)> = fixed.iter().filter(|(p, _)| has(with, *p)).copied().collect();
            // With extensions, all five parameters of the motor may be fixed.
            let space = if *with == With::default() { Space::table2_with } else { Space::table2_to_extend };
            let key = if given.has(Setting::Bounds) { "bounds" } else { "fix" };
            let space = space(&bounds, &fixed).map_err(|error| self.document.located(self.span(key), &error))?;
            let per_recording = own.iter().copied().filter(|p| has(with, *p)).collect();
            let auto_bounds = auto_bounds.clone();
            let spec = IdentifySpec { space, auto_bounds, with: with.clone(), per_recording, ..spec.clone() };
            Ok(Level { with: with.to_string(), spec, model: None })
        };
        motors.iter().map(level).collect()
    }
}
