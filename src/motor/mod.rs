//! The DC motor: parameters with units, the box they are searched in, one-step maps, simulation, response figures.
//!
//! Model (paper, Eqs. 6 and 7), state `[i, ω]`:
//! `di/dt = (v − R i − K ω)/L`, `dω/dt = (K i − B ω − T)/J`.

mod discretize;
mod dual;
mod logarithm;
mod matrix;
mod response;
mod simulate;
mod space;

pub use discretize::{Discretization, StepMap, StepMaps, step_maps};
pub use dual::{Dual, Number};
pub use logarithm::{LogarithmError, matrix_logarithm};
pub use matrix::{Matrix2, inverse, product, times};
pub use response::{Response, response};
pub use simulate::{Drive, Trajectory, simulate, walk};
pub use space::{Axis, Scope, Space};

/// A parameter of the motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Parameter {
    /// Resistance of the armature.
    R,
    /// Inductance of the armature.
    L,
    /// Torque and back-EMF constant.
    K,
    /// Viscous friction.
    B,
    /// Moment of inertia.
    J,
}

impl Parameter {
    /// The five of the linear motor, in the order used everywhere.
    pub const ALL: [Self; 5] = [Self::R, Self::L, Self::K, Self::B, Self::J];

    /// Its symbol, as in results and flags.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        ["R", "L", "K", "B", "J"][self as usize]
    }

    /// Its SI unit, as in results.
    #[must_use]
    pub fn unit(self) -> &'static str {
        ["ohm", "H", "V*s/rad", "N*m*s/rad", "kg*m^2"][self as usize]
    }

    /// Its name in words.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["resistance", "inductance", "motor constant", "viscous friction", "inertia"][self as usize]
    }

    /// The search bounds of the paper's Table 2.
    #[must_use]
    pub fn table2(self) -> (f64, f64) {
        [(0.1, 1.0), (0.001, 0.1), (0.005, 0.1), (1e-5, 1e-3), (1e-5, 1e-3)][self as usize]
    }
}

impl std::str::FromStr for Parameter {
    type Err = crate::Error;

    fn from_str(symbol: &str) -> crate::Result<Self> {
        Self::ALL.into_iter().find(|p| p.symbol() == symbol).ok_or_else(|| {
            crate::Error::usage(
                format!("\"{}\" is not a parameter of the motor", crate::text::excerpt(symbol)),
                "Name R, L, K, B or J.",
            )
        })
    }
}

/// Values of the five parameters, SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
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

    /// In the order R, L, K, B, J.
    #[must_use]
    pub fn to_array(self) -> [f64; 5] {
        [self.r, self.l, self.k, self.b, self.j]
    }

    /// From the order R, L, K, B, J.
    #[must_use]
    pub fn from_array([r, l, k, b, j]: [f64; 5]) -> Self {
        Self { r, l, k, b, j }
    }

    /// The value of one parameter.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> f64 {
        self.to_array()[parameter as usize]
    }

    /// State `[i, ω]` in which the motor settles under a constant voltage \[V\] and load torque \[N·m\].
    #[must_use]
    pub fn steady_state(&self, voltage: f64, torque: f64) -> [f64; 2] {
        let determinant = self.r * self.b + self.k * self.k;
        [(self.b * voltage + self.k * torque) / determinant, (self.k * voltage - self.r * torque) / determinant]
    }
}
