//! The table of extensions: effects of real motors, drives and sensors beyond the linear motor.

use super::parameter::Parameter;
use motorfit_core::named::named;
use motorfit_core::setting::text;
use motorfit_core::text::{excerpt, nearest};
use motorfit_core::{Error, Result};

/// Part of the system on which an extension acts.
#[derive(PartialEq)]
enum Kind {
    /// Torque on the shaft.
    Mechanical,
    /// Delay, or an effect that is hard to distinguish from one.
    Late,
    /// Voltage of the drive or the brushes.
    Electrical,
}

/// Signals that recordings must contain for an extension to be selected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// An output only.
    Nothing,
    /// A measured current.
    Current,
    /// Inputs of both signs.
    BothSigns,
}

use Kind::{Electrical, Late, Mechanical};
use Needs::{BothSigns, Current, Nothing};

named! {
    /// An effect of real motors, drives and sensors beyond the linear motor.
    #[derive(Hash, serde::Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Extension: (&'static [Parameter], Kind, Needs) {
        /// Coulomb friction with stick.
        Coulomb = "coulomb" => (&[Parameter::Coulomb], Mechanical, Nothing),
        /// A constant load torque.
        Load = "load" => (&[Parameter::Load], Mechanical, Nothing),
        /// A dead time of the input.
        DeadTime = "dead-time" => (&[Parameter::DeadTime], Late, Nothing),
        /// A start latency: a delay of the first movement of the input, estimated for each recording.
        Latency = "latency" => (&[Parameter::Latency], Late, Nothing),
        /// An offset of the voltage.
        Offset = "offset" => (&[Parameter::Offset], Electrical, Nothing),
        /// The voltage drop of the brushes; without a measured current it cannot be distinguished from a deadband or
        /// friction.
        BrushDrop = "brush-drop" => (&[Parameter::BrushDrop], Electrical, Current),
        /// A deadband of the drive.
        Deadband = "deadband" => (&[Parameter::Deadband], Electrical, Nothing),
        /// A saturation of the drive.
        Saturation = "saturation" => (&[Parameter::Saturation], Electrical, Nothing),
        /// A drive with a different gain for negative inputs.
        DirectionGain = "direction-gain" => (&[Parameter::NegativeGain], Electrical, BothSigns),
        /// Sensors that output a moving average of samples.
        SensorAverage = "sensor-average" =>
            (&[Parameter::CurrentAverage, Parameter::SpeedAverage], Late, Nothing),
    }
}

impl Extension {
    /// Returns the parameters of the extension.
    #[must_use]
    pub fn parameters(self) -> &'static [Parameter] {
        self.row().0
    }

    /// Returns the extension of a parameter; `None` for the five parameters of the motor.
    #[must_use]
    pub fn of(parameter: Parameter) -> Option<Self> {
        Self::ALL.into_iter().find(|extension| extension.parameters().contains(&parameter))
    }

    /// Returns true if the extension acts like a delay.
    #[must_use]
    pub fn is_delay_like(self) -> bool {
        self.row().1 == Late
    }

    /// Returns true if two extensions may be indistinguishable in recordings: delays of all kinds, and losses by friction,
    /// load, brushes or drive.
    #[must_use]
    pub fn resembles(self, other: Self) -> bool {
        const LOSSES: [Extension; 5] =
            [Extension::Coulomb, Extension::Load, Extension::Offset, Extension::BrushDrop, Extension::Deadband];
        self != other
            && ((self.is_delay_like() && other.is_delay_like()) || (LOSSES.contains(&self) && LOSSES.contains(&other)))
    }

    /// Returns true if the extension has an effect on a motor whose input is the current.
    #[must_use]
    pub fn acts_on_current(self) -> bool {
        self.row().1 != Electrical
    }

    /// Returns the signals that recordings must contain for the extension to be selected.
    #[must_use]
    pub fn needs(self) -> Needs {
        self.row().2
    }
}

impl std::str::FromStr for Extension {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|e| e.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name);
            let near = nearest(name, &names).map_or(String::new(), |near| format!("; did you mean {near}?"));
            Error::usage(
                text!([With](": \"{}\" is not an extension{near}", excerpt(name))),
                format!("Name {}, or auto.", names.join(", ")),
            )
        })
    }
}

/// Choice of the extensions of a motor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum With {
    /// The listed extensions; an empty list is the linear motor.
    These(Vec<Extension>),
    /// Extensions chosen by model selection.
    Auto,
}

impl Default for With {
    fn default() -> Self {
        Self::These(Vec::new())
    }
}

impl std::fmt::Display for With {
    /// Writes `none`, `auto`, or the names separated by commas.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::These(list) if list.is_empty() => f.write_str("none"),
            Self::These(list) => f.write_str(&list.iter().map(|e| e.name()).collect::<Vec<_>>().join(",")),
        }
    }
}

impl std::str::FromStr for With {
    type Err = Error;

    /// Parses the format of [`Display`](std::fmt::Display).
    fn from_str(text: &str) -> Result<Self> {
        match text.trim() {
            "none" => Ok(Self::default()),
            names => Self::parse(&names.split(',').map(str::to_owned).collect::<Vec<_>>()),
        }
    }
}

impl With {
    /// Returns true if a model with these extensions may have a parameter; every model has those of the linear motor.
    #[must_use]
    pub fn may_have(&self, parameter: Parameter) -> bool {
        match self {
            Self::Auto => true,
            Self::These(list) => !parameter.is_extension() || list.iter().any(|e| e.parameters().contains(&parameter)),
        }
    }

    /// Parses names of extensions, or `auto` alone.
    ///
    /// # Errors
    /// Returns `Usage` if a name is unknown, or others are given besides `auto`.
    pub fn parse(items: &[String]) -> Result<Self> {
        let names: Vec<&str> = items.iter().map(|item| item.trim()).filter(|item| !item.is_empty()).collect();
        if names.contains(&"auto") {
            return match names.len() {
                1 => Ok(Self::Auto),
                _ => Err(Error::usage(
                    text!([With = "auto"] " selects among all extensions, but other names are given too"),
                    "Give auto alone, or only names of extensions.",
                )),
            };
        }
        let mut list: Vec<Extension> = Vec::new();
        for name in names {
            let extension = name.parse()?;
            if !list.contains(&extension) {
                list.push(extension);
            }
        }
        Ok(Self::These(list))
    }
}
