//! Settings of searches.

use super::coordinates::Coordinates;
use motorfit_core::setting::{Setting, text};
use motorfit_core::{Error, Result};

/// Largest number of values (candidates × axes) of one population: 1 GiB.
pub(super) const VALUES_MAX: usize = 1 << 27;

/// Settings common to all searches.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchSettings {
    /// Bounds `(min, max)` of each axis.
    pub bounds: Vec<(f64, f64)>,
    /// Number of candidates in the population.
    pub population: usize,
    /// Number of generations, the first population included.
    pub generations: usize,
    /// Seed of the study.
    pub seed: u64,
    /// Index of the run in the study; runs of one seed are independent of each other.
    pub run: u64,
    /// Coordinates in which candidates move.
    pub coordinates: Coordinates,
}

impl Default for SearchSettings {
    /// Returns 100 candidates, 100 generations and seed 1, without axes.
    fn default() -> Self {
        let coordinates = Coordinates::default();
        Self { bounds: Vec::new(), population: 100, generations: 100, seed: 1, run: 0, coordinates }
    }
}

impl SearchSettings {
    pub(super) fn too_large(&self) -> Error {
        let message = format!("a population of {} candidates does not fit in memory", self.population);
        Error::usage(message, format!("Give at most {} candidates.", VALUES_MAX / self.bounds.len()))
    }

    /// Returns the number of evaluations of the budget: the population times the generations.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        (self.population as u64).saturating_mul(self.generations as u64)
    }

    /// Checks the settings.
    ///
    /// # Errors
    /// Returns `Usage` if the box is empty or not finite, the population or the number of generations is zero, or the
    /// population or the number of evaluations exceeds its limit.
    pub fn check(&self) -> Result<()> {
        let size = self.population.checked_mul(self.bounds.len());
        if self.bounds.is_empty() || self.bounds.iter().any(|&(a, b)| !((b - a).is_finite() && a <= b)) {
            return Err(Error::usage("the box of the search is empty", "Give finite bounds with min ≤ max."));
        }
        if self.population == 0 || self.generations == 0 {
            let which = if self.population == 0 { Setting::Population } else { Setting::Generations };
            return Err(Error::usage(format!("{} is 0", which.name()), text!("Give " {which} " at least 1.")));
        }
        if size.is_none_or(|size| size > VALUES_MAX) {
            return Err(self.too_large());
        }
        let evaluations = (self.population as u64).checked_mul(self.generations as u64);
        if evaluations.is_none_or(|count| count > 1 << 53) {
            let message = format!("population {} × generations {} overflows", self.population, self.generations);
            return Err(Error::usage(
                message,
                "Reduce one of them: the product may be at most 9007199254740992 evaluations.",
            ));
        }
        Ok(())
    }
}
