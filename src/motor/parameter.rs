//! The parameters: the five of the linear motor, and those of extensions that real motors need.

use crate::text::excerpt;
use crate::{Error, Result};

/// A parameter of the motor or of what surrounds it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Parameter {
    /// Resistance of the armature.
    R,
    /// Inductance of the armature.
    L,
    /// Torque and back-EMF constant.
    K,
    /// Viscous friction.
    B,
    /// Moment of inertia.
    J,
    /// Coulomb friction: a torque against the movement, which holds the motor at rest up to the same size.
    Coulomb,
    /// Constant load torque.
    Load,
    /// Dead time: all of the input acts that much later.
    DeadTime,
    /// Start latency: the first movement of the input alone acts that much later.
    Latency,
    /// Offset of the voltage.
    Offset,
    /// Voltage drop of the brushes: against the current, which does not flow below it.
    BrushDrop,
    /// Deadband of the drive: what the magnitude of the input loses.
    Deadband,
    /// Magnitude of the input beyond which the drive gives no more.
    Saturation,
    /// Gain of the drive for negative inputs; that for positive ones is 1.
    NegativeGain,
    /// Samples that the current sensor averages over.
    CurrentAverage,
    /// Samples that the speed sensor averages over.
    SpeedAverage,
}

/// What is known of a parameter in general.
struct Facts {
    symbol: &'static str,
    unit: &'static str,
    name: &'static str,
    /// The lowest value, and whether it must be above it.
    lowest: (f64, bool),
    /// The value that changes nothing.
    neutral: f64,
}

const fn facts(
    symbol: &'static str,
    unit: &'static str,
    name: &'static str,
    lowest: (f64, bool),
    neutral: f64,
) -> Facts {
    Facts { symbol, unit, name, lowest, neutral }
}

const POSITIVE: (f64, bool) = (0.0, true);
const NOT_NEGATIVE: (f64, bool) = (0.0, false);
const ANY: (f64, bool) = (f64::NEG_INFINITY, true);

const FACTS: [Facts; Parameter::COUNT] = [
    facts("R", "ohm", "resistance", POSITIVE, f64::NAN),
    facts("L", "H", "inductance", POSITIVE, f64::NAN),
    facts("K", "V*s/rad", "motor constant", POSITIVE, f64::NAN),
    facts("B", "N*m*s/rad", "viscous friction", POSITIVE, f64::NAN),
    facts("J", "kg*m^2", "inertia", POSITIVE, f64::NAN),
    facts("Tc", "N*m", "Coulomb friction", NOT_NEGATIVE, 0.0),
    facts("TL", "N*m", "load torque", ANY, 0.0),
    facts("td", "s", "dead time", NOT_NEGATIVE, 0.0),
    facts("t0", "s", "start latency", NOT_NEGATIVE, 0.0),
    facts("v0", "V", "voltage offset", ANY, 0.0),
    facts("vb", "V", "brush drop", NOT_NEGATIVE, 0.0),
    facts("vd", "V", "deadband", NOT_NEGATIVE, 0.0),
    facts("vs", "V", "saturation", POSITIVE, f64::INFINITY),
    facts("gn", "1", "negative gain", POSITIVE, 1.0),
    facts("Ni", "samples", "current average", (1.0, false), 1.0),
    facts("Nw", "samples", "speed average", (1.0, false), 1.0),
];

impl Parameter {
    /// How many there are.
    pub const COUNT: usize = 16;

    /// The five of the linear motor, in the order used everywhere.
    pub const ALL: [Self; 5] = [Self::R, Self::L, Self::K, Self::B, Self::J];

    /// Those of extensions.
    pub const EXTENSIONS: [Self; Self::COUNT - 5] = [
        Self::Coulomb,
        Self::Load,
        Self::DeadTime,
        Self::Latency,
        Self::Offset,
        Self::BrushDrop,
        Self::Deadband,
        Self::Saturation,
        Self::NegativeGain,
        Self::CurrentAverage,
        Self::SpeedAverage,
    ];

