//! The refined estimate of the recordings, to which the results of searches are compared.

use super::parameter::ComparedParameter;
use super::spec::CompareSpec;
use super::subject::{ComparedMachine, ComparisonSubject};
use motorfit_core::setting::Text;
use motorfit_identify::device::{DeviceSpec, PrecisionSpec};
use motorfit_identify::model::{ModelIdentification, ModelSpec, identify_model};
use motorfit_identify::{Identification, IdentifySpec, Method, Trust, identify};
use motorfit_optimize::Stop;
use std::ops::ControlFlow;

/// Refined estimate of the recordings.
#[derive(Debug, Clone)]
pub enum Reference {
    /// Estimate of the DC motor: Steiglitz–McBride and Levenberg–Marquardt with noise weights.
    Motor(Box<Identification>),
    /// Estimate of a model: a multistart and Levenberg–Marquardt with noise weights.
    Model(Box<ModelIdentification>),
}

impl Reference {
    /// Returns the refined estimate, or the reason why there is none. `look` may end the search of a model.
    pub(super) fn of(
        subject: &ComparisonSubject,
        spec: &CompareSpec,
        look: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> std::result::Result<Self, Text> {
        let device = DeviceSpec::Cpu;
        match &subject.machine {
            ComparedMachine::Motor { .. } => {
                let (model, space, auto_bounds) = (spec.model, spec.space.clone(), Vec::new());
                let auto = IdentifySpec { model, space, auto_bounds, device, ..IdentifySpec::default() };
                let found = identify(&subject.records, &auto).map_err(|error| error.text())?;
                Ok(Self::Motor(Box::new(found)))
            }
            ComparedMachine::Model(of) => {
                let (method, precision) = (Method::Auto, PrecisionSpec::Auto);
                let spec = ModelSpec { method, is_polished: true, device, precision, ..of.spec.clone() };
                let found = identify_model(&of.model, &of.recordings, &spec, &mut |_| look());
                match found.map_err(|error| error.text())? {
                    found if found.stop == Stop::Interrupted => Err("interrupted before its end".into()),
                    found => Ok(Self::Model(Box::new(found))),
                }
            }
        }
    }

    /// Returns the values of the parameters of the comparison.
    #[must_use]
    pub fn values(&self, parameters: &[ComparedParameter]) -> Vec<f64> {
        match self {
            Self::Motor(found) => found.parameters.to_array().to_vec(),
            Self::Model(found) => ComparedParameter::values(parameters, &found.values),
        }
    }

    /// Returns the level of trust in the estimate.
    #[must_use]
    pub fn trust(&self) -> &Trust {
        match self {
            Self::Motor(found) => &found.trust,
            Self::Model(found) => &found.trust,
        }
    }

    /// Returns true if the recordings do not identify the parameter with a name.
    #[must_use]
    pub fn is_unidentified(&self, name: &str) -> bool {
        match self {
            Self::Motor(found) => found.estimates.iter().any(|e| e.label() == name && e.value.is_none()),
            Self::Model(found) => found.estimates.iter().any(|e| e.label() == name && e.value.is_none()),
        }
    }

    /// Returns the estimate of the DC motor; `None` for a model.
    #[must_use]
    pub fn motor(&self) -> Option<&Identification> {
        if let Self::Motor(found) = self { Some(found) } else { None }
    }

    /// Returns the estimate of the model; `None` for the DC motor.
    #[must_use]
    pub fn model(&self) -> Option<&ModelIdentification> {
        if let Self::Model(found) = self { Some(found) } else { None }
    }
}
