//! Score test (C. R. Rao, 1948) of the extensions that the model lacks, evaluated at the optimum without another fit. Delays,
//! averaging sensors and saturation are not tested.

use super::bic::effective;
use super::extension_bounds::extended_space;
use super::model_selection::candidates;
use super::prepare::Prepared;
use super::refine::Fit;
use motorfit_core::setting::{Text, text};
use motorfit_core::text::significant;
use motorfit_estimate::{Score, scores, transferred};
use motorfit_motor::{Extension, Parameter};
use motorfit_record::Severity;
use motorfit_record::warning::Warning;

/// Threshold of the score statistic: χ² with one degree of freedom exceeds it with a probability of 5e-4.
const STATISTIC: f64 = 12.0;
/// Smallest shift of a parameter at which a missing effect matters \[standard errors\].
const SHIFT: f64 = 1.0;
/// Smallest shift of a parameter at which an effect that is not detected, but not excluded either, is named \[standard
/// errors\].
const UNSEEN: f64 = 10.0;

/// Effects that a model lacks.
#[derive(Default)]
pub(super) struct Lacking {
    /// Extension with the largest significant score, and the largest shift of a parameter that it causes \[standard errors\].
    shown: Option<(Extension, f64)>,
    /// Extensions that the recordings neither show nor exclude.
    hidden: Vec<Extension>,
}

/// Tests which extensions the model of a fit lacks.
pub(super) fn lacking(prepared: &Prepared<'_>, fit: &Fit) -> Lacking {
    let (records, spec) = (prepared.records, prepared.spec.as_ref());
    // The other residual tests detect a missing delay. The derivative by a saturation limit is zero while the saturation is
    // inactive.
    let is_tested = |e: &Extension| !e.is_delay_like() && *e != Extension::Saturation;
    let more: Vec<Extension> = candidates(records, &fit.space).into_iter().filter(is_tested).collect();
    let motor = fit.motor();
    let space = extended_space(records, spec, &fit.space, (&more, &motor));
    let Ok(space) = space else { return Lacking::default() };
    let problem = prepared.searched(space.clone());
    let values = transferred(&problem, (&fit.space, &fit.refined.values));
    let is_new = |p: Parameter| Extension::of(p).is_some_and(|e| more.contains(&e));
    let tested: Vec<usize> = (0..values.len()).filter(|n| is_new(space.free()[*n].parameter)).collect();
    let plain = prepared.fitted(&space);
    let all = scores(&plain, &values, &fit.refined, &tested);
    let named = |score: &Score| Extension::of(space.free()[score.axis].parameter);
    let shows = |score: &&Score| score.statistic > STATISTIC && score.shift > SHIFT;
    let mut found: Vec<Score> = all.iter().filter(shows).copied().collect();
    let mut hidden: Vec<Extension> =
        all.iter().filter(|score| score.largest_undetected_shift > UNSEEN).filter_map(named).collect();
    hidden.dedup();
    if found.is_empty() {
        return Lacking { shown: None, hidden };
    }
    // Correlated residuals have a smaller effective sample size.
    let (effective_ratio, _) = effective(&prepared.fitted(&fit.space), &fit.refined);
    found.retain(|score| score.statistic * effective_ratio > STATISTIC);
    let most = found.into_iter().max_by(|a, b| a.statistic.total_cmp(&b.statistic));
    Lacking { shown: most.and_then(|score| Some((named(&score)?, score.shift))), hidden }
}

impl Lacking {
    /// Returns the warnings for a model with the extensions `with`; `is_selected` is true if the model selection chose them.
    pub(super) fn warnings(&self, with: &[Extension], is_selected: bool) -> Vec<Warning> {
        let shown = self.shown.map(|(extension, shift)| shown((with, extension), shift, is_selected));
        shown.into_iter().chain(self.remark()).collect()
    }

    /// Returns the remark about effects that the recordings neither show nor exclude.
    fn remark(&self) -> Option<Warning> {
        let list: Vec<&str> = self.hidden.iter().map(|e| e.name()).collect();
        let message = format!(
            "the recordings do not exclude {}, which could bias the parameters by more than their standard errors",
            list.join(", ")
        );
        let remedy = Some(Text::from("Record several levels of the voltage, both ways, with pauses."));
        let remark = Warning { remedy, severity: Severity::Mention, ..Warning::new("not_excluded", message) };
        (!list.is_empty()).then_some(remark)
    }
}

/// Returns the warning about an extension that the residuals show.
fn shown((with, extension): (&[Extension], Extension), shift: f64, is_selected: bool) -> Warning {
    let name = extension.name();
    let shift = significant(shift, 2);
    let message = format!(
        "the residuals show {name}, which the model lacks: adding it shifts a parameter by {shift} standard errors"
    );
    let all: Vec<&str> = with.iter().chain([&extension]).map(|e| e.name()).collect();
    let named = text!("Use " [With = "{}", all.join(",")]);
    let remedy = Some(if is_selected { named.and(".") } else { named.and(text!(" or " [With = "auto"] ".")) });
    Warning { remedy, ..Warning::new("model_incomplete", message) }
}