    fn facts(self) -> &'static Facts {
        &FACTS[self as usize]
    }

    /// Its symbol, as in results and flags.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        self.facts().symbol
    }

    /// Its SI unit, as in results.
    #[must_use]
    pub fn unit(self) -> &'static str {
        self.facts().unit
    }

    /// Its name in words.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.facts().name
    }

    /// Whether it belongs to an extension, and not to the linear motor.
    #[must_use]
    pub fn is_extension(self) -> bool {
        self as usize >= Self::ALL.len()
    }

    /// The value of an extension's parameter that changes nothing; not a number for the five of the motor.
    #[must_use]
    pub fn neutral(self) -> f64 {
        self.facts().neutral
    }

    /// Whether it can have this value: positive for the five of the motor.
    #[must_use]
    pub fn admits(self, value: f64) -> bool {
        let (lowest, above) = self.facts().lowest;
        value.is_finite() && if above { value > lowest } else { value >= lowest }
    }

    /// The lowest value that there is, or what all are above.
    #[must_use]
    pub fn lowest(self) -> f64 {
        self.facts().lowest.0
    }

    /// What it can be, in words.
    #[must_use]
    pub fn domain(self) -> &'static str {
        match self.facts().lowest {
            (0.0, true) => "positive",
            (0.0, false) => "zero or positive",
            (1.0, _) => "1 or more",
            _ => "finite",
        }
    }

    /// The search bounds of the paper's Table 2, for the five of the motor.
    #[must_use]
    pub fn table2(self) -> Option<(f64, f64)> {
        [(0.1, 1.0), (0.001, 0.1), (0.005, 0.1), (1e-5, 1e-3), (1e-5, 1e-3)].get(self as usize).copied()
    }
}

impl std::str::FromStr for Parameter {
    type Err = Error;

    fn from_str(symbol: &str) -> Result<Self> {
        let found = Self::ALL.into_iter().chain(Self::EXTENSIONS).find(|p| p.symbol() == symbol);
        found.ok_or_else(|| {
            let extensions = Self::EXTENSIONS.map(Self::symbol).join(", ");
            Error::usage(
                format!("\"{}\" is not a parameter of the motor", excerpt(symbol)),
                format!("Name R, L, K, B or J; or of an extension {extensions}."),
            )
        })
    }
}

/// Values of the parameters of extensions, SI units; those that change nothing where an extension is off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extensions([f64; Parameter::EXTENSIONS.len()]);

impl Extensions {
    /// None of them acts.
    pub const NONE: Self = {
        let mut values = [0.0; Parameter::EXTENSIONS.len()];
        let mut n = 0;
        while n < values.len() {
            values[n] = FACTS[Parameter::ALL.len() + n].neutral;
            n += 1;
        }
        Self(values)
    };

    /// The same with another value for one parameter; the five of the motor are left alone.
    #[must_use]
    pub fn with(mut self, parameter: Parameter, value: f64) -> Self {
        self.set(parameter, value);
        self
    }

    /// Changes the value of one parameter; those of the motor are ignored.
    pub(super) fn set(&mut self, parameter: Parameter, value: f64) {
        if let Some(own) = (parameter as usize).checked_sub(Parameter::ALL.len()) {
            self.0[own] = value;
        }
    }

    /// The value of one parameter; not a number for the five of the motor.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> f64 {
        (parameter as usize).checked_sub(Parameter::ALL.len()).map_or(f64::NAN, |own| self.0[own])
    }

    /// In the order of [`Parameter::EXTENSIONS`].
    #[must_use]
    pub fn to_array(self) -> [f64; Parameter::EXTENSIONS.len()] {
        self.0
    }
}

impl Default for Extensions {
    fn default() -> Self {
        Self::NONE
    }
}
