//! Steps of a recording and values at its samples, for operations with a memory.

use super::register::Register;

/// Samples that a memory keeps at most. A longer delay or window counts from the oldest sample kept.
pub(super) const KEPT_MAX: usize = 1 << 20;

/// Steps of a recording, for delays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Clock {
    /// Step after each sample \[s\]; one value if the clock is regular.
    pub step_s: Vec<f64>,
    /// Time at which the inputs first change, from the first sample \[s\]; +∞ if they do not.
    pub first_change_s: f64,
    /// Number of samples.
    pub samples: usize,
}

impl Clock {
    pub fn step(&self, n: usize) -> f64 {
        self.step_s.get(n).or(self.step_s.last()).copied().unwrap_or(1.0)
    }

    pub fn shortest(&self) -> f64 {
        self.step_s.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// Values of a memory at a sample: of a signal, and of its derivative.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry<const C: usize> {
    pub value: Register<C>,
    pub rate: Register<C>,
}

pub(super) const fn zero<const C: usize>() -> Entry<C> {
    Entry { value: Register::ZERO, rate: Register::ZERO }
}
