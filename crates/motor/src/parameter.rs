//! The table of parameters: the five of the linear motor, and those of its extensions.

use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};

/// Row of the table of parameters.
#[derive(Debug)]
struct Facts {
    symbol: &'static str,
    unit: &'static str,
    name: &'static str,
    /// Lower limit of the domain, and true if the limit itself is excluded.
    lowest: (f64, bool),
    /// Value without effect; NaN for the five parameters of the motor.
    neutral: f64,
    bounds: DefaultBounds,
}

/// Default search bounds of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DefaultBounds {
    /// Fixed bounds; for the five parameters of the motor those of the paper's Table 2.
    Fixed(f64, f64),
    /// Multiples of the largest torque that the recorded input produces at stall.
    OfTorque(f64, f64),
    /// Multiples of the largest magnitude of the input.
    OfInput(f64, f64),
    /// Lower and upper bound in sampling periods; the third value is another upper bound, in mechanical time constants. The
    /// larger upper bound is used, but at most a quarter of the longest recording.
    Late(f64, f64, f64),
    /// Bounds from one sample to a quarter of the recording, at most 300 samples.
    Samples,
}

const POSITIVE: (f64, bool) = (0.0, true);
const NOT_NEGATIVE: (f64, bool) = (0.0, false);
const AT_LEAST_ONE: (f64, bool) = (1.0, false);
const ANY: (f64, bool) = (f64::NEG_INFINITY, true);

/// Defines the table of parameters: description, variant, symbol, unit, name, lowest value, neutral value, default bounds.
macro_rules! parameters {
    (
        motor { $($(#[doc = $motor_text:literal])+ $motor:ident = ($($motor_fact:expr),+);)+ }
        extensions { $($(#[doc = $text:literal])+ $extension:ident = ($($fact:expr),+);)+ }
    ) => {
        /// A parameter of the motor or of one of its extensions.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum Parameter {
            $($(#[doc = $motor_text])+ $motor,)+
            $($(#[doc = $text])+ $extension,)+
        }

        const FACTS: [Facts; Parameter::COUNT] = [$(facts($($motor_fact),+),)+ $(facts($($fact),+),)+];

        impl Parameter {
            /// Number of parameters.
            pub const COUNT: usize = Self::ALL.len() + Self::EXTENSIONS.len();

            /// The five parameters of the linear motor, in the order R, L, K, B, J.
            pub const ALL: [Self; 5] = [$(Self::$motor),+];

            /// The parameters of extensions.
            pub const EXTENSIONS: [Self; [$(stringify!($extension)),+].len()] = [$(Self::$extension),+];

            /// Returns the description of the parameter, a sentence.
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
    bounds: DefaultBounds,
) -> Facts {
    Facts { symbol, unit, name, lowest, neutral, bounds }
}

use DefaultBounds::{Fixed, Late, OfInput, OfTorque, Samples};

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
        /// Coulomb friction: a torque against the motion; at rest the motor sticks up to the same torque.
        Coulomb = (["Tc", "N*m", "Coulomb friction"], NOT_NEGATIVE, 0.0, OfTorque(0.0, 1.0));
        /// Constant load torque.
        Load = (["TL", "N*m", "load torque"], ANY, 0.0, OfTorque(-1.0, 1.0));
        /// Dead time: the delay from the recorded input to its effect; negative if the input was recorded late.
        DeadTime = (["td", "s", "dead time"], ANY, 0.0, Late(-1.0, 100.0, 6.0));
        /// Start latency: an additional delay of the first movement of the input alone.
        Latency = (["t0", "s", "start latency"], NOT_NEGATIVE, 0.0, Late(0.0, 500.0, 10.0));
        /// Offset of the voltage.
        Offset = (["v0", "V", "voltage offset"], ANY, 0.0, OfInput(-0.5, 0.5));
        /// Voltage drop of the brushes: a voltage against the current; no current flows below it.
        BrushDrop = (["vb", "V", "brush drop"], NOT_NEGATIVE, 0.0, OfInput(0.0, 0.5));
        /// Deadband of the drive: the amount subtracted from the magnitude of the input.
        Deadband = (["vd", "V", "deadband"], NOT_NEGATIVE, 0.0, OfInput(0.0, 0.95));
        /// Saturation limit of the drive: the magnitude of the input above which its output is constant.
        Saturation = (["vs", "V", "saturation"], POSITIVE, f64::INFINITY, OfInput(0.05, 1.0));
        /// Gain of the drive for negative inputs; the gain for positive inputs is 1.
        NegativeGain = (["gn", "1", "negative gain"], POSITIVE, 1.0, Fixed(0.2, 5.0));
        /// Window of the moving average of the current sensor.
        CurrentAverage = (["Ni", "samples", "current average"], AT_LEAST_ONE, 1.0, Samples);
        /// Window of the moving average of the speed sensor.
        SpeedAverage = (["Nw", "samples", "speed average"], AT_LEAST_ONE, 1.0, Samples);
    }
}

impl Parameter {
    fn facts(self) -> &'static Facts {
        &FACTS[self as usize]
    }

    /// Returns the symbol, as in results and settings.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        self.facts().symbol
    }

    /// Returns the SI unit, as in results.
    #[must_use]
    pub fn unit(self) -> &'static str {
        self.facts().unit
    }

    /// Returns the name.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.facts().name
    }

    /// Returns true if the parameter belongs to an extension and not to the linear motor.
    #[must_use]
    pub fn is_extension(self) -> bool {
        self as usize >= Self::ALL.len()
    }

    /// Returns the value at which the parameter of an extension has no effect; NaN for the five parameters of the motor.
    #[must_use]
    pub fn neutral(self) -> f64 {
        self.facts().neutral
    }

    /// Returns true if `value` is in the domain of the parameter and finite.
    #[must_use]
    pub fn admits(self, value: f64) -> bool {
        let (lowest, above) = self.facts().lowest;
        value.is_finite() && if above { value > lowest } else { value >= lowest }
    }

    /// Returns the lower limit of the domain; the limit itself may be excluded.
    #[must_use]
    pub fn lowest(self) -> f64 {
        self.facts().lowest.0
    }

    /// Returns a description of the domain, for example `positive`.
    #[must_use]
    pub fn domain(self) -> &'static str {
        match self.facts().lowest {
            (0.0, true) => "positive",
            (0.0, false) => "zero or positive",
            (1.0, _) => "1 or more",
            _ => "finite",
        }
    }

    /// Returns the only channel that the parameter affects, 0 for current and 1 for speed; `None` if it affects both.
    #[must_use]
    pub fn channel(self) -> Option<usize> {
        match self {
            Self::CurrentAverage => Some(0),
            Self::SpeedAverage => Some(1),
            _ => None,
        }
    }

    /// Returns the default search bounds.
    #[must_use]
    pub fn default_bounds(self) -> DefaultBounds {
        self.facts().bounds
    }

    /// Returns the search bounds of the paper's Table 2; `None` for the parameter of an extension.
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
                format!("Name R, L, K, B or J, or the parameter of an extension: {extensions}."),
            )
        })
    }
}
