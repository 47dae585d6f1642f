//! Models that are part of the program, by name. Their files can be read, copied and changed.

use super::definition::Model;
use motorfit_core::Result;
use motorfit_core::named::named;

named! {
    /// A built-in model.
    #[non_exhaustive]
    pub enum BuiltIn: &'static str {
        /// The linear DC motor.
        DcMotor = "dc-motor" => include_str!("library/dc-motor.toml"),
        /// The DC motor with friction, brush drop, dead time and a nonlinear drive.
        DcExtended = "dc-extended" => include_str!("library/dc-extended.toml"),
        /// The DC motor whose winding warms up.
        DcThermal = "dc-thermal" => include_str!("library/dc-thermal.toml"),
        /// A mechanism of a robot without gravity: friction, velocity and acceleration.
        Mechanism = "mechanism" => include_str!("library/mechanism.toml"),
        /// A mechanism of a robot that lifts a constant weight.
        Elevator = "elevator" => include_str!("library/elevator.toml"),
        /// A mechanism of a robot that lifts an arm.
        Arm = "arm" => include_str!("library/arm.toml"),
        /// A permanent-magnet synchronous machine in rotor coordinates.
        Pmsm = "pmsm" => include_str!("library/pmsm.toml"),
        /// A servo with a pendulum, its control law and Stribeck friction.
        ServoPendulum = "servo-pendulum" => include_str!("library/servo-pendulum.toml"),
        /// Two masses with an elastic shaft and backlash.
        TwoMass = "two-mass" => include_str!("library/two-mass.toml"),
    }
}

impl BuiltIn {
    /// Returns the text of the model.
    #[must_use]
    pub const fn source(self) -> &'static str {
        self.row()
    }

    /// Returns the model.
    ///
    /// # Errors
    /// Propagates the errors of [`Model::parse`], of which a built-in model has none.
    pub fn model(self) -> Result<Model> {
        Model::parse(self.source())
    }
}
