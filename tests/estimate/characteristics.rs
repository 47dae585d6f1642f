//! Proves: kV, kA, kS and kG follow from the motor's equations (relative 1e-12 against steady states and the trace of the
//! state matrix); their standard errors are those of the delta method and describe the spread of estimates over 200 seeds;
//! the regression for feedforward constants has the bias and standard errors that theory predicts.
#![allow(clippy::unwrap_used, reason = "a test may stop")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

use crate::support;
use crate::support::program::{EXAMPLE, Folder, json, ok};
use motorfit::analysis::{Characteristics, Covariance, characteristics, regression, regressions};
use motorfit::experiment::with_noise;
use motorfit::identify::{IdentifySpec, identify};
use motorfit::motor::{Input, Parameters};
use motorfit::record::{Record, Samples};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;

const SIGMA: [f64; 2] = [0.02, 0.5];

/// Returns kS, kV, kA, kG, gain and sum of time constants from steady states and the trace of the state matrix.
fn oracle([r, l, k, b, j, tc, vb, tl]: [f64; 8]) -> [f64; 6] {
    let motor = Parameters { r, l, k, b, j };
    // The steady-state speed is linear in the voltage, so two points give the voltage at which the friction stops the motor.
    let (still, driven) = (motor.steady_state(0.0, tc)[1], motor.steady_state(1.0, tc)[1]);
    let gain = motor.steady_state(1.0, 0.0)[1];
    let (trace, determinant) = (-r / l - b / j, (r * b + k * k) / (l * j));
    let times = -trace / determinant;
    let (held, moved) = (motor.steady_state(0.0, tl)[1], motor.steady_state(1.0, tl)[1]);
    [-still / (driven - still) + vb, 1.0 / gain, times / gain, -held / (moved - held), gain, times]
}

fn found(of: [f64; 8], covariance: &Covariance) -> Characteristics {
    let [r, l, k, b, j, more @ ..] = of;
    characteristics(Input::Voltage, &Parameters { r, l, k, b, j }, more.map(Some), covariance)
}

#[test]
fn errors_are_those_of_the_delta_method() {
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(1);
    for _ in 0..200 {
        let base = [0.9, 0.008, 0.07, 7e-4, 1.4e-4, 0.01, 0.6, 0.02];
        let of = base.map(|v: f64| v * numbers.random_range(-2.0_f64..2.0).exp());
        // A matrix times its transpose is a covariance; standard deviations of 1e-4 keep the characteristics linear.
        let root: Vec<Vec<f64>> =
            of.iter().map(|v| (0..8).map(|_| 1e-4 * v * numbers.random_range(-1.0..1.0)).collect()).collect();
        let entry = |a: usize, b: usize| root[a].iter().zip(&root[b]).map(|(x, y)| x * y).sum::<f64>();
        let covariance: Covariance = std::array::from_fn(|a| std::array::from_fn(|b| Some(entry(a, b))));
        let slopes: Vec<[f64; 6]> = (0..8)
            .map(|n| {
                let step = 1e-5 * of[n];
                let at = |sign: f64| oracle(std::array::from_fn(|m| of[m] + if m == n { sign * step } else { 0.0 }));
                let (up, down) = (at(1.0), at(-1.0));
                std::array::from_fn(|c| (up[c] - down[c]) / (2.0 * step))
            })
            .collect();
        let found = Characteristics::named(Some(&found(of, &covariance)), Input::Voltage);
        for (c, (expected, (name, _, found))) in oracle(of).into_iter().zip(found).enumerate() {
            let found = found.unwrap();
            let variance: f64 = (0..8)
                .flat_map(|a| (0..8).map(move |b| (a, b)))
                .map(|(a, b)| slopes[a][c] * entry(a, b) * slopes[b][c])
                .sum();
            assert!((found.value / expected - 1.0).abs() < 1e-12, "{name}: {} {expected}", found.value);
            // A central difference with a relative step of 1e-5 has a truncation error of 1e-10 and a rounding error of
            // 1e-11 of each term; cancellation among the terms increases both.
            let error = found.std_error.unwrap();
            assert!((error / variance.sqrt() - 1.0).abs() < 1e-6, "{name}: {error} {}", variance.sqrt());
        }
    }
}

