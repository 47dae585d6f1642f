//! Proves: each diagnostic rule finds its fault in a recording with it and raises no alarm on the same recording without it;
//! each code is a false alarm in at most 0.5 % of random simulated recordings; reversed signs and sensor averages are found at
//! the rates below; known properties of real recordings are found (with MOTORFIT_RECORDINGS).
//! Does not prove: that thresholds suit every logger.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_possible_truncation, clippy::float_cmp, reason = "small numbers; exact equality is meant")]
#![allow(clippy::cast_precision_loss, clippy::cast_sign_loss, reason = "small numbers")]

mod finds;
mod graded;
mod rates;

use crate::support::rates::{cases, is_rare, reaches};
use crate::support::varied;
use crate::support::{changed, driven, m2_record};
use motorfit::record::{Finding, Quantity, Record, Samples, Severity, diagnose, parse_columns, read_recording};
use rand::RngExt as _;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

const LEVELS: [f64; 12] = [0.0, 6.0, 10.0, 3.0, -5.0, 0.0, 8.0, -8.0, 4.0, 9.0, 5.0, 0.0];

/// Returns a recording of the M2 motor at 1 kHz under steps of 0.5 s, with 40 dB of noise; `drive(n, command)` is the voltage
/// that acts on the motor.
fn steps_through(drive: impl Fn(usize, f64) -> f64) -> Record {
    let command: Vec<f64> = (0..6000).map(|n| LEVELS[n / 500]).collect();
    under(&command, drive)
}

fn under(command: &[f64], drive: impl Fn(usize, f64) -> f64) -> Record {
    let time = (0..command.len()).map(|n| n as f64 * 1e-3).collect();
    let got = command.iter().enumerate().map(|(n, v)| drive(n, *v)).collect();
    let clean = driven(time, got, None);
    changed(&clean, |s| {
        s.voltage = command.to_vec();
        let mut numbers = varied::numbers(1);
        for signal in [&mut s.current, &mut s.speed].into_iter().flatten() {
            varied::noisy(&mut numbers, signal, 40.0);
        }
    })
}

fn steps() -> Record {
    steps_through(|_, v| v)
}

fn each(signal: &mut Option<Vec<f64>>, change: impl Fn(usize, f64) -> f64) {
    signal.iter_mut().flatten().enumerate().for_each(|(n, v)| *v = change(n, *v));
}

fn find(record: &Record, code: &str) -> Option<Finding> {
    diagnose(record).into_iter().find(|finding| finding.code == code)
}

#[track_caller]
fn only(record: &Record, code: &str) -> Finding {
    let findings = diagnose(record);
    let codes: Vec<&str> = findings.iter().map(|f| f.code).collect();
    assert!(!codes.is_empty() && codes.iter().all(|c| *c == code), "{code}: {findings:#?}");
    for f in &findings {
        assert!(!f.remedy.is_empty() && f.places.len() <= 20 && f.figures.iter().all(|(_, v)| v.is_finite()));
        assert!(f.places.iter().all(|p| p.start < p.end && p.end <= record.len()), "{f:?}");
    }
    findings.into_iter().next().unwrap()
}

fn figure(finding: &Finding, name: &str) -> f64 {
    finding.figures.iter().find(|(n, _)| *n == name).unwrap().1
}

fn averaged(values: &[f64], window: usize) -> Vec<f64> {
    let at = |n: usize| &values[(n + 1).saturating_sub(window)..=n];
    (0..values.len()).map(|n| at(n).iter().sum::<f64>() / at(n).len() as f64).collect()
}

#[test]
fn a_good_recording_has_no_findings() {
    assert_eq!(diagnose(&steps()), []);
    for part in [|s: &mut Samples| s.current = None, |s: &mut Samples| s.speed = None] {
        assert_eq!(diagnose(&changed(&steps(), part)), []);
    }
}

#[test]
fn clocks() {
    let shaken = changed(&steps(), |s| {
        let mut numbers = varied::numbers(2);
        s.time_s.iter_mut().for_each(|t| *t += 1e-4 * numbers.random_range(-0.7..0.7));
    });
    assert!((0.04..0.08).contains(&figure(&only(&shaken, "jitter"), "spread")));
    let gap = changed(&steps(), |s| s.time_s[300..].iter_mut().for_each(|t| *t += 0.45e-3));
    assert_eq!(only(&gap, "jitter").places, vec![299..301]);
    let rounded = changed(&steps(), |s| s.time_s.iter_mut().for_each(|t| *t = (3300.0 * *t).round() * 1e-3));
    assert!(only(&rounded, "jitter").message.to_string().contains("rounded"));
}

