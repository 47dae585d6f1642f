//! Proves: held-out recordings are simulated with the estimated parameters only, their initial states are the least-squares
//! estimates with the spread that theory predicts, and real recordings keep their fit.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test may stop and print")]
#![allow(clippy::cast_precision_loss, clippy::float_cmp, reason = "small numbers; exact equality is meant")]

use crate::support;
use crate::support::program::{EXAMPLE, Folder, M2, fails, json, ok, simulated};
use motorfit::estimate::{fit_problem, initial_states};
use motorfit::evaluate::Model;
use motorfit::experiment::{drive, with_noise};
use motorfit::identify::{IdentifySpec, identify, validate};
use motorfit::motor::{Discretization, Parameters, Space, simulate};
use motorfit::record::Record;
use serde_json::Value;

const SIGMA: [f64; 2] = [0.02, 0.5];

/// Returns a recording of the M2 motor under a square wave, in motion after the start, without noise.
fn lively(samples: u32) -> Record {
    let time: Vec<f64> = (0..samples).map(|n| f64::from(n) * 1e-3).collect();
    let voltage = (0..samples).map(|n| if (n / 97) % 2 == 0 { 9.0 } else { -3.0 }).collect();
    support::driven(time, voltage, None)
}

/// Returns the weighted sum of squares from an initial state, by the scalar simulation.
fn misfit(record: &Record, parameters: &Parameters, initial: [f64; 2]) -> f64 {
    let model = simulate(parameters, &drive(record), initial, Discretization::Zoh);
    let of = |measured: Option<&[f64]>, model: &[f64], sigma: f64| -> f64 {
        measured.unwrap().iter().zip(model).map(|(y, x)| ((y - x) / sigma).powi(2)).sum()
    };
    let [current, speed] = record.measured();
    of(current, &model[0], SIGMA[0]) + of(speed, &model[1], SIGMA[1])
}

#[test]
fn initial_states_are_least_squares_estimates() {
    let clean = lively(900);
    let [_, clean_rest] = clean.split(0.4).unwrap();
    let truth = [0, 1].map(|channel| clean_rest.measured()[channel].unwrap()[0]);
    let of = |record: &Record, parameters: &Parameters| {
        let problem = fit_problem(std::slice::from_ref(record), &Space::table2(), Model::default()).unwrap();
        initial_states(&problem, &parameters.to_array(), SIGMA).unwrap()[0]
    };
    // Without noise it is the true state, up to rounding.
    let found = of(&clean_rest, &Parameters::M2);
    assert!((0..2).all(|n| (found[n] - truth[n]).abs() < 1e-9 * truth[n].abs().max(1.0)), "{found:?} {truth:?}");
    // With noise and wrong parameters no state in its neighbourhood has a lower cost.
    let mut off = Parameters::M2.to_array();
    off[0] *= 0.9;
    off[4] *= 1.1;
    for parameters in [Parameters::M2, Parameters::from_array(off)] {
        let [_, rest] = with_noise(&clean, SIGMA, 3).unwrap().split(0.4).unwrap();
        let found = of(&rest, &parameters);
        let least = misfit(&rest, &parameters, found);
        for step in [[1e-4, 0.0], [-1e-4, 0.0], [0.0, 1e-3], [0.0, -1e-3], [1e-4, 1e-3], [1e-4, -1e-3]] {
            assert!(misfit(&rest, &parameters, [found[0] + step[0], found[1] + step[1]]) > least, "{step:?}");
        }
    }
}

