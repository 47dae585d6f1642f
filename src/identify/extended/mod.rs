//! Extensions of the linear motor: what can be asked for, and within which bounds.

mod ladder;
mod starts;
mod worth;

pub(super) use ladder::climb;
pub use ladder::{Ladder, Rung};
pub(super) use starts::{best_start, explained, lagged, led};
pub(super) use worth::is_far;

use super::mechanical::is_driven_by_current;
use super::spec::IdentifySpec;
use crate::criterion::peak;
use crate::motor::{Axis, Parameter, Scope, Space};
use crate::record::Record;
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

    /// Its name in flags and results.
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
            Self::DirectionGain => &[Parameter::NegativeGain],
            Self::SensorAverage => &[Parameter::CurrentAverage, Parameter::SpeedAverage],
        }
    }

    /// Its parameters that recordings can show: sensors that were there, directions that were driven.
    fn shown(self, records: &[Record]) -> Vec<Parameter> {
        let measured = |channel: usize| records.iter().any(|r| r.measured()[channel].is_some());
        let told = |parameter: &Parameter| match parameter {
            Parameter::CurrentAverage => measured(0),
            Parameter::SpeedAverage => measured(1),
            _ => true,
        };
        self.parameters().iter().copied().filter(told).collect()
    }
}

impl std::str::FromStr for Extension {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|e| e.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name);
            let near = nearest(name, &names).map_or(String::new(), |near| format!("; did you mean {near}?"));
            Error::usage(
                format!("--with: \"{}\" is no extension{near}", crate::text::excerpt(name)),
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
                    "--with auto chooses among all extensions, yet others are named beside it",
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

/// The space of a spec with these extensions, as far as it has not got their parameters: within bounds that the
/// recordings and a motor near the right one (R, L, K, B, J) give. A start latency belongs to each recording.
///
/// # Errors
/// `Usage` when bounds are crossed.
pub(super) fn extended_space(
    records: &[Record],
    spec: &IdentifySpec,
    space: &Space,
    (extensions, motor): (&[Extension], &[f64; 5]),
) -> Result<Space> {
    let scales = Scales::of(records, motor);
    let mut free = space.free().to_vec();
    let has = |p: Parameter| {
        space.free().iter().any(|axis| axis.parameter == p) || space.fixed().iter().any(|(of, _, _)| *of == p)
    };
    for parameter in extensions.iter().flat_map(|extension| extension.shown(records)).filter(|p| !has(*p)) {
        let (min, max) = scales.bounds(parameter);
        free.push(Axis { parameter, scope: Scope::Shared, min, max });
    }
    let space = Space::new(free, space.fixed().to_vec())?;
    let mut own = spec.per_recording.clone();
    own.push(Parameter::Latency);
    Ok(if records.len() > 1 { space.per_recording(&own, records.len()) } else { space })
}

/// What is large in recordings.
struct Scales {
    /// The input, a voltage or a current.
    voltage: f64,
    stall_torque: f64,
    period_s: f64,
    duration_s: f64,
    time_constant_s: f64,
    samples: f64,
}

impl Scales {
    fn of(records: &[Record], &[r, _, k, b, j]: &[f64; 5]) -> Self {
        let largest = |of: &dyn Fn(&Record) -> f64| records.iter().map(of).fold(0.0, f64::max);
        let voltage = largest(&|record| peak(record.input())).max(f64::MIN_POSITIVE);
        let by_current = is_driven_by_current(records);
        let shortest = records.iter().map(Record::len).min().unwrap_or(1);
        #[expect(clippy::cast_precision_loss, reason = "a count of samples is far below 2^53")]
        let samples = shortest as f64;
        Self {
            voltage,
            stall_torque: if by_current { k * voltage } else { k * voltage / r },
            period_s: largest(&Record::period_s),
            duration_s: largest(&Record::duration_s),
            time_constant_s: if by_current { j / b } else { r * j / (k * k + r * b) },
            samples,
        }
    }

    /// Bounds that leave room for whatever a recording can show.
    fn bounds(&self, parameter: Parameter) -> (f64, f64) {
        let Self { voltage, stall_torque, period_s, duration_s, time_constant_s, samples } = *self;
        let late = |periods: f64, constants: f64| {
            (periods * period_s).max(constants * time_constant_s).min(0.25 * duration_s).max(period_s)
        };
        match parameter {
            Parameter::Coulomb => (0.0, stall_torque),
            Parameter::Load => (-stall_torque, stall_torque),
            Parameter::DeadTime => (0.0, late(100.0, 6.0)),
            Parameter::Latency => (0.0, late(500.0, 10.0)),
            Parameter::Offset => (-0.5 * voltage, 0.5 * voltage),
            Parameter::BrushDrop => (0.0, 0.5 * voltage),
            Parameter::Deadband => (0.0, 0.95 * voltage),
            Parameter::Saturation => (0.05 * voltage, voltage),
            Parameter::NegativeGain => (0.2, 5.0),
            _ => (1.0, (0.25 * samples).clamp(2.0, 300.0)),
        }
    }
}