#[test]
fn sensors() {
    for window in [16, 64] {
        let record = changed(&steps(), |s| s.speed = s.speed.as_deref().map(|w| averaged(w, window)));
        let finding = only(&record, "averaged_sensor");
        assert_eq!((finding.quantity, figure(&finding, "window")), (Quantity::Speed, window as f64));
    }
    let held = changed(&steps(), |s| {
        let raw = s.speed.clone().unwrap();
        each(&mut s.speed, |n, _| raw[n / 5 * 5]);
    });
    assert_eq!(figure(&find(&held, "held_samples").unwrap(), "run"), 5.0);
    let coarse = changed(&steps(), |s| each(&mut s.speed, |_, w| (w / 3.0).round() * 3.0));
    assert!((figure(&only(&coarse, "coarse_quantization"), "step") - 3.0).abs() < 1e-9);
    let fine = changed(&steps(), |s| each(&mut s.speed, |_, w| (w / 0.3).round() * 0.3));
    assert_eq!(diagnose(&fine), []);
    let offset = changed(&steps(), |s| each(&mut s.current, |_, i| i + 0.2));
    assert!((figure(&only(&offset, "rest_offset"), "offset") - 0.2).abs() < 0.01);
    let command: Vec<f64> = (0..3000).map(|n| LEVELS[n / 1000]).collect();
    let ripple = changed(&under(&command, |_, v| v), |s| {
        each(&mut s.speed, |n, w| w * (1.0 + 0.04 * (TAU * 0.05 * n as f64).sin()));
    });
    let finding = only(&ripple, "speed_ripple");
    assert!((figure(&finding, "hertz") - 50.0).abs() < 1.0 && (figure(&finding, "part") - 0.04).abs() < 0.005);
}

#[test]
fn inputs() {
    let mut numbers = varied::numbers(3);
    let noise: Vec<f64> = (0..3000).map(|_| numbers.random_range(-8.0..8.0)).collect();
    only(&under(&noise, |_, v| v), "undersampled_input");
    only(&m2_record(), "single_edge");
    let reset = changed(&steps(), |s| {
        s.voltage[5500..].fill(7.0);
        s.voltage[500..5500].iter_mut().filter(|v| **v == 0.0).for_each(|v| *v = 1.0);
        s.voltage[5998..].fill(0.0);
    });
    let finding = find(&reset, "input_reset").unwrap();
    assert!(finding.remedy.to_string().contains("crop 0:5.997") && finding.places[0] == (5998..6000), "{finding:?}");
    let idle = changed(&steps(), |s| s.voltage.iter_mut().filter(|v| **v == 0.0).for_each(|v| *v = 0.03));
    only(&idle, "idle_input");
    let late = steps_through(|n, v| if n < 560 { 0.0 } else { v });
    assert!((figure(&only(&late, "start_latency"), "first_s") - 0.06).abs() < 0.02);
    for channel in [|s: &mut Samples| each(&mut s.current, |_, v| -v), |s: &mut Samples| each(&mut s.speed, |_, v| -v)]
    {
        only(&changed(&steps(), channel), "sign_reversed");
    }
    let voltage = changed(&steps(), |s| s.voltage.iter_mut().for_each(|v| *v = -*v));
    assert_eq!(only(&voltage, "sign_reversed").quantity, Quantity::Voltage);
}

