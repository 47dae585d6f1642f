//! A map of the cost over two parameters.

use motorfit_core::numeric::count;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_estimate::Uncertainty;
use motorfit_identify::BatchCosts;
use motorfit_record::warning::Warning;

/// A parameter of a cost map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapParameter {
    /// Symbol.
    pub symbol: String,
    /// Description, as `winding resistance`.
    pub name: String,
    /// Unit of its values.
    pub unit: String,
}

/// Costs over a grid of two parameters, all others at the optimum.
#[derive(Debug, Clone, PartialEq)]
pub struct CostMap {
    /// The two parameters.
    pub parameters: [MapParameter; 2],
    /// Range `[min, max]` of each parameter, in its unit.
    pub ranges: [[f64; 2]; 2],
    /// Cost at each point of the grid, range ends included, shape `[side, side]`; the first parameter varies along a
    /// row.
    pub costs: Vec<Vec<f64>>,
    /// Values of the two parameters at the optimum.
    pub optimum: [f64; 2],
    /// Joint 95 % confidence ellipse of the two parameters as a closed curve; empty if their covariance is not available.
    pub ellipse: Vec<(f64, f64)>,
    /// Warnings about the identification of the optimum.
    pub warnings: Vec<Warning>,
}

/// Least number of candidates that are evaluated at once, but for the last.
const TOGETHER: usize = 1 << 14;
/// Half-width of a map without given bounds \[standard errors\].
const REACH: f64 = 8.0;
/// The 95 % quantile of χ² with two degrees of freedom.
const CHI2: f64 = 5.991_464_547_107_98;

impl CostMap {
    /// Returns the value of parameter `which` (0 or 1) at an index of the grid; NaN if the grid has one point.
    ///
    /// # Panics
    /// Panics if `which` is neither 0 nor 1.
    #[must_use]
    pub fn value(&self, which: usize, index: usize) -> f64 {
        let [low, high] = self.ranges[which];
        let fraction = count(index) / count(self.costs.len().saturating_sub(1));
        low + (high - low) * fraction
    }
}

/// An optimum around which costs are mapped over two of its free parameters.
pub(super) struct Optimum<'a> {
    /// Values of all free parameters.
    pub values: Vec<f64>,
    pub uncertainty: Option<&'a Uncertainty>,
    /// The two parameters that vary, with their places among the free ones.
    pub parameters: [MapParameter; 2],
    pub places: [usize; 2],
    pub warnings: &'a [Warning],
}

impl Optimum<'_> {
    /// Evaluates the criterion on a grid. `range` returns the range of the parameter at a place, whose value and eight standard errors to
    /// each side it is given.
    pub fn map(
        self,
        side: usize,
        range: impl Fn(usize, f64, [f64; 2]) -> [f64; 2],
        costs: &mut BatchCosts,
    ) -> Result<CostMap> {
        let Self { values, uncertainty, parameters, places, warnings } = self;
        let error = |place: usize| uncertainty.and_then(|of| *of.std_error.get(place)?);
        let correlation = || *uncertainty?.correlation.get(places[0])?.get(places[1])?;
        let known = || Some(([error(places[0])?, error(places[1])?], correlation()?));
        let optimum = places.map(|place| values[place]);
        let mut map = CostMap {
            parameters,
            ranges: places.map(|place| range(place, values[place], reach(values[place], error(place)))),
            costs: vec![Vec::new(); side],
            optimum,
            ellipse: ellipse(optimum, known()),
            warnings: warnings.to_vec(),
        };
        let rows: Vec<usize> = (0..side).collect();
        for rows in rows.chunks((TOGETHER / side).max(1)) {
            let mut candidates = Vec::with_capacity(rows.len() * side * values.len());
            for (row, column) in rows.iter().flat_map(|row| (0..side).map(move |column| (*row, column))) {
                let mut candidate = values.clone();
                candidate[places[0]] = map.value(0, column);
                candidate[places[1]] = map.value(1, row);
                candidates.extend(candidate);
            }
            let mut lines = vec![0.0; rows.len() * side];
            costs.evaluate(&candidates, &mut lines)?;
            for (row, line) in rows.iter().zip(lines.chunks(side)) {
                map.costs[*row] = line.to_vec();
            }
        }
        Ok(map)
    }
}

/// Checks the names of the parameters and the number of points per side.
pub(super) fn check(symbols: [&str; 2], side: usize) -> Result<()> {
    if symbols[0] != symbols[1] && (2..=4096).contains(&side) {
        return Ok(());
    }
    let message = format!("a slice of {} and {} with {side} points per side", symbols[0], symbols[1]);
    let hint = text!("Name two different parameters and 2 to 4096 points, as in " [Slice = "R,L"] ".");
    Err(Error::usage(message, hint))
}

/// Returns the range around an estimate with a standard error. Without noise the standard errors vanish; the map then reaches
/// 1e-6 of the value to each side.
fn reach(value: f64, error: Option<f64>) -> [f64; 2] {
    let reach = (REACH * error.unwrap_or(0.05 * value.abs())).max(1e-6 * value.abs());
    [value - reach, value + reach]
}

/// Returns the 95 % confidence ellipse of two estimates with their standard errors and correlation.
fn ellipse([x0, y0]: [f64; 2], known: Option<([f64; 2], f64)>) -> Vec<(f64, f64)> {
    let Some(([x, y], correlation)) = known else { return Vec::new() };
    let size = CHI2.sqrt();
    let point = |n: u32| {
        let (sin, cos) = (f64::from(n) * std::f64::consts::TAU / 180.0).sin_cos();
        let across = correlation * cos + (1.0 - correlation * correlation).max(0.0).sqrt() * sin;
        (x0 + size * x * cos, y0 + size * y * across)
    };
    (0..=180).map(point).collect()
}
