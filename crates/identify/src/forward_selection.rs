//! Forward selection among nested models by BIC: starting from the smallest one, each step adds the term with the best fit among those
//! that BIC prefers, and removes others that it makes superfluous, until none is preferred (`bic.rs`). Then each term is exchanged for
//! those with similar effects while this decreases the BIC.

use super::bic::{self, additional, gain, is_preferred};
use motorfit_core::Result;
use motorfit_estimate::Refined;
use rayon::prelude::*;

/// A fit of a model of a family.
pub(crate) type FitOf<F> = bic::Fit<<F as Family>::Term, <F as Family>::Space>;

/// Nested models with optional terms that can be fitted to recordings.
pub(crate) trait Family: Sync {
    /// An optional term.
    type Term: Clone + PartialEq + Send + Sync;
    /// Data that the family keeps of a model beside its terms and its fit.
    type Space: Clone + Send + Sync;

    /// Fits the model without optional terms until convergence.
    fn smallest(&self) -> Result<FitOf<Self>>;
    /// Returns the number of stages of the selection; the terms of a later stage are tried when none of the earlier ones is preferred.
    fn stages(&self) -> usize {
        1
    }
    /// Returns the terms of a stage that a model lacks and that the recordings can show.
    fn candidates(&self, of: &FitOf<Self>, stage: usize) -> Vec<Self::Term>;
    /// Returns true if two terms have similar effects, so that one may have been selected in place of the other.
    fn resembles(&self, a: &Self::Term, b: &Self::Term) -> bool;
    /// Fits a model in a few iterations under the weights of another one, starting from its optimum.
    fn rough(&self, from: &FitOf<Self>, with: &[Self::Term]) -> Result<FitOf<Self>>;
    /// Refines a rough fit until convergence.
    fn finished(&self, rough: FitOf<Self>) -> FitOf<Self>;
    /// Fits a model with fewer terms until convergence, starting from the optimum of `of`.
    fn reduced(&self, of: &FitOf<Self>, with: &[Self::Term]) -> Result<FitOf<Self>>;
    /// Searches the complete box for a lower optimum; `None` if there is none.
    fn lower(&self, own: &FitOf<Self>) -> Result<Option<FitOf<Self>>>;
    /// Returns the larger models after rough fits, the best first, and true if these are fits to all recordings.
    fn ranked(&self, best: &FitOf<Self>, larger: &[Vec<Self::Term>]) -> Result<(Vec<FitOf<Self>>, bool)> {
        // Models whose fit fails are left out.
        let mut fits: Vec<_> = larger.par_iter().filter_map(|with| self.rough(best, with).ok()).collect();
        fits.sort_by(|a, b| ranking_cost(best, a).total_cmp(&ranking_cost(best, b)));
        Ok((fits, true))
    }
    /// Returns the name of a term.
    fn named(&self, term: &Self::Term) -> String;
    /// Returns the fit of each output \[%\].
    fn fit_percent(&self, refined: &Refined) -> Vec<Option<f64>>;
    /// Returns the free parameters of a model with their estimates.
    fn parameters(&self, fit: &FitOf<Self>) -> Vec<(String, f64)>;
    /// Records a fitted model with its BIC minus that of its predecessor.
    fn step(&self, fit: &FitOf<Self>, gain: Option<f64>, taken: bool) -> SelectionStep {
        let with = fit.with.iter().map(|term| self.named(term)).collect();
        SelectionStep { with, free: fit.free, fit_percent: self.fit_percent(&fit.refined), gain, taken }
    }
    /// Records a model that cannot be distinguished from the selected one.
    fn alternative(&self, fit: &FitOf<Self>, gain: f64) -> Alternative {
        let with = fit.with.iter().map(|term| self.named(term)).collect();
        let (fit_percent, parameters) = (self.fit_percent(&fit.refined), self.parameters(fit));
        Alternative { with, fit_percent, gain, parameters }
    }
}

