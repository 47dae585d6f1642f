//! Verification of a fit: comparison with the refined Steiglitz–McBride estimate and with a global search.

use super::method::Method;
use super::prepare::Prepared;
use super::refine::{Fit, refine_widening};
use super::spec::IdentifySpec;
use super::start::steiglitz_mcbride;
use motorfit_core::Result;
use motorfit_core::numeric::{count, rms};
use motorfit_estimate::{Estimate, Reference, ReferenceKind, Refined, reference_beside, refine_on, residual_squares};
use motorfit_evaluate::Problem;
use motorfit_motor::{Axis, Parameters, Space};
use motorfit_record::Record;
use std::cell::LazyCell;

/// The verdict of a verification.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// No reference is better than the fit, and the best one is equally good.
    Agrees,
    /// The search ended in another optimum than the best reference.
    SearchStuck,
    /// No reference is as good as the fit, or the search of the box is inconclusive.
    ReferenceFailed,
    /// No reference exists.
    NotApplicable,
}

impl Status {
    /// Returns the name of the verdict in results.
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

/// The comparison of a result with references. Costs are sums of squares in units of the noise variances.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Verification {
    /// Verdict of the comparison.
    pub status: Status,
    /// Kind of the global search.
    pub reference: Option<ReferenceKind>,
    /// Number of starts of this search; of basins for variable projection, refined or not.
    pub starts: usize,
    /// Number of these starts that ended in the lowest optimum.
    pub arrivals: usize,
    /// Steiglitz–McBride estimate, if there is one.
    pub steiglitz_mcbride: Option<Parameters>,
    /// Best parameters after refinement.
    pub levenberg_marquardt: Option<Parameters>,
    /// Difference of the cost to that of the best reference, relative to the latter or to 1 if that is larger. The cost is that
    /// of the result; without a refinement, and if the search is stuck, that of the search.
    pub cost_gap: Option<f64>,
    /// True if the refined fit is as good as the best reference.
    #[serde(skip)]
    pub refined_agrees: bool,
}

impl Verification {
    /// Returns a verification without a reference.
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

/// A verification with the reference that is better than the fit.
pub(super) struct Verified {
    pub verification: Verification,
    /// Best reference; `None` if it is not better than the fit.
    better: Option<Refined>,
}

/// Stage 5, verify: compares a fit with a global search and with the refined Steiglitz–McBride estimate.
pub(super) fn verify(prepared: &Prepared<'_>, fit: &Fit, estimate: Option<&Estimate>) -> Verified {
    verified(prepared, &Claim::of(prepared, fit, estimate))
}

/// Largest number of better references that replace a fit one after the other.
const REPLACED_MAX: usize = 5;

/// Replaces a fit by a better reference if the method is [`Method::Auto`], until none is better, and verifies it again each time. Returns
/// the verification, and true if the fit was replaced.
///
/// # Errors
/// Propagates the errors of the refinement.
pub(super) fn settle(
    prepared: &Prepared<'_>,
    fit: &mut Fit,
    estimate: Option<&Estimate>,
    mut verified: Verified,
) -> Result<(Verification, bool)> {
    let spec = prepared.spec.as_ref();
    let is_open = spec.method == Method::Auto && spec.is_polished();
    for replaced in 0..REPLACED_MAX {
        let Some(better) = verified.better.take().filter(|_| is_open) else {
            return Ok((verified.verification, replaced > 0));
        };
        (fit.refined, fit.space) = refine_widening(&prepared.fitted(&fit.space), spec, &fit.space, &better.values)?;
        // Under the weights of the new fit another optimum may be lowest.
        verified = verify(prepared, fit, estimate);
    }
    Ok((verified.verification, true))
}

/// Verifies given parameters, one value per free axis of the spec's space, as if a search had found them.
///
/// # Errors
/// Propagates the errors of [`Problem::new`], [`refine_on`] and the Steiglitz–McBride estimate.
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
    Ok(verified(&prepared, &claim).verification)
}

/// Largest relative difference of two costs that count as equal, above rounding and the tolerance of the refinement.
pub(super) const EQUAL: f64 = 1e-6;
/// Decrease of the sum of squares, in units of the noise variances, below which an optimum is no better: a hundredth of that which one more
/// parameter makes by chance.
const RESOLUTION: f64 = 0.01;
/// Largest ratio of the misfit of a searched optimum to that of the reference at which both are the same optimum. The misfit is
/// the root of the sum of squares in units of the variances of the signals.
const MISFIT_TIMES: f64 = 2.0;
/// Additional misfit of a searched optimum that is allowed, as a fraction of the misfit of the signals' means.
const MISFIT_MORE: f64 = 0.02;
/// Smallest standard deviation of residuals, relative to the root mean square of the signal; smaller residuals are rounding.
const ROUNDING: f64 = 1e-7;

/// A fit that is to be verified.
pub(super) struct Claim<'a> {
    pub space: &'a Space,
    /// Refinement of the first optimum.
    pub refined: &'a Refined,
    /// Values of the first optimum.
    pub searched: &'a [f64],
    /// True if the first optimum is verified itself, as the optimum of a population search or the result without a refinement,
    /// rather than being only the start of the refinement.
    pub is_judged: bool,
    /// Steiglitz–McBride estimate, if there is one.
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

