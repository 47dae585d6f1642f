//! Shared by the test programs: the paper's experiment, candidates, evaluation of one group.
#![allow(dead_code, reason = "each test program uses its part")]
#![allow(clippy::unwrap_used, reason = "a test may stop")]

#[cfg(feature = "gpu")]
pub mod adapter;
pub mod browser;
pub mod faults;
pub mod joint;
pub mod program;
pub mod rates;
pub mod recordings;
pub mod suite;
pub mod varied;
pub mod wpilog;

use motorfit::Result;
use motorfit::candidates::Candidates;
use motorfit::criterion::{Criterion, Noise, Norm, Scale};
use motorfit::evaluate::model::ModelRecording;
use motorfit::evaluate::{Batch, Evaluator, Group, Model, Problem};
use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{Discretization, Parameters, Space};
use motorfit::record::{Record, Samples};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::sync::Arc;

/// All criteria and all scales.
pub const NORMS: [Norm; 7] = [Norm::Euclidean, Norm::Ise, Norm::Iae, Norm::Itse, Norm::Itae, Norm::Mse, Norm::Nrmse];
pub const SCALES: [Scale; 4] = [Scale::None, Scale::Peak, Scale::Std, Scale::Noise];

/// Returns a criterion, with a fixed noise σ for recordings without noise.
pub fn criterion(norm: Norm, scale: Scale) -> Criterion {
    Criterion { norm, scale, time_origin_s: None, noise: Noise::Sigma([Some(0.012), Some(1.04)]) }
}

/// Returns the recording of the paper's experiment without noise.
pub fn m2_record() -> Record {
    simulated(&Parameters::M2, &Excitation::step(10.5, 1.0, 3.0, 0.001).unwrap(), Discretization::Zoh).unwrap()
}

/// Returns a recording of the M2 motor from rest under a voltage and a load torque, without noise.
pub fn driven(time_s: Vec<f64>, voltage: Vec<f64>, torque: Option<Vec<f64>>) -> Record {
    simulated(&Parameters::M2, &Excitation { time_s, voltage, torque }, Discretization::Zoh).unwrap()
}

/// Returns a copy of a recording with changed samples.
pub fn changed(record: &Record, change: impl FnOnce(&mut Samples)) -> Record {
    let mut samples = record.samples().clone();
    change(&mut samples);
    Record::new(samples).unwrap()
}

/// Returns a recording of a motor as one of a model with its inputs and outputs.
pub fn of_model(record: &Record) -> ModelRecording {
    ModelRecording {
        time_s: record.samples().time_s.clone(),
        step_s: vec![record.period_s()],
        inputs: vec![record.samples().voltage.clone(), vec![0.0; record.len()]],
        measured: record.measured().map(|signal| signal.map(<[f64]>::to_vec)).to_vec(),
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
    }
}

/// Returns a problem with the bounds of Table 2.
pub fn problem(records: &[Record], model: Model, criterion: Criterion) -> Arc<Problem> {
    Arc::new(Problem::new(records, model, Space::table2(), criterion).unwrap())
}

/// Returns uniformly distributed candidates within the bounds of Table 2.
pub fn uniform(count: usize, seed: u64) -> Vec<f64> {
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(seed);
    let bounds = Space::table2().bounds();
    (0..count).flat_map(|_| bounds.iter().map(|&(a, b)| numbers.random_range(a..b)).collect::<Vec<_>>()).collect()
}

/// Returns candidates whose parameters differ from the M2 motor by up to `distance`, relatively.
pub fn near(count: usize, distance: f64, seed: u64) -> Vec<f64> {
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(seed);
    let truth = Parameters::M2.to_array();
    (0..count).flat_map(|_| truth.map(|p| p * (1.0 + distance * numbers.random_range(-1.0..1.0)))).collect()
}

/// Returns the costs of one group.
pub fn costs(evaluator: &mut dyn Evaluator, problem: &Arc<Problem>, values: &[f64]) -> Vec<f64> {
    let width = problem.space().free().len();
    let groups = [Group { problem, candidates: Candidates::new(values, width), reference: None }];
    batch(evaluator, &groups).unwrap()
}

/// Returns the costs of a batch.
pub fn batch(evaluator: &mut dyn Evaluator, groups: &[Group<'_>]) -> Result<Vec<f64>> {
    let batch = Batch { groups };
    let mut costs = vec![f64::NAN; batch.count()];
    evaluator.evaluate(&batch, &mut costs)?;
    Ok(costs)
}
