//! URDF: inertia and friction of a joint.

use super::contents::{Exported, comment};
use motorfit_core::Result;
use motorfit_core::text::Shortest;
use motorfit_model::Role;
use std::fmt::Write as _;

/// Returns the text of the file.
pub(super) fn text(of: &Exported) -> Result<String> {
    of.check(&[Role::Damping, Role::FrictionLoss])?;
    let inertia = of.needed(Role::Armature)?;
    let mut about = of.origin();
    let winding = [Role::MotorConstant, Role::Resistance, Role::Inductance];
    for role in winding.into_iter().chain([Role::Load, Role::Stiffness, Role::Pendulum, Role::Kp, Role::Kd]) {
        if let Some(value) = of.role(role).filter(|value| *value != 0.0) {
            about.push(format!("Not held by this format: {} = {} {}.", role.name(), Shortest(value), role.unit()));
        }
    }
    about.extend(of.not_held.iter().map(|effect| format!("Not held by this format: {effect}.")));
    let electric = of.role(Role::MotorConstant).zip(of.role(Role::Resistance));
    if let Some((constant, resistance)) = electric {
        let (of_voltage, of_speed) = (constant / resistance, constant * constant / resistance);
        about.push(format!(
            "A voltage u at the motor gives the effort {} u - {} velocity, up to the inductance.",
            Shortest(of_voltage),
            Shortest(of_speed)
        ));
    }
    if let Some(gain) = of.role(Role::Gain).filter(|_| electric.is_none()) {
        about.push(format!("A voltage u at the motor gives the effort {} u.", Shortest(gain)));
    }
    if let (None, Some(voltage)) = (of.role(Role::Voltage), of.voltage) {
        about.push(format!(
            "The limits of effort and velocity are those at {} V, the most that was recorded.",
            Shortest(voltage)
        ));
    }
    let mut text = format!("<?xml version=\"1.0\"?>\n{}", comment(&about));
    let _ = writeln!(text, "<robot name=\"motor\">\n  <link name=\"base\"/>\n  <link name=\"rotor\">\n    <inertial>");
    let inertia = Shortest(inertia);
    let _ = writeln!(text, "      <origin xyz=\"0 0 0\" rpy=\"0 0 0\"/>\n      <mass value=\"0.001\"/>");
    let _ = writeln!(
        text,
        "      <inertia ixx=\"{inertia}\" iyy=\"{inertia}\" izz=\"{inertia}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/>"
    );
    let _ = writeln!(text, "    </inertial>\n  </link>\n  <joint name=\"shaft\" type=\"continuous\">");
    text.push_str("    <parent link=\"base\"/>\n    <child link=\"rotor\"/>\n");
    text.push_str("    <origin xyz=\"0 0 0\" rpy=\"0 0 0\"/>\n    <axis xyz=\"0 0 1\"/>\n");
    let positive = |role: Role| Shortest(of.role(role).unwrap_or(0.0).max(0.0));
    let (damping, friction) = (positive(Role::Damping), positive(Role::FrictionLoss));
    let _ = writeln!(text, "    <dynamics damping=\"{damping}\" friction=\"{friction}\"/>");
    // The torque at standstill and the speed without load, at the largest voltage.
    if let (Some((constant, resistance)), Some(voltage)) = (electric, of.role(Role::Voltage).or(of.voltage)) {
        let (effort, speed) = (Shortest(constant * voltage / resistance), Shortest(voltage / constant));
        let _ = writeln!(text, "    <limit effort=\"{effort}\" velocity=\"{speed}\"/>");
    }
    text.push_str("  </joint>\n</robot>\n");
    Ok(text)
}
