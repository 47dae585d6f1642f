//! Cost maps: the criterion over two parameters around the optimum.

use crate::identify::{BatchCosts, Identification, IdentifySpec, identify, needs_voltage};
use crate::motor::Parameter;
use crate::numeric::count;
use crate::record::Record;
use crate::setting::text;
use crate::{Error, Result};

/// Costs over a grid of two parameters, all others at the optimum.
#[derive(Debug, Clone, PartialEq)]
pub struct CostMap {
    /// The two parameters.
    pub parameters: [Parameter; 2],
    /// Range `[min, max]` of each parameter, in its SI unit.
    pub ranges: [[f64; 2]; 2],
    /// Cost at each point of the grid, range ends included, shape `[side, side]`; the first parameter varies along a
    /// row.
    pub costs: Vec<Vec<f64>>,
    /// Identification with the optimum.
    pub found: Identification,
}

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

    /// Returns the values of the two parameters at the optimum.
    #[must_use]
    pub fn optimum(&self) -> [f64; 2] {
        self.parameters.map(|p| self.found.parameters.get(p))
    }

    /// Returns the joint 95 % confidence ellipse of the two parameters as a closed curve; empty if their covariance is
    /// not available.
    #[must_use]
    pub fn ellipse(&self) -> Vec<(f64, f64)> {
        let known = || {
            let uncertainty = self.found.uncertainty.as_ref()?;
            let place = |p: Parameter| self.found.space.free().iter().position(|axis| axis.parameter == p);
            let [a, b] = [place(self.parameters[0])?, place(self.parameters[1])?];
            let error = |n: usize| uncertainty.std_error.get(n).copied().flatten();
            Some((error(a)?, error(b)?, (*uncertainty.correlation.get(a)?.get(b)?)?))
        };
        let Some((x, y, correlation)) = known() else { return Vec::new() };
        let ([x0, y0], size) = (self.optimum(), CHI2.sqrt());
        let point = |n: u32| {
            let (sin, cos) = (f64::from(n) * std::f64::consts::TAU / 180.0).sin_cos();
            let across = correlation * cos + (1.0 - correlation * correlation).max(0.0).sqrt() * sin;
            (x0 + size * x * cos, y0 + size * y * across)
        };
        (0..=180).map(point).collect()
    }
}

/// Identifies the motor and evaluates the criterion on a grid of `side` × `side` points around the optimum, within the
/// given bounds of the two parameters or eight standard errors to each side.
///
/// # Errors
/// Propagates the errors of [`identify`]. Returns a `Data` error for a recording without a voltage, and a `Usage` error
/// if the parameters are equal or one of them is fixed, or if `side` is not within 2 to 4096.
pub fn cost_map(records: &[Record], spec: &IdentifySpec, parameters: [Parameter; 2], side: usize) -> Result<CostMap> {
    needs_voltage(records)?;
    if parameters[0] == parameters[1] || !(2..=4096).contains(&side) {
        let message =
            format!("a slice of {} and {} with {side} points per side", parameters[0].symbol(), parameters[1].symbol());
        let hint = text!("Name two different parameters and 2 to 4096 points, as in " [Slice = "R,L"] ".");
        return Err(Error::usage(message, hint));
    }
    let axes = spec.space.free().to_vec();
    let place = |p: Parameter| {
        axes.iter().position(|axis| axis.parameter == p).ok_or_else(|| {
            let message = format!("{} is fixed and cannot be varied", p.symbol());
            Error::usage(message, text!("Leave it out of " [Fix] "."))
        })
    };
    let places = [place(parameters[0])?, place(parameters[1])?];
    let found = identify(records, spec)?;
    let range = |p: Parameter, place: usize| {
        let axis = &found.space.free()[place];
        if !spec.auto_bounds.contains(&p) {
            return [axis.min, axis.max];
        }
        let value = found.parameters.get(p);
        let error = found.uncertainty.as_ref().and_then(|u| u.std_error[place]).unwrap_or(0.05 * value);
        // Without noise the standard errors vanish; the map then reaches 1e-6 of the value to each side.
        let reach = (REACH * error).max(1e-6 * value);
        [(value - reach).max(0.01 * value), value + reach]
    };
    let ranges = [range(parameters[0], places[0]), range(parameters[1], places[1])];
    let mut map = CostMap { parameters, ranges, costs: vec![vec![0.0; side]; side], found };
    let around = IdentifySpec { space: map.found.space.clone(), auto_bounds: Vec::new(), ..spec.clone() };
    let mut costs = BatchCosts::new(records, &around)?;
    let optimum: Vec<f64> = axes.iter().map(|axis| map.found.parameters.get(axis.parameter)).collect();
    for row in 0..side {
        let mut values = Vec::with_capacity(side * optimum.len());
        for column in 0..side {
            let mut candidate = optimum.clone();
            candidate[places[0]] = map.value(0, column);
            candidate[places[1]] = map.value(1, row);
            values.extend(candidate);
        }
        costs.evaluate(&values, &mut map.costs[row])?;
    }
    Ok(map)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::{Excitation, simulated, with_noise};
    use crate::motor::{Discretization, Parameters};

    #[test]
    fn a_map_is_lowest_at_the_optimum_and_the_ellipse_encloses_it() {
        let step = Excitation::step(10.5, 0.1, 1.0, 0.001).unwrap();
        let clean = simulated(&Parameters::M2, &step, Discretization::Zoh).unwrap();
        let records = [with_noise(&clean, [0.02, 1.0], 1).unwrap()];
        // The criterion has the noise weights with which the optimum is estimated.
        let noise = crate::criterion::Noise::Sigma([Some(0.02), Some(1.0)]);
        let criterion =
            crate::criterion::Criterion { scale: crate::criterion::Scale::Noise, noise, ..Default::default() };
        let spec = IdentifySpec { criterion, ..IdentifySpec::default() };
        let map = cost_map(&records, &spec, [Parameter::R, Parameter::J], 41).unwrap();
        let all = (0..41).flat_map(|row| (0..41).map(move |column| (row, column)));
        let lowest = all.min_by(|a, b| map.costs[a.0][a.1].total_cmp(&map.costs[b.0][b.1])).unwrap();
        assert_eq!(lowest, (20, 20), "the middle, within a cell");
        let ellipse = map.ellipse();
        let [x, y] = map.optimum();
        let error = map.found.uncertainty.as_ref().unwrap().std_error[0].unwrap();
        let widest = ellipse.iter().map(|p| p.0 - x).fold(0.0, f64::max);
        assert!((widest / (2.4477 * error) - 1.0).abs() < 1e-3);
        assert!(ellipse.iter().any(|p| p.1 > y) && ellipse.iter().any(|p| p.1 < y));
        assert!(cost_map(&records, &spec, [Parameter::R, Parameter::R], 41).is_err());
    }
}
