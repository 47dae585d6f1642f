//! Results of mechanisms of robots: characteristics in the unit of the log, feedback gains, and lines of robot code.

use super::document::warnings;
use super::spelling::command_line;
use motorfit_core::text::significant;
use motorfit_identify::analysis::{Controller, FeedbackWeights};
use motorfit_identify::mechanism::{BIC_MIN, Feedback, MechanismFit, MechanismKind};
use motorfit_record::{Record, Severity};
use serde_json::{Map, Value, json};

/// A characteristic of a mechanism: name, description, and unit with `U` for the unit of position.
type Characteristic = (&'static str, &'static str, &'static str);

/// The characteristics in the order of results.
const CHARACTERISTICS: [Characteristic; 6] = [
    ("kS", "friction", "V"),
    ("kG", "gravity", "V"),
    ("kV", "velocity", "V*s/U"),
    ("kA", "acceleration", "V*s^2/U"),
    ("offset", "angle", "U"),
    ("td", "delay", "s"),
];

/// Feedback gains of a velocity and of a position regulator for a controller.
#[derive(Debug, Clone, Copy)]
pub struct FeedbackDesign<'a> {
    /// Controller with its period and delay.
    pub controller: &'a Controller,
    /// Weights of the regulators, in the unit of the log.
    pub weights: FeedbackWeights,
    /// Gains of the regulator of the velocity.
    pub velocity: Option<Feedback>,
    /// Gains of the regulator of the position.
    pub position: Option<Feedback>,
}

impl<'a> FeedbackDesign<'a> {
    /// Designs both regulators for a mechanism.
    #[must_use]
    pub fn of(fit: &MechanismFit, weights: FeedbackWeights, controller: &'a Controller) -> Self {
        let [velocity, position] = [false, true].map(|is_position| fit.feedback(is_position, &weights, controller));
        Self { controller, weights, velocity, position }
    }
}

/// A line of the result: name, description, value, unit, standard error and 95 % confidence interval.
#[derive(Debug, Clone, PartialEq)]
pub struct MechanismLine {
    /// Name, such as `kV`.
    pub name: &'static str,
    /// Description.
    pub text: &'static str,
    /// Estimate; `None` if it is not identifiable.
    pub value: Option<f64>,
    /// Unit.
    pub unit: String,
    /// Standard error.
    pub std_error: Option<f64>,
    /// 95 % confidence interval.
    pub ci95: Option<[f64; 2]>,
    /// Bound at which the estimate ended.
    pub at_bound: Option<&'static str>,
}

/// Returns the characteristics of a mechanism in the unit of its log; a delay that was not estimated is left out.
#[must_use]
pub fn mechanism_lines(fit: &MechanismFit) -> Vec<MechanismLine> {
    let line = |(name, text, unit): &Characteristic| {
        let estimate = fit.estimate(name).filter(|estimate| !estimate.fixed)?;
        let found = fit.in_unit(name);
        Some(MechanismLine {
            name,
            text,
            value: found.map(|found| found.0),
            unit: unit.replace('U', fit.unit.symbol),
            std_error: found.and_then(|found| found.1),
            ci95: found.and_then(|found| found.2),
            at_bound: estimate.at_bound,
        })
    };
    CHARACTERISTICS.iter().filter_map(line).collect()
}

/// Returns the feedforward of a mechanism as lines of robot code in Java and C++; empty if a characteristic is not identifiable.
#[must_use]
pub fn mechanism_code(fit: &MechanismFit) -> Vec<String> {
    let value = |name| fit.in_unit(name).map(|found| significant(found.0, 5));
    let (Some(ks), Some(kv), Some(ka)) = (value("kS"), value("kV"), value("kA")) else { return Vec::new() };
    let (class, kg) = match fit.kind {
        MechanismKind::Simple => ("SimpleMotorFeedforward", None),
        MechanismKind::Elevator => ("ElevatorFeedforward", value("kG")),
        MechanismKind::Arm => ("ArmFeedforward", value("kG")),
    };
    if kg.is_none() && fit.kind.has_gravity() {
        return Vec::new();
    }
    // The arm of WPILib takes radians.
    let per_radian = |name| fit.estimate(name).and_then(|estimate| estimate.value).map(|value| significant(value, 5));
    let (kv, ka) = match fit.kind {
        MechanismKind::Arm => (per_radian("kV").unwrap_or(kv), per_radian("kA").unwrap_or(ka)),
        _ => (kv, ka),
    };
    let [java, volts] = match &kg {
        None => [format!("{ks}, {kv}, {ka}"), format!("{ks}_V")],
        Some(kg) => [format!("{ks}, {kg}, {kv}, {ka}"), format!("{ks}_V, {kg}_V")],
    };
    let mut lines = vec![format!("Java  new {class}({java})")];
    let unit = if fit.kind == MechanismKind::Arm { "rad" } else { fit.unit.symbol };
    // The elevator of WPILib is linear in C++.
    let literal = CPP.iter().find(|row| row.0 == unit && (fit.kind != MechanismKind::Elevator || fit.unit.is_linear));
    if let Some((_, distance, velocity, acceleration)) = literal {
        let template = if kg.is_none() { format!("<units::{distance}>") } else { String::new() };
        lines
            .push(format!("C++   frc::{class}{template}{{{volts}, {kv}_V / 1_{velocity}, {ka}_V / 1_{acceleration}}}"));
    }
    if let Some(offset) = per_radian("offset").filter(|_| fit.kind == MechanismKind::Arm) {
        lines
            .push(format!("      add {offset} rad to the measured angle, which is then 0 where the arm is horizontal"));
    }
    lines
}

