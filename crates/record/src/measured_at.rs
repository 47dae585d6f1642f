//! The samples of a recording at which an output was measured.

use super::heading::Quantity;

/// The samples at which an output was measured; its values at the others are interpolated linearly and do not count.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MeasuredAt {
    pub quantity: Quantity,
    /// True for each sample at which it was measured.
    pub samples: Vec<bool>,
}

impl MeasuredAt {
    /// Returns the indices of the samples at which the output was measured.
    pub(crate) fn indices(&self) -> Vec<usize> {
        (0..self.samples.len()).filter(|n| self.samples[*n]).collect()
    }

    pub(crate) fn part(&self, range: std::ops::Range<usize>) -> Self {
        Self { quantity: self.quantity, samples: self.samples[range].to_vec() }
    }
}
