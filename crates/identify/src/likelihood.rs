//! Profile likelihoods of identified parameters: one parameter is fixed at successive values and all others are refined (D. M. Bates,
//! D. G. Watts, Nonlinear Regression Analysis and Its Applications, 1988, ch. 6).
//!
//! The likelihood ratio of a point is the increase of the weighted sum of squares. For correlated residuals it is divided by the ratio
//! of the variances of the estimate for correlated and for white residuals (L. Pace, A. Salvan, N. Sartori, Statistica Sinica 21, 2011),
//! so that its curvature at the optimum is that of the standard error.

use super::profile::LIMIT;
use super::result::Identification;
use motorfit_core::setting::{Text, text};
use motorfit_core::{Error, Result};
use motorfit_estimate::Refined;
use motorfit_record::warning::Warning;
use rayon::prelude::*;

/// Distance between points \[standard errors\].
const STEP: f64 = 0.5;
/// Part of a value that stands in for an unknown standard error.
const PART: f64 = 0.05;
/// Likelihood ratio up to which a side is followed.
const REACH: f64 = 2.5 * LIMIT;
/// Points after which the distance between them doubles, and largest number of points of a side.
const POINTS: [usize; 2] = [8, 40];
/// Decrease of the likelihood ratio below that of the optimum from which on a point is a better optimum.
const BETTER: f64 = 1e-3;

/// A point of a profile.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct LikelihoodPoint {
    /// Value of the parameter, in its unit.
    pub value: f64,
    /// Likelihood ratio to the optimum: χ² with one degree of freedom for the true value.
    pub ratio: f64,
}

/// Profile likelihood of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct LikelihoodProfile {
    /// Symbol of the parameter, with the index of the recording if it belongs to one.
    pub name: String,
    /// Description, as `resistance`; empty if a model has none.
    pub description: String,
    /// Unit.
    pub unit: String,
    /// Estimate, in the unit of the parameter.
    pub value: f64,
    /// Standard error; `None` if it is not known.
    pub std_error: Option<f64>,
    /// 95 % interval by the standard error.
    pub ci95: Option<[f64; 2]>,
    /// Ends of the 95 % interval by the likelihood; `None` where the profile ends before its limit, and for all profiles if one reaches
    /// below the optimum or the recordings do not identify some parameters, which the profiles keep fixed.
    pub likelihood95: [Option<f64>; 2],
    /// Points in the order of their values, with the optimum.
    pub points: Vec<LikelihoodPoint>,
}

/// A fitted problem of any machine, whose parameters are profiled.
pub(super) trait Profiled: Sync {
    /// Returns name, description and unit of a free parameter.
    fn named(&self, place: usize) -> [String; 3];
    /// Returns the bounds up to which a parameter is followed.
    fn bounds(&self, place: usize) -> [f64; 2];
    /// Returns the start of the others, given the values of all.
    fn rest(&self, place: usize, values: &[f64]) -> Vec<f64>;
    /// Returns how to search for a lower optimum.
    fn search() -> Text;
    /// Refines the others from `rest` with one fixed at a value and given weights; the values of the result are the next `rest`.
    fn fixed(&self, place: usize, value: f64, rest: &[f64], sigma: &[Vec<f64>]) -> Result<Refined>;
}

/// The optimum of an identification and what all profiles share.
struct Optimum<'a, P> {
    problem: &'a P,
    refined: &'a Refined,
    lowest: f64,
}

/// Checks that there is a refinement, without which there is no likelihood.
pub(super) fn check_polished(is_polished: bool) -> Result<()> {
    let remedy = text!("Give " [Polish = "lm"] ".");
    let none = || Error::usage("profiles of the likelihood need the refinement", remedy);
    is_polished.then_some(()).ok_or_else(none)
}

/// Computes the profile likelihood of each free parameter. Warnings of the result say where a profile found a lower sum of squares than
/// that of the optimum, beside `doubt`, which leaves no interval either.
pub(super) fn profiles<P: Profiled, M: Sync>(
    problem: &P,
    refined: &Refined,
    found: &mut Identification<M>,
    doubt: Option<Warning>,
) -> Vec<LikelihoodProfile> {
    let optimum = Optimum { problem, refined, lowest: refined.weighted(&refined.sigmas) };
    let profile = |place| optimum.profile(place, found);
    let mut profiles: Vec<LikelihoodProfile> = (0..refined.values.len()).into_par_iter().map(profile).collect();
    let doubts: Vec<Warning> = [doubt, below_optimum(&profiles, P::search())].into_iter().flatten().collect();
    if !doubts.is_empty() {
        profiles.iter_mut().for_each(|of| of.likelihood95 = [None; 2]);
    }
    found.warnings.extend(doubts);
    profiles
}

