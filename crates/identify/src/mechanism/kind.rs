//! Kinds of mechanisms by their gravity, and their equations.

use motorfit_core::Result;
use motorfit_core::named::named;
use motorfit_model::{BuiltIn, Model};

named! {
    /// The gravity of a mechanism.
    #[derive(serde::Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum MechanismKind: BuiltIn {
        /// No gravity: a drivetrain, a flywheel, a turret.
        Simple = "simple" => BuiltIn::Mechanism,
        /// A constant weight.
        Elevator = "elevator" => BuiltIn::Elevator,
        /// A weight on an arm, by the cosine of its angle above the horizontal.
        Arm = "arm" => BuiltIn::Arm,
    }
}

impl MechanismKind {
    /// Returns the equations, for a position in radians or, if `is_linear`, in metres.
    ///
    /// # Errors
    /// Propagates the errors of [`Model::parse`], of which a built-in model has none.
    pub fn model(self, is_linear: bool) -> Result<Model> {
        let text = self.row().source();
        match is_linear {
            true => Model::parse(&text.replace("\"rad", "\"m").replace("/rad\"", "/m\"")),
            false => Model::parse(text),
        }
    }

    /// Returns true if the mechanism has a gravity.
    #[must_use]
    pub fn has_gravity(self) -> bool {
        self != Self::Simple
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_mechanisms_have_metres() {
        let units = |kind: MechanismKind, is_linear| {
            let model = kind.model(is_linear).unwrap();
            model.parameters().iter().map(|parameter| parameter.unit.text.clone()).collect::<Vec<_>>()
        };
        assert_eq!(units(MechanismKind::Elevator, true), ["V", "V", "V*s/m", "V*s^2/m", "s"]);
        assert_eq!(units(MechanismKind::Simple, false), ["V", "V*s/rad", "V*s^2/rad", "s"]);
        assert!(MechanismKind::Arm.model(true).is_err(), "the cosine takes an angle");
    }
}
