//! The cost around an optimum, over two parameters.

use crate::identify::{BatchCosts, Identification, IdentifySpec, identify, needs_voltage};
use crate::motor::Parameter;
use crate::numeric::count;
use crate::record::Record;
use crate::setting::text;
use crate::{Error, Result};

/// Costs over two parameters, all others at the optimum.
#[derive(Debug, Clone, PartialEq)]
pub struct CostMap {
    /// Which parameters.
    pub parameters: [Parameter; 2],
    /// From where to where each goes.
    pub ranges: [[f64; 2]; 2],
    /// The cost at the points of a grid that includes the ends: row by row, the first parameter along a row.
    pub costs: Vec<Vec<f64>>,
    /// The identification.
    pub found: Identification,
}

/// Standard errors that a map reaches to each side where nobody gave bounds.
const REACH: f64 = 8.0;
/// The 95 % quantile of χ² with two degrees of freedom.
const CHI2: f64 = 5.991_464_547_107_98;

impl CostMap {
    /// Returns the value of a parameter (0 or 1) at a place of the grid; NaN where the grid has one point.
    ///
    /// # Panics
    /// For other parameters than 0 and 1.
    #[must_use]
    pub fn value(&self, which: usize, place: usize) -> f64 {
        let [low, high] = self.ranges[which];
        let share = count(place) / count(self.costs.len().saturating_sub(1));
        low + (high - low) * share
    }

    /// The optimum.
    #[must_use]
    pub fn optimum(&self) -> [f64; 2] {
        self.parameters.map(|p| self.found.parameters.get(p))
    }

    /// The ellipse that covers both parameters together with 95 %, closed; empty where they are not known so well.
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

/// Identifies the motor and evaluates a grid of `side` by `side` points around it: within the bounds that the spec gives
/// for the two parameters, or eight standard errors to each side.
///
/// # Errors
/// As for an identification; `Usage` when the parameters are the same or held, or the grid is smaller than 2.
pub fn cost_map(records: &[Record], spec: &IdentifySpec, parameters: [Parameter; 2], side: usize) -> Result<CostMap> {
    needs_voltage(records)?;
    if parameters[0] == parameters[1] || !(2..=4096).contains(&side) {
        let message =
            format!("a slice of {} and {} with {side} points a side", parameters[0].symbol(), parameters[1].symbol());
        let hint = text!("Name two different parameters and 2 to 4096 points, as in " [Slice = "R,L"] ".");
        return Err(Error::usage(message, hint));
    }
    let axes = spec.space.free().to_vec();
    let place = |p: Parameter| {
        axes.iter().position(|axis| axis.parameter == p).ok_or_else(|| {
            let message = format!("{} is held: there is nothing to vary", p.symbol());
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
        // A millionth of the value at least: without noise there would be nothing to see.
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
    fn a_map_is_lowest_at_the_optimum_and_the_ellipse_lies_around_it() {
        let step = Excitation::step(10.5, 0.1, 1.0, 0.001).unwrap();
        let clean = simulated(&Parameters::M2, &step, Discretization::Zoh).unwrap();
        let records = [with_noise(&clean, [0.02, 1.0], 1).unwrap()];
        // Weighted by the noise, as the optimum is.
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
