//! Extensions of the linear motor: what real motors, drives and sensors add to it.

use super::parameter::Parameter;
use crate::setting::text;
use crate::text::nearest;
use crate::{Error, Result};

/// Something that real motors, drives and sensors add to the linear motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Extension {
    /// Coulomb friction, which sticks.
    Coulomb,
    /// A constant load torque.
    Load,
    /// A dead time of the input.
    DeadTime,
    /// A first movement that comes late, in each recording by its own time.
    Latency,
    /// An offset of the voltage.
    Offset,
    /// The voltage drop of the brushes.
    BrushDrop,
    /// A deadband of the drive.
    Deadband,
    /// A drive that gives no more beyond some input.
    Saturation,
    /// A drive with another gain for negative inputs.
    DirectionGain,
    /// Sensors that average over samples.
    SensorAverage,
}

impl Extension {
    /// All there are.
    pub const ALL: [Self; 10] = [
        Self::Coulomb,
        Self::Load,
        Self::DeadTime,
        Self::Latency,
        Self::Offset,
        Self::BrushDrop,
        Self::Deadband,
        Self::Saturation,
        Self::DirectionGain,
        Self::SensorAverage,
    ];

    /// What delays, and imitates each other.
    pub const LATE: [Self; 3] = [Self::DeadTime, Self::Latency, Self::SensorAverage];

    /// Its name in settings and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Coulomb => "coulomb",
            Self::Load => "load",
            Self::DeadTime => "dead-time",
            Self::Latency => "latency",
            Self::Offset => "offset",
            Self::BrushDrop => "brush-drop",
            Self::Deadband => "deadband",
            Self::Saturation => "saturation",
            Self::DirectionGain => "direction-gain",
            Self::SensorAverage => "sensor-average",
        }
    }

    /// Its parameters.
    #[must_use]
    pub fn parameters(self) -> &'static [Parameter] {
        match self {
            Self::Coulomb => &[Parameter::Coulomb],
            Self::Load => &[Parameter::Load],
            Self::DeadTime => &[Parameter::DeadTime],
            Self::Latency => &[Parameter::Latency],
            Self::Offset => &[Parameter::Offset],
            Self::BrushDrop => &[Parameter::BrushDrop],
            Self::Deadband => &[Parameter::Deadband],
            Self::Saturation => &[Parameter::Saturation],
            Self::DirectionGain => &[Parameter::ReverseGain],
            Self::SensorAverage => &[Parameter::CurrentAverage, Parameter::SpeedAverage],
        }
    }
}

impl std::str::FromStr for Extension {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|e| e.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name);
            let near = nearest(name, &names).map_or(String::new(), |near| format!("; did you mean {near}?"));
            Error::usage(
                text!([With](": \"{}\" is no extension{near}", crate::text::excerpt(name))),
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

impl With {
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
