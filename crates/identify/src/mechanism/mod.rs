//! Identification of mechanisms of robots from the tests of SysId: kS, kV, kA and, with gravity, kG.
//!
//! The equation is `v = kS sgn(ω) + g + kV ω + kA dω/dt` with the gravity `g` of the kind: none, `kG` for an elevator,
//! `kG cos(θ + offset)` for an arm. A regression on differences (as SysId's) selects the kind and gives start and bounds; the result is
//! the output-error fit of the equations to the velocity ([`crate::model`]), which noise does not bias.

mod checks;
mod delay;
mod fit;
mod kind;
mod regression;
mod signals;
mod unit;

pub use delay::BIC_MIN;
pub use fit::{Feedback, MechanismFit, MechanismSpec, identify_mechanism};
pub use kind::MechanismKind;
pub use regression::{MechanismRegression, mechanism_regression};
pub use signals::mechanism_signals;
pub use unit::PositionUnit;
