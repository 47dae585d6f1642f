//! Settings of a comparison as texts, shared by the front ends.

use super::spec::ComparisonSetting;
use super::subject::ComparisonSubject;
use crate::settings::parse;
use motorfit_core::setting::{Setting as Named, text};
use motorfit_core::text::{alternatives, excerpt, listed};
use motorfit_core::{Error, Result};
use motorfit_evaluate::Model;
use motorfit_evaluate::criterion::Criterion;
use motorfit_identify::device::DeviceSpec;
use motorfit_identify::{IdentifySpec, Method, estimated_space};
use motorfit_motor::Space;
use motorfit_optimize::{Coordinates, SEARCHES};

/// Factors of a comparison, each combination of which is a setting.
#[derive(Debug, Clone)]
pub struct CompareSettings {
    /// Search methods, with Steiglitz–McBride if it is to be compared too.
    pub methods: Vec<Method>,
    /// Criteria as `CRITERION:SCALE`.
    pub criteria: Vec<String>,
    /// Population sizes.
    pub population: Vec<usize>,
    /// Numbers of generations, the initial population included.
    pub generations: Vec<usize>,
    /// Hyperparameters as `METHOD.KEY=VALUE`, several values as `0.1/0.2`.
    pub set: Vec<String>,
    /// Coordinates in which the searches move their candidates, as `mirror`, `shift:0.1`, `log` or `none`. With any of the first three
    /// each setting is also compared in the coordinates of the parameters.
    pub transforms: Vec<String>,
    /// Bounds of the parameters. The default is Table 2 for a simulated motor, and a decade to each side of the estimate
    /// otherwise.
    pub bounds: Vec<String>,
    /// Fixed parameters, as `R=0.92`.
    pub fix: Vec<String>,
}

impl CompareSettings {
    /// Returns a setting for each combination of the factors.
    ///
    /// # Errors
    /// Returns a `Usage` error for invalid or repeated values.
    pub fn settings(&self) -> Result<Vec<ComparisonSetting>> {
        let variants = self.variants()?;
        let transforms = self.transforms.iter().map(|text| text.parse()).collect::<Result<Vec<Coordinates>>>()?;
        let repeated = [
            (Named::Criteria, twice(&self.criteria).is_some()),
            (Named::Population, twice(&self.population).is_some()),
            (Named::Generations, twice(&self.generations).is_some()),
            (Named::Transform, twice(&transforms).is_some()),
        ];
        if let Some((name, _)) = repeated.into_iter().find(|(_, is_repeated)| *is_repeated) {
            return Err(Error::usage(text!({name} " has a value twice"), "Give each once."));
        }
        let others = transforms.iter().copied().filter(|transform| *transform != Coordinates::None);
        let transforms: Vec<Coordinates> = std::iter::once(Coordinates::None).chain(others).collect();
        let mut settings = Vec::new();
        for criterion in &self.criteria {
            let criterion: Criterion = criterion.parse()?;
            for &population in &self.population {
                for &generations in &self.generations {
                    for (methods, &coordinates) in variants.iter().flat_map(|v| transforms.iter().map(move |t| (v, t)))
                    {
                        let methods = methods.clone();
                        settings.push(ComparisonSetting { criterion, population, generations, methods, coordinates });
                    }
                }
            }
        }
        Ok(settings)
    }

    /// Returns the search methods with every combination of their hyperparameters.
    fn variants(&self) -> Result<Vec<Vec<Method>>> {
        let all = &self.methods;
        let searches = SEARCHES.map(|search| search.name);
        if let Some(twice) = twice(all) {
            let message = text!([Methods](" names {} twice", twice.name()));
            return Err(Error::usage(message, "Name each once."));
        }
        if all.contains(&Method::Auto) {
            let message = text!([Methods] ": auto cannot be compared, because it selects a method itself");
            return Err(Error::usage(message, format!("Name {}.", alternatives(&[&searches[..], &["sm"]].concat()))));
        }
        let named: Vec<Method> = all.iter().filter(|method| method.is_search()).copied().collect();
        if named.is_empty() {
            let message = text!([Methods] " names no search");
            return Err(Error::usage(message, format!("Name at least one of {}.", listed(&searches, "and"))));
        }
        let mut variants = vec![named];
        for item in &self.set {
            let (name, values) = parse::pair(item, Named::Set, "ga.mutation=0.1/0.2")?;
            let (method, key) = name.split_once('.').ok_or_else(|| {
                let message = text!([Set](" \"{}\" names no method", excerpt(item)));
                Error::usage(message, "Write METHOD.KEY=VALUE, as in ga.mutation=0.1.")
            })?;
            let mut next = Vec::new();
            for variant in &variants {
                for value in values.split('/') {
                    let mut changed = variant.clone();
                    let found = changed.iter_mut().find(|m| m.name() == method).ok_or_else(|| {
                        let message = text!([Set](": {} is not among the methods", excerpt(method)));
                        Error::usage(message, text!("Name it in " [Methods] "."))
                    })?;
                    found.set(key, value)?;
                    next.push(changed);
                }
            }
            variants = next;
        }
        Ok(variants)
    }

    /// Returns the space of free parameters with their bounds. Automatic bounds are a decade to each side of the
    /// Steiglitz–McBride estimate, or of the refined estimate where that fails, and those of Table 2 without any estimate. A user's model has
    /// its own space.
    ///
    /// # Errors
    /// Returns a `Usage` error for invalid bounds or fixed values, and a `Data` or `NotIdentified` error for unsuitable
    /// recordings.
    pub fn space(&self, subject: &ComparisonSubject, model: Model) -> Result<Space> {
        if subject.model().is_some() {
            return Ok(Space::table2());
        }
        let usual = [if subject.truth().is_some() { "table2" } else { "auto" }.to_owned()];
        let bounds = if self.bounds.is_empty() { &usual[..] } else { &self.bounds };
        let fixed = parse::parameters(&self.fix, Named::Fix)?;
        let space = Space::table2_with(&parse::bounds(bounds)?, &fixed)?;
        let (auto_bounds, device) = (parse::auto_bounds(bounds)?, DeviceSpec::Cpu);
        let identify = IdentifySpec { space, auto_bounds, device, model, ..IdentifySpec::default() };
        estimated_space(&subject.records, &identify)
    }
}

/// Returns the first value that occurs twice in a list.
fn twice<T: PartialEq>(list: &[T]) -> Option<&T> {
    (1..list.len()).find(|n| list[..*n].contains(&list[*n])).map(|n| &list[n])
}
