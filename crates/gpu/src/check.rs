//! The self-check: the shader compilers of some driver versions are known to be faulty, so every shader is compared with the
//! scalar evaluator before its first use.

use super::device::{self, AdapterFacts};
use super::features::ShaderFeatures;
use super::variant::{LANES, Precision, Variant};
use motorfit_core::Result;
use motorfit_core::candidates::Candidates;
use motorfit_core::setting::text;
use motorfit_evaluate::criterion::{Criterion, Norm};
use motorfit_evaluate::{Model, Problem, Scalar};
use motorfit_motor::{Discretization, Parameter, Parameters, SimulationInput, Space, simulate};
use motorfit_record::{Record, Samples};
use std::sync::Arc;

/// Number of samples of the experiment: more than a block of the shader, and no multiple of a block or a subgroup.
const SAMPLES: u32 = 395;

/// Number of candidates of which no cost is needed: those of one subgroup, which may end.
const UNNEEDED: usize = 8 * LANES;

/// Candidates around the parameters of the paper's motor M2 on a short simulated recording.
pub(crate) struct Specimen {
    pub problem: Arc<Problem>,
    pub values: Vec<f64>,
    /// Costs by the scalar evaluator.
    costs: Vec<f64>,
    /// Cutoffs, above the costs except for those of the first subgroup.
    cutoffs: Vec<f64>,
}

impl Specimen {
    /// Returns candidates that use the shader `variant`.
    pub(crate) fn new(variant: Variant) -> Result<Self> {
        let (problem, values) = candidates(variant)?;
        let costs: Vec<f64> =
            values.chunks(problem.space().free().len()).map(|row| Scalar::cost(&problem, row)).collect();
        let cutoff = |(row, cost): (usize, &f64)| if row < UNNEEDED { 0.2 * cost } else { 2.0 * cost };
        let cutoffs = costs.iter().enumerate().map(cutoff).collect();
        Ok(Self { problem, values, costs, cutoffs })
    }

    /// Returns the candidates with their cutoffs.
    pub(crate) fn candidates(&self) -> Candidates<'_> {
        Candidates::new(&self.values, self.problem.space().free().len()).with_cutoffs(&self.cutoffs)
    }

    /// Compares the costs of a device with those of the scalar evaluator. Returns a device error if one deviates too far
    /// or, for a candidate whose cost is above its cutoff, is not between the two.
    pub(crate) fn compare(&self, facts: &AdapterFacts, precision: Precision, costs: &[f64]) -> Result<()> {
        // The tolerances are ten times those of the test suite.
        let allowed = match precision {
            Precision::F64 => 1e-11,
            Precision::F32 => 2e-4,
            Precision::F32Plain => 1e-3,
        };
        for ((cost, oracle), cutoff) in costs.iter().zip(&self.costs).zip(&self.cutoffs) {
            let error = (cost - oracle) / oracle;
            let is_right = if oracle > cutoff { cost > cutoff && error <= allowed } else { error.abs() <= allowed };
            if !is_right {
                let AdapterFacts { name, driver, .. } = facts;
                let precision = precision.name();
                let message = format!(
                    "{name} ({driver}) computes wrongly in {precision}: cost {cost:e}, expected {oracle:e}, relative error {error:.1e}"
                );
                let remedy = text!("Update its driver, choose another adapter, or use " [Device = "cpu"] ".");
                return Err(device::error(message, remedy));
            }
        }
        Ok(())
    }
}

/// Returns a problem that uses the shader `variant`, with a short simulated recording of the paper's motor M2, and 37
/// candidates around the true parameters.
fn candidates(variant: Variant) -> Result<(Arc<Problem>, Vec<f64>)> {
    let volts = |n: u32| match n {
        0..20 => 0.0,
        300.. if variant.features.is_some() => -6.5,
        _ => 10.0 - f64::from(n / 100),
    };
    let voltage: Vec<f64> = (0..SAMPLES).map(volts).collect();
    let drive = SimulationInput { step_s: &[0.001], step_index: &[], voltage: &voltage, voltage_end: &[], torque: &[] };
    let [current, speed] = simulate(&Parameters::M2, &drive, [0.0; 2], Discretization::Zoh);
    let time_s = (0..SAMPLES).map(|n| f64::from(n) * 0.001).collect();
    let record = Record::new(Samples {
        time_s,
        voltage,
        torque: None,
        current: Some(current),
        speed: Some(speed),
        ..Samples::default()
    })?;
    let norm = match (variant.absolute, variant.weighted) {
        (false, false) => Norm::Nrmse,
        (false, true) => Norm::Itse,
        (true, false) => Norm::Iae,
        (true, true) => Norm::Itae,
    };
    let criterion = Criterion { norm, ..Criterion::default() };
    let (mut truth, mut space) = (Parameters::M2.to_array().to_vec(), Space::table2());
    if let Some(features) = variant.features {
        let extensions = extensions(features);
        truth.extend(extensions.iter().map(|(_, value)| value));
        let bounds: Vec<_> = extensions.iter().map(|&(of, value)| (of, 0.7 * value, 1.3 * value)).collect();
        space = Space::table2_with(&bounds, &[])?;
    }
    // A first-order hold of a delayed voltage has more special steps than a zero-order hold, which are checked too.
    let discretization = if variant.features.is_some() { Discretization::Foh } else { Discretization::Zoh };
    let problem = Problem::new(&[record], Model { discretization, ..Model::default() }, space, criterion)?;
    let factor = |n: u32, axis: u32| 1.0 + 0.3 * f64::from(n * 7 + axis * 5 + 1).sin();
    let candidate = |n| truth.iter().zip(0..).map(move |(value, axis)| value * factor(n, axis));
    Ok((Arc::new(problem), (0..37).flat_map(candidate).collect()))
}

/// Returns extensions that use the given shader parts, the drive and friction, with values that affect the cost.
fn extensions(features: ShaderFeatures) -> Vec<(Parameter, f64)> {
    use Parameter as P;
    let ShaderFeatures { brushes, delayed, averages } = features;
    let drive = [(P::Coulomb, 0.02), (P::Load, 0.01), (P::Offset, 0.2), (P::Deadband, 0.5), (P::Saturation, 8.0)];
    let parts = [
        (brushes, (P::BrushDrop, 0.7)),
        (delayed, (P::DeadTime, 0.0123)),
        (delayed, (P::Latency, 0.02)),
        (averages[0], (P::CurrentAverage, 9.0)),
        (averages[1], (P::SpeedAverage, 33.0)),
    ];
    let needed = parts.into_iter().filter_map(|(needed, part)| needed.then_some(part));
    drive.into_iter().chain([(P::NegativeGain, 0.9)]).chain(needed).collect()
}
