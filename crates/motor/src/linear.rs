//! The linear motor (Eqs. 6 and 7): its five parameters and its steady state.

use super::parameter::Parameter;

/// Values of the five parameters in SI units.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub struct Parameters {
    /// Resistance \[ohm\].
    pub r: f64,
    /// Inductance \[H\].
    pub l: f64,
    /// Torque and back-EMF constant \[V·s/rad = N·m/A\].
    pub k: f64,
    /// Viscous friction \[N·m·s/rad\].
    pub b: f64,
    /// Moment of inertia \[kg·m²\].
    pub j: f64,
}

impl Parameters {
    /// The paper's M2 motor (Table 1).
    pub const M2: Self = Self { r: 0.921_042, l: 0.007_759, k: 0.073_472, b: 0.000_678, j: 0.000_136 };

    /// Returns the values in the order R, L, K, B, J.
    #[must_use]
    pub fn to_array(self) -> [f64; 5] {
        [self.r, self.l, self.k, self.b, self.j]
    }

    /// Makes parameters from values in the order R, L, K, B, J.
    #[must_use]
    pub fn from_array([r, l, k, b, j]: [f64; 5]) -> Self {
        Self { r, l, k, b, j }
    }

    /// Returns the value of one parameter, or NaN for a parameter of an extension.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> f64 {
        self.to_array().get(parameter as usize).copied().unwrap_or(f64::NAN)
    }

    /// Returns the steady state `[i, ω]` under a constant voltage \[V\] and load torque \[N·m\].
    #[must_use]
    pub fn steady_state(&self, voltage: f64, torque: f64) -> [f64; 2] {
        let determinant = self.r * self.b + self.k * self.k;
        [(self.b * voltage + self.k * torque) / determinant, (self.k * voltage - self.r * torque) / determinant]
    }
}
