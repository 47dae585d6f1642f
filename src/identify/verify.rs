//! The verdict: what was found, against Steiglitz–McBride, the refinement and a search of the whole box.

use super::method::Method;
use super::prepare::Prepared;
use super::refine::{Fit, refine_widening};
use super::spec::IdentifySpec;
use super::start::steiglitz_mcbride;
use crate::Result;
use crate::estimate::{Estimate, Reference, ReferenceKind, Refined, global_reference, refine_on, squares_on};
use crate::evaluate::Problem;
use crate::motor::{Axis, Parameters, Space};
use crate::numeric::{count, rms};
use crate::record::Record;
use std::cell::LazyCell;

/// The verdict of a verification.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// No reference is better, and the best of them is as good.
    Agrees,
    /// The search ended in another optimum than the best reference.
    SearchStuck,
    /// No reference came as far as what was found, or too few did.
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

/// The comparison of a result with references. Costs are sums of squares weighted by the noise.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Verification {
    /// The verdict.
    pub status: Status,
    /// The kind of search of the whole box.
    pub reference: Option<ReferenceKind>,
    /// Starts that were refined for it.
    pub starts: usize,
    /// The number of them that ended in the lowest optimum.
    pub arrivals: usize,
    /// The Steiglitz–McBride estimate, where there is one.
    pub steiglitz_mcbride: Option<Parameters>,
    /// The best refinement of any start.
    pub levenberg_marquardt: Option<Parameters>,
    /// The cost above the best reference's, relative to it: of the result, or where the search is stuck of what it
    /// found.
    pub cost_gap: Option<f64>,
    /// True if the refinement of what was found is as good as the best reference.
    #[serde(skip)]
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
            starts: 0,
            arrivals: 0,
            cost_gap: None,
            refined_agrees: false,
        }
    }
}

/// The verification with what it found on the way.
pub(super) struct Verified {
    pub verification: Verification,
    /// The best of the references, where it is better than what was found.
    better: Option<Refined>,
}

/// Stage 5, verify: holds a fit against a search of the whole box and the refinement of the Steiglitz–McBride estimate.
pub(super) fn verify(prepared: &Prepared<'_>, fit: &Fit, estimate: Option<&Estimate>) -> Verified {
    judged(prepared, &Claim::of(prepared, fit, estimate))
}

/// Takes a better reference in place of a fit under `auto`: the best there is was asked for, wherever it was found.
/// Returns the verdict, and whether the fit was replaced.
///
/// # Errors
/// As a refinement.
pub(super) fn settle(
    prepared: &Prepared<'_>,
    fit: &mut Fit,
    estimate: Option<&Estimate>,
    verified: Verified,
) -> Result<(Verification, bool)> {
    let (spec, Verified { verification, better }) = (prepared.spec.as_ref(), verified);
    let Some(better) = better.filter(|_| spec.method == Method::Auto && spec.is_polished()) else {
        return Ok((verification, false));
    };
    (fit.refined, fit.space) = refine_widening(&prepared.fitted(&fit.space), spec, &fit.space, &better.values)?;
    // Its own weights may lead elsewhere again.
    let again = verify(prepared, fit, estimate);
    Ok((again.verification, true))
}

/// Returns the verdict on parameters from elsewhere (one value per free axis of the spec's space), as if a search had
/// found them.
///
/// # Errors
/// As [`super::identify_with`].
pub fn verify_at(records: &[Record], spec: &IdentifySpec, values: &[f64]) -> Result<Verification> {
    let prepared = Prepared::as_given(records, spec)?;
    let refined = refine_on(prepared.plain(), values, None)?;
    let estimate = steiglitz_mcbride(records, spec, prepared.plain())?;
    let claim = Claim {
        space: &spec.space,
        refined: &refined,
        searched: values,
        is_judged: true,
        estimate: estimate.as_ref().ok(),
    };
    Ok(judged(&prepared, &claim).verification)
}

/// Relative differences of the cost below this are rounding and the end of an iteration.
pub(super) const EQUAL: f64 = 1e-6;
/// A searched optimum is the reference's when its misfit, relative to the variation of the signals, is at most this many
/// times as large, and this much more.
const MISFIT_TIMES: f64 = 2.0;
const MISFIT_MORE: f64 = 0.02;
/// Residuals below this part of a signal are rounding: there is no noise to be weighted by.
const ROUNDING: f64 = 1e-7;

/// A fit that is verified.
pub(super) struct Claim<'a> {
    pub space: &'a Space,
    /// The refinement of what was searched.
    pub refined: &'a Refined,
    /// The values that were searched.
    pub searched: &'a [f64],
    /// True where they are more than a start for the refinement: a population's optimum, or the result itself.
    pub is_judged: bool,
    /// The Steiglitz–McBride estimate, where there is one.
    pub estimate: Option<&'a Estimate>,
}

impl<'a> Claim<'a> {
    /// Makes the claim of a fit.
    pub(super) fn of(prepared: &Prepared<'_>, fit: &'a Fit, estimate: Option<&'a Estimate>) -> Self {
        let spec = prepared.spec.as_ref();
        let is_judged = spec.method.is_search() || !spec.is_polished();
        Self { space: &fit.space, refined: &fit.refined, searched: &fit.found.values, is_judged, estimate }
    }
}

