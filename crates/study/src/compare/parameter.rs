//! Parameters of the machine that methods are compared on: their names, units, bounds and fixed values.

use motorfit_evaluate::model::ModelSpace;
use motorfit_model::Model;
use motorfit_motor::{Parameter, Space};

/// A parameter of the machine of a comparison: of the DC motor or of a user's model.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedParameter {
    /// Name, with the index of the recording if it belongs to one, as in `TL[1]`.
    pub name: String,
    /// Unit of its values.
    pub unit: String,
    /// Description, as `winding resistance`; empty without one.
    pub description: String,
    /// Bounds of a free parameter, or the value of a fixed one.
    pub domain: Domain,
}

/// Bounds of a free parameter, or the value of a fixed one, in the unit of the parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Domain {
    /// The searches estimate the parameter.
    Free {
        /// Index of the parameter among the values of a candidate.
        axis: usize,
        /// Lower bound.
        min: f64,
        /// Upper bound.
        max: f64,
    },
    /// All candidates have this value.
    Fixed(f64),
}

impl ComparedParameter {
    /// Returns the five parameters of the DC motor.
    pub(super) fn of_motor(space: &Space) -> Vec<Self> {
        let domain = |parameter: Parameter| {
            let free = space.free().iter().enumerate().find(|(_, axis)| axis.parameter == parameter);
            let fixed =
                || space.fixed().iter().find(|(own, ..)| *own == parameter).map_or(f64::NAN, |(.., value)| *value);
            free.map_or_else(|| Domain::Fixed(fixed()), |(axis, of)| Domain::Free { axis, min: of.min, max: of.max })
        };
        let of = |parameter: Parameter| Self {
            name: parameter.symbol().to_owned(),
            unit: parameter.unit().to_owned(),
            description: parameter.name().to_owned(),
            domain: domain(parameter),
        };
        Parameter::ALL.map(of).to_vec()
    }

    /// Returns the parameters of a model in its order, those of single recordings once for each.
    pub(super) fn of_model(model: &Model, space: &ModelSpace) -> Vec<Self> {
        let mut all = Vec::new();
        let names = space.names(model);
        for (number, parameter) in model.parameters().iter().enumerate() {
            let of = |name: &str, domain| Self {
                name: name.to_owned(),
                unit: parameter.unit.text.clone(),
                description: parameter.description.clone(),
                domain,
            };
            all.extend(
                space.fixed.get(number).copied().flatten().map(|value| of(&parameter.name, Domain::Fixed(value))),
            );
            let own = space.free.iter().zip(&names).enumerate().filter(|(_, (axis, _))| axis.parameter == number);
            all.extend(own.map(|(n, (axis, name))| of(name, Domain::Free { axis: n, min: axis.min, max: axis.max })));
        }
        all
    }

    /// Returns true if the searches estimate the parameter; its value is fixed otherwise.
    #[must_use]
    pub fn is_free(&self) -> bool {
        self.bounds().is_some()
    }

    /// Returns the bounds; `None` for a fixed parameter.
    #[must_use]
    pub fn bounds(&self) -> Option<[f64; 2]> {
        if let Domain::Free { min, max, .. } = self.domain { Some([min, max]) } else { None }
    }

    /// Returns the value of a fixed parameter; `None` for a free one.
    #[must_use]
    pub fn fixed(&self) -> Option<f64> {
        if let Domain::Fixed(value) = self.domain { Some(value) } else { None }
    }

    /// Returns the values of all parameters, fixed ones included, of a candidate; NaN where the candidate has no value.
    #[must_use]
    pub fn values(parameters: &[Self], candidate: &[f64]) -> Vec<f64> {
        let value = |parameter: &Self| match parameter.domain {
            Domain::Free { axis, .. } => candidate.get(axis).copied().unwrap_or(f64::NAN),
            Domain::Fixed(value) => value,
        };
        parameters.iter().map(value).collect()
    }

    /// Returns the candidate that has these values of all parameters: the inverse of [`Self::values`].
    #[must_use]
    pub fn candidate(parameters: &[Self], values: &[f64]) -> Vec<f64> {
        let axis = |(parameter, value): (&Self, &f64)| match parameter.domain {
            Domain::Free { axis, .. } => Some((axis, *value)),
            Domain::Fixed(_) => None,
        };
        let mut free: Vec<(usize, f64)> = parameters.iter().zip(values).filter_map(axis).collect();
        free.sort_by_key(|(axis, _)| *axis);
        free.into_iter().map(|(_, value)| value).collect()
    }
}
