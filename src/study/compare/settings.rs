//! Texts of settings of a comparison, shared by front ends.

use super::{Setting, Subject};
use crate::criterion::Criterion;
use crate::device::DeviceSpec;
use crate::evaluate::Model;
use crate::identify::{BatchCosts, IdentifySpec, Method};
use crate::motor::Space;
use crate::optimize::SEARCHES;
use crate::setting::{Setting as Named, text};
use crate::settings::values;
use crate::text::{alternatives, excerpt, listed};
use crate::{Error, Result};

/// Factors of a comparison: each of their combinations is a setting.
#[derive(Debug, Clone)]
pub struct CompareSettings {
    /// Searches, and Steiglitz–McBride where it is to stand beside them.
    pub methods: Vec<Method>,
    /// `CRITERION:SCALE`.
    pub criteria: Vec<String>,
    /// Agents.
    pub population: Vec<usize>,
    /// Generations, the first population included.
    pub generations: Vec<usize>,
    /// `METHOD.KEY=VALUE`; several values as `0.1/0.2`.
    pub set: Vec<String>,
    /// Bounds; without any those of Table 2 for a motor that is known, and such as follow the estimate for another.
    pub bounds: Vec<String>,
    /// Held values, `R=0.92`.
    pub fix: Vec<String>,
}

impl CompareSettings {
    /// A setting for each combination.
    ///
    /// # Errors
    /// `Usage` for what cannot be, and for what is asked twice.
    pub fn settings(&self) -> Result<Vec<Setting>> {
        let variants = self.variants()?;
        let repeated = [
            (Named::Criteria, twice(&self.criteria).is_some()),
            (Named::Population, twice(&self.population).is_some()),
            (Named::Generations, twice(&self.generations).is_some()),
        ];
        if let Some((name, _)) = repeated.into_iter().find(|(_, is_repeated)| *is_repeated) {
            return Err(Error::usage(text!({name} " has a value twice"), "Give each once."));
        }
        let mut settings = Vec::new();
        for criterion in &self.criteria {
            let criterion: Criterion = criterion.parse()?;
            for &population in &self.population {
                for &generations in &self.generations {
                    let setting = |methods| Setting { criterion, population, generations, methods };
                    settings.extend(variants.iter().cloned().map(setting));
                }
            }
        }
        Ok(settings)
    }

    /// The searches, with every combination of their own settings.
    fn variants(&self) -> Result<Vec<Vec<Method>>> {
        let all = &self.methods;
        let searches = SEARCHES.map(|search| search.name);
        if let Some(twice) = twice(all) {
            let message = text!([Methods](" names {} twice", twice.name()));
            return Err(Error::usage(message, "Name each once."));
        }
        if all.contains(&Method::Auto) {
            let message = text!([Methods] ": auto is no method of its own");
            return Err(Error::usage(message, format!("Name {}.", alternatives(&[&searches[..], &["sm"]].concat()))));
        }
        let named: Vec<Method> = all.iter().filter(|method| method.is_search()).copied().collect();
        if named.is_empty() {
            let message = text!([Methods] " names no search");
            return Err(Error::usage(message, format!("Name at least one of {}.", listed(&searches, "and"))));
        }
        let mut variants = vec![named];
        for item in &self.set {
            let (name, values) = values::pair(item, Named::Set, "ga.mutation=0.1/0.2")?;
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

    /// Returns the space of free parameters with their bounds.
    ///
    /// # Errors
    /// `Usage` for bounds or held values that cannot be; `Data` and `NotIdentified` for recordings that cannot serve.
    pub fn space(&self, subject: &Subject, model: Model) -> Result<Space> {
        let usual = [if subject.truth.is_some() { "table2" } else { "auto" }.to_owned()];
        let bounds = if self.bounds.is_empty() { &usual[..] } else { &self.bounds };
        let fixed = values::parameters(&self.fix, Named::Fix)?;
        let space = Space::table2_with(&values::bounds(bounds)?, &fixed)?;
        let (auto_bounds, device) = (values::auto_bounds(bounds)?, DeviceSpec::Cpu);
        let identify = IdentifySpec { space, auto_bounds, device, model, ..IdentifySpec::default() };
        Ok(BatchCosts::new(&subject.records, &identify)?.problem().space().clone())
    }
}

/// The first value that a list has twice.
fn twice<T: PartialEq>(list: &[T]) -> Option<&T> {
    (1..list.len()).find(|n| list[..*n].contains(&list[*n])).map(|n| &list[n])
}
