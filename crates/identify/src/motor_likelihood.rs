//! Profile likelihoods of the DC motor.

use super::automatic::without_undersampled;
use super::likelihood::{LikelihoodProfile, Profiled, check_polished, profiles};
use super::pipeline::identify;
use super::profile::wider;
use super::result::Identification;
use super::spec::IdentifySpec;
use motorfit_core::Result;
use motorfit_core::setting::{Text, text};
use motorfit_estimate::{Refined, fit_problem, refine_on};
use motorfit_evaluate::Problem;
use motorfit_motor::{Axis, Space};
use motorfit_record::Record;
use motorfit_record::warning::Warning;

/// The problem of a fit with the bounds that were automatic.
struct Motor<'a> {
    spec: &'a IdentifySpec,
    problem: &'a Problem,
}

impl Profiled for Motor<'_> {
    fn named(&self, place: usize) -> [String; 3] {
        let Axis { parameter, scope, .. } = self.problem.space().free()[place];
        [scope.name(parameter), parameter.name().to_owned(), parameter.unit().to_owned()]
    }

    fn bounds(&self, place: usize) -> [f64; 2] {
        let Axis { min, max, .. } = wider(self.spec, &self.problem.space().free()[place]);
        [min, max]
    }

    fn rest(&self, place: usize, values: &[f64]) -> Vec<f64> {
        let mut rest = values.to_vec();
        rest.remove(place);
        rest
    }

    fn search() -> Text {
        text!("Search for it with " [Method = "multistart"] ".")
    }

    fn fixed(&self, place: usize, value: f64, rest: &[f64], sigma: &[Vec<f64>]) -> Result<Refined> {
        let space = self.problem.space();
        let mut free: Vec<Axis> = space.free().iter().map(|axis| wider(self.spec, axis)).collect();
        let axis = free.remove(place);
        let mut fixed = space.fixed().to_vec();
        fixed.push((axis.parameter, axis.scope, value));
        let problem = self.problem.with_space(Space::new(free, fixed)?);
        refine_on(&problem, rest, Some(sigma))
    }
}

/// Identifies the motor and computes the profile likelihood of each free parameter. Warnings of the result say where a profile found a
/// lower sum of squares than that of the optimum, and that parameters are not identifiable.
///
/// # Errors
/// Propagates the errors of [`identify`], and returns `Usage` without a polish, which has no likelihood.
pub fn likelihood_profiles(
    records: &[Record],
    spec: &IdentifySpec,
) -> Result<(Identification, Vec<LikelihoodProfile>)> {
    check_polished(spec.is_polished())?;
    let mut found = identify(records, spec)?;
    let masked = without_undersampled(records, spec).filter(|_| !found.left_out.is_empty());
    let problem = fit_problem(masked.as_deref().unwrap_or(records), &found.space, found.model)?;
    let refined = refine_on(&problem, &found.values, None)?;
    let doubt = conditional(&found);
    let profiles = profiles(&Motor { spec, problem: &problem }, &refined, &mut found, doubt);
    Ok((found, profiles))
}

/// Returns the warning that parameters are not identifiable: the other values that they may have would widen the profiles.
fn conditional(found: &Identification) -> Option<Warning> {
    let names: Vec<String> = found.unidentified.iter().map(|(parameter, scope)| scope.name(*parameter)).collect();
    let first = names.first()?;
    let message = text!(
        (
            "the recordings do not identify {} each by itself; the profiles keep some of them fixed and therefore have no \
             intervals. Fix what is known, as ",
            names.join(", ")
        )[Fix = "{first}=…"]
    );
    Some(Warning::new("profile_conditional", message))
}
