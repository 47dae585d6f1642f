//! The grid of the variable projection, and its minima.

use super::projection::{motor, power, project};
use super::projection_sums::LANES;
use motorfit_core::numeric::count;
use motorfit_evaluate::Problem;
use motorfit_motor::Parameters;
use rayon::prelude::*;

/// Number of grid points in each direction.
const GRID: usize = 25;
/// Factor for the depth of a basin below its lowest point, since it is not quadratic. In 6000 fits from random starts a factor of 4
/// left out two lower optima, which ring above the Nyquist frequency, and a factor of 16 one.
const MARGIN: f64 = 100.0;

/// A minimum of the grid.
pub(super) struct Basin {
    /// The motor of the point within the bounds: R, L, K, B, J.
    pub motor: [f64; 5],
    /// The cost of the point, in units of σ², without regard to the bounds.
    cost: f64,
    /// Estimate of the lowest cost of the basin, [`MARGIN`] times as deep as a quadratic function with the same second differences.
    bottom: f64,
    /// c₁ and c₀ of the point, and the logarithms of the ratios of those of neighbouring points.
    point: [f64; 2],
    spacing: [f64; 2],
}

impl Basin {
    /// Returns true if the basin may have a motor with a lower cost than this.
    pub(super) fn may_reach(&self, cost: f64) -> bool {
        self.bottom < cost
    }

    /// Returns true if a motor of this cost lies at the bottom of the basin: it is within two points and not above the grid.
    pub(super) fn holds(&self, &Parameters { r, l, k, b, j }: &Parameters, cost: f64) -> bool {
        let own = [r / l + b / j, (r * b + k * k) / (l * j)];
        let near = |axis: usize| (own[axis] / self.point[axis]).ln().abs() <= 2.0 * self.spacing[axis];
        cost <= self.cost && near(0) && near(1)
    }
}

/// Returns up to `most` minima of the grid, the lowest first. Minima need not be exact, so times may be rounded.
///
/// Every second point in each direction is evaluated first. From the minima of these, at most twice `most`, the search goes on to
/// the lowest point within two points until none is lower. A valley across the grid, which has a lowest point in every row, is then
/// one minimum.
pub(super) fn basins(problem: &Problem, sigma: &[Vec<f64>], most: usize) -> Vec<Basin> {
    let mut grid = Grid::new(problem, sigma);
    let first: Vec<Place> = (0..GRID).step_by(2).flat_map(|row| (0..GRID).step_by(2).map(move |n| [row, n])).collect();
    grid.evaluate(&first);
    let mut lowest: Vec<Place> = first.into_iter().filter(|place| grid.is_lowest(*place)).collect();
    lowest.sort_by(|a, b| grid.cost(*a).total_cmp(&grid.cost(*b)));
    lowest.truncate(2 * most);
    loop {
        grid.evaluate(&lowest.iter().copied().flat_map(near).collect::<Vec<_>>());
        let mut lower: Vec<Place> = lowest.iter().map(|place| grid.lowest_near(*place)).collect();
        lower.sort_by(|a, b| grid.cost(*a).total_cmp(&grid.cost(*b)));
        lower.dedup();
        if lower == lowest {
            break;
        }
        lowest = lower;
    }
    lowest.into_iter().take(most).filter_map(|place| grid.basin(place)).collect()
}

/// Row and column of a grid point.
type Place = [usize; 2];

/// Returns the places within two points of one.
fn near([row, column]: Place) -> impl Iterator<Item = Place> {
    let range = |center: usize| center.saturating_sub(2)..(center + 3).min(GRID);
    range(row).flat_map(move |row| range(column).map(move |column| [row, column]))
}

/// The costs and (p, q, r) at points of the grid.
struct Grid<'a> {
    problem: Problem,
    sigma: &'a [Vec<f64>],
    power: [f64; 2],
    ranges: [[f64; 2]; 2],
    /// Logarithms of the ratios of coordinates of neighbouring points.
    spacing: [f64; 2],
    found: Vec<Option<(f64, [f64; 3])>>,
}

