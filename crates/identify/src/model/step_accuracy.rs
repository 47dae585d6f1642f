//! Reasons and remedies where the estimates of a result depend on the steps of the integration: the parameter that moved most, and the cause.

use motorfit_core::setting::{Text, text};
use motorfit_core::text::significant;
use motorfit_evaluate::model::{ModelProblem, StepChange};

/// Reasons for which estimates depend on the steps.
enum StepCause {
    Stick,
    Corners,
    Stiff,
}

fn step_cause(problem: &ModelProblem) -> StepCause {
    match problem.model() {
        _ if problem.method().is_stiff() => StepCause::Stiff,
        model if model.reactions() > 0 => StepCause::Stick,
        model if model.has_corners() => StepCause::Corners,
        _ => StepCause::Stiff,
    }
}

/// Describes how far the estimates moved with the steps, and why.
pub(super) fn inaccuracy(problem: &ModelProblem) -> String {
    let cause = match step_cause(problem) {
        StepCause::Stick => "the moments at which friction sticks depend on the steps of the integration",
        StepCause::Corners => "the moments at which the equations switch depend on the steps of the integration",
        StepCause::Stiff => "the equations are stiff: steps are too long for the accuracy of the integration",
    };
    let Some(StepChange { axis, std_errors, substeps: [from, to] }) = problem.method().change else {
        return cause.to_owned();
    };
    let names = problem.space().names(problem.model());
    let name = names.get(axis).map_or("an estimate", String::as_str);
    let size = significant(std_errors, 2);
    format!("{cause}; from {from} to {to} substeps {name} moved by {size} standard errors, the others by less")
}

/// Returns the next step where the estimates depend on the steps of the integration, for a recording that exists.
pub(super) fn shorter_steps(problem: &ModelProblem) -> Text {
    let names = problem.space().names(problem.model());
    let moved = problem.method().change.and_then(|change| names.get(change.axis)).map_or("an estimate", String::as_str);
    match step_cause(problem) {
        StepCause::Stick => text!(
            ("Widen the interval of {moved} by the change, or exclude the rests of the machine (") [Mask] ")."
        ),
        StepCause::Corners => text!(
            ("Widen the interval of {moved} by the change, or write the switch as a steep function, as tanh(w/w0).")
        ),
        StepCause::Stiff => text!(
            "Narrow the " [Bounds] " of the fastest parameters, or replace the fastest state by its value at rest."
        ),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may stop")]

    use super::*;
    use motorfit_evaluate::model::{ModelRecording, ModelSettings, ModelSpace};
    use motorfit_model::{IntegrationMethod, Model};

    /// Returns the words for a motor with the given friction and rate of its equations, with 16 substeps of 10 ms.
    fn words(friction: &str, rate: f64, change: Option<StepChange>) -> (String, String) {
        let text = format!(
            "format = 1\nname = \"M\"\n[inputs]\nu = {{ unit = \"V\" }}\n[constants]\nw0 = {{ value = 1, unit = \"rad/s\" }}\n\
             J = {{ value = 1, unit = \"V*s^2/rad\" }}\n[parameters]\n\
             B = {{ unit = \"V*s/rad\", min = {rate}, max = {} }}\nTc = {{ unit = \"V\", min = 0, max = 1 }}\n\
             [states]\nw = {{ unit = \"rad/s\", d = \"(u - B*w*(1 + (w/w0)^2) - {friction})/J\", initial = 0 }}\n\
             [outputs]\nw = {{ value = \"w\", unit = \"rad/s\" }}\n",
            2.0 * rate
        );
        let model = Model::parse(&text).unwrap_or_else(|error| panic!("{error} {text}"));
        let recording = ModelRecording {
            time_s: (0..50).map(|n| 0.01 * f64::from(n)).collect(),
            step_s: vec![0.01],
            inputs: vec![(0..50).map(|n| f64::from(n % 7)).collect()],
            measured: vec![Some((0..50).map(|n| f64::from(n % 5)).collect())],
            counting: Vec::new(),
            effective_sample_ratio: 1.0,
            name: None,
            assumed: None,
        };
        let settings = ModelSettings { method: Some((IntegrationMethod::RungeKutta, 16)), ..ModelSettings::default() };
        let problem = ModelProblem::new(&model, ModelSpace::new(&model, 1), vec![recording], settings).unwrap();
        let problem = problem.with_rough_steps(true, change);
        (inaccuracy(&problem), shorter_steps(&problem).to_string())
    }

    #[test]
    fn the_cause_and_the_largest_change_are_named() {
        let change = Some(StepChange { axis: 1, std_errors: 0.316, substeps: [8, 16] });
        for (friction, cause, remedy) in
            [("stick(w, Tc)", "friction sticks", "exclude the rests"), ("Tc*sign(w)", "the equations switch", "tanh")]
        {
            let (reason, next) = words(friction, 1.0, change);
            assert!(reason.contains(cause) && !reason.contains("stiff"), "{reason}");
            assert!(
                reason.ends_with("from 8 to 16 substeps Tc moved by 0.32 standard errors, the others by less"),
                "{reason}"
            );
            assert!(next.contains(remedy) && next.contains("interval of Tc") && !next.contains("Record"), "{next}");
        }
        // 16 substeps of 10 ms suit rates up to 1120 1/s; beyond, friction is not the cause.
        for friction in ["stick(w, Tc)", "Tc*tanh(w/w0)"] {
            let (reason, next) = words(friction, 5e3, None);
            assert!(reason.starts_with("the equations are stiff") && !reason.contains("moved"), "{reason}");
            assert!(next.contains("fastest"), "{next}");
        }
    }
}