#[test]
fn an_unobservable_state_is_not_estimated() {
    // An unmeasured current that decays within 1e-9 samples is not identifiable.
    let motor = Parameters { l: 1e-12, ..Parameters::M2 };
    for with_current in [false, true] {
        let [_, rest] = with_noise(&lively(900), SIGMA, 5).unwrap().split(0.4).unwrap();
        let rest = support::changed(&rest, |s| s.current = s.current.take().filter(|_| with_current));
        let problem = fit_problem(std::slice::from_ref(&rest), &Space::table2(), Model::default()).unwrap();
        let [current, speed] = initial_states(&problem, &motor.to_array(), SIGMA).unwrap()[0];
        let measured = rest.measured()[1].unwrap()[0];
        eprintln!("{current} A, {speed} rad/s of {measured}");
        assert!(current.abs() < 20.0 && (speed - measured).abs() < 5.0, "{current} {speed}");
    }
}

#[test]
fn initial_states_spread_as_predicted() {
    let clean = lively(900);
    let [_, rest] = clean.split(0.4).unwrap();
    let truth = [0, 1].map(|channel| rest.measured()[channel].unwrap()[0]);
    // The inverse covariance is half the Hessian of the weighted sum of squares, by differences of the simulation.
    let base = |initial: [f64; 2]| misfit(&rest, &Parameters::M2, initial);
    let curve = |n: usize| {
        let mut step = [0.0; 2];
        step[n] = 1e-3;
        (base([truth[0] + step[0], truth[1] + step[1]]) + base([truth[0] - step[0], truth[1] - step[1]])
            - 2.0 * base(truth))
            / 2e-6
    };
    let cross = {
        let at = |a: f64, b: f64| base([truth[0] + a * 1e-3, truth[1] + b * 1e-3]);
        (at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0)) / 8e-6
    };
    let (a, b) = (curve(0), curve(1));
    let deviations = [b, a].map(|own| (own / (a * b - cross * cross)).sqrt());
    let mut z = [Vec::new(), Vec::new()];
    for seed in 0..200 {
        let noisy = with_noise(&rest, SIGMA, seed).unwrap();
        let problem = fit_problem(&[noisy], &Space::table2(), Model::default()).unwrap();
        let found = initial_states(&problem, &Parameters::M2.to_array(), SIGMA).unwrap()[0];
        (0..2).for_each(|n| z[n].push((found[n] - truth[n]) / deviations[n]));
    }
    for z in z {
        let mean = z.iter().sum::<f64>() / 200.0;
        let rms = (z.iter().map(|z| z * z).sum::<f64>() / 200.0).sqrt();
        // Over 200 seeds the standard errors of mean and rms are 0.071 and 0.05; the bounds are four of them.
        assert!(mean.abs() < 0.28 && (rms - 1.0).abs() < 0.2, "{mean} {rms}");
    }
}

#[test]
fn held_out_recordings_reach_the_noise_floor() {
    let clean = lively(2000);
    let noisy = |seed: u64| with_noise(&clean, SIGMA, seed).unwrap();
    let found = identify(&[noisy(1)], &IdentifySpec::default()).unwrap();
    let validation = validate(&[noisy(2), noisy(3)], &IdentifySpec::default(), &found).unwrap();
    // The fit is 100 (1 − σ/std): the residuals are the noise, whose σ over 4000 samples has a standard error of 1.1 %.
    for (channel, sigma) in SIGMA.into_iter().enumerate() {
        let signal = clean.measured()[channel].unwrap();
        let spread = (motorfit::numeric::standard_deviation(signal).powi(2) + sigma * sigma).sqrt();
        let expected = 100.0 * (1.0 - sigma / spread);
        let fit = validation.fit_percent[channel].unwrap();
        assert!((fit - expected).abs() < 4.0 * 0.011 * (100.0 - expected), "{fit} {expected}");
    }
    // Another motor does not fit.
    let mut other = found.clone();
    other.machine.parameters.k *= 1.3;
    other.values[2] *= 1.3;
    let wrong = validate(&[noisy(2)], &IdentifySpec::default(), &other).unwrap();
    assert!(wrong.fit_percent[1].unwrap() < 90.0, "{:?}", wrong.fit_percent);
}

