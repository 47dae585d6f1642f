//! A study as described by its file: factors, whose product gives the runs, and settings of all runs.

use super::entries::{AddedNoise, Entry, Seeds};
use super::keys::{Keys, OF_ALL_RUNS, OF_MODELS};
use super::levels::Machines;
use super::limits::Limits;
use super::machine::{Level, ModelFile, ModelLevel, ModelTexts};
use super::parameter::SweepParameter;
use super::toml::{Document, Item, as_key};
use crate::settings::READING;
use motorfit_core::Result;
use motorfit_core::setting::{Text, text};
use motorfit_core::text::{listed, nearest};
use motorfit_evaluate::criterion::{Criterion, Norm, Scale};
use motorfit_identify::device::{DeviceSpec, OnLoss, PrecisionSpec};
use motorfit_identify::model::ModelSpec;
use motorfit_identify::{IdentifySpec, Method, Polish};
use motorfit_motor::{Extension, Parameter};
use motorfit_record::Reading;
use std::collections::BTreeSet;
use std::path::Path;

/// A study. Each list is a factor whose entries are its levels.
#[derive(Debug, Clone)]
pub(super) struct Study {
    pub name: String,
    pub recordings: Vec<Entry>,
    pub methods: Vec<Method>,
    pub polish: Vec<Polish>,
    /// Machines: the DC motor with its extensions, and models.
    pub machines: Vec<Level>,
    /// Texts of the models.
    pub models: Vec<ModelFile>,
    /// True if the study names extensions; the lines of its results then name them too.
    pub names_with: bool,
    pub population: Vec<usize>,
    /// Numbers of generations, the initial population included.
    pub generations: Vec<usize>,
    pub criterion: Vec<Norm>,
    /// Scales of the channels in the criterion.
    pub scale: Vec<Scale>,
    pub noise: Vec<AddedNoise>,
    /// Seeds of the searches and of the added noise.
    pub seeds: Seeds,
    pub reading: Reading,
    /// Paths and patterns of held-out recordings, for motors that name none themselves.
    pub validate: Vec<String>,
    /// Fraction of each recording that is fitted, from its start; the remainder is held out.
    pub split: Option<f64>,
    /// Settings of all runs: simulation model and device.
    pub spec: IdentifySpec,
    pub on_loss: OnLoss,
    /// Acceptance limits of the motors.
    pub limits: Limits,
}

/// Number of factors except motor and seed.
pub(super) const FACTORS: usize = 8;
/// Keys of a study other than the common settings of all front ends.
const OWN_KEYS: [&str; 17] = [
    "name",
    "recordings",
    "methods",
    "polish",
    "with",
    "model",
    "population",
    "generations",
    "seeds",
    "criterion",
    "scale",
    "noise",
    "validate",
    "split",
    "fallback",
    "set",
    "limits",
];

impl Study {
    /// Parses a study; `path` is used in errors, and `texts` has its models.
    ///
    /// # Errors
    /// Returns a `Usage` error with the line of the first invalid key or value.
    pub(super) fn parse(text: &str, path: &Path, texts: ModelTexts<'_>) -> Result<Self> {
        let document = Document { text, path };
        let table = document.table()?;
        let settings = OF_ALL_RUNS.iter().chain(&OF_MODELS).chain(&READING).map(|setting| setting.name());
        let known: Vec<&str> = OWN_KEYS.into_iter().chain(settings).collect();
        document.check_keys(&table, &known, "A study")?;
        let keys = Keys { document, table: &table };
        let spec = keys.spec()?;
        let methods = keys.methods()?;
        let models = keys.models(texts)?;
        let limits = keys.limits(&models.limited())?;
        let Machines { levels, files } = keys.machines(&spec, models)?;
        // `auto` is the complete pipeline, which refines; a comparison of searches is about what they find themselves.
        let is_complete = methods.iter().all(|method| *method == Method::Auto);
        let study = Self {
            name: keys.name(path)?,
            recordings: keys.recordings()?,
            methods,
            machines: levels,
            models: files,
            names_with: keys.names_with(),
            polish: keys.list(
                "polish",
                Item::choice,
                if is_complete { Polish::LevenbergMarquardt } else { Polish::None },
            )?,
            population: keys.list("population", Item::positive, 100)?,
            generations: keys.list("generations", Item::positive, 100)?,
            criterion: keys.list("criterion", Item::choice, Norm::Nrmse)?,
            scale: keys.list("scale", Item::choice, Scale::Std)?,
            noise: keys.noise()?,
            seeds: keys.seeds()?,
            reading: keys.reading(spec.model.discretization)?,
            validate: keys.words("validate", "[\"held-out.csv\"]")?,
            split: keys.split()?,
            on_loss: keys.on_loss(&spec)?,
            limits,
            spec,
        };
        study.check(document)?;
        if let Some((symbol, hint)) = study.unlimited(&study.limits) {
            let message = format!("limits: no model of the study has {symbol}");
            return Err(document.error(keys.span("limits"), message, hint.respelled(as_key).to_string()));
        }
        Ok(study)
    }

    /// Returns the first parameter with limits that no result can have, and a hint.
    pub(super) fn unlimited(&self, limits: &Limits) -> Option<(String, Text)> {
        let symbol = limits.symbols().find(|symbol| !self.machines.iter().any(|level| level.may_have(symbol)))?;
        let extension = symbol
            .parse::<Parameter>()
            .ok()
            .and_then(|own| Extension::ALL.into_iter().find(|extension| extension.parameters().contains(&own)));
        let names: BTreeSet<String> =
            self.machines.iter().flat_map(Level::parameters).map(|parameter| parameter.symbol).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let hint = match (extension, nearest(symbol, &names)) {
            (Some(extension), _) => text!("Add its extension: " [With = "{}", extension.name()] "."),
            (None, Some(near)) => format!("Did you mean {near}?").into(),
            (None, None) => format!("They have {}.", listed(&names, "and")).into(),
        };
        Some((symbol.to_owned(), hint))
    }

