//! The refined estimate of the recordings, to which the results of searches are compared.

use super::parameter::ComparedParameter;
use motorfit_identify::model::ModelIdentification;
use motorfit_identify::{Identification, Trust};

/// Refined estimate of the recordings.
#[derive(Debug, Clone)]
pub enum Reference {
    /// Estimate of the DC motor: Steiglitz–McBride and Levenberg–Marquardt with noise weights.
    Motor(Box<Identification>),
    /// Estimate of a model: a multistart and Levenberg–Marquardt with noise weights.
    Model(Box<ModelIdentification>),
}

impl Reference {
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
