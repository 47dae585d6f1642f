//! The table of extensions: what real motors, drives and sensors add to the linear motor.

use super::parameter::Parameter;
use crate::named::named;
use crate::setting::text;
use crate::text::{excerpt, nearest};
use crate::{Error, Result};

/// The place where an extension acts.
#[derive(PartialEq)]
enum Kind {
    /// On the shaft.
    Mechanical,
    /// As a delay; delays are hard to tell apart.
    Late,
    /// On the voltage.
    Electrical,
}

/// Signals that recordings need for an extension to be selected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// Nothing more than an output.
    Nothing,
    /// A measured current.
    Current,
    /// Inputs of both signs.
    BothSigns,
}

use Kind::{Electrical, Late, Mechanical};
use Needs::{BothSigns, Current, Nothing};

named! {
    /// Something that real motors, drives and sensors add to the linear motor.
    #[derive(Hash, serde::Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Extension: (&'static [Parameter], Kind, Needs) {
        /// Coulomb friction, which sticks.
        Coulomb = "coulomb" => (&[Parameter::Coulomb], Mechanical, Nothing),
        /// A constant load torque.
        Load = "load" => (&[Parameter::Load], Mechanical, Nothing),
        /// A dead time of the input.
        DeadTime = "dead-time" => (&[Parameter::DeadTime], Late, Nothing),
        /// A first movement that comes late, in each recording by its own time.
        Latency = "latency" => (&[Parameter::Latency], Late, Nothing),
        /// An offset of the voltage.
        Offset = "offset" => (&[Parameter::Offset], Electrical, Nothing),
        /// The voltage drop of the brushes; without a current it is that of a deadband or of friction.
        BrushDrop = "brush-drop" => (&[Parameter::BrushDrop], Electrical, Current),
        /// A deadband of the drive.
        Deadband = "deadband" => (&[Parameter::Deadband], Electrical, Nothing),
        /// A drive that gives no more beyond some input.
        Saturation = "saturation" => (&[Parameter::Saturation], Electrical, Nothing),
        /// A drive with another gain for negative inputs.
        DirectionGain = "direction-gain" => (&[Parameter::NegativeGain], Electrical, BothSigns),
        /// Sensors that average over samples.
        SensorAverage = "sensor-average" =>
            (&[Parameter::CurrentAverage, Parameter::SpeedAverage], Late, Nothing),
    }
}

impl Extension {
    /// Returns its parameters.
    #[must_use]
    pub fn parameters(self) -> &'static [Parameter] {
        self.row().0
    }

    /// Returns the extension that a parameter belongs to; none for the five of the motor.
    #[must_use]
    pub fn of(parameter: Parameter) -> Option<Self> {
        Self::ALL.into_iter().find(|extension| extension.parameters().contains(&parameter))
    }

    /// Returns whether it acts as a delay, which others are hard to tell from.
    #[must_use]
    pub fn is_late(self) -> bool {
        self.row().1 == Late
    }

    /// Returns whether recordings may not tell it apart from another: delays of all kinds, and what a motor loses to friction,
    /// load, brushes or drive.
    #[must_use]
    pub fn resembles(self, other: Self) -> bool {
        const LOSSES: [Extension; 5] =
            [Extension::Coulomb, Extension::Load, Extension::Offset, Extension::BrushDrop, Extension::Deadband];
        self != other && ((self.is_late() && other.is_late()) || (LOSSES.contains(&self) && LOSSES.contains(&other)))
    }

    /// Returns whether it acts where the current is the input, and not a voltage.
    #[must_use]
    pub fn acts_on_current(self) -> bool {
        self.row().1 != Electrical
    }

    /// Returns what recordings must hold so that it may be chosen for them.
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
                text!([With](": \"{}\" is no extension{near}", excerpt(name))),
                format!("Name {}, or auto.", names.join(", ")),
            )
        })
    }
}

/// Which extensions a motor has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum With {
    /// These; none for the linear motor.
    These(Vec<Extension>),
    /// Those that the recordings speak for.
    Auto,
}

impl Default for With {
    fn default() -> Self {
        Self::These(Vec::new())
    }
}

impl std::fmt::Display for With {
    /// `none`, `auto`, or the names with commas between them.
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

    /// Reads what [`Display`](std::fmt::Display) writes.
    fn from_str(text: &str) -> Result<Self> {
        match text.trim() {
            "none" => Ok(Self::default()),
            names => Self::parse(&names.split(',').map(str::to_owned).collect::<Vec<_>>()),
        }
    }
}

impl With {
    /// Returns whether a model with these extensions may have a parameter: each has those of the linear motor.
    #[must_use]
    pub fn may_have(&self, parameter: Parameter) -> bool {
        match self {
            Self::Auto => true,
            Self::These(list) => !parameter.is_extension() || list.iter().any(|e| e.parameters().contains(&parameter)),
        }
    }

    /// `coulomb,dead-time,…` or `auto`.
    ///
    /// # Errors
    /// `Usage` for anything else.
    pub fn parse(items: &[String]) -> Result<Self> {
        let names: Vec<&str> = items.iter().map(|item| item.trim()).filter(|item| !item.is_empty()).collect();
        if names.contains(&"auto") {
            return match names.len() {
                1 => Ok(Self::Auto),
                _ => Err(Error::usage(
                    text!([With = "auto"] " chooses among all extensions, yet others are named beside it"),
                    "Give auto alone, or name the extensions.",
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
