//! Proves: models reach at least the fits below on real recordings, fitted and held out: gain, time constant and dead time;
//! drives with deadband and saturation; averaging sensors; recordings with missing channels; nested models of friction. The bounds
//! are measured fits, less a margin. Recordings are in the folder that `MOTORFIT_RECORDINGS` names.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr, reason = "a test may stop and print")]
#![allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, reason = "small numbers")]

mod friction;

use crate::support::program::{self, Folder, json};
use crate::support::rates::cases;
use crate::support::recordings::set;
use motorfit::analysis::Characteristics;
use motorfit::identify::{Identification, IdentifySpec, identify, validate};
use motorfit::motor::{Extension, With};
use motorfit::motor::{Parameter, Scope, Space};
use motorfit::record::{Preparation, ReadOptions, Reading, Record, parse_columns, parse_masks};
use rayon::prelude::*;
use std::path::PathBuf;

/// Returns the recordings of tutla53 with motion, with the voltage as a fraction of 12 V.
fn tutla53() -> Option<Vec<Record>> {
    let folder = set("tutla53-dc-motor")?;
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "csv"));
    files.sort();
    let columns = parse_columns("voltage=Commanded_PWM*12/7200:V").unwrap();
    let reading = Reading {
        options: ReadOptions { columns, ..ReadOptions::default() },
        preparation: Preparation { mask: parse_masks(&["auto".to_owned()]).unwrap(), ..Preparation::default() },
    };
    let records: Vec<Record> = files.iter().flat_map(|file| reading.records(file).unwrap()).collect();
    let moves = |record: &Record| {
        let speed = record.samples().speed.as_deref().unwrap();
        let [low, high] = [f64::min, f64::max].map(|f| speed.iter().copied().fold(speed[0], f));
        high - low > 10.0
    };
    let moving: Vec<Record> = records.into_iter().filter(moves).collect();
    assert_eq!(moving.len(), 87, "recordings that move");
    Some(moving)
}

/// Returns the specification of the linear motor with extensions and fixed values.
fn spec(with: &[Extension], held: &[(Parameter, f64)]) -> IdentifySpec {
    let fixed = held.iter().map(|&(parameter, value)| (parameter, Scope::Shared, value)).collect();
    let space = Space::new(Space::table2().free().to_vec(), fixed).unwrap();
    IdentifySpec { with: With::These(with.to_vec()), space, ..IdentifySpec::default() }
}

/// Returns the fit of many recordings together: 100 (1 − ‖y − ŷ‖/‖y − mean y‖), with the mean over all of them.
fn pooled(records: &[Record], found: &[Identification]) -> f64 {
    let all: Vec<f64> = records.iter().flat_map(|r| r.samples().speed.clone().unwrap()).collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let about: f64 = all.iter().map(|y| (y - mean).powi(2)).sum();
    let left: f64 = records.iter().zip(found).map(|(r, f)| f.residual_sigma[1].unwrap().powi(2) * r.len() as f64).sum();
    100.0 * (1.0 - (left / about).sqrt())
}

#[test]
fn gain_time_constant_and_dead_time_of_each_recording() {
    let Some(records) = tutla53() else { return };
    let records: Vec<Record> = records.into_iter().step_by(cases(4, 1)).collect();
    for (held, window) in [(&[][..], None), (&[(Parameter::SpeedAverage, 32.0)][..], Some([0.021, 0.025]))] {
        let spec = spec(&[Extension::DeadTime], held);
        let one = |record: &Record| identify(std::slice::from_ref(record), &spec).unwrap();
        let found: Vec<Identification> = records.par_iter().map(one).collect();
        let fit = pooled(&records, &found);
        let mut constants: Vec<f64> =
            found.iter().map(|f| Characteristics::of(f).unwrap().time_constant.value).collect();
        constants.sort_by(f64::total_cmp);
        let [low, middle, high] =
            [0.1, 0.5, 0.9].map(|share| constants[(share * (constants.len() - 1) as f64) as usize]);
        println!("pooled {fit:.2} %, time constants {low:.4} {middle:.4} {high:.4} s");
        assert!(fit >= 97.8, "{fit}");
        if let Some([from, to]) = window {
            assert!(from <= low && high <= to, "{low} {middle} {high}");
        }
    }
}

