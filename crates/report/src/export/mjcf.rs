//! MuJoCo's MJCF: a joint with inertia and friction, driven by a DC motor with its winding, by a gain, or by a position servo.

use super::contents::{Exported, comment};
use motorfit_core::text::Shortest;
use motorfit_core::{Error, Result};
use motorfit_model::Role;
use std::fmt::Write as _;

/// Steps of the simulation per sampling period, or per time constant of the winding if that is shorter: speed and current are then
/// exact to some 1e-3 of their size.
const STEPS: f64 = 10.0;
/// Most steps per sampling period. A winding that is faster than five steps is left out, which is more accurate.
const STEPS_MAX: f64 = 50.0;
/// Share of the inertia that the body has, without which MuJoCo refuses it; the remainder is the armature of the joint.
const OF_BODY: f64 = 1e-6;
/// Gravity \[m/s²\].
const GRAVITY: f64 = 9.81;
/// Friction that holds the joint at rest: with MuJoCo's usual values it creeps.
const SHARP: &str = "solreffriction=\"1e-6 1\" solimpfriction=\"0.9999 0.9999 0.001 0.5 2\"";

/// The winding: torque constant \[V s/rad\], resistance \[ohm\] and inductance \[H\].
#[derive(Clone, Copy)]
struct Winding {
    constant: f64,
    resistance: f64,
    /// `None` if it acts within a few steps.
    inductance: Option<f64>,
}

/// The actuator: a winding, or a gain \[N m/V\] whose back-EMF is a part of the damping.
#[derive(Clone, Copy)]
enum Drive {
    Winding(Winding),
    Gain(f64),
}

impl Drive {
    /// Returns the torque for each volt at rest \[N m/V\].
    fn gain(self) -> f64 {
        match self {
            Self::Winding(winding) => winding.constant / winding.resistance,
            Self::Gain(gain) => gain,
        }
    }

    /// Returns the damping by the back-EMF \[N m s/rad\].
    fn back_emf(self) -> f64 {
        match self {
            Self::Winding(winding) => winding.constant * winding.constant / winding.resistance,
            Self::Gain(_) => 0.0,
        }
    }

    /// Returns the inductance \[H\], if it does not act within a few steps.
    fn inductance(self) -> Option<f64> {
        match self {
            Self::Winding(winding) => winding.inductance,
            Self::Gain(_) => None,
        }
    }
}

/// Returns the actuator of a machine, with the number of steps of the simulation per sampling period.
fn drive(of: &Exported) -> Result<(Drive, f64)> {
    let has_winding = [Role::MotorConstant, Role::Resistance].into_iter().any(|role| of.role(role).is_some());
    if let Some(gain) = of.role(Role::Gain).filter(|_| !has_winding) {
        return Ok((Drive::Gain(gain), STEPS));
    }
    if !has_winding {
        let hint = "Give the model a section [export] with motorconst and resistance, or with gain = \"…\", in N*m/V, for an \
                    actuator without a known winding.";
        return Err(Error::usage("the model names neither motorconst and resistance nor gain for simulators", hint));
    }
    let (constant, resistance) = (of.needed(Role::MotorConstant)?, of.needed(Role::Resistance)?);
    let inductance = of.role(Role::Inductance).filter(|value| *value > 0.0);
    let fastest = inductance.map_or(of.period_s, |inductance| of.period_s.min(inductance / resistance));
    let steps = (of.period_s * STEPS / fastest).ceil().clamp(STEPS, STEPS_MAX);
    let inductance = inductance.filter(|inductance| inductance / resistance > 5.0 * of.period_s / steps);
    Ok((Drive::Winding(Winding { constant, resistance, inductance }), steps))
}

/// Returns the text of the file.
pub(super) fn text(of: &Exported) -> Result<String> {
    of.check(&Role::ALL)?;
    let inertia = of.needed(Role::Armature)?;
    let (drive, steps) = drive(of)?;
    let timestep = of.period_s / steps;
    // The Runge–Kutta method does not integrate the current, which is an activation.
    let integrator = if drive.inductance().is_some() { "implicitfast" } else { "RK4" };
    let pendulum = of.role(Role::Pendulum).filter(|value| *value > 0.0);
    let gravity = if pendulum.is_some() { -GRAVITY } else { 0.0 };
    let is_servo = of.role(Role::Kp).is_some();
    let mut text = comment(&about(of, drive, (steps, is_servo)));
    let _ = writeln!(text, "<mujoco model=\"motor\">\n  <compiler angle=\"radian\"/>");
    let _ = writeln!(
        text,
        "  <option timestep=\"{}\" integrator=\"{integrator}\" gravity=\"0 0 {gravity}\"/>",
        Shortest(timestep)
    );
    // The limit of a servo acts on the voltage alone, so that the back-EMF is a damping of its joint.
    let back_emf = if is_servo { drive.back_emf() } else { 0.0 };
    text.push_str(&body(of, (inertia, back_emf), pendulum));
    text.push_str("  <actuator>\n");
    text.push_str(&if is_servo { servo(of, drive) } else { motor(of, drive) });
    if let Some(load) = of.role(Role::Load).filter(|load| *load != 0.0) {
        let bias = "gainprm=\"0\" biastype=\"affine\"";
        let _ =
            writeln!(text, "    <general name=\"load\" joint=\"shaft\" {bias} biasprm=\"{} 0 0\"/>", Shortest(-load));
    }
    text.push_str("  </actuator>\n</mujoco>\n");
    Ok(text)
}

