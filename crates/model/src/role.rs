//! Roles of values in the files of simulators.

use motorfit_core::named::named;
use motorfit_core::units::{Dimension, Unit, parse_unit};

named! {
    /// A role that a function of the parameters takes in the file of a simulator.
    #[non_exhaustive]
    pub enum Role: &'static str {
        /// Moment of inertia about the axis of the joint.
        Armature = "armature" => "kg*m^2",
        /// Viscous friction.
        Damping = "damping" => "N*m*s/rad",
        /// Coulomb friction.
        FrictionLoss = "frictionloss" => "N*m",
        /// Stiffness of a spring that pulls the joint to zero.
        Stiffness = "stiffness" => "N*m/rad",
        /// Constant torque against the motor.
        Load = "load" => "N*m",
        /// Weight times length of a pendulum on the joint, which hangs at zero.
        Pendulum = "pendulum" => "N*m",
        /// Torque constant and back-EMF constant at the joint.
        MotorConstant = "motorconst" => "V*s/rad",
        /// Resistance of the winding.
        Resistance = "resistance" => "ohm",
        /// Inductance of the winding.
        Inductance = "inductance" => "H",
        /// Torque at the joint for each volt, of an actuator without a known winding.
        Gain = "gain" => "N*m/V",
        /// Gain of the angle in the control law.
        Kp = "kp" => "V/rad",
        /// Gain of the speed in the control law.
        Kd = "kd" => "V*s/rad",
        /// Largest voltage.
        Voltage = "voltage" => "V",
    }
}

impl Role {
    /// Returns the unit of the values.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        self.row()
    }

    /// Returns the dimension of the values.
    pub(super) fn dimension(self) -> Dimension {
        parse_unit(self.row()).unwrap_or(Unit::ONE).dimension
    }
}