#[test]
fn motors_and_drives() {
    let unseen = changed(&steps(), |s| s.voltage.fill(0.0));
    only(&unseen, "motion_without_input");
    let flag = changed(
        &under(&[vec![0.0; 1000], vec![1.0; 2000]].concat(), |n, v| if n < 100 { 0.0 } else { 5.0 + 3.0 * v }),
        |s| {
            *s = Samples {
                time_s: s.time_s[500..].to_vec(),
                voltage: s.voltage[500..].to_vec(),
                torque: None,
                current: Some(s.current.as_ref().unwrap()[500..].to_vec()),
                speed: Some(s.speed.as_ref().unwrap()[500..].to_vec()),
                ..Samples::default()
            };
        },
    );
    assert_eq!(find(&flag, "motion_without_input").unwrap().places, vec![0..500]);
    for still in [|_, _| 0.0, |n: usize, _| 0.3 * f64::from(u8::from(n.is_multiple_of(900)))] {
        assert!(find(&changed(&steps(), |s| each(&mut s.speed, still)), "no_motion").is_some());
    }
    let staircase: Vec<f64> = (0..6000).map(|n| (n / 500) as f64).collect();
    assert_eq!(diagnose(&under(&staircase, |_, v| v)), []);
    only(&under(&staircase, |_, v| if v > 8.5 { 17.0 - v } else { v }), "speed_falls");
    only(&under(&staircase, |_, v| v.min(6.0)), "speed_saturates");
    let clipped = changed(&steps(), |s| each(&mut s.current, |_, i| i.clamp(-0.7, 0.7)));
    only(&clipped, "current_clipped");
}

/// Returns a recording of a motor without inductance, whose drive supplies the current i = drive(n, v, (v − Kω)/R).
fn behind(drive: impl Fn(usize, f64, f64) -> f64) -> Record {
    let [r, k, b, j, h] = [1.0, 0.05, 1e-5, 1e-4, 1e-3];
    let mut speed = 0.0;
    let mut s = Samples { current: Some(vec![]), speed: Some(vec![]), ..Samples::default() };
    for n in 0..6000 {
        let v = LEVELS[n / 500];
        let i = drive(n, v, (v - k * speed) / r);
        s.time_s.push(n as f64 * h);
        s.voltage.push(v);
        s.current.as_mut().unwrap().push(i);
        s.speed.as_mut().unwrap().push(speed);
        speed += h / j * (k * i - b * speed);
    }
    let mut numbers = varied::numbers(4);
    for signal in [&mut s.current, &mut s.speed].into_iter().flatten() {
        varied::noisy(&mut numbers, signal, 45.0);
    }
    Record::new(s).unwrap()
}

#[test]
fn drives_that_limit_or_are_off() {
    assert_eq!(diagnose(&behind(|_, _, i| i)), []);
    let limited = only(&behind(|_, _, i| i.clamp(-3.0, 3.0)), "current_clipped");
    assert!(limited.message.to_string().contains("limit"), "{limited:?}");
    let off = |n: usize| n < 900 || (3200..3400).contains(&n);
    let record = behind(|n, _, i| if off(n) { 0.0 } else { i });
    let finding = find(&record, "voltage_without_current").unwrap();
    assert!(finding.places.iter().all(|p| off(p.start) && off(p.end - 1)), "{finding:?}");
}

#[test]
fn units() {
    let rpm = changed(&steps(), |s| each(&mut s.speed, |_, w| (w * 60.0 / TAU).round()));
    assert!(only(&rpm, "units").remedy.to_string().contains(":rpm"));
    let milliamperes = changed(&steps(), |s| each(&mut s.current, |_, i| (1000.0 * i).round()));
    assert!(only(&milliamperes, "units").remedy.to_string().contains(":mA"));
    let milliseconds = changed(&steps(), |s| s.time_s.iter_mut().for_each(|t| *t *= 1000.0));
    assert!(only(&milliseconds, "units").remedy.to_string().contains(":ms"));
}