fn verified(prepared: &Prepared<'_>, claim: &Claim<'_>) -> Verified {
    let (plain, sigma) = (prepared.fitted(claim.space), sigmas(prepared.records, claim.refined));
    let references = references(&plain, &sigma, claim);
    compared(prepared, (&plain, &sigma), claim, references.as_ref())
}

/// The best reference fit, and the global search that produced it.
pub(super) struct References {
    /// Fit with the lowest weighted sum of squares.
    pub best: Refined,
    /// Kind of the search of the box, with its numbers of starts and of arrivals.
    searched_box: Option<(ReferenceKind, usize, usize)>,
    is_conclusive: bool,
}

/// Searches the complete box of a problem for the lowest sum of squares weighted by `sigma`, and refines the Steiglitz–McBride
/// estimate of a claim; `None` if both fail.
pub(super) fn references(plain: &Problem, sigma: &[Vec<f64>], claim: &Claim<'_>) -> Option<References> {
    let Claim { space, refined, searched, estimate, .. } = *claim;
    let inside = |axis: &Axis| Some(estimate?.parameters.get(axis.parameter).clamp(axis.min, axis.max));
    let start: Option<Vec<f64>> = space.free().iter().map(inside).collect();
    let from_sm = || match &start {
        // The fit is the refinement of this estimate already.
        Some(start) if start == searched => Some(refined.clone()),
        Some(start) => refine_on(plain, start, Some(sigma)).ok(),
        None => None,
    };
    let (reference, from_sm) = rayon::join(|| reference_beside(plain, sigma, refined).ok(), from_sm);
    let searched_box = reference.as_ref().map(|of: &Reference| (of.kind, of.starts, of.arrivals));
    let is_conclusive = reference.as_ref().is_some_and(Reference::is_conclusive);
    let fits = reference.map(|reference| reference.refined).into_iter().chain(from_sm);
    let best = fits.min_by(|a, b| a.weighted(sigma).total_cmp(&b.weighted(sigma)))?;
    Some(References { best, searched_box, is_conclusive })
}

/// Compares a claim with references under the weights `sigma` of the claim's refinement.
pub(super) fn compared(
    prepared: &Prepared<'_>,
    (plain, sigma): (&Problem, &[Vec<f64>]),
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
        // Values that cannot be simulated have an infinite misfit.
        residual_squares(plain, searched).unwrap_or_else(|_| vec![vec![f64::INFINITY; 2]; plain.signals().len()])
    });
    let deviations = prepared.deviations();
    let misfit = |squares: &[Vec<f64>]| weighted(squares, deviations).sqrt();
    let count = misfit_of_mean(prepared.records);
    let is_far = || misfit(&start) > MISFIT_TIMES * misfit(&best.squares) + MISFIT_MORE * count;
    let is_lower = relative(own) > EQUAL && own - lowest > RESOLUTION;
    let status = match relative(own) {
        _ if is_lower || (is_judged && is_far()) => Status::SearchStuck,
        gap if gap < -EQUAL || !is_conclusive => Status::ReferenceFailed,
        _ => Status::Agrees,
    };
    let is_own = status == Status::ReferenceFailed;
    let of_search = !prepared.spec.is_polished() || status == Status::SearchStuck;
    let verification = Verification {
        status,
        steiglitz_mcbride: estimate.map(|e| e.parameters),
        levenberg_marquardt: Some(plain.parameters(if is_own { &refined.values } else { &best.values }, 0)),
        reference: searched_box.map(|(kind, ..)| kind),
        starts: searched_box.map_or(0, |(_, starts, _)| starts),
        arrivals: searched_box.map_or(0, |(.., arrivals)| arrivals),
        cost_gap: Some(if of_search { relative(weighted(&start, sigma)) } else { relative(own) }),
        refined_agrees: !is_lower,
    };
    Verified { verification, better: is_lower.then(|| best.clone()) }
}

/// Returns the total of the sums of squares in units of `sigma²`.
fn weighted(squares: &[Vec<f64>], sigma: &[Vec<f64>]) -> f64 {
    squares.iter().flatten().zip(sigma.iter().flatten()).map(|(square, sigma)| square / (sigma * sigma)).sum()
}

/// Returns the standard deviations by which the refinement weighted each recording, limited from below by rounding.
pub(super) fn sigmas(records: &[Record], refined: &Refined) -> Vec<Vec<f64>> {
    let of = |(record, sigma): (&Record, &Vec<f64>)| {
        [0, 1]
            .map(|channel| {
                let smallest = record.measured()[channel].map_or(0.0, |signal| ROUNDING * rms(signal));
                sigma[channel].max(smallest).max(f64::MIN_POSITIVE.sqrt())
            })
            .to_vec()
    };
    records.iter().zip(&refined.weights).map(of).collect()
}

/// Returns the misfit of residuals that are as large as the variation of the signals.
fn misfit_of_mean(records: &[Record]) -> f64 {
    let values: usize = records.iter().map(|r| r.len() * r.measured().iter().flatten().count()).sum();
    count(values).sqrt()
}