#[test]
fn one_motor_with_its_drive_fits_held_out_recordings() {
    let Some(records) = tutla53() else { return };
    let part = |rest: usize| -> Vec<Record> { records.iter().skip(rest).step_by(2).cloned().collect() };
    let (fitted, held_out) = (part(0), part(1));
    let drive = [Extension::DeadTime, Extension::Deadband];
    let all = [&drive[..], &[Extension::Saturation, Extension::DirectionGain]].concat();
    for (with, floor) in [(&drive[..], 94.0), (&all[..], 95.0)].into_iter().take(cases(1, 2)) {
        let spec = spec(with, &[(Parameter::SpeedAverage, 32.0)]);
        let found = identify(&fitted, &spec).unwrap();
        let validation = validate(&held_out, &spec, &found).unwrap();
        let (own, held) = (found.fit_percent[1].unwrap(), validation.fit_percent[1].unwrap());
        println!("fitted {own:.2} %, held out {held:.2} %: {:?}", found.extensions());
        assert!(own >= floor && held >= floor, "{own} {held}");
    }
}

#[test]
fn steps_and_chirps_fit_held_out_ones() {
    let Some(folder) = set("labmrd-odrive") else { return };
    for (name, flags, own, held_out) in
        [("step", &[][..], 98.5, 97.0), ("chirp", &["--crop", ":3.5", "--discretization", "foh"][..], 97.0, 97.0)]
    {
        let path = |n: usize| folder.join(format!("{name}{n}.csv")).to_str().unwrap().to_owned();
        let mut args = vec!["identify".to_owned(), path(1), "--json".to_owned()];
        args.extend(["--columns", "time=timestep (8Hz):8kHz"].map(str::to_owned));
        args.extend(flags.iter().map(|flag| (*flag).to_owned()));
        for n in 2..=5 {
            args.extend(["--validate".to_owned(), path(n)]);
        }
        let document = json(&args.iter().map(String::as_str).collect::<Vec<_>>());
        let of = |at: &serde_json::Value| at["fit_percent"]["speed"].as_f64().unwrap();
        let (fitted, held) = (of(&document), of(&document["validation"]));
        println!("{name}: {fitted:.2} %, held out {held:.2} %");
        assert!(fitted >= own && held >= held_out, "{name}: {fitted} {held}");
        // Voltage and speed identify gain and time constant, not R, L, K, B and J.
        assert!(document["parameters"]["R"]["value"].is_null() && document["parameters"]["R"]["identified"] == false);
        assert!(document["characteristics"]["output_error"]["kV"]["std_error"].as_f64().unwrap() > 0.0);
    }
}

#[test]
fn averaging_sensors_and_friction_fit_a_step() {
    let Some(folder) = set("waam-ufjf-ensaio-frequencia") else { return };
    let file = folder.join("dados.csv");
    let volts = [154.0, 180.0].map(|duty| 11.04 * duty / 255.0);
    let columns = format!(
        "time=Tempo:s,current=Corrente:mA,speed=Velocidade:rad/s,voltage=Degrau:{:.5}..{:.5}",
        volts[0], volts[1]
    );
    let document = json(&[
        "identify",
        file.to_str().unwrap(),
        "--json",
        "--columns",
        &columns,
        "--with",
        "coulomb,offset,sensor-average",
    ]);
    let fit = &document["fit_percent"];
    println!("current {}, speed {}", fit["current"], fit["speed"]);
    assert!(fit["speed"].as_f64().unwrap() >= 96.0 && fit["current"].as_f64().unwrap() >= 87.0, "{fit}");
    // Without the sensor average L would be 9 H with a small standard error.
    let inductance = &document["parameters"]["L"];
    assert!(inductance["value"].is_null() && inductance["identified"] == false, "{inductance}");
    let codes: Vec<&str> =
        document["warnings"].as_array().unwrap().iter().map(|w| w["code"].as_str().unwrap()).collect();
    assert!(codes.contains(&"not_identifiable"), "{codes:?}");
    let window = |symbol: &str| document["parameters"][symbol]["value"].as_f64().unwrap();
    assert!((window("Ni") - 128.0).abs() < 12.0 && (window("Nw") - 128.0).abs() < 12.0);
}

