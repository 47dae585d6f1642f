//! Machines of a study, the levels of one factor: the DC motor with its extensions, and models of users.

use super::parameter::SweepParameter;
use motorfit_core::text::{listed, nearest};
use motorfit_core::{Error, Result};
use motorfit_identify::IdentifySpec;
use motorfit_identify::model::ModelSpec;
use motorfit_model::Model;
use motorfit_motor::Parameter;
use motorfit_record::Reading;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// Name of the DC motor among the models of a study.
pub(super) const MOTOR: &str = "none";

/// Number of the DC motor among the machines of a study; models have theirs from 1.
pub(super) const OF_MOTOR: usize = 0;

/// A level of the factor machine.
#[derive(Debug, Clone)]
pub(super) struct Level {
    /// Extensions of the DC motor: `none`, `auto`, or their names separated by commas; `none` for a model.
    pub with: String,
    /// Settings of all runs with the extensions, bounds, fixed values and per-recording parameters of the DC motor.
    pub spec: IdentifySpec,
    /// Model in place of the DC motor.
    pub model: Option<Arc<ModelLevel>>,
}

/// A model of a user with its settings.
#[derive(Debug)]
pub(super) struct ModelLevel {
    /// Name in the study: a path or a built-in model.
    pub name: String,
    /// Number of the model in the study, from 1.
    pub number: usize,
    pub model: Model,
    pub spec: ModelSpec,
    /// Reading of its signals.
    pub reading: Reading,
}

impl Level {
    /// Returns the number of the machine, by which it reads recordings.
    pub(super) fn number(&self) -> usize {
        self.model.as_ref().map_or(OF_MOTOR, |of| of.number)
    }

    /// Returns the name of the model; that of the DC motor for none.
    pub(super) fn model_name(&self) -> &str {
        self.model.as_ref().map_or(MOTOR, |of| &of.name)
    }

    /// Returns the parameter with a name; `None` if the machine has none.
    pub(super) fn parameter(&self, name: &str) -> Option<SweepParameter> {
        match &self.model {
            None => SweepParameter::named_of_motor(name),
            Some(of) => SweepParameter::named_of_model(&of.model, of.number, name),
        }
    }

    /// Returns true if results of the machine can have a parameter or a derived quantity.
    pub(super) fn may_have(&self, symbol: &str) -> bool {
        let Some(parameter) = self.parameter(symbol) else { return false };
        let Ok(own) = parameter.symbol.parse::<Parameter>() else { return true };
        let is_in_space = || {
            let space = &self.spec.space;
            space.free().iter().any(|axis| axis.parameter == own) || space.fixed().iter().any(|(p, ..)| *p == own)
        };
        self.model.is_some() || self.spec.with.may_have(own) || is_in_space()
    }

    /// Returns the parameters that every result has.
    pub(super) fn parameters(&self) -> Vec<SweepParameter> {
        let Some(of) = &self.model else { return SweepParameter::motor() };
        let is_own = |name: &str| of.spec.per_recording.iter().any(|own| own == name);
        let shared = of.model.parameters().iter().filter(|p| !p.is_per_recording && !is_own(&p.name));
        shared.filter_map(|p| self.parameter(&p.name)).collect()
    }

    /// Returns the names of the outputs.
    pub(super) fn outputs(&self) -> Vec<String> {
        match &self.model {
            None => ["current", "speed"].map(str::to_owned).to_vec(),
            Some(of) => of.model.outputs().iter().map(|output| output.name.clone()).collect(),
        }
    }
}

/// A model of a study with its text, so that a sweep does not need its file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelFile {
    /// Name in the study: a path relative to its folder, or a built-in model.
    pub name: String,
    /// Text of the model.
    pub text: String,
}

/// Origin of the texts of models: the folder of the study, or the models that a manifest holds.
#[derive(Clone, Copy)]
pub(super) enum ModelTexts<'a> {
    Folder(&'a Path),
    Known(&'a [ModelFile]),
}

impl ModelTexts<'_> {
    /// Returns the model with a name and its text.
    pub(super) fn model(self, name: &str) -> Result<(Model, ModelFile)> {
        let model = match self {
            Self::Folder(folder) if folder.join(name).is_file() => Model::open(&folder.join(name))?,
            Self::Folder(_) => Model::open(Path::new(name))?,
            Self::Known(known) => {
                let names: Vec<&str> = known.iter().map(|model| model.name.as_str()).collect();
                let found = known.iter().find(|model| model.name == name);
                let found = found.ok_or_else(|| {
                    let near = nearest(name, &names).map_or_else(|| listed(&names, "and"), str::to_owned);
                    Error::data(
                        format!("lacks the text of the model {name}"),
                        format!("It has {near}. Plan the study again."),
                    )
                })?;
                Model::parse(&found.text).map_err(|error| error.in_file(Path::new(name)))?
            }
        };
        let file = ModelFile { name: name.to_owned(), text: model.text().to_owned() };
        Ok((model, file))
    }
}