#[test]
fn a_split_fits_the_first_part_and_reports_the_remainder() {
    let folder = Folder::new();
    let path = folder.file("lively.csv", motorfit::record::write_csv(&with_noise(&lively(1000), SIGMA, 1).unwrap()));
    let split = json(&["identify", &path, "--json", "--split", "0.6"]);
    let crop = json(&["identify", &path, "--json", "--crop", ":0.599"]);
    assert_eq!(split["parameters"], crop["parameters"]);
    assert_eq!(split["fit_percent"], crop["fit_percent"]);
    assert!(crop["validation"].is_null());
    let held = &split["validation"]["records"][0];
    assert_eq!((&held["record"]["samples"], &held["initial_state_estimated"]), (&400.into(), &true.into()));
    assert!(split["validation"]["fit_percent"]["speed"].as_f64().unwrap() > 90.0);
    let table = ok(&["identify", &path, "--split", "0.6"]);
    assert!(table.contains("held out") && table.contains("its initial state was estimated"), "{table}");
    for wrong in ["0", "1", "-0.5", "nan", "0.0001"] {
        fails(&["identify", &path, "--split", wrong], 2, if wrong == "0.0001" { "a split at" } else { "--split is" });
    }
    fails(&["identify", &path, "--validate", "none.csv"], 3, "none.csv: cannot be read");
}

#[test]
fn held_out_files_do_not_change_the_fit_and_are_on_the_page() {
    let folder = Folder::new();
    let other = folder.path("other.csv");
    simulated(&other, M2, "step:6@0.5", ["2", "9"]);
    let alone = json(&["identify", EXAMPLE, "--json"]);
    let out = folder.path("out");
    let with = json(&["identify", EXAMPLE, "--json", "--validate", &other, "--validate", EXAMPLE, "--out", &out]);
    assert_eq!(with["parameters"], alone["parameters"]);
    let held: Vec<&Value> = with["validation"]["records"].as_array().unwrap().iter().collect();
    assert!(held.iter().all(|h| h["initial_state_estimated"] == false), "both begin at rest");
    // The fitted recording as held-out one has the same fit.
    for channel in ["current", "speed"] {
        let [held, fitted] = [held[1], &alone].map(|of| of["fit_percent"][channel].as_f64().unwrap());
        assert!((held - fitted).abs() < 1e-9, "{held} {fitted}");
    }
    let page = std::fs::read_to_string(format!("{out}/report.html")).unwrap();
    assert!(page.contains("Held-out recordings") && page.contains("other.csv"));
}

#[test]
fn the_first_odrive_step_fits_the_others() {
    let Some(folder) = std::env::var_os("MOTORFIT_RECORDINGS") else {
        assert!(std::env::var_os("MOTORFIT_NO_SKIP").is_none(), "MOTORFIT_RECORDINGS is not set");
        eprintln!("skipped: MOTORFIT_RECORDINGS is not set");
        return;
    };
    let path = |n: usize| {
        std::path::Path::new(&folder).join(format!("labmrd-odrive/step{n}.csv")).to_str().unwrap().to_owned()
    };
    let mut args = vec![
        "identify".to_owned(),
        path(1),
        "--json".to_owned(),
        "--columns".to_owned(),
        "time=timestep (8Hz):8kHz".to_owned(),
        // Voltage and speed identify gain and time constant; the other parameters are fixed.
        "--fix".to_owned(),
        "R=1,L=0.0001,B=1e-7".to_owned(),
    ];
    for n in 2..=5 {
        args.extend(["--validate".to_owned(), path(n)]);
    }
    let document = json(&args.iter().map(String::as_str).collect::<Vec<_>>());
    let (fitted, held) = (&document["fit_percent"]["speed"], &document["validation"]["fit_percent"]["speed"]);
    assert!(fitted.as_f64().unwrap() >= 98.5 && held.as_f64().unwrap() >= 97.0, "{fitted} {held}");
}
