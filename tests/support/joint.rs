//! Simulated recordings for joint fits: random motors with extensions, five excitations each, white noise.
#![allow(clippy::unwrap_used, reason = "a test may stop")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "small numbers"
)]

use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{Axis, Discretization, Extended, Extension, Parameter, Scope, Space};
use motorfit::record::{Record, Samples};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
pub use rand_xoshiro::Xoshiro256PlusPlus as Numbers;

/// Motor, its nominal voltage, and the sampling period of its recordings.
pub struct Truth {
    pub motor: Extended,
    pub volts: f64,
    pub period_s: f64,
}

/// Number of excitations: a step, random levels, a binary sequence, a staircase in both directions, pulses.
pub const EXCITATIONS: usize = 5;

pub fn numbers(seed: u64) -> Numbers {
    Numbers::seed_from_u64(seed.wrapping_mul(7919).wrapping_add(13))
}

fn log_uniform(numbers: &mut Numbers, from: f64, to: f64) -> f64 {
    numbers.random_range(from.ln()..to.ln()).exp()
}

/// Draws a motor with these extensions, each large enough to be significant.
pub fn motor(numbers: &mut Numbers, with: &[Extension]) -> Truth {
    let period_s = [0.001, 0.002, 0.005][numbers.random_range(0..3)];
    let constant = period_s * log_uniform(numbers, 15.0, 80.0);
    let volts = log_uniform(numbers, 5.0, 36.0);
    let k = volts / log_uniform(numbers, 60.0, 800.0);
    let r = log_uniform(numbers, 0.3, 10.0);
    let b = log_uniform(numbers, 0.01, 0.2) * k * k / r;
    let l = log_uniform(numbers, 0.05, 0.3) * constant * r;
    let j = constant * k * k / r;
    let stall = k * volts / r;
    let mut values: Vec<(Parameter, f64)> = Parameter::ALL.into_iter().zip([r, l, k, b, j]).collect();
    for extension in with {
        let (from, to, unit) = match extension {
            Extension::Coulomb | Extension::Load => (0.04, 0.15, stall),
            Extension::DeadTime => (2.0, 8.0, period_s),
            Extension::Latency => (4.0, 15.0, period_s),
            Extension::Deadband => (0.05, 0.15, volts),
            Extension::Saturation => (0.5, 0.8, volts),
            Extension::SensorAverage => (4.0, 12.0, 1.0),
            Extension::DirectionGain => (0.6, 0.8, 1.0),
            other => panic!("{other:?} is not drawn"),
        };
        let value = unit * numbers.random_range(from..to);
        values.extend(extension.parameters().iter().map(|parameter| (*parameter, value)));
    }
    Truth { motor: built(&values), volts, period_s }
}

fn built(values: &[(Parameter, f64)]) -> Extended {
    let (parameter, value) = values[0];
    let axis = Axis { parameter, scope: Scope::Shared, min: 0.5 * value, max: 2.0 * value };
    let held = values[1..].iter().map(|(parameter, value)| (*parameter, Scope::Shared, *value)).collect();
    Space::new(vec![axis], held).unwrap().motor(&[value], 0)
}

/// Returns the voltage of an excitation \[V\], zero for the first tenth.
pub fn voltage(numbers: &mut Numbers, truth: &Truth, excitation: usize, count: usize) -> Vec<f64> {
    let of = |parameter| truth.motor.get(parameter);
    let constant = of(Parameter::R) * of(Parameter::J) / of(Parameter::K).powi(2) / truth.period_s;
    let (rest, dwell, hold) = (count / 10, (3.0 * constant) as usize + 5, (0.6 * constant).max(2.0) as usize);
    let mut level = 0.0;
    let share = |n: usize| {
        if n < rest {
            return 0.0;
        }
        let at = n - rest;
        match excitation {
            0 => level = 1.0,
            1 if at.is_multiple_of(dwell) => level = numbers.random_range(-1.0..1.0),
            2 if at.is_multiple_of(hold) => level = if numbers.random_bool(0.5) { 1.0 } else { -1.0 },
            3 => {
                let size = ((8 * at / (count - rest)).min(4) + 1) as f64 / 5.0;
                level = if 2 * at > count - rest { -size } else { size };
            }
            4 => level = f64::from(u8::from(at % (2 * dwell) < dwell)),
            _ => {}
        }
        level
    };
    (0..count).map(share).map(|share| share * truth.volts).collect()
}

