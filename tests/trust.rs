//! Proves: model selection on joint fits finds what is there; a result is trusted where it is right and not where model,
//! units, sign, clock or channels are wrong; intervals of trusted results cover. `MOTORFIT_MOTORS=N` takes N motors of each
//! kind instead of a few.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

#[path = "support/joint.rs"]
mod joint;

use joint::{EXCITATIONS, Truth, motor, noisy, numbers, record, records};
use motorfit::experiment::{Excitation, simulated};
use motorfit::identify::{Identification, IdentifySpec, TrustLevel, identify};
use motorfit::motor::{Discretization, Extension, Extension::*, With};
use motorfit::record::{Record, Samples};
use rayon::prelude::*;

/// Motors of each kind.
fn motors(usual: u64) -> u64 {
    std::env::var("MOTORFIT_MOTORS").ok().and_then(|count| count.parse().ok()).unwrap_or(usual)
}

fn with(list: &[Extension]) -> IdentifySpec {
    IdentifySpec { with: With::These(list.to_vec()), ..IdentifySpec::default() }
}

/// The extensions of the motors of joint fits.
const MODELS: [&[Extension]; 8] = [
    &[],
    &[Coulomb],
    &[DeadTime],
    &[Deadband],
    &[SensorAverage],
    &[Latency],
    &[Coulomb, DeadTime],
    &[Coulomb, SensorAverage],
];

#[test]
fn auto_finds_what_joint_fits_are_made_with() {
    let cases: Vec<(&[Extension], f64, u64)> = MODELS
        .iter()
        .flat_map(|model| [40.0, 25.0].map(|decibels| (*model, decibels)))
        .flat_map(|(model, decibels)| (0..motors(2)).map(move |seed| (model, decibels, seed)))
        .collect();
    let auto = IdentifySpec { with: With::Auto, ..IdentifySpec::default() };
    let one = |&(model, decibels, seed): &(&[Extension], f64, u64)| {
        let mut numbers = numbers(seed);
        let truth = motor(&mut numbers, model);
        let mut all = records(&mut numbers, &truth, 1000, decibels);
        let right = identify(&all, &with(model)).unwrap();
        let found = identify(&all, &auto).unwrap();
        all.reverse();
        let reversed = identify(&all, &auto).unwrap();
        let extensions = found.extensions();
        let lost =
            (0..2).map(|n| right.fit_percent[n].unwrap() - found.fit_percent[n].unwrap()).fold(f64::MIN, f64::max);
        let more = extensions.iter().filter(|e| !model.contains(e)).count();
        let is_good = model.iter().all(|e| extensions.contains(e)) && more <= 1;
        if !is_good || lost > 0.2 || reversed.extensions() != extensions {
            println!(
                "{model:?} at {decibels} dB, seed {seed}: {extensions:?}, reversed {:?}, {lost:.3}",
                reversed.extensions()
            );
        }
        [is_good, lost <= 0.2, reversed.extensions() == extensions]
    };
    let verdicts: Vec<[bool; 3]> = cases.iter().map(one).collect();
    let share = |n: usize| verdicts.iter().filter(|v| v[n]).count() as f64 / verdicts.len() as f64;
    println!("{} fits: right model {:.3}, fit {:.3}, any order {:.3}", cases.len(), share(0), share(1), share(2));
    // At least 95 % each is promised; of 32 one may fail.
    assert!((0..3).all(|n| share(n) >= 0.95), "{:?}", [share(0), share(1), share(2)]);
}

/// Errors over standard errors of what a result gives.
fn errors<'a>(found: &'a Identification, truth: &'a Truth) -> impl Iterator<Item = f64> + 'a {
    let estimates = found.estimates().into_iter();
    estimates.filter_map(|e| Some((e.value? - truth.motor.get(e.parameter)) / e.std_error?))
}

#[test]
fn right_fits_are_trusted_and_their_intervals_cover() {
    let models: [&[Extension]; 6] = [&[], &[], &[Coulomb], &[DeadTime], &[Deadband], &[Coulomb, DeadTime]];
    let count = motors(50);
    let cases: Vec<(usize, u64)> =
        (0..models.len()).flat_map(|model| (0..count).map(move |seed| (model, seed))).collect();
    let one = |&(model, seed): &(usize, u64)| {
        let mut numbers = numbers(1000 * (1 + seed) + model as u64);
        let truth = motor(&mut numbers, models[model]);
        let decibels = [40.0, 25.0][usize::from(seed % 2 == 1)];
        let all = records(&mut numbers, &truth, 800, decibels);
        let found = identify(&all[1..4], &with(models[model])).unwrap();
        let errors: Vec<f64> = errors(&found, &truth).collect();
        if found.trust.level != TrustLevel::Good {
            println!("{:?}, seed {seed}: {:?}", models[model], found.trust);
        }
        (found.trust.level == TrustLevel::Good, errors)
    };
    let all: Vec<(bool, Vec<f64>)> = cases.par_iter().map(one).collect();
    let good = all.iter().filter(|(good, _)| *good).count() as f64 / all.len() as f64;
    let errors: Vec<f64> = all.iter().filter(|(good, _)| *good).flat_map(|(_, errors)| errors.clone()).collect();
    let covered = errors.iter().filter(|z| z.abs() < 1.96).count() as f64 / errors.len() as f64;
    println!("good {good:.3}, covered {covered:.3} of {}", errors.len());
    // 99 % are promised: of 300 fits, 597 of 600 measured, some five may be taken for wrong. 95 % of some 1750 values has a
    // standard deviation of 0.5 %, and up to twice that for errors that are correlated within a fit.
    assert!(good >= 0.983 && (0.925..0.975).contains(&covered), "{good} {covered}");
}

