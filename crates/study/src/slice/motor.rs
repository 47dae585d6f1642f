//! Cost maps of the DC motor.

use super::map::{CostMap, MapParameter, Optimum, check};
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_identify::{BatchCosts, IdentifySpec, identify, needs_voltage};
use motorfit_motor::Parameter;
use motorfit_record::Record;

/// Identifies the motor and evaluates the criterion on a grid of `side` × `side` points around the optimum, within the
/// given bounds of the two parameters or eight standard errors to each side.
///
/// # Errors
/// Propagates the errors of [`identify`]. Returns a `Data` error for a recording without a voltage, and a `Usage` error
/// if the parameters are equal or one of them is fixed, or if `side` is not within 2 to 4096.
pub fn cost_map(records: &[Record], spec: &IdentifySpec, parameters: [Parameter; 2], side: usize) -> Result<CostMap> {
    needs_voltage(records)?;
    check(parameters.map(Parameter::symbol), side)?;
    let axes = spec.space.free().to_vec();
    let place = |p: Parameter| {
        axes.iter().position(|axis| axis.parameter == p).ok_or_else(|| {
            let message = format!("{} is fixed and cannot be varied", p.symbol());
            Error::usage(message, text!("Leave it out of " [Fix] "."))
        })
    };
    let places = [place(parameters[0])?, place(parameters[1])?];
    let found = identify(records, spec)?;
    let space = found.space.clone();
    let around = IdentifySpec { space, auto_bounds: Vec::new(), population: side, generations: side, ..spec.clone() };
    let optimum = Optimum {
        values: axes.iter().map(|axis| found.parameters.get(axis.parameter)).collect(),
        uncertainty: found.uncertainty.as_ref(),
        parameters: parameters.map(|p| MapParameter {
            symbol: p.symbol().to_owned(),
            name: p.name().to_owned(),
            unit: p.unit().to_owned(),
        }),
        places,
        warnings: &found.warnings,
    };
    let range = |place: usize, value: f64, [low, high]: [f64; 2]| {
        let axis = &found.space.free()[place];
        let is_automatic = spec.auto_bounds.contains(&axes[place].parameter);
        if is_automatic { [low.max(0.01 * value), high] } else { [axis.min, axis.max] }
    };
    optimum.map(side, range, &mut BatchCosts::new(records, &around)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorfit_evaluate::experiment::{Excitation, simulated, with_noise};
    use motorfit_motor::{Discretization, Parameters};

    #[test]
    fn a_map_is_lowest_at_the_optimum_and_the_ellipse_encloses_it() {
        let step = Excitation::step(10.5, 0.1, 1.0, 0.001).unwrap();
        let clean = simulated(&Parameters::M2, &step, Discretization::Zoh).unwrap();
        let records = [with_noise(&clean, [0.02, 1.0], 1).unwrap()];
        // The criterion has the noise weights with which the optimum is estimated.
        let noise = motorfit_evaluate::criterion::Noise::Sigma([Some(0.02), Some(1.0)]);
        let criterion = motorfit_evaluate::criterion::Criterion {
            scale: motorfit_evaluate::criterion::Scale::Noise,
            noise,
            ..Default::default()
        };
        let spec = IdentifySpec { criterion, ..IdentifySpec::default() };
        let map = cost_map(&records, &spec, [Parameter::R, Parameter::J], 41).unwrap();
        let all = (0..41).flat_map(|row| (0..41).map(move |column| (row, column)));
        let lowest = all.min_by(|a, b| map.costs[a.0][a.1].total_cmp(&map.costs[b.0][b.1])).unwrap();
        assert_eq!(lowest, (20, 20), "the middle, within a cell");
        let [x, y] = map.optimum;
        let error = identify(&records, &spec).unwrap().uncertainty.unwrap().std_error[0].unwrap();
        let widest = map.ellipse.iter().map(|p| p.0 - x).fold(0.0, f64::max);
        assert!((widest / (2.4477 * error) - 1.0).abs() < 1e-3);
        assert!(map.ellipse.iter().any(|p| p.1 > y) && map.ellipse.iter().any(|p| p.1 < y));
        assert!(cost_map(&records, &spec, [Parameter::R, Parameter::R], 41).is_err());
    }
}
