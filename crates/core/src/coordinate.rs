//! The coordinate of a parameter within its bounds: the unknown of a search and of a refinement.

/// Bounds of a parameter and the coordinate that moves it: its logarithm, or its ratio to the range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinate {
    /// Lower bound.
    pub min: f64,
    /// Upper bound, above `min`.
    pub max: f64,
    /// True if the coordinate is the logarithm of the value, as of a parameter whose magnitude is not known beforehand.
    pub is_logarithmic: bool,
    /// Lowest value of the domain of the parameter.
    pub lowest: f64,
    /// Value within the bounds at which the parameter has no effect; `None` if there is none.
    pub neutral: Option<f64>,
}

impl Coordinate {
    /// Returns the coordinate of a value.
    #[must_use]
    pub fn of(&self, value: f64) -> f64 {
        if self.is_logarithmic { value.ln() } else { value / (self.max - self.min) }
    }

    /// Returns the value of a coordinate, within the bounds.
    #[must_use]
    pub fn value(&self, coordinate: f64) -> f64 {
        let value = if self.is_logarithmic { coordinate.exp() } else { coordinate * (self.max - self.min) };
        // Not `clamp`, which panics where bounds are not ordered.
        value.max(self.min).min(self.max)
    }

    /// Returns the derivative of the value with respect to the coordinate.
    #[must_use]
    pub fn slope(&self, value: f64) -> f64 {
        if self.is_logarithmic { value } else { self.max - self.min }
    }

    /// Returns the values at `distance` below and above a value, measured in the coordinate; the lower one is not below the
    /// domain of the parameter.
    #[must_use]
    pub fn around(&self, value: f64, distance: f64) -> [f64; 2] {
        if self.is_logarithmic {
            return [value * (-distance).exp(), value * distance.exp()];
        }
        let distance = distance * (self.max - self.min);
        [(value - distance).max(self.lowest), value + distance]
    }

    /// Returns the value at a fraction of the range of the coordinate.
    #[must_use]
    pub fn at(&self, fraction: f64) -> f64 {
        let [low, high] = [self.of(self.min), self.of(self.max)];
        self.value(low + fraction * (high - low))
    }

    /// Returns true if the parameter has no effect at a value.
    #[must_use]
    pub fn is_idle(&self, value: f64) -> bool {
        self.neutral.is_some_and(|neutral| (neutral - value).abs() <= 1e-9 * (self.max - self.min))
    }
}