#[test]
fn auto_selects_models_that_fit_held_out_recordings() {
    let Some(records) = tutla53() else { return };
    let part = |rest: usize| -> Vec<Record> { records.iter().skip(rest).step_by(2).cloned().collect() };
    let (fitted, held_out) = (part(0), part(1));
    let auto = IdentifySpec { with: With::Auto, ..IdentifySpec::default() };
    let found = identify(&fitted, &auto).unwrap();
    let held = validate(&held_out, &auto, &found).unwrap().fit_percent[1].unwrap();
    println!("tutla53: held out {held:.2} %: {:?}, {:?}", found.extensions(), found.trust);
    assert!(held >= 94.5, "{held}");
    let Some(folder) = set("waam-ufjf-ensaio-frequencia") else { return };
    let columns = "time=Tempo:s,current=Corrente:mA,speed=Velocidade:rad/s,voltage=Degrau:6.66745..7.79294";
    let file = folder.join("dados.csv");
    let document = json(&["identify", file.to_str().unwrap(), "--json", "--columns", columns, "--with", "auto"]);
    let [current, speed] = ["current", "speed"].map(|channel| document["fit_percent"][channel].as_f64().unwrap());
    println!("waam: {current:.2} %, {speed:.2} %: {}", document["trust"]);
    assert!(current >= 87.0 && speed >= 97.0, "{current} {speed}");
    // Two sensors average, and the residuals are not noise, so the level of trust is not good.
    assert_ne!(document["trust"]["level"], "good");
}