/// Adds white noise `decibels` below the rms of each channel.
pub fn noisy(numbers: &mut Numbers, record: &Record, decibels: f64) -> Record {
    let mut samples: Samples = record.samples().clone();
    for signal in [&mut samples.current, &mut samples.speed].into_iter().flatten() {
        let rms = (signal.iter().map(|v| v * v).sum::<f64>() / signal.len() as f64).sqrt();
        for value in signal.iter_mut() {
            let normal: f64 = StandardNormal.sample(numbers);
            *value += rms * 10f64.powf(-decibels / 20.0) * normal;
        }
    }
    Record::new(samples).unwrap()
}

/// Returns a recording of `count` samples.
pub fn record(numbers: &mut Numbers, truth: &Truth, excitation: usize, count: usize, decibels: f64) -> Record {
    let voltage = voltage(numbers, truth, excitation, count);
    let time_s = (0..count).map(|n| n as f64 * truth.period_s).collect();
    let excitation = Excitation { time_s, voltage, torque: None };
    noisy(numbers, &simulated(truth.motor, &excitation, Discretization::Zoh).unwrap(), decibels)
}

/// Returns a recording whose voltage is logged late, as by a program that logs asynchronously: the drive applies each value at
/// a uniformly distributed time in the period before its sample.
pub fn late(numbers: &mut Numbers, truth: &Truth, excitation: usize, count: usize, decibels: f64) -> Record {
    const FINE: usize = 10;
    let voltage = voltage(numbers, truth, excitation, count);
    let mut fine = Vec::with_capacity(count * FINE);
    for n in 0..count {
        let (now, next, at) = (voltage[n], voltage[(n + 1).min(count - 1)], numbers.random_range(0..FINE));
        fine.extend((0..FINE).map(|k| if k < at { now } else { next }));
    }
    let time_s = |count: usize, period_s: f64| (0..count).map(|n| n as f64 * period_s).collect::<Vec<f64>>();
    let times = time_s(fine.len(), truth.period_s / FINE as f64);
    let excitation = Excitation { time_s: times, voltage: fine, torque: None };
    let all = simulated(truth.motor, &excitation, Discretization::Zoh).unwrap();
    let logged = |signal: &Option<Vec<f64>>| signal.as_ref().map(|of| of.iter().step_by(FINE).copied().collect());
    let samples = Samples {
        time_s: time_s(count, truth.period_s),
        voltage,
        current: logged(&all.samples().current),
        speed: logged(&all.samples().speed),
        ..Samples::default()
    };
    noisy(numbers, &Record::new(samples).unwrap(), decibels)
}

/// Returns a recording with a jitter of up to `jitter` periods, whose voltage is logged `late` periods after the drive applies
/// it.
pub fn shifted(
    numbers: &mut Numbers,
    truth: &Truth,
    (excitation, count, decibels): (usize, usize, f64),
    (late, jitter): (f64, f64),
) -> Record {
    const FINE: usize = 20;
    let voltage = voltage(numbers, truth, excitation, count);
    let step = truth.period_s / FINE as f64;
    let mut at: Vec<usize> =
        (0..count).map(|n| n * FINE + (jitter * FINE as f64 * numbers.random_range(0.0..1.0)) as usize).collect();
    at[0] = 0;
    let taken = |n: usize| at[n].saturating_sub((late * FINE as f64).round() as usize);
    let mut fine = Vec::with_capacity(count * FINE);
    let mut now = 0;
    for k in 0..=at[count - 1] {
        while now + 1 < count && taken(now + 1) <= k {
            now += 1;
        }
        fine.push(voltage[now]);
    }
    let time_s = |at: &mut dyn Iterator<Item = usize>| at.map(|k| k as f64 * step).collect::<Vec<f64>>();
    let excitation = Excitation { time_s: time_s(&mut (0..fine.len())), voltage: fine, torque: None };
    let all = simulated(truth.motor, &excitation, Discretization::Zoh).unwrap();
    let logged = |signal: &Option<Vec<f64>>| signal.as_ref().map(|of| at.iter().map(|k| of[*k]).collect());
    let samples = Samples {
        time_s: time_s(&mut at.iter().copied()),
        voltage,
        current: logged(&all.samples().current),
        speed: logged(&all.samples().speed),
        ..Samples::default()
    };
    noisy(numbers, &Record::new(samples).unwrap(), decibels)
}

/// Returns one recording of each excitation.
pub fn records(numbers: &mut Numbers, truth: &Truth, count: usize, decibels: f64) -> Vec<Record> {
    (0..EXCITATIONS).map(|excitation| record(numbers, truth, excitation, count, decibels)).collect()
}
