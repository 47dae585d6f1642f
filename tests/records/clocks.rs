//! Proves: recordings whose channels have clocks of their own give parameters without bias, with intervals that hold 95 % of the truths
//! under the level `good`, whatever the rates and phases of the outputs; residuals and faults are tested at the samples of each sensor.
//! Does not prove: times that are wrong.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]

use crate::support::wpilog::Log;
use motorfit::experiment::{Excitation, simulated};
use motorfit::identify::{IdentifySpec, TrustLevel, identify};
use motorfit::motor::{Discretization, Parameters};
use motorfit::record::{Preparation, Quantity, ReadOptions, Record, diagnose, read_bytes};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const M2: Parameters = Parameters { r: 0.921, l: 0.00776, k: 0.0734, b: 6.76e-4, j: 1.36e-4 };
/// Step of the simulation \[µs\].
const STEP_US: u64 = 100;

/// Periods and phases of voltage, current and speed \[µs\].
type Clocks = [(u64, u64); 3];

/// A slow speed in phase; a slow current and speed out of phase; equal rates out of phase; a voltage that is logged every 20 ms.
const CLOCKS: [(&str, Clocks); 4] = [
    ("speed at a tenth", [(1000, 0), (1000, 0), (10_000, 0)]),
    ("slower and out of phase", [(1000, 0), (2000, 600), (5000, 300)]),
    ("out of phase", [(2000, 0), (2000, 700), (2000, 1300)]),
    ("voltage of 50 Hz", [(20_000, 0), (1000, 0), (2000, 500)]),
];

/// Returns the log of a motor under random steps of 20 ms, whose channels are sampled by their own clocks.
fn log(seed: u64, clocks: &Clocks) -> Vec<u8> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let rows = 20_000;
    let time_s: Vec<f64> = (0..rows).map(|n| 1e-6 * f64::from(n) * 100.0).collect();
    let levels: Vec<f64> = (0..100).map(|_| random.random_range(-6.0..6.0)).collect();
    let voltage: Vec<f64> = (0..100).flat_map(|n| std::iter::repeat_n(levels[n], 200)).collect();
    let clean = simulated(&M2, &Excitation { time_s, voltage, torque: None }, Discretization::Zoh).unwrap();
    let samples = clean.samples();
    let signals = [&samples.voltage, samples.current.as_ref().unwrap(), samples.speed.as_ref().unwrap()];
    let mut log = Log::new();
    let names = [("/motor/voltage", "V"), ("/motor/current", "A"), ("/motor/speed", "rad/s")];
    for ((((name, unit), signal), (period, phase)), noise) in
        names.into_iter().zip(signals).zip(clocks).zip([0.0, 0.03, 0.3])
    {
        let entry = log.start(name, "double", &format!("{{\"unit\": \"{unit}\"}}"));
        for at in (0..2_000_000_u64).skip(usize::try_from(*phase).unwrap()).step_by(usize::try_from(*period).unwrap()) {
            let jitter: f64 = StandardNormal.sample(&mut random);
            log.double(entry, at, signal[usize::try_from(at / STEP_US).unwrap()] + noise * jitter);
        }
    }
    log.bytes
}

fn record(seed: u64, clocks: &Clocks) -> Record {
    let [record] =
        <[Record; 1]>::try_from(read_bytes(&log(seed, clocks), None, &ReadOptions::default()).unwrap()).unwrap();
    record
}

#[test]
fn parameters_are_unbiased_whatever_the_clocks() {
    const SEEDS: u64 = 40;
    for (name, clocks) in &CLOCKS {
        let (mut held, mut good, mut sums) = (0, 0, [0.0; 5]);
        for seed in 0..SEEDS {
            let found = identify(&[record(seed, clocks)], &IdentifySpec::default()).unwrap();
            good += u64::from(found.trust.level == TrustLevel::Good);
            let errors = &found.uncertainty.as_ref().unwrap().std_error;
            for (n, (value, truth)) in found.parameters.to_array().into_iter().zip(M2.to_array()).enumerate() {
                let z = (value - truth) / errors[n].unwrap();
                held += u64::from(z.abs() < 1.96);
                sums[n] += z;
            }
        }
        let means = sums.map(|sum| sum / 40.0);
        println!("{name}: {held} of 200 intervals, good {good} of {SEEDS}, mean errors {means:.2?}");
        // Four standard deviations: of a binomial whose parameters of one seed are as one, and of a mean of 40.
        assert!(held >= 163, "{name}: {held} of 200");
        assert!(means.iter().all(|mean| mean.abs() < 4.0 / 40.0_f64.sqrt()), "{name}: {means:?}");
        // A few tests at 99 % reject a complete model.
        assert!(good >= 32, "{name}: good {good} of {SEEDS}");
    }
}

#[test]
fn sensors_of_several_clocks_have_no_false_faults() {
    for (name, clocks) in &CLOCKS {
        for seed in 0..10 {
            let record = record(seed, clocks);
            let own = (0..record.len()).filter(|n| record.is_measured(Quantity::Speed, *n)).count() as u64;
            let [.., (period, _)] = clocks;
            assert!(own.abs_diff(2_000_000 / period) <= 20_000 / period + 1, "{name}: {own}");
            let codes: Vec<&str> = diagnose(&record).iter().map(|finding| finding.code).collect();
            assert!(codes.is_empty(), "{name}, seed {seed}: {codes:?}");
        }
    }
}

#[test]
fn filters_and_rates_that_would_mix_samples_are_refused() {
    let record = record(1, &CLOCKS[0].1);
    let preparations = [
        Preparation { rate_hz: Some(500.0), ..Preparation::default() },
        Preparation { decimate: Some(4), ..Preparation::default() },
    ];
    for preparation in preparations {
        let error = preparation.apply(&record).unwrap_err().to_string();
        assert!(error.contains("the speed was not measured at every sample"), "{error}");
    }
    let cropped = Preparation { crop: [Some(0.5), Some(1.5)], ..Preparation::default() };
    assert_eq!(cropped.apply(&record).unwrap()[0].counting().iter().filter(|counts| counts[1]).count(), 101);
}