/// A model that the selection fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct SelectionStep {
    /// Extensions, or optional terms, of the model.
    pub with: Vec<String>,
    /// Number of free parameters.
    pub free: usize,
    /// Fit `100 (1 − ‖y − ŷ‖/‖y − mean y‖)` of each output \[%\]; `None` for one that was not measured.
    pub fit_percent: Vec<Option<f64>>,
    /// BIC (Schwarz, 1978) minus the BIC of its predecessor in the selection: negative if this model is better. `None` for the
    /// smallest model.
    pub gain: Option<f64>,
    /// True if the selection continued with this model.
    pub taken: bool,
}

/// Another model whose BIC cannot be distinguished from that of the selected model.
#[derive(Debug, Clone, PartialEq)]
pub struct Alternative {
    /// Extensions, or optional terms, of the model.
    pub with: Vec<String>,
    /// Fit of each output \[%\], as in [`SelectionStep::fit_percent`].
    pub fit_percent: Vec<Option<f64>>,
    /// BIC minus the BIC of the selected model.
    pub gain: f64,
    /// Free parameters with their estimates.
    pub parameters: Vec<(String, f64)>,
}

/// The model of a forward selection.
pub(crate) struct Selected<F: Family + ?Sized> {
    pub best: FitOf<F>,
    /// Models that were fitted, in their order.
    pub steps: Vec<SelectionStep>,
    /// Models that fit the recordings equally well.
    pub alternatives: Vec<Alternative>,
}

/// Largest number of terms of a model.
const TERMS_MAX: usize = 6;
/// Number of models of a step that are refined until convergence.
pub(crate) const FINALISTS: usize = 3;
/// Difference of BIC below which models are indistinguishable: odds of e³ = 20 to 1.
pub(crate) const INDISTINGUISHABLE: f64 = 6.0;
/// Difference of BIC above which a rough fit is not refined further; convergence would change it by some hundredths only.
const FAR_WORSE: f64 = 3.0 * INDISTINGUISHABLE;
/// Decrease of BIC, above rounding, from which a model is exchanged for another of the same size.
const EXCHANGE: f64 = 0.1;

/// Selects the model of a family.
///
/// # Errors
/// Propagates the errors of the fits.
pub(crate) fn select_forward<F: Family>(family: &F) -> Result<Selected<F>> {
    let mut steps = Vec::new();
    let best = forward(family, &mut steps)?;
    let (best, alternatives) = exchanged(family, best, &mut steps);
    Ok(Selected { best, steps, alternatives })
}

/// Adds terms to the smallest model, and removes superfluous ones, until none is preferred.
fn forward<F: Family>(family: &F, steps: &mut Vec<SelectionStep>) -> Result<FitOf<F>> {
    let mut best = family.smallest()?;
    best = family.lower(&best)?.unwrap_or(best);
    steps.push(family.step(&best, None, true));
    let mut stage = 0;
    while best.with.len() < TERMS_MAX {
        let add = |term: F::Term| best.with.iter().cloned().chain([term]).collect::<Vec<_>>();
        let larger: Vec<Vec<F::Term>> = family.candidates(&best, stage).into_iter().map(add).collect();
        let (mut tried, is_on_all) = family.ranked(&best, &larger)?;
        let mut others = tried.split_off(tried.len().min(FINALISTS));
        tried.extend(likeliest(&mut others));
        let mut fits: Vec<FitOf<F>> = tried.into_par_iter().map(|fit| finished(family, &best, fit)).collect();
        fits.sort_by(|a, b| ranking_cost(&best, a).total_cmp(&ranking_cost(&best, b)));
        let taken = fits.iter().position(|fit| is_preferred(&best, fit));
        for (n, fit) in fits.iter().enumerate() {
            steps.push(family.step(fit, Some(gain(&best, fit)), taken == Some(n)));
        }
        if is_on_all {
            steps.extend(others.iter().map(|fit| family.step(fit, Some(gain(&best, fit)), false)));
        }
        match taken {
            // Beside a term of a later stage, one of an earlier stage may be preferred.
            Some(n) => (best, stage) = (pruned(family, fits.swap_remove(n))?, 0),
            // A lower optimum of the same model may allow further steps.
            None if stage + 1 < family.stages() => stage += 1,
            None => match family.lower(&best)?.filter(|lower| gain(&best, lower) < -EXCHANGE) {
                Some(lower) => best = lower,
                None => break,
            },
        }
    }
    Ok(best)
}

