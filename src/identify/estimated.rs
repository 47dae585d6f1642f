//! A result parameter by parameter, as it is shown.

use super::result::{Identification, side};
use super::spec::IdentifySpec;
use crate::Result;
use crate::estimate::fit_problem;
use crate::motor::{Axis, Extension, Input, Parameter, Scope};
use crate::record::Record;

/// A parameter of a result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimated {
    /// Which.
    pub parameter: Parameter,
    /// For which recordings.
    pub scope: Scope,
    /// Its value; `None` where the recordings do not tell it.
    pub value: Option<f64>,
    /// Its standard error; `None` at a bound, where it is held, and without a polish.
    pub std_error: Option<f64>,
    /// Its 95 % interval, likewise.
    pub ci95: Option<[f64; 2]>,
    /// The bound, `min` or `max`, that it ended at.
    pub at_bound: Option<&'static str>,
    /// Whether it was held at its value.
    pub fixed: bool,
    /// What it was free within, where it was.
    pub axis: Option<Axis>,
}

impl Identification {
    /// All parameters: the five of the motor, then those of extensions; those of recordings one after the other.
    #[must_use]
    pub fn estimates(&self) -> Vec<Estimated> {
        let uncertainty = self.uncertainty.as_ref();
        let free = self.space.free().iter().zip(&self.values).enumerate().map(|(n, (axis, value))| Estimated {
            parameter: axis.parameter,
            scope: axis.scope,
            value: Some(*value),
            std_error: uncertainty.and_then(|u| u.std_error[n]),
            ci95: uncertainty.and_then(|u| u.ci95[n]),
            at_bound: side(axis, *value),
            fixed: false,
            axis: Some(*axis),
        });
        let held = self.space.fixed().iter().map(|&(parameter, scope, value)| Estimated {
            parameter,
            scope,
            value: Some(value),
            std_error: None,
            ci95: None,
            at_bound: None,
            fixed: true,
            axis: None,
        });
        let mut all: Vec<Estimated> = free.chain(held).collect();
        for unknown in all.iter_mut().filter(|e| self.unidentified.contains(&e.parameter)) {
            *unknown = Estimated {
                value: None,
                std_error: None,
                ci95: None,
                at_bound: None,
                fixed: false,
                axis: None,
                ..*unknown
            };
        }
        let place = |scope: Scope| if let Scope::Recording(n) = scope { n } else { 0 };
        all.sort_by_key(|e| (e.parameter as usize, place(e.scope)));
        all
    }

    /// The extensions of its motor.
    #[must_use]
    pub fn extensions(&self) -> Vec<Extension> {
        let features = self.space.features();
        Extension::ALL.into_iter().filter(|extension| features.has_any(extension.parameters())).collect()
    }

    /// What it says that recordings show: current and speed, one value a sample, of those that it was made from; not a
    /// number for a current that is the input.
    ///
    /// # Errors
    /// As for a problem of these recordings.
    pub fn modelled(&self, records: &[Record], spec: &IdentifySpec) -> Result<Vec<[Vec<f64>; 2]>> {
        let problem = fit_problem(records, &self.space, spec.model)?;
        let initial = |n: usize| self.initial.get(n).copied().unwrap_or_default();
        let mut shown: Vec<_> = (0..records.len()).map(|n| problem.simulate(&self.values, n, initial(n))).collect();
        if self.input == Input::Current {
            shown.iter_mut().for_each(|[current, _]| current.fill(f64::NAN));
        }
        Ok(shown)
    }
}
