//! The self-check of the shaders of a problem: the shader compilers of some driver versions are known to be faulty, and some
//! built-in functions are wrong in f64.

use super::super::device::{AdapterFacts, Device, error};
use super::loaded::Loaded;
use motorfit_core::Result;
use motorfit_core::numeric::count;
use motorfit_core::setting::text;
use motorfit_evaluate::model::ModelProblem;
use motorfit_model::wgsl::ShaderPrecision;
use rand::{RngExt as _, SeedableRng as _};

/// Number of candidates that are compared.
const CANDIDATES: usize = 16;
/// Spans that are compared, in samples. After a bounce of a backlash two computations differ soon, so that a shorter span may agree where
/// the longest does not.
const SPANS: [usize; 3] = [300, 40, 8];
/// Fraction of the comparisons that must agree.
const AGREEING: f64 = 0.75;

/// Compares the sums of a device with those of the graph for candidates spread over the bounds. Returns false if all candidates diverge
/// within the shortest span, so that there is nothing to compare.
pub(super) fn check(
    device: &Device,
    loaded: &mut Loaded,
    problem: &ModelProblem,
    precision: ShaderPrecision,
) -> Result<bool> {
    let axes = &problem.space().free;
    let mut numbers = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(7);
    let candidates: Vec<Vec<f64>> =
        (0..CANDIDATES).map(|_| axes.iter().map(|axis| axis.at(numbers.random::<f64>())).collect()).collect();
    let candidates: Vec<&[f64]> = candidates.iter().map(Vec::as_slice).collect();
    for unit in 0..loaded.units() {
        let mut worst = None;
        let mut is_right = false;
        for span in SPANS {
            let compared = compare(device, loaded, problem, (unit, span), &candidates)?;
            let agreeing = compared.iter().filter(|error| **error <= allowed(precision)).count();
            is_right = agreeing > 0 && count(agreeing) >= AGREEING * count(compared.len());
            if is_right {
                break;
            }
            worst = worst.or_else(|| compared.iter().copied().reduce(f64::max));
        }
        if is_right {
            continue;
        }
        let Some(worst) = worst else { return Ok(false) };
        let AdapterFacts { name, driver, .. } = &device.facts;
        let message = format!(
            "{name} ({driver}) computes the model {} wrongly in {}: relative error {worst:.1e}",
            problem.model().name(),
            motorfit_core::named::Named::name(&precision)
        );
        return Err(error(message, text!("Update its driver, choose another adapter, or use " [Device = "cpu"] ".")));
    }
    Ok(true)
}

/// Largest relative error of a sum: rounding, and in f32 the differences of close numbers.
fn allowed(precision: ShaderPrecision) -> f64 {
    match precision {
        ShaderPrecision::F64 => 1e-8,
        ShaderPrecision::F32 => 5e-3,
    }
}

/// Returns the relative errors of the sums that are finite by the graph; +∞ for one that is not finite on the device.
fn compare(
    device: &Device,
    loaded: &mut Loaded,
    problem: &ModelProblem,
    (unit, span): (usize, usize),
    candidates: &[&[f64]],
) -> Result<Vec<f64>> {
    let (_, prepared) = problem.prepared(unit);
    let found = loaded.sums(device, problem, (unit, span), candidates)?;
    let mut errors = Vec::new();
    for (n, candidate) in candidates.iter().enumerate() {
        let expected = problem.walk(candidate, unit, span);
        let measured = expected.iter().zip(&prepared.factors).filter(|(_, factor)| **factor > 0.0);
        for ((expected, _), found) in measured.zip(&found) {
            // Sums near the bound of finite numbers differ between precisions.
            if expected.is_finite() && expected.abs() < 1e30 {
                let difference = (found[n] - expected).abs();
                errors.push(if difference == 0.0 { 0.0 } else { difference / expected.abs() });
            }
        }
    }
    Ok(errors)
}
