//! The optional parts of a shader for motors with extensions, and the layout of a candidate's constants.

use motorfit_motor::{ModelFeatures, Parameter};

/// The optional parts of a shader for motors with extensions. Friction and the drive are always present.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ShaderFeatures {
    /// True if the brushes have a voltage drop.
    pub brushes: bool,
    /// True if the voltage is delayed.
    pub delayed: bool,
    /// True for each sensor, of current and of speed, that is a moving average.
    pub averages: [bool; 2],
}

/// Number of entries of a step map, and of each slot of constants after the maps of a block.
pub(crate) const FIELDS: usize = 12;
/// Number of entries of a block that are kept between rounds: states and running sums.
pub(crate) const STATES: usize = 4;
/// Number of words of a job.
pub(crate) const JOB: usize = 15;
/// Window lengths of the sensors, in samples.
pub(crate) const WINDOWS: [Parameter; 2] = [Parameter::CurrentAverage, Parameter::SpeedAverage];

/// A slot of [`FIELDS`] constants of a candidate for one recording. Before these slots are the values of the extensions, in the
/// order of [`Parameter::EXTENSIONS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Slot {
    /// For each sensor: integer part of the window, weight of the oldest sample, and reciprocal of the window.
    Averages,
    /// Integer part of the dead time in samples, step of the first movement, and gains of three samples.
    Taps,
    /// Steps whose input the taps do not represent, and their contributions.
    Special,
}

/// Number of slots with the values of the extensions.
const VALUES: usize = Parameter::EXTENSIONS.len().div_ceil(FIELDS);
/// Largest number of slots of a candidate.
pub(crate) const SLOTS: usize = VALUES + 3;

impl ShaderFeatures {
    /// Returns the shader parts that a model needs; `None` for the linear motor.
    pub(crate) fn of(features: ModelFeatures) -> Option<Self> {
        (!features.is_linear()).then(|| Self {
            brushes: features.has(Parameter::BrushDrop),
            delayed: features.is_delayed(),
            averages: WINDOWS.map(|window| features.has(window)),
        })
    }

    /// Returns the number of slots after the step maps of a block.
    pub(crate) fn slots(self) -> usize {
        self.slot(Slot::Taps) + if self.delayed { 2 } else { 0 }
    }

    /// Returns the index of a slot.
    pub(crate) fn slot(self, slot: Slot) -> usize {
        let averages = usize::from(self.averages != [false; 2]);
        match slot {
            Slot::Averages => VALUES,
            Slot::Taps => VALUES + averages,
            Slot::Special => VALUES + averages + 1,
        }
    }

    /// Returns the number of sensors that are moving averages.
    pub(crate) fn channels(self) -> usize {
        self.averages.into_iter().filter(|averages| *averages).count()
    }
}
