//! Random machines and excitations: distributions, random steps, and a machine with its recording.

use crate::machines::integrator::{Inputs, State, System, simulated};
use motorfit::numeric::{count, standard_deviation, whole};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Random numbers of one machine.
pub struct Numbers(Xoshiro256PlusPlus);

impl Numbers {
    /// Returns the numbers of a machine of a model, which do not depend on other machines.
    pub fn new(model: &str, machine: u64) -> Self {
        let name = model.bytes().fold(0_u64, |hash, byte| hash.wrapping_mul(257).wrapping_add(byte.into()));
        Self(Xoshiro256PlusPlus::seed_from_u64(name.wrapping_mul(7919).wrapping_add(machine)))
    }

    pub fn uniform(&mut self, from: f64, to: f64) -> f64 {
        self.0.random_range(from..to)
    }

    pub fn log_uniform(&mut self, from: f64, to: f64) -> f64 {
        self.uniform(from.ln(), to.ln()).exp()
    }

    pub fn is_likely(&mut self, probability: f64) -> bool {
        self.uniform(0.0, 1.0) < probability
    }

    pub fn sign(&mut self) -> f64 {
        if self.is_likely(0.5) { 1.0 } else { -1.0 }
    }

    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Returns random steps after `rest` samples of zero. The logarithm of the number of samples of a step is uniform.
    pub fn steps(
        &mut self,
        (samples, rest): (usize, usize),
        [shortest, longest]: [f64; 2],
        mut level: impl FnMut(&mut Self) -> f64,
    ) -> Vec<f64> {
        let mut steps = vec![0.0; rest];
        while steps.len() < samples {
            let length = whole(self.log_uniform(shortest, longest).round().max(1.0));
            let value = level(self);
            steps.extend(vec![value; length]);
        }
        steps.truncate(samples);
        steps
    }
}

/// Returns true if each value lies within its bounds.
pub fn is_inside(values: &[(f64, [f64; 2])]) -> bool {
    values.iter().all(|(value, [min, max])| (*min..=*max).contains(value))
}

/// A machine with its excitation.
pub struct Machine {
    pub system: Box<dyn System>,
    /// True parameters in the order and in the units of the model.
    pub truth: Vec<f64>,
    pub period_s: f64,
    /// Values of the inputs at each sample, in the order of the model.
    pub inputs: Vec<Inputs>,
    pub initial: State,
}

/// Outputs of a machine without noise, shape `[outputs][samples]`, and the standard deviations of their noise.
pub struct Clean {
    pub outputs: Vec<Vec<f64>>,
    pub sigma: Vec<f64>,
    /// Largest root mean square of the changes by the last halving of the substeps, relative to the noise.
    pub change: f64,
    pub substeps: f64,
}

/// Standard deviation of the noise relative to that of the output: 40 dB.
const NOISE: f64 = 0.01;
/// Largest change of a trajectory by the last halving of its substeps, relative to the noise. An error of this size moves an estimate
/// from n samples by at most 2e-4 √n standard errors, 0.014 of 5000.
pub const CHANGE: f64 = 2e-4;

impl Machine {
    /// Simulates with substeps that are halved until the trajectory stays the same, or 256 in each sampling period.
    pub fn simulated(&self) -> Clean {
        let outputs = |substeps| simulated(&*self.system, &self.initial, &self.inputs, (self.period_s, substeps));
        let mut substeps = 4.0;
        let mut last = outputs(substeps);
        loop {
            substeps *= 2.0;
            let outputs = outputs(substeps);
            let sigma: Vec<f64> = outputs.iter().map(|signal| NOISE * standard_deviation(signal)).collect();
            let changes = outputs.iter().zip(&last).zip(&sigma).map(|((a, b), sigma)| {
                let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
                (squares / count(a.len())).sqrt() / sigma
            });
            let change = changes.fold(0.0, f64::max);
            if change < CHANGE || substeps >= 256.0 {
                return Clean { outputs, sigma, change, substeps };
            }
            last = outputs;
        }
    }
}
