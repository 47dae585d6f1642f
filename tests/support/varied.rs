//! Simulated recordings of random motors with various excitations, rates, lengths, noise and channels.
#![allow(clippy::unwrap_used, reason = "a test may stop")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "small numbers"
)]

use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{Discretization, Parameters};
use motorfit::record::{Record, Samples};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
pub use rand_xoshiro::Xoshiro256PlusPlus as Numbers;
use std::f64::consts::TAU;

/// Kinds of excitations.
pub const KINDS: [&str; 9] = ["step", "steps", "prbs", "chirp", "sine", "ramp", "staircase", "impulses", "multisine"];

/// Recording with its motor and excitation.
pub struct Varied {
    pub kind: &'static str,
    pub record: Record,
    pub motor: Parameters,
    /// Stall torque \[N·m\].
    pub stall: f64,
    /// Number of samples per value of a binary sequence.
    pub hold: usize,
    /// Mechanical time constant \[samples\].
    pub memory: f64,
}

pub fn numbers(seed: u64) -> Numbers {
    Numbers::seed_from_u64(seed)
}

pub fn log_uniform(numbers: &mut Numbers, from: f64, to: f64) -> f64 {
    (numbers.random_range(from.ln()..to.ln())).exp()
}

/// Draws a motor with the mechanical time constant `memory` \[s\]; returns it with its nominal voltage \[V\].
pub fn motor(numbers: &mut Numbers, memory: f64) -> (Parameters, f64) {
    let volts = log_uniform(numbers, 3.0, 48.0);
    let k = volts / log_uniform(numbers, 30.0, 1500.0);
    let r = log_uniform(numbers, 0.2, 20.0);
    let b = log_uniform(numbers, 0.003, 0.3) * k * k / r;
    let j = memory * k * k / r;
    let l = log_uniform(numbers, 0.002, 0.2) * memory * r;
    (Parameters::from_array([r, l, k, b, j]), volts)
}

pub fn voltage(numbers: &mut Numbers, kind: &str, count: usize, memory: f64) -> (Vec<f64>, usize) {
    let rest = numbers.random_range(0..=count / 5);
    let dwell = ((memory * log_uniform(numbers, 0.3, 8.0)) as usize).clamp(5, count / 4);
    let hold = (log_uniform(numbers, 1.0, (1.5 * memory).max(2.0)) as usize).clamp(1, count / 4);
    let signed = numbers.random_bool(0.5);
    let cycles = log_uniform(numbers, 2.0, number(count) / 12.0);
    let phases: Vec<f64> = (0..8).map(|_| numbers.random_range(0.0..TAU)).collect();
    let top = numbers.random_range(3..10);
    let mut level = 0.0;
    let volts = (0..count).map(|n| {
        if n < rest {
            return 0.0;
        }
        let (at, part) = (n - rest, number(n - rest) / number(count - rest));
        match kind {
            "step" => 1.0,
            "steps" => {
                if at % dwell == 0 {
                    level = numbers.random_range(if signed { -1.0..1.0 } else { 0.1..1.0 });
                }
                level
            }
            "prbs" => {
                if at % hold == 0 {
                    level = if numbers.random_bool(0.5) {
                        1.0
                    } else if signed {
                        -1.0
                    } else {
                        0.0
                    };
                }
                level
            }
            "chirp" => (TAU * cycles * (0.2 * part + 0.8 * part * part)).sin(),
            "triangle" => {
                let triangle = (TAU * cycles * part).sin().asin() * 4.0 / TAU;
                if signed { triangle } else { triangle.abs() }
            }
            "sine" => (TAU * cycles * part).sin(),
            "ramp" => part,
            "staircase" => {
                let steps = if signed { 2 * top } else { top };
                let at = (part * number(steps)) as usize;
                number(if at < top { at + 1 } else { steps - at }) / number(top)
            }
            "impulses" => {
                if at % (4 * dwell) < hold.min(2 * dwell) {
                    1.0
                } else {
                    0.0
                }
            }
            _ => {
                phases
                    .iter()
                    .zip(1..)
                    .map(|(p, k)| (p + TAU * f64::from(k * k) * cycles / 64.0 * part).sin())
                    .sum::<f64>()
                    / 4.0
            }
        }
    });
    (volts.collect(), hold)
}

fn number(count: usize) -> f64 {
    count as f64
}

/// Draws a recording without noise, with both channels.
pub fn clean(numbers: &mut Numbers, kind: &'static str, count: usize) -> Varied {
    let (varied, excitation) = drawn(numbers, kind, count, 600.0);
    let record = simulated(&varied.motor, &excitation, Discretization::Zoh).unwrap();
    Varied { record, ..varied }
}

/// Draws a motor with a time constant of up to `longest` samples and its excitation. The recording is a placeholder.
pub fn drawn(numbers: &mut Numbers, kind: &'static str, count: usize, longest: f64) -> (Varied, Excitation) {
    let memory = log_uniform(numbers, 3.0, longest).min(number(count));
    let period = [0.0005, 0.001, 0.002, 0.005, 0.01, 0.02][numbers.random_range(0..6)];
    let (motor, volts) = motor(numbers, memory * period);
    let (mut voltage, hold) = voltage(numbers, kind, count, memory);
    voltage.iter_mut().for_each(|v| *v *= volts);
    let time_s: Vec<f64> = (0..count).map(|n| number(n) * period).collect();
    let none = Some(vec![0.0; count]);
    let samples = Samples {
        time_s: time_s.clone(),
        voltage: voltage.clone(),
        torque: None,
        current: none.clone(),
        speed: none,
        ..Samples::default()
    };
    let record = Record::new(samples).unwrap();
    let varied = Varied { kind, record, motor, stall: motor.k * volts / motor.r, hold, memory };
    (varied, Excitation { time_s, voltage, torque: None })
}

/// Adds white noise `decibels` below the rms.
pub fn noisy(numbers: &mut Numbers, values: &mut [f64], decibels: f64) {
    let rms = (values.iter().map(|v| v * v).sum::<f64>() / number(values.len())).sqrt();
    let sigma = rms * 10f64.powf(-decibels / 20.0);
    for value in values {
        let normal: f64 = StandardNormal.sample(numbers);
        *value += sigma * normal;
    }
}

/// Draws a recording without faults, with noise and one or both channels.
pub fn varied(seed: u64) -> Varied {
    let mut numbers = numbers(seed);
    let kind = KINDS[numbers.random_range(0..KINDS.len())];
    let count = log_uniform(&mut numbers, 200.0, 10_000.0) as usize;
    let mut varied = clean(&mut numbers, kind, count);
    let mut samples: Samples = varied.record.samples().clone();
    for signal in [&mut samples.current, &mut samples.speed].into_iter().flatten() {
        let decibels = numbers.random_range(20.0..60.0);
        noisy(&mut numbers, signal, decibels);
    }
    match numbers.random_range(0..4) {
        0 => samples.current = None,
        1 => samples.speed = None,
        _ => {}
    }
    varied.record = Record::new(samples).unwrap();
    varied
}
