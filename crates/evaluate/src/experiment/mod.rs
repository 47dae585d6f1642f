//! Simulated experiments: an excitation drives a motor at rest, and white noise is added to current and speed.

mod excitation;
mod shape;
mod streamed;

pub use excitation::Excitation;
pub use shape::Shape;
pub use streamed::{StepExperiment, StepFigures};

use crate::criterion::Noise;
use excitation::diverges;
use motorfit_core::{Error, Result};
use motorfit_motor::{Discretization, Extended, ExtendedWalk, InputHistory, SimulationInput, SimulationSettings, walk};
use motorfit_record::{Record, Samples};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

/// Simulates a motor that starts at rest and returns its recording without noise.
///
/// # Errors
/// Returns a data error if the simulation diverges or the excitation is not a valid recording.
pub fn simulated(motor: impl Into<Extended>, excitation: &Excitation, method: Discretization) -> Result<Record> {
    let Excitation { time_s, voltage, torque } = excitation.clone();
    if voltage.len() != time_s.len() {
        let message = format!("{} samples of time but {} of voltage", time_s.len(), voltage.len());
        return Err(Error::data(message, "Give one voltage per sample of time."));
    }
    let zero = Some(vec![0.0; time_s.len()]);
    let draft =
        Record::new(Samples { time_s, voltage, torque, current: zero.clone(), speed: zero, ..Samples::default() })?;
    let mut signals = [0, 1].map(|_| Vec::with_capacity(draft.len()));
    let visit = |seen: [f64; 2]| signals.iter_mut().zip(seen).for_each(|(signal, value)| signal.push(value));
    let motor = motor.into();
    let features = motor.features();
    if features.is_linear() {
        walk(&motor.parameters(), &drive(&draft), [0.0; 2], method, visit);
    } else {
        let history = InputHistory::of(&draft.samples().voltage, true);
        let settings = SimulationSettings { features, method: method.into(), history };
        ExtendedWalk::new(&motor, &drive(&draft), settings, [0.0; 2]).for_each(visit);
    }
    let [current, speed] = signals.map(Some);
    Record::new(Samples { current, speed, ..draft.samples().clone() }).map_err(|error| diverges(&error))
}

/// Returns a recording with white Gaussian noise of standard deviation `sigma` added (current \[A\], speed \[rad/s\]).
///
/// # Errors
/// Returns a data error if a value leaves the range of a recording.
pub fn with_noise(record: &Record, sigma: [f64; 2], seed: u64) -> Result<Record> {
    let add = |samples: &mut Samples| {
        for (stream, (signal, sigma)) in (0..).zip([&mut samples.current, &mut samples.speed].into_iter().zip(sigma)) {
            let Some(signal) = signal else { continue };
            let noise = white_noise(signal.len(), sigma, seed, stream);
            signal.iter_mut().zip(noise).for_each(|(value, noise)| *value += noise);
        }
    };
    record.clone().changed(add, "white noise added".to_owned())
}

/// Returns white Gaussian noise with the standard deviation `sigma`; each stream of a seed is independent of the others.
#[must_use]
pub fn white_noise(length: usize, sigma: f64, seed: u64, stream: u64) -> Vec<f64> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    generator.set_stream(stream);
    let mut next = || {
        let normal: f64 = StandardNormal.sample(&mut generator);
        sigma * normal
    };
    (0..length).map(|_| next()).collect()
}

/// Returns the standard deviation of the noise to be added to current \[A\] and speed \[rad/s\] of a recording; 0 for a missing
/// channel, and for a channel without a given value.
#[must_use]
pub fn noise_of(record: &Record, noise: Noise) -> [f64; 2] {
    let measured = record.measured();
    let sigma = |channel: usize, signal: &[f64]| match noise {
        Noise::Sigma(sigma) => sigma[channel].unwrap_or(0.0),
        noise => noise.sigma(channel, signal),
    };
    [0, 1].map(|channel| measured[channel].map_or(0.0, |signal| sigma(channel, signal)))
}

/// Returns the input of a recording in the form of [`simulate`](motorfit_motor::simulate).
#[must_use]
pub fn drive(record: &Record) -> SimulationInput<'_> {
    let (samples, steps) = (record.samples(), record.steps());
    SimulationInput {
        step_s: &steps.step_s,
        step_index: &steps.step_index,
        voltage: record.input(),
        voltage_end: &[],
        torque: samples.torque.as_deref().unwrap_or_default(),
    }
}
