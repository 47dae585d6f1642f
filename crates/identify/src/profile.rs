//! Profile likelihood of parameters that recordings do not identify: one parameter is fixed at successive values and all others
//! are refined, as long as the weighted sum of squares stays within the 95 % limit of χ². The intervals of the other parameters
//! become the hull over these points.

use super::prepare::Prepared;
use super::refine::Fit;
use super::spec::IdentifySpec;
use motorfit_core::Result;
use motorfit_estimate::{Refined, refine_on};
use motorfit_motor::{Axis, Parameter, Scope, Space};

/// 97.5 % quantile of the normal distribution.
pub(super) const QUANTILE: f64 = 1.96;
/// 95 % quantile of χ² with one degree of freedom.
pub const LIMIT: f64 = 3.84;
/// First step along the profile, in the coordinate of the axis.
const FIRST: f64 = 0.05;
/// Ratio of successive steps along the profile.
const GROWTH: f64 = 3.0;
/// Largest distance along the profile of a parameter with automatic bounds, in its logarithm.
const REACH: f64 = 30.0;
/// Factor by which automatic bounds of the other parameters are widened.
const WIDER: f64 = 100.0;
/// Largest number of bisections between the last point within the limit and the first one beyond it.
const BISECTIONS: usize = 8;
/// Ratio of the increase to the limit from which a point counts as being at the limit.
const CLOSE: f64 = 0.8;
/// Largest width of a profile that identifies the parameter of an extension, relative to its range.
const NARROW_PART: f64 = 0.1;
/// Largest width of a profile that identifies a parameter of the motor, in its logarithm.
const NARROW_LOGARITHM: f64 = 1.0;

/// A parameter that is fixed because the recordings do not identify it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FixedParameter {
    pub axis: Axis,
    pub value: f64,
    /// Other parameters with a component in the same unidentifiable direction.
    pub others: Vec<(Parameter, Scope)>,
}

impl FixedParameter {
    /// Returns the parameter with its scope.
    pub(super) fn name(&self) -> (Parameter, Scope) {
        (self.axis.parameter, self.axis.scope)
    }
}

/// The profile of one parameter.
struct Profile<'a> {
    prepared: &'a Prepared<'a>,
    /// Parameter whose values are fixed along the profile.
    profiled: &'a FixedParameter,
    /// Other unidentified parameters: fixed in the fit, free along the profile.
    released: Vec<&'a FixedParameter>,
    /// Axes of the free parameters of the fit, automatic bounds widened.
    others: Vec<Axis>,
    fixed: Vec<(Parameter, Scope, f64)>,
    sigma: &'a [Vec<f64>],
    /// Weighted sum of squares at the start of the profile.
    lowest: f64,
    /// Largest increase of the weighted sum of squares.
    limit: f64,
}

/// A point of a profile.
#[derive(Clone)]
pub(super) struct Point {
    /// Value of the profiled parameter.
    pub value: f64,
    /// Values of the other unidentified parameters.
    pub released: Vec<f64>,
    /// Refinement of the free parameters of the fit.
    pub refined: Refined,
}

/// The points of a profile within the limit.
pub(super) struct Points {
    pub fits: Vec<Point>,
    /// Lowest and highest value of the profiled parameter.
    pub range: [f64; 2],
    /// Best point, if its weighted sum of squares is lower than that of the start by more than the limit.
    pub better: Option<Point>,
}

impl Points {
    /// Returns true if the profile identifies the parameter even though the information matrix at one point does not, as at a
    /// delay of zero, where the derivative by the delay is zero.
    pub(super) fn is_narrow(&self, axis: &Axis) -> bool {
        let width = axis.coordinate(self.range[1]) - axis.coordinate(self.range[0]);
        width < if axis.parameter.is_extension() { NARROW_PART } else { NARROW_LOGARITHM }
    }
}

