//! The search space of a model: free parameters with bounds, fixed values, parameters of single recordings.

use motorfit_core::coordinate::Coordinate;
use motorfit_core::text::{excerpt, nearest, quoted};
use motorfit_core::{Error, Result};
use motorfit_model::Model;

/// A free parameter, of all recordings or of one.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelAxis {
    /// Number of the parameter in the model.
    pub parameter: usize,
    /// Number of the recording; `None` for all.
    pub recording: Option<usize>,
    /// Lower bound, in the unit of the parameter.
    pub min: f64,
    /// Upper bound, in the unit of the parameter.
    pub max: f64,
    /// True if the search and the refinement move its logarithm.
    pub is_logarithmic: bool,
}

impl ModelAxis {
    /// Returns the bounds with the coordinate of the parameter.
    #[must_use]
    pub fn range(&self) -> Coordinate {
        let &Self { min, max, is_logarithmic, .. } = self;
        Coordinate { min, max, is_logarithmic, lowest: f64::NEG_INFINITY, neutral: None }
    }

    /// Returns the value at a fraction of the range of the coordinate.
    #[must_use]
    pub fn at(&self, fraction: f64) -> f64 {
        self.range().at(fraction)
    }
}

/// The search space of a model on some recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSpace {
    /// The free parameters; those of single recordings come after those of all.
    pub free: Vec<ModelAxis>,
    /// Value of each fixed parameter of the model.
    pub fixed: Vec<Option<f64>>,
}

impl ModelSpace {
    /// Makes the space with the bounds of a model, for a number of recordings.
    #[must_use]
    pub fn new(model: &Model, recordings: usize) -> Self {
        let axis = |parameter: usize, recording: Option<usize>| {
            let of = &model.parameters()[parameter];
            ModelAxis { parameter, recording, min: of.min, max: of.max, is_logarithmic: of.is_logarithmic }
        };
        let is_own = |n: &usize| recordings > 1 && model.parameters()[*n].is_per_recording;
        let all = 0..model.parameters().len();
        let shared = all.clone().filter(|n| !is_own(n)).map(|n| axis(n, None));
        let own = all.filter(is_own).flat_map(|n| (0..recordings).map(move |of| axis(n, Some(of))));
        Self { free: shared.chain(own).collect(), fixed: vec![None; model.parameters().len()] }
    }

    /// Makes a space without free parameters, with a value for each parameter of the model.
    #[must_use]
    pub fn all_fixed(values: &[f64]) -> Self {
        Self { free: Vec::new(), fixed: values.iter().copied().map(Some).collect() }
    }

    /// Returns the space with a parameter of its own for each recording.
    ///
    /// # Errors
    /// Returns `Usage` if the model has no such parameter.
    pub fn per_recording(mut self, model: &Model, names: &[String], recordings: usize) -> Result<Self> {
        for name in names {
            let parameter = number(model, name)?;
            let Some(at) = self.free.iter().position(|axis| axis.parameter == parameter && axis.recording.is_none())
            else {
                continue;
            };
            if recordings > 1 {
                let axis = self.free.remove(at);
                self.free.extend((0..recordings).map(|of| ModelAxis { recording: Some(of), ..axis.clone() }));
            }
        }
        Ok(self)
    }

    /// Returns the space with other bounds of a parameter.
    ///
    /// # Errors
    /// Returns `Usage` if the model has no such parameter or the bounds do not suit it.
    pub fn with_bounds(mut self, model: &Model, name: &str, [min, max]: [f64; 2]) -> Result<Self> {
        let parameter = number(model, name)?;
        let is_logarithmic = model.parameters()[parameter].is_logarithmic;
        if !(min < max && min.is_finite() && max.is_finite()) || (is_logarithmic && min <= 0.0) {
            let hint = if is_logarithmic {
                "Give two positive bounds, the lower first."
            } else {
                "Give the lower bound first."
            };
            return Err(Error::usage(format!("the bounds {min}:{max} of {name}"), hint));
        }
        for axis in self.free.iter_mut().filter(|axis| axis.parameter == parameter) {
            (axis.min, axis.max) = (min, max);
        }
        Ok(self)
    }

    /// Returns the space with a parameter held at a value.
    ///
    /// # Errors
    /// Returns `Usage` if the model has no such parameter or the value is not finite.
    pub fn with_fixed(mut self, model: &Model, name: &str, value: f64) -> Result<Self> {
        let parameter = number(model, name)?;
        if !value.is_finite() {
            return Err(Error::usage(format!("the value {value} of {name}"), "Give a finite number."));
        }
        self.fixed[parameter] = Some(value);
        self.free.retain(|axis| axis.parameter != parameter);
        Ok(self)
    }

    /// Returns the starts with given values of parameters, within their bounds; one without values is none. Other parameters have their
    /// usual value, or the middle of their bounds.
    #[doc(hidden)]
    pub fn starts(&self, model: &Model, given: &[Vec<(String, f64)>]) -> Result<Vec<Vec<f64>>> {
        let starts = given.iter().filter(|given| !given.is_empty()).map(|given| self.start(model, given));
        let starts = starts.collect::<Result<Vec<_>>>()?;
        Ok(if self.free.is_empty() { Vec::new() } else { starts })
    }

    /// Returns a start with the given values of parameters.
    fn start(&self, model: &Model, given: &[(String, f64)]) -> Result<Vec<f64>> {
        let numbers = given.iter().map(|(name, _)| number(model, name)).collect::<Result<Vec<usize>>>()?;
        let value = |axis: &ModelAxis| {
            let own = numbers.iter().position(|number| *number == axis.parameter).map(|place| given[place].1);
            let own = own.or(model.parameters()[axis.parameter].value).filter(|value| value.is_finite());
            own.map_or_else(|| axis.at(0.5), |value| value.clamp(axis.min, axis.max))
        };
        Ok(self.free.iter().map(value).collect())
    }

    /// Returns the names of the free parameters, as `R`, or `R[0]` for that of the first recording.
    #[must_use]
    pub fn names(&self, model: &Model) -> Vec<String> {
        let name = |axis: &ModelAxis| {
            let own = model.parameters().get(axis.parameter).map_or("", |parameter| parameter.name.as_str());
            axis.recording.map_or_else(|| own.to_owned(), |of| format!("{own}[{of}]"))
        };
        self.free.iter().map(name).collect()
    }

    /// Returns the values of all parameters of the model for a recording.
    #[must_use]
    pub fn values(&self, free: &[f64], recording: usize) -> Vec<f64> {
        let mut values: Vec<f64> = self.fixed.iter().map(|value| value.unwrap_or(f64::NAN)).collect();
        for (axis, value) in self.free.iter().zip(free) {
            if axis.recording.is_none_or(|of| of == recording)
                && let Some(own) = values.get_mut(axis.parameter)
            {
                *own = *value;
            }
        }
        values
    }
}

/// Returns the number of a parameter with a name.
fn number(model: &Model, name: &str) -> Result<usize> {
    let names: Vec<&str> = model.parameters().iter().map(|parameter| parameter.name.as_str()).collect();
    names.iter().position(|own| *own == name).ok_or_else(|| {
        let same = names.iter().find(|own| own.eq_ignore_ascii_case(name)).copied();
        let hint = match same.or_else(|| nearest(name, &names)) {
            Some(near) => format!("Did you mean {near}?"),
            None => format!("The parameters are {}.", names.join(", ")),
        };
        Error::usage(format!("{} is not a parameter of the model {}", quoted(name), excerpt(model.name())), hint)
    })
}