fn judged(prepared: &Prepared<'_>, claim: &Claim<'_>) -> Verified {
    let (plain, sigma) = (prepared.fitted(claim.space), sigmas(prepared.records, claim.refined));
    let references = references(&plain, &sigma, claim);
    held_against(prepared, (&plain, &sigma), claim, references.as_ref())
}

/// The best fit that is known beside a claim, and how the whole box was searched for it.
pub(super) struct References {
    /// The fit with the lowest weighted sum of squares.
    pub best: Refined,
    searched_box: Option<(ReferenceKind, usize, usize)>,
    is_conclusive: bool,
}

/// Searches the whole box of a problem for the lowest sum of squares weighted by `sigma`, and refines the Steiglitz–McBride
/// estimate of a claim; `None` where neither leads to a fit.
pub(super) fn references(plain: &Problem, sigma: &[[f64; 2]], claim: &Claim<'_>) -> Option<References> {
    let Claim { space, refined, searched, estimate, .. } = *claim;
    let inside = |axis: &Axis| Some(estimate?.parameters.get(axis.parameter).clamp(axis.min, axis.max));
    let start: Option<Vec<f64>> = space.free().iter().map(inside).collect();
    let from_sm = || match &start {
        // What was found is the refinement of this estimate.
        Some(start) if start == searched => Some(refined.clone()),
        Some(start) => refine_on(plain, start, Some(sigma)).ok(),
        None => None,
    };
    let own = refined.weighted(sigma);
    let (reference, from_sm) = rayon::join(|| global_reference(plain, sigma, Some(own)).ok(), from_sm);
    let searched_box = reference.as_ref().map(|of: &Reference| (of.kind, of.starts, of.arrivals));
    let is_conclusive = reference.as_ref().is_some_and(Reference::is_conclusive);
    let fits = reference.map(|reference| reference.refined).into_iter().chain(from_sm);
    let best = fits.min_by(|a, b| a.weighted(sigma).total_cmp(&b.weighted(sigma)))?;
    Some(References { best, searched_box, is_conclusive })
}

/// Returns the verdict on a claim, held against references under the weights `sigma` of the claim's refinement.
pub(super) fn held_against(
    prepared: &Prepared<'_>,
    (plain, sigma): (&Problem, &[[f64; 2]]),
    claim: &Claim<'_>,
    references: Option<&References>,
) -> Verified {
    let Claim { refined, searched, is_judged, estimate, .. } = *claim;
    let Some(References { best, searched_box, is_conclusive }) = references else {
        let verification = Verification { steiglitz_mcbride: estimate.map(|e| e.parameters), ..Verification::none() };
        return Verified { verification, better: None };
    };
    let (own, lowest) = (refined.weighted(sigma), best.weighted(sigma));
    let relative = |cost: f64| (cost - lowest) / lowest.max(1.0);
    let start = LazyCell::new(|| {
        // What cannot be simulated is as far off as can be.
        squares_on(plain, searched).unwrap_or_else(|_| vec![[f64::INFINITY; 2]; plain.signals().len()])
    });
    let deviations = prepared.deviations();
    let misfit = |squares: &[[f64; 2]]| weighted(squares, deviations).sqrt();
    let count = misfit_of_nothing(prepared.records);
    let is_far = || misfit(&start) > MISFIT_TIMES * misfit(&best.squares) + MISFIT_MORE * count;
    let status = match relative(own) {
        gap if gap > EQUAL || (is_judged && is_far()) => Status::SearchStuck,
        gap if gap < -EQUAL || !is_conclusive => Status::ReferenceFailed,
        _ => Status::Agrees,
    };
    let of_search = !prepared.spec.is_polished() || status == Status::SearchStuck;
    let verification = Verification {
        status,
        steiglitz_mcbride: estimate.map(|e| e.parameters),
        levenberg_marquardt: Some(if status == Status::ReferenceFailed { refined.parameters } else { best.parameters }),
        reference: searched_box.map(|(kind, ..)| kind),
        starts: searched_box.map_or(0, |(_, starts, _)| starts),
        arrivals: searched_box.map_or(0, |(.., arrivals)| arrivals),
        cost_gap: Some(if of_search { relative(weighted(&start, sigma)) } else { relative(own) }),
        refined_agrees: relative(own) <= EQUAL,
    };
    Verified { verification, better: (relative(own) > EQUAL).then(|| best.clone()) }
}

/// Sums of squares in units of `sigma`.
fn weighted(squares: &[[f64; 2]], sigma: &[[f64; 2]]) -> f64 {
    squares.iter().flatten().zip(sigma.iter().flatten()).map(|(square, sigma)| square / (sigma * sigma)).sum()
}

/// The weights of the refinement of each recording, no less than rounding.
pub(super) fn sigmas(records: &[Record], refined: &Refined) -> Vec<[f64; 2]> {
    let of = |(record, sigma): (&Record, &[f64; 2])| {
        [0, 1].map(|channel| {
            let smallest = record.measured()[channel].map_or(0.0, |signal| ROUNDING * rms(signal));
            sigma[channel].max(smallest).max(f64::MIN_POSITIVE.sqrt())
        })
    };
    records.iter().zip(&refined.weights).map(of).collect()
}

/// The misfit whose residuals are as large as the signals vary.
fn misfit_of_nothing(records: &[Record]) -> f64 {
    let values: usize = records.iter().map(|r| r.len() * r.measured().iter().flatten().count()).sum();
    count(values).sqrt()
}