#[test]
fn unknown_covariances_give_no_standard_errors() {
    let motor = Parameters { r: 1.0, l: 0.01, k: 0.05, b: 1e-4, j: 1e-4 };
    let mut covariance: Covariance = [[Some(0.0); 8]; 8];
    covariance[0][0] = Some(1e-4);
    let known = characteristics(Input::Voltage, &motor, [None; 3], &covariance);
    assert!(known.ks.is_none());
    // The derivative of kV = K + R B/K with respect to R is B/K.
    assert!((known.kv.std_error.unwrap() - 0.01 * 1e-4 / 0.05).abs() < 1e-15);
    covariance[1][1] = None;
    let unknown = characteristics(Input::Voltage, &motor, [None; 3], &covariance);
    assert_eq!(unknown.kv, known.kv, "the inductance is no part of it");
    assert!(unknown.ka.std_error.is_none() && unknown.time_constant.std_error.is_none());
    assert!(unknown.ka.value > 0.0);
}

/// Returns a recording of the M2 motor under a square-wave voltage, without noise.
fn lively(samples: u32) -> Record {
    let time: Vec<f64> = (0..samples).map(|n| f64::from(n) * 1e-3).collect();
    let voltage = (0..samples).map(|n| if (n / 97) % 2 == 0 { 9.0 } else { -3.0 }).collect();
    support::driven(time, voltage, None)
}

#[test]
fn estimates_spread_as_their_standard_errors() {
    const SEEDS: u64 = 200;
    let clean = lively(600);
    let [r, l, k, b, j] = Parameters::M2.to_array();
    let truth = oracle([r, l, k, b, j, 0.0, 0.0, 0.0]);
    let mut z = vec![Vec::new(); 6];
    for seed in 0..SEEDS {
        let found = identify(&[with_noise(&clean, SIGMA, seed).unwrap()], &IdentifySpec::default()).unwrap();
        for (c, (_, _, value)) in Characteristics::named_of(&found).into_iter().enumerate() {
            if let Some(value) = value {
                z[c].push((value.value - truth[c]) / value.std_error.unwrap());
            }
        }
    }
    assert!(z[0].is_empty() && z[3].is_empty(), "a motor without friction and load has neither kS nor kG");
    for (c, z) in z.iter().enumerate().filter(|(_, z)| !z.is_empty()) {
        let mean = z.iter().sum::<f64>() / SEEDS as f64;
        let rms = (z.iter().map(|z| z * z).sum::<f64>() / SEEDS as f64).sqrt();
        // Over 200 seeds the standard errors of mean and rms are 0.071 and 0.05; the bounds are four of them.
        assert!(mean.abs() < 0.28 && (rms - 1.0).abs() < 0.2, "{c}: {mean} {rms}");
    }
}

/// Returns recordings of a first-order motor under constant voltages, in closed form.
fn decays(kv: f64, tau: f64, period_s: f64) -> Vec<Record> {
    let runs = [(10.0, 20.0), (3.0, 250.0), (-6.0, -20.0), (-2.0, -150.0)];
    let one = |(volts, start): (f64, f64)| {
        let time_s: Vec<f64> = (0..120).map(|n| f64::from(n) * period_s).collect();
        let end = volts / kv;
        let speed = time_s.iter().map(|t| end + (start - end) * (-t / tau).exp()).collect();
        Record::new(Samples { voltage: vec![volts; time_s.len()], time_s, speed: Some(speed), ..Samples::default() })
            .unwrap()
    };
    runs.map(one).to_vec()
}

#[test]
fn central_differences_have_the_predicted_bias() {
    let (kv, tau, period) = (0.05, 0.03, 0.001);
    let records = decays(kv, tau, period);
    for (window_s, samples) in [(0.002, 2), (0.008, 8), (0.020, 20)] {
        let found = regression(&records, window_s).unwrap();
        assert_eq!(found.window_samples, samples);
        let half = 0.5 * window_s / tau;
        // The central difference of an exponential over ±d is sinh(d/τ)/(d/τ) times its derivative.
        let expected = kv * tau * half / half.sinh();
        assert!((found.ka.value / expected - 1.0).abs() < 1e-9, "{} {expected}", found.ka.value);
        assert!((found.kv.value / kv - 1.0).abs() < 1e-9 && found.ks.value.abs() < 1e-9, "{found:?}");
    }
    // Under one constant voltage the regressors are collinear.
    assert_eq!(regression(&records[..1], 0.002), None);
}

