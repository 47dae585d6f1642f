//! Profiles of parameters that recordings do not identify: the others refined while one is held elsewhere, as far as the
//! fit stays within the 95 % limit of χ². Their intervals become the hull over these points.

use super::prepare::Prepared;
use super::refine::Fit;
use crate::Result;
use crate::analysis::variance_inflation;
use crate::estimate::{Refined, refine_on};
use crate::motor::{Axis, Parameter, Scope, Space};

/// The 97.5 % quantile of the normal distribution.
pub(super) const QUANTILE: f64 = 1.96;
/// The 95 % quantile of χ² with one degree of freedom.
const LIMIT: f64 = 3.84;
/// The first step from where the parameter is held, and the growth of the steps, in its coordinate.
const FIRST: f64 = 0.05;
const GROWTH: f64 = 3.0;
/// How far a profile goes where nobody gave bounds, in the logarithm.
const REACH: f64 = 30.0;
/// The factor by which bounds of others that nobody gave are moved out.
const WIDER: f64 = 100.0;
/// Points between the last one within the limit and the first one beyond.
const BISECTIONS: usize = 8;
/// A point that rises by this part of the limit is at the limit.
const CLOSE: f64 = 0.8;
/// A parameter is identified by a profile that is narrower than this part of its range, or this step of its logarithm.
const NARROW_PART: f64 = 0.1;
const NARROW_LOGARITHM: f64 = 1.0;
/// A parameter whose logarithm, or part of its range, is known no better than this is unknown.
const SPREAD_MAX: f64 = 1.0;

/// A parameter that is held since the recordings do not identify it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Held {
    pub axis: Axis,
    pub value: f64,
    /// The others that take part in its direction.
    pub others: Vec<(Parameter, Scope)>,
}

impl Held {
    /// Returns which parameter of which recordings it is.
    pub(super) fn name(&self) -> (Parameter, Scope) {
        (self.axis.parameter, self.axis.scope)
    }
}

/// The other parameters of a fit along the profile of one that is held.
struct Profile<'a> {
    prepared: &'a Prepared<'a>,
    held: &'a Held,
    /// The others, bounds that nobody gave moved out.
    others: Vec<Axis>,
    fixed: Vec<(Parameter, Scope, f64)>,
    sigma: &'a [[f64; 2]],
    /// The weighted sum of squares where it is held, and how far it may rise.
    lowest: f64,
    limit: f64,
}

/// The points of a profile that are within the limit.
pub(super) struct Points {
    /// The value of the parameter that is held, and the others, at each of them.
    pub fits: Vec<(f64, Refined)>,
    /// The lowest and the highest value of the parameter that is held.
    pub range: [f64; 2],
    /// The point that fits better than the one where the profile began by more than the limit.
    pub better: Option<(f64, Vec<f64>)>,
}

impl Points {
    /// Returns whether the profile alone identifies the parameter, whatever the derivatives at one point say: at a delay of
    /// zero, for example, they are zero.
    pub(super) fn is_narrow(&self, axis: &Axis) -> bool {
        let width = axis.coordinate(self.range[1]) - axis.coordinate(self.range[0]);
        width < if axis.parameter.is_extension() { NARROW_PART } else { NARROW_LOGARITHM }
    }
}

/// Refines the others at points of the profile of a parameter that is held: from where it is to each side, up to the limit.
///
/// # Errors
/// As a refinement.
pub(super) fn profile(prepared: &Prepared<'_>, fit: &Fit, held: &Held) -> Result<Points> {
    let spec = prepared.spec.as_ref();
    let out = |axis: &Axis| match spec.auto_bounds.contains(&axis.parameter) && !axis.parameter.is_extension() {
        true => Axis { min: axis.min / WIDER, max: axis.max * WIDER, ..*axis },
        false => *axis,
    };
    let is_other = |(p, scope, _): &&(Parameter, Scope, f64)| (*p, *scope) != (held.axis.parameter, held.axis.scope);
    let mut profile = Profile {
        prepared,
        held,
        others: fit.space.free().iter().map(out).collect(),
        fixed: fit.space.fixed().iter().filter(is_other).copied().collect(),
        sigma: &fit.refined.sigmas,
        lowest: 0.0,
        limit: LIMIT * variance_inflation(&fit.refined.uncertainty),
    };
    let start = profile.at(held.value, &fit.refined.values)?;
    profile.lowest = start.weighted(profile.sigma);
    let ((mut fits, low), (above, high)) = rayon::join(|| profile.side(-1.0, &start), || profile.side(1.0, &start));
    fits.extend(above);
    let height = |(_, point): &(f64, Refined)| point.weighted(profile.sigma);
    let best = fits.iter().min_by(|a, b| height(a).total_cmp(&height(b)));
    let best = best.filter(|point| height(point) < profile.lowest - profile.limit);
    let better = best.map(|(value, point)| (*value, point.values.clone()));
    fits.push((held.value, start));
    Ok(Points { fits, range: [low, high], better })
}