    /// Checks the keys for contradictions.
    fn check(&self, document: Document<'_>) -> Result<()> {
        let wrong = |message: String, remedy: &str| Err(document.error(0..0, message, remedy));
        if self.methods.contains(&Method::SteiglitzMcBride)
            && self.machines.iter().any(|level| !level.spec.space.fixed().is_empty())
        {
            return wrong(
                "fix: Steiglitz–McBride estimates all five parameters and cannot fix any".to_owned(),
                "Remove fix or the method sm.",
            );
        }
        let has_models = !self.models.is_empty();
        if has_models && self.methods.contains(&Method::SteiglitzMcBride) {
            let message = "methods: Steiglitz–McBride is a method of the linear DC motor";
            return wrong(message.to_owned(), "Remove sm, or give the models a study of their own.");
        }
        if has_models && !matches!(self.spec.device, DeviceSpec::Auto | DeviceSpec::Cpu) {
            let message = "device: models are evaluated on the CPU in a sweep";
            return wrong(message.to_owned(), "Leave device out, or identify each recording alone.");
        }
        let parameters: Vec<SweepParameter> = self.machines.iter().flat_map(Level::parameters).collect();
        for (place, one) in parameters.iter().enumerate() {
            if let Some(other) = parameters[..place].iter().find(|of| of.name == one.name && of.unit != one.unit) {
                let message =
                    format!("model: {} is in {} in one model and in {} in another", one.name, other.unit, one.unit);
                return wrong(message, "Give it the same unit, or another name: their results share a column.");
            }
        }
        if self.spec.device == DeviceSpec::Cpu && self.spec.precision == PrecisionSpec::F32 {
            let message = "precision: f32 is for GPUs, the CPU evaluates in f64 only";
            return wrong(message.to_owned(), "Leave precision out, or give device = \"gpu\".");
        }
        let timed = |norm: &Norm| norm.is_time_weighted();
        if self.spec.criterion.time_origin_s.is_some() && !self.criterion.iter().any(timed) {
            return wrong("time_origin has no effect without the criterion itse or itae".to_owned(), "Leave it out.");
        }
        Ok(())
    }

    /// Returns the names of the factors except motor and seed with their numbers of levels, from the slowest to the
    /// fastest.
    pub(super) fn levels(&self) -> [(&'static str, usize); FACTORS] {
        [
            ("method", self.methods.len()),
            ("polish", self.polish.len()),
            (if self.models.is_empty() { "with" } else { "model" }, self.machines.len()),
            ("population", self.population.len()),
            ("generations", self.generations.len()),
            ("criterion", self.criterion.len()),
            ("scale", self.scale.len()),
            ("noise", self.noise.len()),
        ]
    }

    /// Returns the settings of one run.
    pub(super) fn spec(&self, factors: &Factors) -> IdentifySpec {
        IdentifySpec {
            method: factors.method,
            polish: factors.polish,
            population: factors.population,
            generations: factors.generations,
            seed: factors.seed,
            criterion: Criterion { norm: factors.criterion, scale: factors.scale, ..self.spec.criterion },
            ..self.machine(factors).spec.clone()
        }
    }

    /// Returns the machine of a run.
    pub(super) fn machine(&self, factors: &Factors) -> &Level {
        &self.machines[factors.machine]
    }

    /// Returns the model of a run with its settings; `None` for the DC motor.
    pub(super) fn model(&self, factors: &Factors) -> Option<(&ModelLevel, ModelSpec)> {
        let level = self.machine(factors).model.as_deref()?;
        let spec = ModelSpec {
            method: factors.method,
            is_polished: factors.polish != Polish::None,
            population: factors.population,
            generations: factors.generations,
            seed: factors.seed,
            criterion: Criterion { norm: factors.criterion, scale: factors.scale, ..level.spec.criterion },
            ..level.spec.clone()
        };
        Some((level, spec))
    }

    /// Returns the models with their settings.
    pub(super) fn model_levels(&self) -> impl Iterator<Item = &ModelLevel> {
        self.machines.iter().filter_map(|level| level.model.as_deref())
    }

    /// Returns true if the DC motor is among the machines.
    pub(super) fn has_motor(&self) -> bool {
        self.machines.iter().any(|level| level.model.is_none())
    }

    /// Returns the extensions of a run; `None` if the study names none.
    pub(super) fn with_name(&self, factors: &Factors) -> Option<&str> {
        self.names_with.then(|| self.machine(factors).with.as_str())
    }

    /// Returns the name of the model of a run; `None` if the study names no models.
    pub(super) fn model_name(&self, factors: &Factors) -> Option<&str> {
        (!self.models.is_empty()).then(|| self.machine(factors).model_name())
    }
}

/// Levels of the factors of one run, except its motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factors {
    /// Method that finds the optimum.
    pub method: Method,
    /// Refinement after the method.
    pub polish: Polish,
    /// Index of the machine in the study: the DC motor with its extensions, or a model.
    pub machine: usize,
    /// Population size.
    pub population: usize,
    /// Number of generations.
    pub generations: usize,
    /// Criterion that a search minimizes.
    pub criterion: Norm,
    /// Scale of the channels in the criterion.
    pub scale: Scale,
    /// Index of the added noise in the study.
    pub noise: usize,
    /// Seed of the search and of the added noise.
    pub seed: u64,
}