/// Returns the warning that a point is lower than the optimum, to which all likelihood ratios refer.
fn below_optimum(profiles: &[LikelihoodProfile], remedy: Text) -> Option<Warning> {
    let is_better = |of: &&LikelihoodProfile| of.points.iter().any(|point| point.ratio < -BETTER);
    let better: Vec<String> = profiles.iter().filter(is_better).map(|of| of.name.clone()).collect();
    let message = text!((
        "the profile of {} reaches a lower sum of squares than the optimum, which is therefore not the lowest; the profiles \
          have no intervals",
        better.join(", ")
    ));
    let warning = || Warning { remedy: Some(remedy), ..Warning::new("profile_below_optimum", message) };
    (!better.is_empty()).then(warning)
}

impl<P: Profiled> Optimum<'_, P> {
    fn profile<M>(&self, place: usize, found: &Identification<M>) -> LikelihoodProfile {
        let (value, [name, description, unit]) = (self.refined.values[place], self.problem.named(place));
        let robust = found.uncertainty.as_ref().and_then(|u| *u.std_error.get(place)?);
        let white = self.refined.uncertainty.std_error[place];
        // At a bound, where there is no standard error, the largest variance ratio stands in.
        let widest = found.uncertainty.as_ref().map_or(1.0, |u| u.widened_by.powi(-2));
        let scale = robust.zip(white).map_or(widest, |(robust, white)| (white / robust).powi(2));
        let step = STEP * robust.or(white).unwrap_or(PART * value.abs());
        let ((below, low), (above, high)) =
            rayon::join(|| self.side(place, -step, scale), || self.side(place, step, scale));
        let optimum = LikelihoodPoint { value, ratio: 0.0 };
        LikelihoodProfile {
            name,
            description,
            unit,
            value,
            std_error: robust,
            ci95: found.uncertainty.as_ref().and_then(|u| *u.ci95.get(place)?),
            likelihood95: [low, high],
            points: below.into_iter().rev().chain([optimum]).chain(above).collect(),
        }
    }

    /// Returns the points to a side of the optimum and the value at which the likelihood ratio passes its limit.
    fn side(&self, place: usize, step: f64, scale: f64) -> (Vec<LikelihoodPoint>, Option<f64>) {
        let (value, [min, max]) = (self.refined.values[place], self.problem.bounds(place));
        let mut points: Vec<LikelihoodPoint> = Vec::new();
        let (mut rest, mut distance, mut end) = (self.problem.rest(place, &self.refined.values), 0.0, None);
        let at = |value: f64, rest: &mut Vec<f64>| {
            let refined = self.problem.fixed(place, value, rest, &self.refined.sigmas).ok()?;
            rest.clone_from(&refined.values);
            let ratio = scale * (refined.weighted(&self.refined.sigmas) - self.lowest);
            ratio.is_finite().then_some(LikelihoodPoint { value, ratio })
        };
        for n in 0..POINTS[1] {
            distance +=
                step * if n < POINTS[0] { 1.0 } else { 2f64.powi(i32::try_from(n - POINTS[0]).unwrap_or(0) + 1) };
            let next = (value + distance).clamp(min, max);
            let before = points.last().copied().unwrap_or(LikelihoodPoint { value, ratio: 0.0 });
            if next.total_cmp(&before.value).is_eq() {
                break;
            }
            let Some(point) = at(next, &mut rest) else { break };
            if end.is_none() && point.ratio > LIMIT {
                let crossing = crossing(before, point);
                let closer = at(crossing, &mut rest.clone());
                end = Some(closer.map_or(crossing, |closer| {
                    if closer.ratio > LIMIT { self::crossing(before, closer) } else { self::crossing(closer, point) }
                }));
            }
            points.push(point);
            if point.ratio > REACH {
                break;
            }
        }
        (points, end)
    }
}

/// Returns the value at which the root of the likelihood ratio, which is nearly linear, passes that of the limit.
fn crossing(inside: LikelihoodPoint, outside: LikelihoodPoint) -> f64 {
    let [low, limit, high] = [inside.ratio.max(0.0), LIMIT, outside.ratio].map(f64::sqrt);
    inside.value + (outside.value - inside.value) * (limit - low) / (high - low)
}