/// Refines a rough fit until convergence if it may become as good as the best.
fn finished<F: Family>(family: &F, best: &FitOf<F>, rough: FitOf<F>) -> FitOf<F> {
    if gain(best, &rough) > FAR_WORSE { rough } else { family.finished(rough) }
}

/// Removes terms that the last one has made superfluous.
fn pruned<F: Family>(family: &F, fit: FitOf<F>) -> Result<FitOf<F>> {
    let mut best = fit;
    for term in best.with.clone() {
        if best.with.last() == Some(&term) {
            continue;
        }
        let with: Vec<F::Term> = best.with.iter().filter(|of| **of != term).cloned().collect();
        let less = family.reduced(&best, &with)?;
        if !is_preferred(&less, &best) {
            best = less;
        }
    }
    Ok(best)
}

/// Exchanges each term for those with similar effects while this decreases the BIC. Returns the best model and the indistinguishable
/// alternatives.
fn exchanged<F: Family>(
    family: &F,
    mut best: FitOf<F>,
    steps: &mut Vec<SelectionStep>,
) -> (FitOf<F>, Vec<Alternative>) {
    for _ in 0..TERMS_MAX {
        let possible: Vec<F::Term> = (0..family.stages()).flat_map(|stage| family.candidates(&best, stage)).collect();
        let pairs = best.with.iter().flat_map(|old| possible.iter().map(move |new| (old, new)));
        let replaced = |(old, new): (&F::Term, &F::Term)| {
            best.with.iter().map(|term| if term == old { new.clone() } else { term.clone() }).collect()
        };
        let models: Vec<Vec<F::Term>> = pairs.filter(|(old, new)| family.resembles(old, new)).map(replaced).collect();
        let tried = models.par_iter().filter_map(|with| family.rough(&best, with).ok());
        let tried: Vec<FitOf<F>> = tried.map(|fit| finished(family, &best, fit)).collect();
        let gains: Vec<f64> = tried.iter().map(|fit| gain(&best, fit)).collect();
        let lowest = (0..tried.len()).min_by(|a, b| gains[*a].total_cmp(&gains[*b]));
        let taken = lowest.filter(|n| gains[*n] < -EXCHANGE);
        for (n, fit) in tried.iter().enumerate() {
            steps.push(family.step(fit, Some(gains[n]), taken == Some(n)));
        }
        let Some(n) = taken else {
            let alike = tried.iter().zip(&gains).filter(|(_, gain)| **gain < INDISTINGUISHABLE);
            let alternatives = alike.map(|(fit, gain)| family.alternative(fit, *gain)).collect();
            return (best, alternatives);
        };
        best = tried.into_iter().nth(n).unwrap_or(best);
    }
    (best, Vec::new())
}

/// Removes and returns the model with the lowest deviance of the innovations.
fn likeliest<T, S>(fits: &mut Vec<bic::Fit<T, S>>) -> Option<bic::Fit<T, S>> {
    let lowest = (0..fits.len()).min_by(|a, b| fits[*a].deviance.total_cmp(&fits[*b].deviance))?;
    Some(fits.remove(lowest))
}

/// Returns the cost that ranks models with the same predecessor: the sum of squares under the weights of the predecessor, times
/// the penalty of BIC for the additional parameters.
pub(crate) fn ranking_cost<T, S>(from: &bic::Fit<T, S>, to: &bic::Fit<T, S>) -> f64 {
    let samples = (from.effective * from.count).max(std::f64::consts::E);
    to.refined.weighted(&from.refined.weights) * (1.0 + additional(from, to) * samples.ln() / samples)
}
