//! The parts of a shader for motors with extensions, and where the constants of a candidate lie for them.

use crate::motor::{ModelFeatures, Parameter};

/// The parts of a shader for motors with extensions, beyond friction and the drive, which all of them have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ShaderFeatures {
    /// True if brushes drop a voltage.
    pub brushes: bool,
    /// True if the voltage is delayed.
    pub delayed: bool,
    /// Which sensors average.
    pub averages: [bool; 2],
}

/// Entries of a step map, and of each slot of constants behind the maps of a block.
pub(super) const FIELDS: usize = 12;
/// Entries of the state of a block between rounds: state and running sums.
pub(super) const STATES: usize = 4;
/// Words of a job.
pub(super) const JOB: usize = 15;
/// Windows of the sensors, in samples.
pub(super) const WINDOWS: [Parameter; 2] = [Parameter::CurrentAverage, Parameter::SpeedAverage];

/// A group of a candidate's constants for one recording, [`FIELDS`] entries. The first are the values of the extensions,
/// in the order of [`Parameter::EXTENSIONS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Slot {
    /// Whole samples, weight of the oldest, and one over the window, of each sensor.
    Averages,
    /// Whole samples of the dead time, the step of the first movement, and the gains of three samples.
    Taps,
    /// Steps that no taps give, and their gains.
    Special,
}

/// Slots with the values of the extensions.
const VALUES: usize = Parameter::EXTENSIONS.len().div_ceil(FIELDS);
/// Slots of a candidate at most.
pub(super) const SLOTS: usize = VALUES + 3;

impl ShaderFeatures {
    /// Returns the parts of a model; `None` for the linear motor.
    pub(super) fn of(features: ModelFeatures) -> Option<Self> {
        (!features.is_linear()).then(|| Self {
            brushes: features.has(Parameter::BrushDrop),
            delayed: features.is_delayed(),
            averages: WINDOWS.map(|window| features.has(window)),
        })
    }

    /// Returns the slots that a block has behind its step maps.
    pub(super) fn slots(self) -> usize {
        self.slot(Slot::Taps) + if self.delayed { 2 } else { 0 }
    }

    /// Returns the number of a slot.
    pub(super) fn slot(self, slot: Slot) -> usize {
        let averages = usize::from(self.averages != [false; 2]);
        match slot {
            Slot::Averages => VALUES,
            Slot::Taps => VALUES + averages,
            Slot::Special => VALUES + averages + 1,
        }
    }

    /// Returns the number of sensors that average.
    pub(super) fn channels(self) -> usize {
        self.averages.into_iter().filter(|averages| *averages).count()
    }
}