impl<'a> Grid<'a> {
    fn new(problem: &Problem, sigma: &'a [Vec<f64>]) -> Self {
        let ranges = ranges(problem);
        let spacing = ranges.map(|[low, high]| (high / low).ln() / count(GRID - 1));
        Self {
            problem: problem.at_coarse_steps(),
            sigma,
            power: power(problem, sigma),
            ranges,
            spacing,
            found: vec![None; GRID * GRID],
        }
    }

    /// Returns c₁ and c₀.
    fn point(&self, place: Place) -> [f64; 2] {
        [0, 1].map(|axis| self.ranges[axis][0] * (count(place[axis]) * self.spacing[axis]).exp())
    }

    /// Evaluates those of some points that are not known.
    fn evaluate(&mut self, places: &[Place]) {
        let mut places: Vec<Place> =
            places.iter().filter(|[row, n]| self.found[row * GRID + n].is_none()).copied().collect();
        places.sort_unstable();
        places.dedup();
        let points: Vec<[f64; 2]> = places.iter().map(|place| self.point(*place)).collect();
        let one = |points: &[[f64; 2]]| project(&self.problem, points, self.sigma, self.power);
        let found: Vec<_> = points.par_chunks(LANES).flat_map_iter(one).collect();
        for ([row, n], found) in places.into_iter().zip(found) {
            self.found[row * GRID + n] = Some(found);
        }
    }

    /// Returns the cost at a point; ∞ if it is not known.
    fn cost(&self, [row, n]: Place) -> f64 {
        self.found[row * GRID + n].map_or(f64::INFINITY, |found| found.0)
    }

    /// Returns the lowest known point within two points of one; the point itself if none is lower.
    fn lowest_near(&self, place: Place) -> Place {
        near(place).fold(place, |lowest, other| if self.cost(other) < self.cost(lowest) { other } else { lowest })
    }

    fn is_lowest(&self, place: Place) -> bool {
        self.cost(place).is_finite() && self.lowest_near(place) == place
    }

    fn basin(&self, place: Place) -> Option<Basin> {
        let ((cost, solved), point) = (self.found[place[0] * GRID + place[1]]?, self.point(place));
        let bottom = cost - MARGIN * self.depth(place);
        Some(Basin { motor: motor(point, solved, &self.problem), cost, bottom, point, spacing: self.spacing })
    }

    /// Returns the largest difference between a lowest point and the minimum of a quadratic function with the same second
    /// differences Dₙ, which is `Σ Dₙ/4`: the point nearest to the minimum is half a spacing from it at most. At the edge of the
    /// grid a second difference is that of a symmetric function.
    fn depth(&self, place: Place) -> f64 {
        let mut sum = 0.0;
        for axis in 0..2 {
            let beside = |at: usize| {
                let mut other = place;
                other[axis] = at;
                if at < GRID { self.cost(other) } else { f64::INFINITY }
            };
            let sides = [beside(place[axis].wrapping_sub(1)), beside(place[axis] + 1)];
            let finite = sides.into_iter().filter(|cost| cost.is_finite());
            let (rise, count) = finite.fold((0.0, 0.0), |(rise, n), cost| (rise + cost - self.cost(place), n + 1.0));
            sum += if count > 0.0 { 2.0 * rise / count } else { f64::INFINITY };
        }
        sum / 4.0
    }
}

/// Returns the ranges of c₁ and c₀ within the bounds.
fn ranges(problem: &Problem) -> [[f64; 2]; 2] {
    let [mut low, mut high] = [[0.0; 5]; 2];
    for axis in problem.space().free() {
        low[axis.parameter as usize] = axis.min;
        high[axis.parameter as usize] = axis.max;
    }
    let c1 = |[r, _, _, b, _]: [f64; 5], [_, l, _, _, j]: [f64; 5]| r / l + b / j;
    let c0 = |[r, _, k, b, _]: [f64; 5], [_, l, _, _, j]: [f64; 5]| (r * b + k * k) / (l * j);
    // No motor has time constants beyond these limits, and they keep the logarithms finite.
    let possible = |v: f64| if v.is_nan() { 1.0 } else { v.clamp(1e-12, 1e18) };
    [[c1(low, high), c1(high, low)], [c0(low, high), c0(high, low)]].map(|range| range.map(possible))
}