/// Computes the profile of `all[index]` from its value to each side, up to the limit or the end of its range.
///
/// # Errors
/// Propagates the errors of [`refine_on`] at the start of the profile.
pub(super) fn profile(prepared: &Prepared<'_>, fit: &Fit, all: &[FixedParameter], index: usize) -> Result<Points> {
    let is_unidentified = |of: (Parameter, Scope)| all.iter().any(|fixed| fixed.name() == of);
    let fixed = fit.space.fixed().iter().filter(|(parameter, scope, _)| !is_unidentified((*parameter, *scope)));
    let profiled = &all[index];
    let mut profile = Profile {
        prepared,
        profiled,
        released: all.iter().filter(|other| other.name() != profiled.name()).collect(),
        others: fit.space.free().iter().map(|axis| wider(&prepared.spec, axis)).collect(),
        fixed: fixed.copied().collect(),
        sigma: &fit.refined.sigmas,
        lowest: 0.0,
        limit: LIMIT * fit.refined.uncertainty.variance_inflation(),
    };
    let released: Vec<f64> = profile.released.iter().map(|other| other.value).collect();
    let refined = profile.rest(profiled.value, &released, &fit.refined.values)?;
    let start = Point { value: profiled.value, refined, released };
    profile.lowest = start.refined.weighted(profile.sigma);
    let ((mut fits, low), (above, high)) = rayon::join(|| profile.side(-1.0, &start), || profile.side(1.0, &start));
    fits.extend(above);
    let height = |point: &Point| point.refined.weighted(profile.sigma);
    let best = fits.iter().min_by(|a, b| height(a).total_cmp(&height(b)));
    let better = best.filter(|point| height(point) < profile.lowest - profile.limit).cloned();
    fits.push(start);
    Ok(Points { fits, range: [low, high], better })
}

/// Returns an axis with automatic bounds widened.
pub(super) fn wider(spec: &IdentifySpec, axis: &Axis) -> Axis {
    match spec.auto_bounds.contains(&axis.parameter) && !axis.parameter.is_extension() {
        true => Axis { min: axis.min / WIDER, max: axis.max * WIDER, ..*axis },
        false => *axis,
    }
}

impl Profile<'_> {
    /// Refines all other parameters with the profiled one fixed at `value`, and then those that are free in the fit, with the
    /// intervals of the point.
    fn at(&self, value: f64, start: &Point) -> Result<Point> {
        let mut released = start.released.clone();
        let mut rest = start.refined.values.clone();
        if !released.is_empty() {
            let (parameter, scope) = self.profiled.name();
            let wide = self.released.iter().map(|other| wider(&self.prepared.spec, &other.axis));
            let free = self.others.iter().copied().chain(wide);
            let fixed = self.fixed.iter().copied().chain([(parameter, scope, value)]).collect();
            let space = Space::new(free.collect(), fixed)?;
            let from: Vec<f64> = rest.iter().chain(&released).copied().collect();
            rest = refine_on(&self.prepared.fitted(&space), &from, Some(self.sigma))?.values;
            released = rest.split_off(self.others.len());
        }
        Ok(Point { value, refined: self.rest(value, &released, &rest)?, released })
    }

    /// Refines the free parameters of the fit with all unidentified ones fixed at `value` and `released`.
    fn rest(&self, value: f64, released: &[f64], start: &[f64]) -> Result<Refined> {
        let parameters = [self.profiled].into_iter().chain(self.released.iter().copied()).map(FixedParameter::name);
        let named = parameters.zip([value].into_iter().chain(released.iter().copied()));
        let fixed = named.map(|((parameter, scope), value)| (parameter, scope, value));
        let space = Space::new(self.others.clone(), self.fixed.iter().copied().chain(fixed).collect())?;
        refine_on(&self.prepared.fitted(&space), start, Some(self.sigma))
    }

    /// Returns the farthest coordinate of the profile to a side.
    fn end(&self, side: f64) -> f64 {
        let FixedParameter { axis, value, .. } = self.profiled;
        let is_wide = !axis.parameter.is_extension() && self.prepared.spec.auto_bounds.contains(&axis.parameter);
        match (is_wide, side < 0.0) {
            (true, _) => axis.coordinate(*value) + side * REACH,
            (false, true) => axis.coordinate(axis.min),
            (false, false) => axis.coordinate(axis.max),
        }
    }

    /// Returns the value at a coordinate, which may be outside automatic bounds.
    fn value(&self, coordinate: f64) -> f64 {
        let Axis { parameter, .. } = self.profiled.axis;
        if parameter.is_extension() { self.profiled.axis.value(coordinate) } else { coordinate.exp() }
    }

    /// Returns the points to one side within the limit, and the farthest value among them.
    fn side(&self, side: f64, start: &Point) -> (Vec<Point>, f64) {
        let FixedParameter { axis, value, .. } = self.profiled;
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
