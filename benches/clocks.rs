//! Measures identification of recordings with irregular sampling times against recordings with a constant period: the median
//! ratio of alternating runs, for the linear motor and with Coulomb friction, for single recordings and joint fits.
#![allow(missing_docs, reason = "a bench has no public interface")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a bench prints and may stop")]

mod support;

use motorfit::experiment::{Excitation, simulated};
use motorfit::identify::{IdentifySpec, identify};
use motorfit::motor::{Discretization, Extended, Extension, Parameter, Parameters, With};
use motorfit::record::{Gaps, ReadOptions, Record, Samples, read_bytes, write_csv};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus as Numbers;
use support::{median, ratio, seconds};

const PERIOD_S: f64 = 1e-3;

/// Sampling times of a recording.
#[derive(Clone, Copy)]
enum Clock {
    Regular,
    /// Jitter of up to 0.3 periods: nearly every step has a different length.
    Jittered,
    /// Jitter of up to 0.3 periods, quantized to 0.1 periods: some ten different lengths of steps.
    Quantized,
    /// Jitter of up to 0.3 periods, and a gap of a tenth of the samples.
    Gap,
}

/// Returns recordings of the M2 motor under a random piecewise-constant voltage, with about 40 dB of noise.
fn records(clock: Clock, (count, samples): (u64, u32), friction: f64) -> Vec<Record> {
    (0..count).map(|seed| record(clock, samples, friction, seed)).collect()
}

fn record(clock: Clock, samples: u32, friction: f64, seed: u64) -> Record {
    let mut numbers = Numbers::seed_from_u64(seed);
    let missing = if matches!(clock, Clock::Gap) { samples / 2..samples / 2 + samples / 10 } else { 0..0 };
    let count = samples + missing.end - missing.start;
    let time = |n: u32| {
        let off = 0.3 * numbers.random_range(-1.0..1.0);
        let off = match clock {
            Clock::Regular => 0.0,
            Clock::Jittered | Clock::Gap => off,
            Clock::Quantized => (10.0_f64 * off).round() / 10.0,
        };
        PERIOD_S * (f64::from(n) + off)
    };
    let time_s: Vec<f64> = (0..count).map(time).collect();
    let mut level = 0.0;
    let voltage = |n: u32| {
        if n >= 20 && n % 40 == 20 && !missing.contains(&n) {
            level = numbers.random_range(-10.5..10.5);
        }
        level
    };
    let voltage = (0..count).map(voltage).collect();
    let excitation = Excitation { time_s, voltage, torque: None };
    let motor = Extended::from(&Parameters::M2).with(Parameter::Coulomb, friction);
    let clean = simulated(motor, &excitation, Discretization::Zoh).unwrap();
    let mut samples: Samples = clean.samples().clone();
    for (signal, sigma) in [(&mut samples.current, 0.03), (&mut samples.speed, 0.6)] {
        for value in signal.iter_mut().flatten() {
            let noise: f64 = StandardNormal.sample(&mut numbers);
            *value += sigma * noise;
        }
    }
    let text = write_csv(&Record::new(samples).unwrap());
    let rows = text.lines().zip(0..).filter(|(_, n)| *n == 0 || !missing.contains(&(n - 1)));
    let rows: String = rows.map(|(row, _)| format!("{row}\n")).collect();
    let options = ReadOptions { gaps: Gaps::Keep, ..ReadOptions::default() };
    read_bytes(rows.as_bytes(), None, &options).unwrap().remove(0)
}

fn main() {
    let coulomb = IdentifySpec { with: With::These(vec![Extension::Coulomb]), ..IdentifySpec::default() };
    let clocks = [("jittered", Clock::Jittered), ("quantized", Clock::Quantized), ("gap", Clock::Gap)];
    for (name, spec, friction) in [("linear", IdentifySpec::default(), 0.0), ("Coulomb friction", coulomb, 0.02)] {
        for size @ (count, samples) in [(1, 165), (1, 1000), (1, 3000), (1, 20_000), (10, 165), (10, 1000)] {
            let run = |records: &[Record]| drop(identify(records, &spec).unwrap());
            let regular = records(Clock::Regular, size, friction);
            let base = median((0..5).map(|_| seconds(|| run(&regular))).collect());
            print!("{name}, {count:>2} x {samples:>6}: regular {:>8.1} ms", 1e3 * base);
            for (clock, of) in clocks {
                let irregular = records(of, size, friction);
                let found = identify(&irregular, &spec).unwrap().verification;
                let kind = found.reference.map_or("none".to_owned(), |kind| format!("{kind:?}"));
                let times = ratio(5, || run(&regular), || run(&irregular));
                print!(", {clock} {times:.2} ({kind}, {})", found.status.name());
            }
            println!();
        }
    }
}