/// Units with the type and the literals of their velocities and accelerations in the library of units of WPILib; others have none.
const CPP: [(&str, &str, &str, &str); 5] = [
    ("rad", "radians", "rad_per_s", "rad_per_s_sq"),
    ("deg", "degrees", "deg_per_s", "deg_per_s_sq"),
    ("turn", "turns", "tps", "tr_per_s_sq"),
    ("m", "meters", "mps", "mps_sq"),
    ("ft", "feet", "fps", "fps_sq"),
];

/// Returns the gains of a regulator.
fn gains(feedback: Option<&Feedback>) -> Value {
    let Some(Feedback { gains, std_error: [kp, kd] }) = feedback else { return Value::Null };
    json!({"kP": {"value": gains.kp, "std_error": kp}, "kD": {"value": gains.kd, "std_error": kd}})
}

/// Returns the JSON document of an identification of a mechanism.
#[must_use]
pub fn mechanism_document(records: &[Record], fit: &MechanismFit, design: &FeedbackDesign<'_>) -> Value {
    let found = &fit.found;
    let parameters: Map<String, Value> = mechanism_lines(fit)
        .into_iter()
        .map(|line| {
            let MechanismLine { name, value, unit, std_error, ci95, at_bound, .. } = line;
            let entry =
                json!({"value": value, "unit": unit, "std_error": std_error, "ci95": ci95, "at_bound": at_bound});
            (name.to_owned(), entry)
        })
        .collect();
    let regression = |of: &motorfit_identify::mechanism::MechanismRegression| {
        let per = fit.unit.factor;
        json!({"mechanism": of.kind, "bic": of.bic, "samples": of.samples, "kS": of.ks, "kG": of.kg, "kV": of.kv * per, "kA": of.ka * per})
    };
    let reasons = found
        .trust
        .reasons
        .iter()
        .map(|reason| json!({"code": reason.code, "message": reason.message.spelled(command_line)}));
    json!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "trust": {
            "level": found.trust.level,
            "reasons": reasons.collect::<Vec<_>>(),
            "next": found.trust.next.as_ref().map(|next| next.spelled(command_line)),
        },
        "records": records,
        "mechanism": fit.kind,
        "mechanism_selected": fit.is_selected,
        "unit": fit.unit.symbol,
        "parameters": parameters,
        "delay_bic_gain": fit.delay_gain,
        "time_constant": fit.in_unit("kA").zip(fit.in_unit("kV")).map(|(ka, kv)| ka.0 / kv.0),
        "feedback": {
            "controller": design.controller.name,
            "period_s": design.controller.period_s,
            "delay_s": design.controller.delay_s,
            "max_voltage": design.weights.volts,
            "max_velocity_error": design.weights.velocity,
            "max_position_error": design.weights.position,
            "velocity": gains(design.velocity.as_ref()),
            "position": gains(design.position.as_ref()),
        },
        "regression": fit.regressions.iter().map(regression).collect::<Vec<_>>(),
        "fit_percent": found.fit_percent.first().copied().flatten(),
        "residual_sigma": found.residual_sigma.first().copied().flatten().map(|sigma| sigma / fit.unit.factor),
        "verification": {"status": found.verification.status, "starts": found.verification.starts, "arrivals": found.verification.arrivals},
        "warnings": warnings(&found.warnings, Severity::Report),
        "seconds": found.seconds,
    })
}

/// Returns the sentence that says how the kind was selected.
#[must_use]
pub fn mechanism_selection(fit: &MechanismFit) -> String {
    let kind = fit.kind.name();
    if !fit.is_selected {
        return format!("{kind}, as given");
    }
    let of = |kind: MechanismKind| fit.regressions.iter().find(|of| of.kind == kind).map(|of| of.bic);
    let own = of(fit.kind);
    let other = fit.regressions.iter().filter(|of| of.kind != fit.kind).map(|of| of.bic).reduce(f64::min);
    match own.zip(other) {
        Some((own, other)) if fit.kind.has_gravity() || own < other => {
            format!("{kind}, selected by regression (BIC lower by {})", significant(other - own, 3))
        }
        Some(_) => format!("{kind}: no gravity improves the regression by a BIC of {BIC_MIN}"),
        None => format!("{kind}: the tests leave no other choice"),
    }
}