#[test]
fn least_squares_standard_errors_describe_the_spread() {
    // White noise of the voltage is an independent equation error.
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(3);
    let (mut ka, mut ks, seeds) = (Vec::new(), Vec::new(), 300);
    for _ in 0..seeds {
        let runs: Vec<Record> = decays(0.05, 0.03, 0.001)
            .iter()
            .map(|record| {
                support::changed(record, |samples| {
                    for v in &mut samples.voltage {
                        *v += 0.01 * numbers.random_range(-1.0..1.0);
                    }
                })
            })
            .collect();
        let found = regression(&runs, 0.002).unwrap();
        let half = 1.0 / 30.0_f64;
        ka.push((found.ka.value - 0.0015 * half / half.sinh()) / found.ka.std_error.unwrap());
        ks.push(found.ks.value / found.ks.std_error.unwrap());
    }
    for z in [ka, ks] {
        let rms = (z.iter().map(|z| z * z).sum::<f64>() / f64::from(seeds)).sqrt();
        // The standard error of the rms is 1/√600 = 0.041; the bound is four of them. The noise is small against the
        // voltage, so that attenuation is negligible.
        assert!((rms - 1.0).abs() < 0.17, "{rms}");
    }
}

#[test]
fn the_regression_is_biased_and_the_output_error_estimate_is_not() {
    let clean = lively(2000);
    let [r, l, k, b, j] = Parameters::M2.to_array();
    let [_, kv, ka, ..] = oracle([r, l, k, b, j, 0.0, 0.0, 0.0]);
    let found = identify(&[with_noise(&clean, SIGMA, 1).unwrap()], &IdentifySpec::default()).unwrap();
    let by_error = Characteristics::of(&found).unwrap();
    assert!((by_error.ka.value / ka - 1.0).abs() < 0.01 && (by_error.kv.value / kv - 1.0).abs() < 0.01);
    let list = regressions(&[clean], Some(by_error.time_constant.value));
    assert_eq!(list.len(), 2);
    // Without noise: the inductance delays the torque by 8 ms, which biases the regression like 40 % more inertia and
    // negative Coulomb friction (measured: kV −3.9 and −2.7 %, kA +38 and +42 %, kS −1.0 and −1.1 V).
    for found in list {
        let (of_kv, of_ka) = (found.kv.value / kv - 1.0, found.ka.value / ka - 1.0);
        assert!((-0.05..-0.02).contains(&of_kv) && (0.3..0.5).contains(&of_ka), "{of_kv} {of_ka}");
        assert!((-1.2..-0.9).contains(&found.ks.value) && found.ks.value.abs() > 5.0 * found.ks.std_error.unwrap());
    }
}

#[test]
fn the_program_reports_characteristics() {
    let document = json(&["identify", EXAMPLE, "--json"]);
    let of = &document["characteristics"];
    let by_error = &of["output_error"];
    assert!(by_error["kS"].is_null() && by_error["kG"].is_null());
    assert_eq!((&by_error["kV"]["unit"], &by_error["kA"]["unit"]), (&"V*s/rad".into(), &"V*s^2/rad".into()));
    let value = |name: &str| by_error[name]["value"].as_f64().unwrap();
    let parameter = |name: &str| document["parameters"][name]["value"].as_f64().unwrap();
    let [r, l, k, b, j] = ["R", "L", "K", "B", "J"].map(parameter);
    let expected = oracle([r, l, k, b, j, 0.0, 0.0, 0.0]);
    for (n, name) in [(1, "kV"), (2, "kA"), (4, "gain"), (5, "time_constant")] {
        assert!((value(name) / expected[n] - 1.0).abs() < 1e-9, "{name}");
        assert!(by_error[name]["std_error"].as_f64().unwrap() > 0.0, "{name}");
    }
    // After one step from rest the regressors are collinear.
    assert!(of["regression"].as_array().unwrap().iter().all(|r| r["window_samples"].as_u64().unwrap() >= 2));
    let folder = Folder::new();
    let path = folder.file("lively.csv", motorfit::record::write_csv(&with_noise(&lively(1500), SIGMA, 1).unwrap()));
    let out = folder.path("out");
    let text = ok(&["identify", &path, "--out", &out]);
    assert!(text.contains("kV 0.0") && text.contains("by regression on differences over"), "{text}");
    let page = std::fs::read_to_string(format!("{out}/report.html")).unwrap();
    assert!(
        page.contains("Feedforward characteristics")
            && page.contains("regression on differences over 2.00 ms (2 samples)")
    );
    // Without refinement there are values without standard errors.
    let rough = json(&["identify", EXAMPLE, "--json", "--polish", "none"]);
    assert!(rough["characteristics"]["output_error"]["kV"]["std_error"].is_null());
}