impl Profile<'_> {
    /// Refines the others with the parameter held at a value.
    fn at(&self, value: f64, start: &[f64]) -> Result<Refined> {
        let Axis { parameter, scope, .. } = self.held.axis;
        let fixed = self.fixed.iter().copied().chain([(parameter, scope, value)]).collect();
        let space = Space::new(self.others.clone(), fixed)?;
        refine_on(&self.prepared.fitted(&space), start, Some(self.sigma))
    }

    /// Returns the farthest coordinate to a side.
    fn end(&self, side: f64) -> f64 {
        let Held { axis, value, .. } = self.held;
        let is_wide = !axis.parameter.is_extension() && self.prepared.spec.auto_bounds.contains(&axis.parameter);
        match (is_wide, side < 0.0) {
            (true, _) => axis.coordinate(*value) + side * REACH,
            (false, true) => axis.coordinate(axis.min),
            (false, false) => axis.coordinate(axis.max),
        }
    }

    /// Returns the value at a coordinate; bounds that nobody gave do not limit it.
    fn value(&self, coordinate: f64) -> f64 {
        let Axis { parameter, .. } = self.held.axis;
        if parameter.is_extension() { self.held.axis.value(coordinate) } else { coordinate.exp() }
    }

    /// Returns the points to one side that are within the limit, and the farthest value among them.
    fn side(&self, side: f64, start: &Refined) -> (Vec<(f64, Refined)>, f64) {
        let Held { axis, value, .. } = self.held;
        let (from, end) = (axis.coordinate(*value), self.end(side));
        let reach = side * (end - from);
        let mut points: Vec<(f64, Refined)> = Vec::new();
        let (mut inside, mut outside, mut step) = (0.0, None, FIRST);
        let mut halvings = 0;
        while inside < reach && halvings < BISECTIONS {
            let distance = match outside {
                None => step.min(reach),
                Some(outside) => 0.5 * (inside + outside),
            };
            let warm = points.last().map_or(&start.values, |(_, point)| &point.values);
            let at = self.value(from + side * distance);
            let point = self.at(at, warm).ok();
            let rise = point.as_ref().map_or(f64::INFINITY, |point| point.weighted(self.sigma) - self.lowest);
            halvings += usize::from(outside.is_some());
            match point.filter(|_| rise <= self.limit) {
                Some(point) => {
                    points.push((at, point));
                    inside = distance;
                    if outside.is_some() && rise > CLOSE * self.limit {
                        break;
                    }
                }
                None => outside = Some(distance),
            }
            step *= GROWTH;
        }
        let farthest = points.last().map_or(*value, |(at, _)| *at);
        (points, farthest)
    }
}

/// What a profile does to another parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Moved {
    /// Its interval allows for it.
    Within,
    /// It moves by more than its standard error.
    Beyond,
    /// Nothing of it is known.
    Lost,
}

/// Widens the interval of a free parameter to the hull over points of a profile and returns how it moves.
pub(super) fn widen(refined: &mut Refined, place: usize, axis: &Axis, points: &[(f64, Refined)]) -> Moved {
    let (value, more) = (refined.values[place], variance_inflation(&refined.uncertainty).sqrt());
    let uncertainty = &mut refined.uncertainty;
    let (Some(error), Some(interval)) = (uncertainty.std_error[place], uncertainty.ci95[place]) else {
        return if refined.at_bound[place].is_some() { Moved::Within } else { Moved::Lost };
    };
    let coordinate = |value: f64| axis.coordinate(value);
    let own = error / axis.slope(value);
    let quantile = (coordinate(interval[1]) - coordinate(value)) / own;
    let of = |(_, point): &(f64, Refined)| point.uncertainty.ci95[place].unwrap_or([point.values[place]; 2]);
    let hull = points.iter().map(of).fold(interval, |hull, of| [hull[0].min(of[0]), hull[1].max(of[1])]);
    let half = 0.5 * (coordinate(hull[1]) - coordinate(hull[0])) / quantile;
    let farther = (hull[1] - value).max(value - hull[0]) / quantile;
    if hull.iter().zip(interval).any(|(hull, own)| hull.to_bits() != own.to_bits()) {
        uncertainty.ci95[place] = Some(hull);
        uncertainty.std_error[place] = Some(error.max(farther));
    }
    let distance = |(_, point): &(f64, Refined)| (coordinate(point.values[place]) - coordinate(value)).abs();
    let farthest = points.iter().map(distance).fold(0.0, f64::max);
    match (half.is_finite() && half < SPREAD_MAX, farthest > own * more) {
        (false, _) => Moved::Lost,
        (true, true) => Moved::Beyond,
        (true, false) => Moved::Within,
    }
}