#[test]
fn auto_excludes_undersampled_segments() {
    let Some(folder) = set("labmrd-odrive") else { return };
    let path = |n: usize| folder.join(format!("chirp{n}.csv")).to_str().unwrap().to_owned();
    let run = |more: &[String]| {
        let mut args: Vec<String> = ["identify", "--json", "--with", "auto", "--columns", "time=timestep (8Hz):8kHz"]
            .map(str::to_owned)
            .to_vec();
        args.extend_from_slice(more);
        let document = json(&args.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(document["discretization"], "foh");
        assert_ne!(document["trust"]["level"], "good", "its residuals are correlated");
        // Voltage and speed identify gain and time constant only, for any intersample behaviour.
        for symbol in ["R", "L", "K", "B", "J"] {
            assert!(document["parameters"][symbol]["value"].is_null(), "{}", document["parameters"][symbol]);
        }
        document
    };
    let speed = |at: &serde_json::Value| at["fit_percent"]["speed"].as_f64().unwrap();
    let fits: Vec<f64> = (1..=cases(1, 5)).map(|n| speed(&run(&[path(n)]))).collect();
    let validate: Vec<String> = [4, 5].into_iter().flat_map(|n| ["--validate".to_owned(), path(n)]).collect();
    let joint = run(&[&[path(1), path(2), path(3)], &validate[..]].concat());
    let (fitted, held_out) = (speed(&joint), speed(&joint["validation"]));
    println!("chirps one by one {fits:.2?} %, three {fitted:.2} %, held out {held_out:.2} %");
    assert!(fits.iter().chain([&fitted, &held_out]).all(|fit| *fit >= 97.5));
    // The chirp exceeds a sixth of the sampling rate from 4 s to its end.
    let left_out = joint["left_out"].as_array().unwrap();
    assert_eq!(left_out.len(), 3);
    for (n, of) in left_out.iter().enumerate() {
        assert_eq!(of["record"], path(n + 1));
        let [from, to] = ["from_s", "to_s"].map(|key| of[key].as_f64().unwrap());
        assert!((4.0..4.6).contains(&from) && to > 6.9, "{from} to {to}");
    }
}

#[test]
fn auto_finds_a_motor_whose_voltage_is_logged_late() {
    let Some(folder) = set("newcomer-logs") else { return };
    for name in ["reg2.csv", "k_good.csv"] {
        let document = json(&["identify", folder.join(name).to_str().unwrap(), "--json", "--with", "auto"]);
        // With a zero-order hold the error of J is 8 to 9 %.
        for (symbol, truth) in [("R", 2.5), ("K", 0.02), ("J", 1.5e-5), ("Tc", 0.002), ("B", 1.2e-5)] {
            let own = &document["parameters"][symbol];
            let [low, high] = [0, 1].map(|end| own["ci95"][end].as_f64().unwrap());
            println!("{name}: {symbol} {low:.5e} to {high:.5e}, truth {truth:e}");
            assert!((low..=high).contains(&truth) && high - low < 0.15 * truth, "{name}: {symbol} {low} to {high}");
        }
        let dead_time = document["parameters"]["td"]["value"].as_f64().unwrap();
        // The voltage was logged 6 ms late in one recording, 5 to 10 ms in the other.
        assert!((-0.0095..-0.0045).contains(&dead_time), "{dead_time}");
        assert_ne!(document["trust"]["level"], "poor", "{}", document["trust"]);
    }
}

/// Logs of newcomers, each with the arguments that the program advises.
const NEWCOMERS: [(&str, &[&str]); 15] = [
    ("a_natural.csv", &["--columns", "time=millis:ms,voltage=pwm*12/255:V,speed=rpm:rpm,current=current_mA:mA"]),
    ("b_german.csv", &["--columns", "voltage=PWM (0-255)*12/255:V"]),
    ("c_spanish.csv", &["--columns", "time=tiempo:ms,voltage=ciclo*12/255:V,speed=velocidad:rpm,current=corriente:mA"]),
    ("d_nocurrent.csv", &["--columns", "time=millis:ms,voltage=pwm*12/255:V,speed=rpm:rpm"]),
    (
        "e_garbage.csv",
        &["--bad-rows", "skip", "--columns", "time=millis:ms,voltage=pwm*12/255:V,speed=rpm:rpm,current=current_mA:mA"],
    ),
    ("f_volts.csv", &[]),
    ("g_noheader.csv", &["--columns", "time=#1:ms,voltage=#2*12/255:V,speed=#3:rpm,current=#4:mA"]),
    ("h_serial.txt", &["--columns", "time=t:ms,voltage=pwm*12/255:V,speed=rpm:rpm,current=mA:mA"]),
    ("glitch.csv", &["--mask", "auto"]),
    ("i_wrongunit.csv", &[]),
    ("j_reversed.csv", &[]),
    ("k_good.csv", &[]),
    ("l_const.csv", &[]),
    ("reg.csv", &[]),
    ("reg2.csv", &[]),
];

#[test]
fn no_log_of_a_newcomer_gives_a_wrong_number_that_is_trusted() {
    let Some(folder) = set("newcomer-logs") else { return };
    for (name, options) in NEWCOMERS {
        let path = folder.join(name).to_str().unwrap().to_owned();
        for with in [&[][..], &["--with", "auto"]] {
            let output = program::run(&[&["identify", &path, "--json"], options, with].concat());
            let error = String::from_utf8_lossy(&output.stderr);
            // A failed fit reports the findings of the recording.
            assert!(matches!(output.status.code(), Some(0 | 4)), "{name} {with:?}: {error}");
            let Ok(document) = serde_json::from_slice::<serde_json::Value>(&output.stdout) else {
                println!("{name} {with:?}: {}", error.lines().next().unwrap_or_default());
                continue;
            };
            let off = [("R", 2.5), ("K", 0.02), ("J", 1.5e-5)].map(|(symbol, truth)| {
                let value = document["parameters"][symbol]["value"].as_f64();
                value.map_or(0.0, |value| value / truth - 1.0)
            });
            println!("{name} {with:?}: {off:.3?} {}", document["trust"]["level"]);
            assert!(document["trust"]["level"] != "good" || off.iter().all(|off| off.abs() < 0.02), "{name} {off:?}");
            let is_messy = ["i_wrongunit.csv", "j_reversed.csv", "l_const.csv", "reg.csv"].contains(&name);
            assert!(with.is_empty() || is_messy || off.iter().all(|off| off.abs() < 0.05), "{name} {off:?}");
        }
    }
}

#[test]
fn auto_fits_wheels_from_encoder_counts() {
    let Some(folder) = set("robojackets-plant-excitation") else { return };
    let path = folder.join("excite_1").to_str().unwrap().to_owned();
    for wheel in 1..=4 {
        // Encoder counts and duty cycles of each wheel, and the step in ticks of 72 kHz: 608 ticks for counts over 8.4 ms.
        let columns =
            format!("time=cumsum(#9)/72000:s,voltage=#{}*12/128:V,speed=#{wheel}/#9*72000/2048*2*pi:rad/s", wheel + 4);
        let document = json(&["identify", &path, "--json", "--with", "auto", "--columns", &columns]);
        let fit = document["fit_percent"]["speed"].as_f64().unwrap();
        println!("wheel {wheel}: {fit:.2} %");
        // Another program with Coulomb friction only: 95.2 % for one wheel.
        assert!(fit >= 95.0 && document["trust"]["level"] != "good", "{fit} {}", document["trust"]);
    }
}

#[test]
fn auto_fits_a_pendulum_with_gravity() {
    let Some(folder) = set("rhoban-bam-xl330") else { return };
    let path = folder.join("2026-01-15_10h29m37.json").to_str().unwrap().to_owned();
    let columns = "time=timestamp:s,speed=speed:rad/s,voltage=int16(load)/885*input_volts*torque_enable:V,\
                   load_torque=mass*9.80665*length*sin(position):Nm";
    let document = json(&["identify", &path, "--json", "--with", "auto", "--columns", columns]);
    let fit = document["fit_percent"]["speed"].as_f64().unwrap();
    println!("pendulum: {fit:.2} %, {}", document["trust"]);
    // Another program with gravity: 92.7 %. Without the load torque the fit is some 30 %.
    assert!(fit >= 92.0 && document["trust"]["level"] != "good", "{fit} {}", document["trust"]);
    let with = document["with"].as_array().unwrap();
    assert!(with.iter().any(|e| e == "coulomb"), "{with:?}");
}

#[test]
fn a_model_that_does_not_fit_is_not_trusted() {
    let Some(folder) = set("labmrd-odrive") else { return };
    for n in 1..=5 {
        let path = folder.join(format!("noise{n}.csv")).to_str().unwrap().to_owned();
        // A random voltage at every sample, not synchronous with the log: kV is fifty times that of the steps.
        let args = ["identify", &path, "--json", "--columns", "time=timestep (8Hz):8kHz", "--with", "auto"];
        let output = program::run(&args);
        if output.status.code() == Some(4) {
            continue;
        }
        let document: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(document["fit_percent"]["speed"].as_f64().unwrap() < 10.0);
        assert_eq!(document["trust"]["level"], "poor", "{}", document["trust"]);
    }
}

#[test]
fn one_channel_gives_identifiable_parameters() {
    // The paper's motor at 40 dB under a varying voltage, without one channel.
    let folder = Folder::new();
    let whole = folder.path("whole.csv");
    // Several levels in both directions, because under a single step a brush drop is like a lower voltage.
    let level = |n: u32| [0.0, 9.0, 2.0, -6.0, 4.0, -1.5, 10.5][(n / 200) as usize % 7];
    let input: String = (0..2800).map(|n| format!("{},{}\n", f64::from(n) * 1e-3, level(n))).collect();
    let input = folder.file("input.csv", format!("time_s,voltage_V\n{input}"));
    program::ok(&["simulate", "--parameters", "m2,vb=0.4", "--input", &input, "--noise", "40dB", "--out", &whole]);
    let text = std::fs::read_to_string(&whole).unwrap();
    let without = |column: usize, name: &str| {
        let keep = |line: &str| {
            let cells: Vec<&str> = line.split(',').enumerate().filter(|(n, _)| *n != column).map(|(_, c)| c).collect();
            cells.join(",")
        };
        let path = folder.path(name);
        std::fs::write(&path, text.lines().map(keep).collect::<Vec<_>>().join("\n") + "\n").unwrap();
        path
    };
    let current = json(&["identify", &without(3, "current.csv"), "--json", "--with", "brush-drop"]);
    let of = |symbol: &str, key: &str| current["parameters"][symbol][key].as_f64();
    for (symbol, truth) in [("R", 0.921_042), ("L", 0.007_759), ("vb", 0.4)] {
        let (value, error) = (of(symbol, "value").unwrap(), of(symbol, "std_error").unwrap());
        assert!((value - truth).abs() < 5.0 * error, "{symbol} = {value} ± {error}");
    }
    assert!(of("K", "value").is_none() && of("B", "value").is_none() && of("J", "value").is_none());
    assert!(current["characteristics"]["output_error"]["kV"].is_null());
    let speed = json(&["identify", &without(2, "speed.csv"), "--json", "--with", "coulomb"]);
    assert!(speed["parameters"]["K"]["value"].is_null());
    let m2 = motorfit::motor::Parameters::M2;
    let truth = (m2.r * m2.b + m2.k * m2.k) / m2.k;
    let kv = &speed["characteristics"]["output_error"]["kV"];
    let (value, error) = (kv["value"].as_f64().unwrap(), kv["std_error"].as_f64().unwrap());
    assert!(value > 0.9 * truth && value < 1.1 * truth && error > 0.0, "kV = {value} ± {error}, truth {truth}");
}
