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
pub(super) const LIMIT: f64 = 3.84;
/// The first step from where the parameter is held, and the growth of the steps, in its coordinate.
const FIRST: f64 = 0.05;
const GROWTH: f64 = 3.0;
/// The reach of a profile where nobody gave bounds, in the logarithm.
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
    /// The others that are held in the fit: they follow it.
    loose: Vec<&'a Held>,
    /// The rest, bounds that nobody gave moved out.
    others: Vec<Axis>,
    fixed: Vec<(Parameter, Scope, f64)>,
    sigma: &'a [[f64; 2]],
    /// The weighted sum of squares where it is held, and how far it may rise.
    lowest: f64,
    limit: f64,
}

/// A point of a profile.
#[derive(Clone)]
pub(super) struct Point {
    /// The value of the parameter that is held, and those of others that are held in the fit and free here.
    pub value: f64,
    pub loose: Vec<f64>,
    /// The rest.
    pub refined: Refined,
}

/// The points of a profile that are within the limit.
pub(super) struct Points {
    pub fits: Vec<Point>,
    /// The lowest and the highest value of the parameter that is held.
    pub range: [f64; 2],
    /// The point that fits better than the one where the profile began by more than the limit.
    pub better: Option<Point>,
}

impl Points {
    /// Returns whether the profile alone identifies the parameter, whatever the derivatives at one point say: at a delay of
    /// zero, for example, they are zero.
    pub(super) fn is_narrow(&self, axis: &Axis) -> bool {
        let width = axis.coordinate(self.range[1]) - axis.coordinate(self.range[0]);
        width < if axis.parameter.is_extension() { NARROW_PART } else { NARROW_LOGARITHM }
    }
}

/// Refines all others at points of the profile of the parameter that is `held` in this place: from where it is to each side, up
/// to the limit.
///
/// # Errors
/// As a refinement.
pub(super) fn profile(prepared: &Prepared<'_>, fit: &Fit, all: &[Held], place: usize) -> Result<Points> {
    let is_held = |of: (Parameter, Scope)| all.iter().any(|held| held.name() == of);
    let fixed = fit.space.fixed().iter().filter(|(parameter, scope, _)| !is_held((*parameter, *scope)));
    let held = &all[place];
    let mut profile = Profile {
        prepared,
        held,
        loose: all.iter().filter(|other| other.name() != held.name()).collect(),
        others: fit.space.free().iter().map(|axis| wider(prepared, axis)).collect(),
        fixed: fixed.copied().collect(),
        sigma: &fit.refined.sigmas,
        lowest: 0.0,
        limit: LIMIT * variance_inflation(&fit.refined.uncertainty),
    };
    let loose: Vec<f64> = profile.loose.iter().map(|held| held.value).collect();
    let start = Point { value: held.value, refined: profile.rest(held.value, &loose, &fit.refined.values)?, loose };
    profile.lowest = start.refined.weighted(profile.sigma);
    let ((mut fits, low), (above, high)) = rayon::join(|| profile.side(-1.0, &start), || profile.side(1.0, &start));
    fits.extend(above);
    let height = |point: &Point| point.refined.weighted(profile.sigma);
    let best = fits.iter().min_by(|a, b| height(a).total_cmp(&height(b)));
    let better = best.filter(|point| height(point) < profile.lowest - profile.limit).cloned();
    fits.push(start);
    Ok(Points { fits, range: [low, high], better })
}

/// Returns an axis with bounds that nobody gave moved out.
fn wider(prepared: &Prepared<'_>, axis: &Axis) -> Axis {
    match prepared.spec.auto_bounds.contains(&axis.parameter) && !axis.parameter.is_extension() {
        true => Axis { min: axis.min / WIDER, max: axis.max * WIDER, ..*axis },
        false => *axis,
    }
}

impl Profile<'_> {
    /// Refines all others with the parameter held at a value, and then the rest alone, whose intervals are those of the point.
    fn at(&self, value: f64, start: &Point) -> Result<Point> {
        let mut loose = start.loose.clone();
        let mut rest = start.refined.values.clone();
        if !loose.is_empty() {
            let (parameter, scope) = self.held.name();
            let free =
                self.others.iter().copied().chain(self.loose.iter().map(|held| wider(self.prepared, &held.axis)));
            let fixed = self.fixed.iter().copied().chain([(parameter, scope, value)]).collect();
            let space = Space::new(free.collect(), fixed)?;
            let from: Vec<f64> = rest.iter().chain(&loose).copied().collect();
            rest = refine_on(&self.prepared.fitted(&space), &from, Some(self.sigma))?.values;
            loose = rest.split_off(self.others.len());
        }
        Ok(Point { value, refined: self.rest(value, &loose, &rest)?, loose })
    }

    /// Refines the rest with all that are held at values.
    fn rest(&self, value: f64, loose: &[f64], start: &[f64]) -> Result<Refined> {
        let held = [self.held].into_iter().chain(self.loose.iter().copied()).map(Held::name);
        let held = held.zip([value].into_iter().chain(loose.iter().copied()));
        let held = held.map(|((parameter, scope), value)| (parameter, scope, value));
        let space = Space::new(self.others.clone(), self.fixed.iter().copied().chain(held).collect())?;
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
    fn side(&self, side: f64, start: &Point) -> (Vec<Point>, f64) {
        let Held { axis, value, .. } = self.held;
        let (from, end) = (axis.coordinate(*value), self.end(side));
        let reach = side * (end - from);
        let mut points: Vec<Point> = Vec::new();
        let (mut inside, mut outside, mut step) = (0.0, None, FIRST);
        let mut halvings = 0;
        while inside < reach && halvings < BISECTIONS {
            let distance = match outside {
                None => step.min(reach),
                Some(outside) => 0.5 * (inside + outside),
            };
            let warm = points.last().unwrap_or(start);
            let at = self.value(from + side * distance);
            let point = self.at(at, warm).ok();
            let rise = point.as_ref().map_or(f64::INFINITY, |point| point.refined.weighted(self.sigma) - self.lowest);
            halvings += usize::from(outside.is_some());
            match point.filter(|_| rise <= self.limit) {
                Some(point) => {
                    points.push(point);
                    inside = distance;
                    if outside.is_some() && rise > CLOSE * self.limit {
                        break;
                    }
                }
                None => outside = Some(distance),
            }
            step *= GROWTH;
        }
        let farthest = points.last().map_or(*value, |point| point.value);
        (points, farthest)
    }
}