#[test]
fn short_and_empty_recordings_are_fine() {
    for count in [2, 3, 4, 5, 9, 10, 11, 20, 21, 40, 511, 513, 600] {
        for (v, y) in [(0.0, 0.0), (5.0, 0.0), (5.0, 1.0), (0.0, 1.0), (-1e9, 1e9), (1e-300, 1e-300)] {
            for edge in [0, 1, count / 2, count - 1, count] {
                for (current, speed) in [(true, false), (false, true), (true, true)] {
                    let time_s = (0..count).map(|n| n as f64 * 1e-3).collect();
                    let at = |x: f64| (0..count).map(|n| if n < edge { 0.0 } else { x }).collect::<Vec<f64>>();
                    let (current, speed) = (current.then(|| at(y)), speed.then(|| at(-y)));
                    let record = Record::new(Samples {
                        time_s,
                        voltage: at(v),
                        torque: None,
                        current,
                        speed,
                        ..Samples::default()
                    })
                    .unwrap();
                    for finding in diagnose(&record) {
                        assert!(finding.figures.iter().all(|(_, v)| v.is_finite()), "{finding:?}");
                        assert!(finding.places.iter().all(|p| p.start < p.end && p.end <= count), "{finding:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn an_unrecorded_pulse_is_motion_without_input() {
    let slow = |drive: &dyn Fn(usize, f64) -> f64| {
        let p = motorfit::motor::Parameters { j: 0.005, ..motorfit::motor::Parameters::M2 };
        let time_s: Vec<f64> = (0..6000).map(|n| f64::from(n) * 1e-3).collect();
        let command: Vec<f64> = (0..6000)
            .map(|n| {
                if n < 500 {
                    0.0
                } else if n < 2500 {
                    4.0
                } else {
                    10.0
                }
            })
            .collect();
        let got = command.iter().enumerate().map(|(n, v)| drive(n, *v)).collect();
        let excitation = motorfit::experiment::Excitation { time_s, voltage: got, torque: None };
        let clean = motorfit::experiment::simulated(&p, &excitation, motorfit::motor::Discretization::Zoh).unwrap();
        let noisy = motorfit::experiment::with_noise(&clean, [0.02, 0.5], 3).unwrap();
        changed(&noisy, |s| s.voltage = command)
    };
    let dropped = changed(&slow(&|_, v| v), |s| s.voltage[2500..3000].fill(0.0));
    assert_eq!(find(&dropped, "motion_without_input").unwrap().places, vec![2500..3000]);
    let coasting =
        changed(&slow(&|n, v| if (2500..3000).contains(&n) { 0.0 } else { v }), |s| s.voltage[2500..3000].fill(0.0));
    assert_eq!(find(&coasting, "motion_without_input"), None);
}

#[test]
fn reversed_signs_are_found_under_any_excitation() {
    let mut seen: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    let mut wrong = 0;
    for seed in 0..cases(130, 400) {
        let varied = varied::varied(5000 + seed);
        if varied.record.measured().iter().any(Option::is_none) {
            continue;
        }
        for which in 0..3 {
            let reversed = changed(&varied.record, |s| match which {
                0 => s.voltage.iter_mut().for_each(|v| *v = -*v),
                1 => each(&mut s.current, |_, i| -i),
                _ => each(&mut s.speed, |_, w| -w),
            });
            let expected = [Quantity::Voltage, Quantity::Current, Quantity::Speed][which];
            let found = find(&reversed, "sign_reversed").map(|finding| finding.quantity);
            wrong += usize::from(found.is_some_and(|found| found != expected));
            let [right, all] = seen.entry(varied.kind).or_default();
            (*right, *all) = (*right + usize::from(found.is_some()), *all + 1);
        }
    }
    println!("reversed signs found: {seen:?}, wrongly named: {wrong}");
    let [right, all] = seen.values().fold([0, 0], |[a, b], [c, d]| [a + c, b + d]);
    assert!(reaches(right, all, 0.8) && is_rare(wrong, all, 0.025), "{right} of {all}, {wrong} wrongly");
}

#[test]
fn false_alarms_are_rare() {
    let all = cases(500, 1500);
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for seed in 0..all {
        let varied = varied::varied(seed);
        for finding in diagnose(&varied.record) {
            // Findings that are true for this excitation.
            let true_of_it = match finding.code {
                "single_edge" => true,
                "undersampled_input" => varied.kind == "prbs" && varied.hold == 1,
                _ => false,
            };
            *counts.entry(finding.code).or_default() += usize::from(!true_of_it);
        }
    }
    println!("false alarms in {all}: {counts:?}");
    for (code, count) in counts {
        assert!(is_rare(count, all as usize, 0.005), "{code}: {count} of {all}");
    }
}

#[test]
fn averages_are_detected() {
    for (kind, least) in [("prbs", 0.97), ("steps", 0.85)] {
        for window in [8, 32, 100, 128] {
            let (mut right, total) = (0, cases(15, 40));
            for seed in 0..total {
                let mut numbers = varied::numbers(9000 + seed);
                let count = numbers.random_range(5000..10_000);
                let clean = varied::clean(&mut numbers, kind, count);
                let record = changed(&clean.record, |s| {
                    let mut speed = s.speed.take().unwrap();
                    varied::noisy(&mut numbers, &mut speed, 40.0);
                    s.speed = Some(averaged(&speed, window));
                    s.current = None;
                });
                let found = find(&record, "averaged_sensor").map_or(0.0, |f| figure(&f, "window"));
                right += usize::from((found / window as f64 - 1.0).abs() < 0.02);
            }
            println!("{kind}, average over {window}: {right} of {total}");
            assert!(reaches(right, total as usize, least), "{kind} {window}: {right} of {total}");
        }
    }
}

/// Returns the folder of real recordings.
fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("MOTORFIT_RECORDINGS").map(PathBuf::from);
    if folder.is_none() {
        assert!(
            std::env::var_os("MOTORFIT_NO_SKIP").is_none(),
            "MOTORFIT_RECORDINGS is not set and skips are failures"
        );
        println!("SKIPPED: set MOTORFIT_RECORDINGS to the folder of real recordings");
    }
    folder
}

/// Returns all findings in a folder, by file.
fn findings(folder: &Path, read: impl Fn(&Path) -> Record) -> BTreeMap<String, Vec<Finding>> {
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let files = paths.filter(|path| path.extension().is_some_and(|e| e == "csv"));
    files.map(|path| (path.file_stem().unwrap().to_str().unwrap().to_owned(), diagnose(&read(&path)))).collect()
}

/// Returns the files with a finding for which `test` is true.
fn files(findings: &BTreeMap<String, Vec<Finding>>, test: impl Fn(&Finding) -> bool) -> Vec<&str> {
    findings.iter().filter(|(_, list)| list.iter().any(&test)).map(|(name, _)| name.as_str()).collect()
}

#[test]
fn real_waam() {
    let Some(folder) = folder() else { return };
    let columns = parse_columns("time=Tempo:s,current=Corrente:mA,speed=Velocidade:rad/s,voltage=Degrau:V").unwrap();
    let found = findings(&folder.join("waam-ufjf-ensaio-frequencia"), |path| read_recording(path, &columns).unwrap());
    for quantity in [Quantity::Current, Quantity::Speed] {
        let right = |f: &Finding| f.quantity == quantity && (127.0..=129.0).contains(&figure(f, "window"));
        assert_eq!(files(&found, |f| f.code == "averaged_sensor" && right(f)).len(), 12, "{quantity}");
    }
    assert!(files(&found, |f| f.code == "motion_without_input").len() >= 10);
}

#[test]
fn real_tutla53() {
    let Some(folder) = folder() else { return };
    let columns = parse_columns("time=Timestamp(ms):ms,speed=Motor_Speed(RPM):rpm,voltage=Commanded_PWM:V").unwrap();
    let found = findings(&folder.join("tutla53-dc-motor"), |path| read_recording(path, &columns).unwrap());
    let of = |code: &str| files(&found, |f| f.code == code);
    let still = of("no_motion");
    assert_eq!((still.len(), of("input_reset").len(), of("idle_input").len()), (17, 15, 104));
    assert!(files(&found, |f| f.code == "averaged_sensor" && figure(f, "window") == 32.0).len() >= 80);
    let coarse = of("coarse_quantization");
    assert!(coarse.len() == 87 && coarse.iter().all(|name| !still.contains(name)));
    let never = ["sign_reversed", "motion_without_input", "jitter", "held_samples", "units", "speed_ripple"];
    assert!(never.iter().all(|code| of(code).is_empty()));
}

#[test]
fn real_labmrd() {
    let Some(folder) = folder() else { return };
    let columns = parse_columns("time=timestep (8Hz):8kHz").unwrap();
    let found = findings(&folder.join("labmrd-odrive"), |path| read_recording(path, &columns).unwrap());
    let of = |code: &str| files(&found, |f| f.code == code && f.severity == Severity::Report);
    assert_eq!(of("jitter").len(), 20);
    assert_eq!(of("motion_without_input"), ["impulse2", "impulse3", "impulse4", "impulse5"]);
    let fast = of("undersampled_input");
    assert_eq!(fast.iter().filter(|name| name.starts_with("noise")).count(), 5);
    assert!(fast.iter().all(|name| name.starts_with("noise") || name.starts_with("chirp")));
}
