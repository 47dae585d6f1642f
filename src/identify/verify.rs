//! The verdict: what was found, against Steiglitz–McBride, the refinement and a search of the whole box.

use crate::criterion::rms;
use crate::estimate::{
    Estimate, Reference, ReferenceKind, RefineOptions, Refined, global_reference, refine, weighted_squares,
};
use crate::evaluate::Model;
use crate::motor::{Parameters, Space};
use crate::record::Record;

/// The verdict of a verification.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// No reference is better, and the best of them is as good.
    Agrees,
    /// The search ended in another optimum than the best reference.
    SearchStuck,
    /// No reference came as far as what was found.
    ReferenceFailed,
    /// There is no reference for this.
    NotApplicable,
}

impl Status {
    /// Its name in results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Agrees => "agrees",
            Self::SearchStuck => "search_stuck",
            Self::ReferenceFailed => "reference_failed",
            Self::NotApplicable => "not_applicable",
        }
    }
}

/// What was found, against the references. Costs are sums of squares weighted by the noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Verification {
    /// The verdict.
    pub status: Status,
    /// What Steiglitz–McBride gives, where it serves.
    pub steiglitz_mcbride: Option<Parameters>,
    /// The best refinement of any start.
    pub levenberg_marquardt: Option<Parameters>,
    /// How the whole box was searched.
    pub reference: Option<ReferenceKind>,
    /// The cost above the best reference's, relative to it: of the result, or where the search is stuck of what it
    /// found.
    pub cost_gap: Option<f64>,
    /// Whether the refinement of what was found is as good as the best reference.
    pub refined_agrees: bool,
}

impl Verification {
    /// None yet.
    pub(super) fn none() -> Self {
        Self {
            status: Status::NotApplicable,
            steiglitz_mcbride: None,
            levenberg_marquardt: None,
            reference: None,
            cost_gap: None,
            refined_agrees: false,
        }
    }
}

/// The verification with what it found on the way.
pub(super) struct Verified {
    pub verification: Verification,
    /// The best of the references, where it is better than what was found.
    pub better: Option<Refined>,
}

/// Relative differences of the cost below this are rounding and the end of an iteration.
const EQUAL: f64 = 1e-6;
/// A search that is off by more than this factor in a parameter, and by more than this part of the cost, ended in
/// another optimum, wherever a refinement then leads.
const FAR: f64 = 5.0;
const WORSE: f64 = 0.1;
/// Residuals below this part of a signal are rounding: there is no noise to be weighted by.
const ROUNDING: f64 = 1e-7;

/// What is verified.
pub(super) struct Claim<'a> {
    pub records: &'a [Record],
    pub space: &'a Space,
    pub model: Model,
    /// The refinement of what was searched.
    pub refined: &'a Refined,
    /// What was searched.
    pub searched: &'a [f64],
    /// Whether it is reported as it is, and not its refinement.
    pub unpolished: bool,
    /// Whether it is more than a start for the refinement: a population's optimum, or the result itself.
    pub is_judged: bool,
    pub estimate: Option<&'a Estimate>,
}

pub(super) fn verify(claim: &Claim<'_>) -> Verified {
    let Claim { records, space, model, refined, searched, unpolished, is_judged, estimate } = *claim;
    let sigma = sigma(records, refined);
    let options = RefineOptions { model, sigma: Some(sigma) };
    let own = refined.weighted(sigma);
    let reference = global_reference(records, space, model, sigma).ok();
    let from_sm = estimate.and_then(|estimate| {
        let start: Vec<f64> =
            space.free().iter().map(|axis| estimate.parameters.get(axis.parameter).clamp(axis.min, axis.max)).collect();
        refine(records, space, &start, &options).ok()
    });
    let kind = reference.as_ref().map(|reference: &Reference| reference.kind);
    let fits = reference.map(|reference| reference.refined).into_iter().chain(from_sm);
    let best = fits.min_by(|a, b| a.weighted(sigma).total_cmp(&b.weighted(sigma)));
    let Some(best) = best else {
        let verification = Verification { steiglitz_mcbride: estimate.map(|e| e.parameters), ..Verification::none() };
        return Verified { verification, better: None };
    };
    let lowest = best.weighted(sigma);
    let relative = |cost: f64| (cost - lowest) / lowest.max(1.0);
    let start = weighted_squares(records, space, searched, &options).map_or(f64::INFINITY, relative);
    let is_far = searched.iter().zip(&best.values).any(|(a, b)| (a / b).ln().abs() > FAR.ln());
    let status = match relative(own) {
        gap if gap > EQUAL || (is_judged && is_far && start > WORSE) => Status::SearchStuck,
        gap if gap < -EQUAL => Status::ReferenceFailed,
        _ => Status::Agrees,
    };
    let of_search = unpolished || status == Status::SearchStuck;
    let verification = Verification {
        status,
        steiglitz_mcbride: estimate.map(|e| e.parameters),
        levenberg_marquardt: Some(if status == Status::ReferenceFailed { refined.parameters } else { best.parameters }),
        reference: kind,
        cost_gap: Some(if of_search { start } else { relative(own) }),
        refined_agrees: relative(own) <= EQUAL,
    };
    Verified { verification, better: (relative(own) > EQUAL).then_some(best) }
}

/// σ of the residuals, no less than rounding.
fn sigma(records: &[Record], refined: &Refined) -> [f64; 2] {
    [0, 1].map(|channel| {
        let signals = records.iter().filter_map(|r| r.measured()[channel]);
        let smallest = ROUNDING * signals.map(rms).fold(0.0, f64::max);
        refined.sigma[channel].unwrap_or(1.0).max(smallest).max(f64::MIN_POSITIVE.sqrt())
    })
}