fn about(of: &Exported, drive: Drive, (steps, is_servo): (f64, bool)) -> Vec<String> {
    let mut about = of.origin();
    let steps = format!("{} steps of the simulation are a sampling period.", Shortest(steps));
    about.push(steps);
    about.extend(match (is_servo, drive) {
        (true, _) => vec![
            "ctrl[0] is the reference of the angle [rad]; the torque of the winding at rest is actuator_force[0]."
                .to_owned(),
        ],
        (_, Drive::Gain(_)) => vec!["ctrl[0] is the voltage [V]; the back-EMF is a part of the damping.".to_owned()],
        (_, Drive::Winding(Winding { inductance: Some(_), .. })) => {
            vec!["MuJoCo 3.7 or later. ctrl[0] is the voltage [V], act[0] the current [A].".to_owned()]
        }
        _ => vec!["ctrl[0] is the voltage u [V]; the current is (u - motorconst qvel) / resistance.".to_owned()],
    });
    if of.role(Role::Inductance).is_some() && drive.inductance().is_none() {
        about.push("The inductance acts within a few steps and is left out.".to_owned());
    }
    about.extend(of.not_held.iter().map(|effect| format!("Not held by this format: {effect}.")));
    about
}

fn motor(of: &Exported, drive: Drive) -> String {
    let limit = of.role(Role::Voltage).filter(|limit| *limit > 0.0);
    let range = limit
        .map(Shortest)
        .map_or_else(String::new, |limit| format!(" ctrllimited=\"true\" ctrlrange=\"-{limit} {limit}\""));
    match drive {
        Drive::Gain(gain) => {
            format!("    <motor name=\"motor\" joint=\"shaft\"{range} gear=\"{}\"/>\n", Shortest(gain))
        }
        Drive::Winding(Winding { constant, resistance, inductance: Some(inductance) }) => {
            let [constant, resistance, inductance] = [constant, resistance, inductance].map(Shortest);
            format!(
                "    <dcmotor name=\"motor\" joint=\"shaft\"{range}\n             motorconst=\"{constant}\" \
                 resistance=\"{resistance}\" inductance=\"{inductance}\"/>\n"
            )
        }
        Drive::Winding(_) => {
            let (gain, damping) = (Shortest(drive.gain()), Shortest(-drive.back_emf()));
            format!(
                "    <general name=\"motor\" joint=\"shaft\"{range}\n             gainprm=\"{gain}\" biastype=\"affine\" \
                 biasprm=\"0 0 {damping}\"/>\n"
            )
        }
    }
}

/// Returns a position servo with the control law `u = kp (ref − q) − kd w`, limited as a voltage.
fn servo(of: &Exported, drive: Drive) -> String {
    let gain = drive.gain();
    let [kp, kd] = [Role::Kp, Role::Kd].map(|role| gain * of.role(role).unwrap_or(0.0));
    let limit = of.role(Role::Voltage).map(|limit| Shortest(gain * limit));
    let limit =
        limit.map_or_else(String::new, |limit| format!(" forcelimited=\"true\" forcerange=\"-{limit} {limit}\""));
    let (gain, bias) = (Shortest(kp), format!("0 {} {}", Shortest(-kp), Shortest(-kd)));
    format!(
        "    <general name=\"motor\" joint=\"shaft\"{limit}\n             gainprm=\"{gain}\" biastype=\"affine\" biasprm=\"{bias}\"/>\n"
    )
}

/// Returns the body on its joint. A pendulum is a point mass, near enough to the joint that half of the inertia remains.
fn body(of: &Exported, (inertia, back_emf): (f64, f64), pendulum: Option<f64>) -> String {
    let length = pendulum.map_or(0.0, |weight| 0.5 * inertia * GRAVITY / weight);
    let mass = pendulum.map_or(1e-3, |weight| weight / (GRAVITY * length));
    let own = OF_BODY * inertia;
    let armature = inertia - own - if pendulum.is_some() { 0.5 * inertia } else { 0.0 };
    let axis = if pendulum.is_some() { "0 1 0" } else { "0 0 1" };
    let mut text = String::from("  <worldbody>\n    <body name=\"rotor\">\n      <joint name=\"shaft\" type=\"hinge\"");
    let _ = write!(text, " axis=\"{axis}\" armature=\"{}\"", Shortest(armature));
    let attribute = |name: &str, value: f64| {
        if value > 0.0 { format!(" {name}=\"{}\"", Shortest(value)) } else { String::new() }
    };
    let role = |role: Role| of.role(role).unwrap_or(0.0);
    text.push_str(&attribute("damping", role(Role::Damping) + back_emf));
    text.push_str(&attribute("stiffness", role(Role::Stiffness)));
    let friction = attribute("frictionloss", role(Role::FrictionLoss));
    if !friction.is_empty() {
        let _ = write!(text, "{friction}\n             {SHARP}");
    }
    let at = if pendulum.is_some() { -length } else { 0.0 };
    let (at, mass, own) = (Shortest(at), Shortest(mass), Shortest(own));
    let _ = writeln!(text, "/>\n      <inertial pos=\"0 0 {at}\" mass=\"{mass}\" diaginertia=\"{own} {own} {own}\"/>");
    // Something to see, without mass or contacts.
    let reach = if pendulum.is_some() { format!("0 0 {at}") } else { "0.02 0 0".to_owned() };
    let shape = "type=\"capsule\" size=\"0.002\" contype=\"0\" conaffinity=\"0\" mass=\"0\"";
    let _ = writeln!(text, "      <geom {shape} fromto=\"0 0 0 {reach}\"/>");
    text.push_str("    </body>\n  </worldbody>\n");
    text
}