type Change = fn(&mut Samples);

fn scaled(signal: &mut Option<Vec<f64>>, factor: f64) {
    signal.iter_mut().flatten().for_each(|v| *v *= factor);
}

fn delayed(signal: &mut Vec<f64>, samples: usize) {
    let first = signal[0];
    signal.truncate(signal.len() - samples);
    signal.splice(0..0, std::iter::repeat_n(first, samples));
}

/// Loses every fourth block of ten samples, with a time that goes on as if nothing were missing.
fn dropped(samples: &mut Samples) {
    let kept = |signal: &mut Vec<f64>| {
        let mut n = 0;
        signal.retain(|_| {
            n += 1;
            (n - 1) / 10 % 4 != 3
        });
    };
    kept(&mut samples.voltage);
    [&mut samples.current, &mut samples.speed].into_iter().flatten().for_each(kept);
    samples.time_s.truncate(samples.voltage.len());
}

/// Recordings that are wrong, by what was done to them.
const WRONG: [(&str, Change); 9] = [
    ("sign of the current", |s| scaled(&mut s.current, -1.0)),
    ("sign of the speed", |s| scaled(&mut s.speed, -1.0)),
    ("sign of the voltage", |s| s.voltage.iter_mut().for_each(|v| *v = -*v)),
    ("milliamperes as amperes", |s| scaled(&mut s.current, 1000.0)),
    ("milliseconds as seconds", |s| s.time_s.iter_mut().for_each(|t| *t *= 1000.0)),
    ("current and speed exchanged", |s| std::mem::swap(&mut s.current, &mut s.speed)),
    ("voltage logged late", |s| delayed(&mut s.voltage, 2)),
    ("speed late", |s| delayed(s.speed.as_mut().unwrap(), 4)),
    ("samples lost", dropped),
];

/// Models that the linear motor is taken for.
const MISSING: [&[Extension]; 6] =
    [&[Coulomb], &[Deadband], &[SensorAverage], &[DeadTime], &[Saturation], &[DirectionGain]];

#[test]
fn wrong_fits_are_not_trusted() {
    let spec = IdentifySpec::default();
    let is_good =
        |records: &[Record]| identify(records, &spec).is_ok_and(|found| found.trust.level == TrustLevel::Good);
    let level = |seed: u64| [40.0, 25.0][usize::from(seed % 2 == 1)];
    let mut total = 0;
    let mut tell = |name: &str, trusted: Vec<bool>| {
        let wrong = trusted.iter().filter(|good| **good).count();
        println!("{name}: {wrong} of {} trusted", trusted.len());
        total += wrong;
    };
    let all = || (0..motors(50)).into_par_iter();
    for (name, change) in WRONG {
        tell(
            name,
            all()
                .map(|seed| {
                    let mut numbers = numbers(seed);
                    let truth = motor(&mut numbers, &[]);
                    let right = record(&mut numbers, &truth, 1, 1500, level(seed));
                    let mut samples = right.samples().clone();
                    change(&mut samples);
                    is_good(&[Record::new(samples).unwrap()])
                })
                .collect(),
        );
    }
    for model in MISSING {
        tell(
            &format!("no {model:?}"),
            all()
                .map(|seed| {
                    let mut numbers = numbers(seed);
                    let truth = motor(&mut numbers, model);
                    // Levels both ways: under one sign a gain or a limit of the drive would be another voltage.
                    is_good(&[1, 3].map(|excitation| record(&mut numbers, &truth, excitation, 1500, level(seed))))
                })
                .collect(),
        );
    }
    tell(
        "two motors",
        all()
            .map(|seed| {
                let mut numbers = numbers(seed);
                let truth = motor(&mut numbers, &[]);
                let mut all = records(&mut numbers, &truth, 1000, level(seed));
                let Samples { time_s, voltage, .. } = all[2].samples().clone();
                let mut other = truth.motor.parameters();
                other.r *= 1.2;
                let clean = simulated(&other, &Excitation { time_s, voltage, torque: None }, Discretization::Zoh);
                all[2] = noisy(&mut numbers, &clean.unwrap(), level(seed));
                is_good(&all[..EXCITATIONS - 1])
            })
            .collect(),
    );
    let count = usize::try_from(motors(50)).unwrap() * (WRONG.len() + MISSING.len() + 1);
    println!("{total} of {count} wrong fits trusted");
    assert!(100 * total <= count, "more than 1 %");
}
