//! Outcomes for tests.

use super::estimates::{OutputFits, RunEstimate, RunEstimates};
use super::line::Outcome;
use super::trust::RunTrust;
use motorfit_identify::TrustLevel;
use motorfit_motor::{Parameter, Parameters, Scope};
use motorfit_optimize::Stop;

/// Returns the outcome of motor M2 with Coulomb friction and a load of the second recording.
pub(super) fn sample() -> Outcome {
    let own = Parameter::ALL.map(|p| (p, Scope::Shared, Parameters::M2.get(p)));
    let more = [(Parameter::Coulomb, Scope::Shared, 1e-300), (Parameter::Load, Scope::Recording(1), -0.1)];
    let estimate = |(n, &(parameter, scope, value)): (usize, &(Parameter, Scope, f64))| RunEstimate {
        name: scope.name(parameter),
        value: (n != 1).then_some(value),
        std_error: (n % 2 == 0).then_some(0.1),
        ci95: (n % 2 == 0).then_some([1e-9, 1e300]),
        at_bound: (n == 3).then_some("max"),
    };
    let list = own.iter().chain(&more).enumerate().map(estimate).collect();
    Outcome {
        estimates: Some(RunEstimates { list, derived: Vec::new(), polished: true }),
        cost: Some(0.025),
        fit_percent: Some(OutputFits(vec![("current".to_owned(), Some(99.5)), ("speed".to_owned(), None)])),
        evaluations: 4,
        stop: Some(Stop::Converged),
        device: "cpu",
        precision: "f64",
        trust: Some(RunTrust { level: TrustLevel::Check, reasons: vec!["at_bound".to_owned()] }),
        ..Outcome::default()
    }
}
