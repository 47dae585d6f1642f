//! The extensions of a model as a set of flags.

use super::extended::Extended;
use super::extension::Extension;
use super::parameter::Parameter;
use super::space::Space;

/// The set of the extension parameters of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ModelFeatures(u64);

// The set has one bit for each parameter.
const _: () = assert!(Parameter::COUNT <= u64::BITS as usize);

impl ModelFeatures {
    /// Returns the set with one more extension parameter; the five parameters of the motor leave it unchanged.
    #[must_use]
    pub fn with(self, parameter: Parameter) -> Self {
        if parameter.is_extension() { Self(self.0 | 1 << parameter as u64) } else { self }
    }

    /// Returns true if the model has this extension parameter.
    #[inline]
    #[must_use]
    pub fn has(self, parameter: Parameter) -> bool {
        self.0 & 1 << parameter as u64 != 0
    }

    /// Returns true if the model has any of these extension parameters.
    #[inline]
    #[must_use]
    pub fn has_any(self, parameters: &[Parameter]) -> bool {
        parameters.iter().any(|p| self.has(*p))
    }

    /// Returns the extensions of the model.
    #[must_use]
    pub fn extensions(self) -> Vec<Extension> {
        Extension::ALL.into_iter().filter(|extension| self.has_any(extension.parameters())).collect()
    }

    /// Returns true if the model is the linear motor.
    #[inline]
    #[must_use]
    pub fn is_linear(self) -> bool {
        self.0 == 0
    }

    /// Returns true if the input is delayed.
    #[inline]
    #[must_use]
    pub fn is_delayed(self) -> bool {
        self.has_any(&[Parameter::DeadTime, Parameter::Latency])
    }

    /// Returns true if the model is driven even while its input is zero.
    #[inline]
    #[must_use]
    pub fn is_biased(self) -> bool {
        self.has_any(&[Parameter::Load, Parameter::Offset])
    }

    /// Returns true if a sensor averages.
    #[inline]
    #[must_use]
    pub fn is_averaged(self) -> bool {
        self.has_any(&[Parameter::CurrentAverage, Parameter::SpeedAverage])
    }
}

impl FromIterator<Parameter> for ModelFeatures {
    fn from_iter<I: IntoIterator<Item = Parameter>>(parameters: I) -> Self {
        parameters.into_iter().fold(Self::default(), Self::with)
    }
}

impl Extended {
    /// Returns the extension parameters whose values are not neutral.
    #[must_use]
    pub fn features(&self) -> ModelFeatures {
        let acts = |p: &Parameter| self.get(*p).to_bits() != p.neutral().to_bits();
        Parameter::EXTENSIONS.into_iter().filter(acts).collect()
    }
}

impl Space {
    /// Returns the extension parameters of the model, free or fixed.
    #[must_use]
    pub fn features(&self) -> ModelFeatures {
        let fixed = self.fixed().iter().map(|(parameter, _, _)| *parameter);
        fixed.chain(self.free().iter().map(|axis| axis.parameter)).collect()
    }
}
