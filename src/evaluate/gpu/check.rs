//! The self-check: the compilers of some driver versions are known to be wrong, so every shader is compared with the
//! oracle before its first use.

use super::device::AdapterFacts;
use super::shader::{Precision, Variant};
use crate::criterion::{Criterion, Norm};
use crate::evaluate::{Model, Problem, Scalar};
use crate::motor::{Discretization, Drive, Parameters, Space, Trajectory, simulate};
use crate::record::{Record, Samples};
use crate::{Error, ErrorKind, Result};
use std::sync::Arc;

/// Samples of the experiment: more than a block of the shader, and no multiple of anything.
const SAMPLES: u32 = 395;

/// A short experiment with a motor like the paper's under a criterion that needs `variant`, and candidates around it.
pub(super) fn specimen(variant: Variant) -> Result<(Arc<Problem>, Vec<f64>)> {
    let voltage: Vec<f64> = (0..SAMPLES).map(|n| if n < 20 { 0.0 } else { 10.0 - f64::from(n / 100) }).collect();
    let drive = Drive { step_s: &[0.001], step_index: &[], voltage: &voltage, voltage_end: &[], torque: &[] };
    let truth = Parameters::M2.to_array();
    let Trajectory { current, speed } = simulate(&Parameters::M2, &drive, [0.0; 2], Discretization::Zoh);
    let time_s = (0..SAMPLES).map(|n| f64::from(n) * 0.001).collect();
    let record = Record::new(Samples { time_s, voltage, torque: None, current: Some(current), speed: Some(speed) })?;
    let norm = match (variant.absolute, variant.weighted) {
        (false, false) => Norm::Nrmse,
        (false, true) => Norm::Itse,
        (true, false) => Norm::Iae,
        (true, true) => Norm::Itae,
    };
    let criterion = Criterion { norm, ..Criterion::default() };
    let problem = Problem::new(&[record], Model::default(), Space::table2(), criterion)?;
    let factor = |n: u32, axis: u32| 1.0 + 0.3 * f64::from(n * 7 + axis * 5 + 1).sin();
    let candidates = (0..37).flat_map(|n| (0..5).map(move |axis| (n, axis)));
    Ok((Arc::new(problem), candidates.map(|(n, axis)| truth[axis as usize] * factor(n, axis)).collect()))
}

/// Costs that a device gave against the oracle's.
pub(super) fn compare(
    facts: &AdapterFacts,
    precision: Precision,
    problem: &Problem,
    values: &[f64],
    costs: &[f64],
) -> Result<()> {
    // Ten times what the suite of tests allows.
    let allowed = match precision {
        Precision::F64 => 1e-11,
        Precision::F32 => 2e-4,
        Precision::F32Plain => 1e-3,
    };
    for (row, cost) in values.chunks(5).zip(costs) {
        let oracle = Scalar::cost(problem, row);
        let error = (cost - oracle).abs() / oracle;
        if error.is_nan() || error > allowed {
            let AdapterFacts { name, driver, .. } = facts;
            let precision = precision.name();
            return Err(Error::new(
                ErrorKind::Device,
                format!(
                    "{name} ({driver}) computes wrongly in {precision}: {cost:e} where {oracle:e} is right, off by \
                     {error:.1e}"
                ),
                "Update its driver, choose another adapter, or use --device cpu.",
            ));
        }
    }
    Ok(())
}
