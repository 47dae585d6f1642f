//! The DC motor: parameters with units, the box they are searched in, one-step maps, simulation, response figures.
//!
//! Model (paper, Eqs. 6 and 7), state `[i, ω]`:
//! `di/dt = (v − R i − K ω)/L`, `dω/dt = (K i − B ω − T)/J`.

mod delay;
mod discretize;
mod dual;
mod extended;
mod extension;
mod logarithm;
mod matrix;
mod parameter;
mod response;
mod simulate;
mod space;
mod terminal;

pub use delay::Beginning;
pub(crate) use delay::late;
pub(crate) use delay::{DelayTaps, sample_times};
pub use discretize::{Discretization, Input, Method, StepMap, StepMaps, step_maps};
pub use dual::{Dual, Number};
pub(crate) use extended::WINDOW_MAX;
pub use extended::{Extended, ExtendedWalk, Extent, Setting, walk_extended};
pub use extension::{Extension, Needs, With};
pub use logarithm::{LogarithmError, matrix_logarithm};
pub use matrix::{Matrix2, inverse, product, times};
pub use parameter::{Extensions, Parameter, UsualBounds};
pub use response::{Response, response};
pub use simulate::{Drive, Trajectory, simulate, walk};
pub use space::{Axis, Scope, Space};
pub(crate) use terminal::Terminal;

/// Values of the five parameters, SI units.
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

    /// The value of one parameter; not a number for one of an extension.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> f64 {
        self.to_array().get(parameter as usize).copied().unwrap_or(f64::NAN)
    }

    /// State `[i, ω]` in which the motor settles under a constant voltage \[V\] and load torque \[N·m\].
    #[must_use]
    pub fn steady_state(&self, voltage: f64, torque: f64) -> [f64; 2] {
        let determinant = self.r * self.b + self.k * self.k;
        [(self.b * voltage + self.k * torque) / determinant, (self.k * voltage - self.r * torque) / determinant]
    }
}
