//! A study as its file says it: factors, whose product the runs are, and what holds for all of them.

use super::keys::{Keys, OF_ALL_RUNS, OF_MODELS};
use super::toml::{Document, Item};
use crate::Result;
use crate::criterion::{Criterion, Noise, Norm, Scale};
use crate::device::{DeviceSpec, OnLoss, PrecisionSpec};
use crate::identify::{IdentifySpec, Method, Polish};
use crate::record::Reading;
use crate::settings::READING;
use std::path::Path;

/// Noise that is added to recordings.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AddedNoise {
    pub name: String,
    pub noise: Option<Noise>,
}

/// The files of a motor, or a pattern whose every file is a motor.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Entry {
    /// A path or a pattern (`*`, `?`, `[…]`, `**`): each file a motor of its own.
    Files(String),
    /// One motor in several files: a joint fit.
    Motor {
        name: String,
        files: Vec<String>,
        /// Files that are held out; none where those of the study are.
        validate: Vec<String>,
    },
}

/// The seeds: all from one number to another, or a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Seeds {
    /// From the first to the last, both included.
    Range(u64, u64),
    List(Vec<u64>),
}

impl Seeds {
    pub(super) fn count(&self) -> u64 {
        match self {
            Self::Range(first, last) => (last - first).saturating_add(1),
            Self::List(list) => list.len() as u64,
        }
    }

    /// The seed at a place.
    pub(super) fn at(&self, place: u64) -> u64 {
        match self {
            Self::Range(first, _) => first + place,
            Self::List(list) => usize::try_from(place).ok().and_then(|place| list.get(place)).copied().unwrap_or(0),
        }
    }
}

/// A level of the factor `with`: a model of the motor.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Level {
    /// `none`, `auto`, or the extensions with commas between them.
    pub name: String,
    /// The extensions, with the bounds, the held values and the parameters of each recording that such a model has.
    pub spec: IdentifySpec,
}

/// A study; a list of levels is a factor.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Study {
    pub name: String,
    pub recordings: Vec<Entry>,
    pub methods: Vec<Method>,
    pub polish: Vec<Polish>,
    pub with: Vec<Level>,
    /// True where the study names models; its lines then name them too.
    pub names_with: bool,
    pub population: Vec<usize>,
    /// The first population included.
    pub generations: Vec<usize>,
    pub criterion: Vec<Norm>,
    /// The scale of each channel in the criterion.
    pub scale: Vec<Scale>,
    pub noise: Vec<AddedNoise>,
    /// Of searches and of added noise.
    pub seeds: Seeds,
    pub reading: Reading,
    /// Recordings that are held out of every motor that has none of its own: paths and patterns.
    pub validate: Vec<String>,
    /// The part of each recording that is fitted, from its start; the rest is held out.
    pub split: Option<f64>,
    /// The simulation model and the device.
    pub spec: IdentifySpec,
    pub on_loss: OnLoss,
}

/// Factors but the motor and the seed.
pub(super) const FACTORS: usize = 8;
/// The keys that a study has beside the settings that are read as everywhere else.
const OWN_KEYS: [&str; 15] = [
    "name",
    "recordings",
    "methods",
    "polish",
    "with",
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
];

impl Study {
    /// Reads a study; `path` names it in errors.
    ///
    /// # Errors
    /// `Usage` with the line of what is wrong.
    pub(super) fn parse(text: &str, path: &Path) -> Result<Self> {
        let document = Document { text, path };
        let table = document.table()?;
        let settings = OF_ALL_RUNS.iter().chain(&OF_MODELS).chain(&READING).map(|setting| setting.name());
        let known: Vec<&str> = OWN_KEYS.into_iter().chain(settings).collect();
        document.check_keys(&table, &known, "A study")?;
        let keys = Keys { document, table: &table };
        let spec = keys.spec()?;
        let study = Self {
            name: keys.name(path)?,
            recordings: keys.recordings()?,
            methods: keys.methods()?,
            with: keys.with(&spec)?,
            names_with: keys.names_with(),
            polish: keys.list("polish", Item::choice, Polish::None)?,
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
            spec,
        };
        study.check(document)?;
        Ok(study)
    }

    /// Checks that the keys fit together.
    fn check(&self, document: Document<'_>) -> Result<()> {
        let wrong = |message: String, remedy: &str| Err(document.error(0..0, message, remedy));
        if self.methods.contains(&Method::SteiglitzMcBride)
            && self.with.iter().any(|level| !level.spec.space.fixed().is_empty())
        {
            return wrong(
                "fix: Steiglitz–McBride estimates all five parameters and cannot hold any".to_owned(),
                "Leave fix or the method sm out.",
            );
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

    /// The factors but motor and seed with their numbers of levels, from the slowest to the fastest.
    pub(super) fn levels(&self) -> [(&'static str, usize); FACTORS] {
        [
            ("method", self.methods.len()),
            ("polish", self.polish.len()),
            ("with", self.with.len()),
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
            ..self.with[factors.with].spec.clone()
        }
    }

    /// The model of a run, where the study names models.
    pub(super) fn with_name(&self, factors: &Factors) -> Option<&str> {
        self.names_with.then(|| self.with[factors.with].name.as_str())
    }
}

/// The levels of the factors of one run, but for its motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factors {
    /// The method that finds the optimum.
    pub method: Method,
    /// The refinement.
    pub polish: Polish,
    /// Place of the extensions in the study.
    pub with: usize,
    /// Agents.
    pub population: usize,
    /// Generations.
    pub generations: usize,
    /// The criterion of a search.
    pub criterion: Norm,
    /// The scale of each channel.
    pub scale: Scale,
    /// Place of the added noise in the study.
    pub noise: usize,
    /// The seed.
    pub seed: u64,
}
