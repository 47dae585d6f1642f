//! The parameters: the five of the linear motor, and those of extensions that real motors need.

use crate::text::excerpt;
use crate::{Error, Result};

/// The row of a parameter.
#[derive(Debug)]
struct Facts {
    symbol: &'static str,
    unit: &'static str,
    name: &'static str,
    /// The lowest value, and whether it must be above it.
    lowest: (f64, bool),
    /// The value that changes nothing; not a number for the five of the motor.
    neutral: f64,
    bounds: UsualBounds,
}

/// The bounds of a parameter where none are given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum UsualBounds {
    /// From one value to another; for the five of the motor those of the paper's Table 2.
    Fixed(f64, f64),
    /// Parts of the largest torque that the recorded input gives.
    OfTorque(f64, f64),
    /// Parts of the largest input.
    OfInput(f64, f64),
    /// From so many periods to so many periods or so many mechanical time constants, whichever is longer.
    Late(f64, f64, f64),
    /// From one sample to a quarter of the recording, 300 at most.
    Samples,
}

const POSITIVE: (f64, bool) = (0.0, true);
const NOT_NEGATIVE: (f64, bool) = (0.0, false);
const AT_LEAST_ONE: (f64, bool) = (1.0, false);
const ANY: (f64, bool) = (f64::NEG_INFINITY, true);

/// Defines the parameters as a table: text, variant, symbol, unit, name, lowest value, neutral value, usual bounds.
macro_rules! parameters {
    (
        motor { $($(#[doc = $motor_text:literal])+ $motor:ident = ($($motor_fact:expr),+);)+ }
        extensions { $($(#[doc = $text:literal])+ $extension:ident = ($($fact:expr),+);)+ }
    ) => {
        /// A parameter of the motor or of what surrounds it.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum Parameter {
            $($(#[doc = $motor_text])+ $motor,)+
            $($(#[doc = $text])+ $extension,)+
        }

        const FACTS: [Facts; Parameter::COUNT] = [$(facts($($motor_fact),+),)+ $(facts($($fact),+),)+];

        impl Parameter {
            /// The number of parameters.
            pub const COUNT: usize = Self::ALL.len() + Self::EXTENSIONS.len();

            /// The five of the linear motor, in the order used everywhere.
            pub const ALL: [Self; 5] = [$(Self::$motor),+];

            /// Those of extensions.
            pub const EXTENSIONS: [Self; [$(stringify!($extension)),+].len()] = [$(Self::$extension),+];

            /// Returns what it is, in a sentence.
            #[must_use]
            pub fn text(self) -> &'static str {
                match self {
                    $(Self::$motor => concat!($($motor_text),+).trim_ascii(),)+
                    $(Self::$extension => concat!($($text),+).trim_ascii(),)+
                }
            }
        }
    };
}

const fn facts(
    [symbol, unit, name]: [&'static str; 3],
    lowest: (f64, bool),
    neutral: f64,
    bounds: UsualBounds,
) -> Facts {
    Facts { symbol, unit, name, lowest, neutral, bounds }
}

use UsualBounds::{Fixed, Late, OfInput, OfTorque, Samples};

parameters! {
    motor {
        /// Resistance of the armature.
        R = (["R", "ohm", "resistance"], POSITIVE, f64::NAN, Fixed(0.1, 1.0));
        /// Inductance of the armature.
        L = (["L", "H", "inductance"], POSITIVE, f64::NAN, Fixed(0.001, 0.1));
        /// Torque and back-EMF constant.
        K = (["K", "V*s/rad", "motor constant"], POSITIVE, f64::NAN, Fixed(0.005, 0.1));
        /// Viscous friction.
        B = (["B", "N*m*s/rad", "viscous friction"], POSITIVE, f64::NAN, Fixed(1e-5, 1e-3));
        /// Moment of inertia.
        J = (["J", "kg*m^2", "inertia"], POSITIVE, f64::NAN, Fixed(1e-5, 1e-3));
    }
    extensions {
        /// Coulomb friction: a torque against the movement, which holds the motor at rest up to the same size.
        Coulomb = (["Tc", "N*m", "Coulomb friction"], NOT_NEGATIVE, 0.0, OfTorque(0.0, 1.0));
        /// Constant load torque.
        Load = (["TL", "N*m", "load torque"], ANY, 0.0, OfTorque(-1.0, 1.0));
        /// Dead time: all of the input acts that much later than it was recorded; below zero it acts before.
        DeadTime = (["td", "s", "dead time"], ANY, 0.0, Late(-1.0, 100.0, 6.0));
        /// Start latency: the first movement of the input alone acts that much later.
        Latency = (["t0", "s", "start latency"], NOT_NEGATIVE, 0.0, Late(0.0, 500.0, 10.0));
        /// Offset of the voltage.
        Offset = (["v0", "V", "voltage offset"], ANY, 0.0, OfInput(-0.5, 0.5));
        /// Voltage drop of the brushes: against the current, which does not flow below it.
        BrushDrop = (["vb", "V", "brush drop"], NOT_NEGATIVE, 0.0, OfInput(0.0, 0.5));
        /// Deadband of the drive: what the magnitude of the input loses.
        Deadband = (["vd", "V", "deadband"], NOT_NEGATIVE, 0.0, OfInput(0.0, 0.95));
        /// Magnitude of the input beyond which the drive gives no more.
        Saturation = (["vs", "V", "saturation"], POSITIVE, f64::INFINITY, OfInput(0.05, 1.0));
        /// Gain of the drive for negative inputs; that for positive ones is 1.
        NegativeGain = (["gn", "1", "negative gain"], POSITIVE, 1.0, Fixed(0.2, 5.0));
        /// Samples that the current sensor averages over.
        CurrentAverage = (["Ni", "samples", "current average"], AT_LEAST_ONE, 1.0, Samples);
        /// Samples that the speed sensor averages over.
        SpeedAverage = (["Nw", "samples", "speed average"], AT_LEAST_ONE, 1.0, Samples);
    }
}

impl Parameter {
    fn facts(self) -> &'static Facts {
        &FACTS[self as usize]
    }

    /// Its symbol, as in results and settings.
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

    /// Returns whether it belongs to an extension, and not to the linear motor.
    #[must_use]
    pub fn is_extension(self) -> bool {
        self as usize >= Self::ALL.len()
    }

    /// The value of an extension's parameter that changes nothing; not a number for the five of the motor.
    #[must_use]
    pub fn neutral(self) -> f64 {
        self.facts().neutral
    }

    /// Returns whether it can have this value: positive for the five of the motor.
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

    /// Returns the domain of its values, in words.
    #[must_use]
    pub fn domain(self) -> &'static str {
        match self.facts().lowest {
            (0.0, true) => "positive",
            (0.0, false) => "zero or positive",
            (1.0, _) => "1 or more",
            _ => "finite",
        }
    }

    /// Returns the channel that shows it, 0 the current and 1 the speed; none where each does.
    #[must_use]
    pub fn channel(self) -> Option<usize> {
        match self {
            Self::CurrentAverage => Some(0),
            Self::SpeedAverage => Some(1),
            _ => None,
        }
    }

    /// Returns its bounds where none are given.
    #[must_use]
    pub fn usual_bounds(self) -> UsualBounds {
        self.facts().bounds
    }

    /// The search bounds of the paper's Table 2, for the five of the motor.
    #[must_use]
    pub fn table2(self) -> Option<(f64, f64)> {
        match self.facts().bounds {
            Fixed(min, max) if !self.is_extension() => Some((min, max)),
            _ => None,
        }
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
