//! Effects that the residuals of a fit show and its model lacks: the score test of every extension, at the optimum.

use super::bic::effective;
use super::extension_bounds::extended_space;
use super::model_selection::candidates;
use super::prepare::Prepared;
use super::refine::Fit;
use crate::estimate::{Score, carried, scores};
use crate::motor::{Extension, Parameter};
use crate::record::Severity;
use crate::setting::{Text, text};
use crate::text::significant;
use crate::warning::Warning;

/// A score above this shows an effect: χ² with one degree of freedom exceeds it five times in ten thousand.
const STATISTIC: f64 = 12.0;
/// Effects that move each parameter by less than this are of no consequence \[standard errors\].
const SHIFT: f64 = 1.0;
/// Effects that may be there without being seen are named when they could move a parameter by more than this \[standard errors\].
const UNSEEN: f64 = 10.0;

/// Effects that a model lacks.
#[derive(Default)]
pub(super) struct Lacking {
    /// The one that the residuals show most, and by how many standard errors a parameter moves with it.
    shown: Option<(Extension, f64)>,
    /// Those that they do not show, and that may be there all the same.
    hidden: Vec<Extension>,
}

/// Tests which effects a fit lacks.
pub(super) fn lacking(prepared: &Prepared<'_>, fit: &Fit) -> Lacking {
    let (records, spec) = (prepared.records, prepared.spec.as_ref());
    // A delay leaves residuals that the other tests notice, and a limit of the drive has no derivative where it changes nothing.
    let is_tested = |e: &Extension| !e.is_late() && *e != Extension::Saturation;
    let more: Vec<Extension> = candidates(records, &fit.space).into_iter().filter(is_tested).collect();
    let motor = Parameter::ALL.map(|p| fit.refined.parameters.get(p));
    let space = extended_space(records, spec, &fit.space, (&more, &motor));
    let Ok(space) = space else { return Lacking::default() };
    let problem = prepared.searched(space.clone());
    let values = carried(&problem, (&fit.space, &fit.refined.values));
    let is_new = |p: Parameter| Extension::of(p).is_some_and(|e| more.contains(&e));
    let tested: Vec<usize> = (0..values.len()).filter(|n| is_new(space.free()[*n].parameter)).collect();
    let plain = prepared.fitted(&space);
    let all = scores(&plain, &values, &fit.refined, &tested);
    let named = |score: &Score| Extension::of(space.free()[score.axis].parameter);
    let shows = |score: &&Score| score.statistic > STATISTIC && score.shift > SHIFT;
    let mut found: Vec<Score> = all.iter().filter(shows).copied().collect();
    let mut hidden: Vec<Extension> = all.iter().filter(|score| score.unseen > UNSEEN).filter_map(named).collect();
    hidden.dedup();
    if found.is_empty() {
        return Lacking { shown: None, hidden };
    }
    // Correlated residuals count for less.
    let (independent, _) = effective(&prepared.fitted(&fit.space), &fit.refined);
    found.retain(|score| score.statistic * independent > STATISTIC);
    let most = found.into_iter().max_by(|a, b| a.statistic.total_cmp(&b.statistic));
    Lacking { shown: most.and_then(|score| Some((named(&score)?, score.shift))), hidden }
}

impl Lacking {
    /// Returns the effect that the residuals show.
    pub(super) fn extension(&self) -> Option<Extension> {
        self.shown.map(|(extension, _)| extension)
    }

    /// Returns it as warnings about a fit with some extensions, which `auto` has selected where that `is_selected`.
    pub(super) fn warnings(&self, with: &[Extension], is_selected: bool) -> Vec<Warning> {
        let shown = self.shown.map(|(extension, shift)| shown((with, extension), shift, is_selected));
        shown.into_iter().chain(self.remark()).collect()
    }

    /// Returns the remark about effects that the recordings do not show and do not exclude.
    fn remark(&self) -> Option<Warning> {
        let list: Vec<&str> = self.hidden.iter().map(|e| e.name()).collect();
        let message = format!(
            "the recordings do not exclude {}, which would change the parameters by more than their errors",
            list.join(", ")
        );
        let remedy = Some(Text::from("Record several levels of the voltage, both ways, with pauses."));
        let remark = Warning { remedy, severity: Severity::Mention, ..Warning::new("not_excluded", message) };
        (!list.is_empty()).then_some(remark)
    }
}

/// Returns the warning about an effect that residuals show.
fn shown((with, extension): (&[Extension], Extension), shift: f64, is_selected: bool) -> Warning {
    let name = extension.name();
    let shift = significant(shift, 2);
    let message = format!(
        "the residuals show {name}, which the model lacks: with it a parameter moves by {shift} standard errors"
    );
    let all: Vec<&str> = with.iter().chain([&extension]).map(|e| e.name()).collect();
    let named = text!("Use " [With = "{}", all.join(",")]);
    let remedy = Some(if is_selected { named.and(".") } else { named.and(text!(" or " [With = "auto"] ".")) });
    Warning { remedy, ..Warning::new("model_incomplete", message) }
}
