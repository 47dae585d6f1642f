//! Proves: a recording saved by an independent writer in each log format gives the samples of the CSV file to the last bit; the tests
//! of SysId are cut from logs of WPILib and of changes alone; mechanisms are identified with intervals that hold 95 % of the truths; each
//! of ten faults of a log is named; damaged logs never panic.
//! Does not prove: logs of real robots, of which none is in the project.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::float_cmp, reason = "equality to the last bit is meant")]

use crate::support::program;
use crate::support::rates::{cases, covers};
use crate::support::wpilog::{Log, Mechanism, Routine, Rows, TESTS, simulated, volts, write};
use motorfit::Error;
use motorfit::identify::mechanism::{
    MechanismFit, MechanismKind, MechanismSpec, identify_mechanism, mechanism_signals,
};
use motorfit::identify::{IdentifySpec, TrustLevel, identify};
use motorfit::record::{Gaps, ReadOptions, Record, Samples, parse_columns, read, read_bytes};
use rand::SeedableRng as _;
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

fn path(name: &str) -> String {
    golden(name).to_str().unwrap().to_owned()
}

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/formats").join(name)
}

/// Logs with the samples of recording.csv, and the request for their columns.
const RECORDINGS: [(&str, &str); 8] = [
    ("recording.wpilog", ""),
    ("recording.mcap", "voltage=/motor/voltage/data:V,current=/motor/current/data:A"),
    ("recording.parquet", ""),
    ("recording.tdms", ""),
    ("recording.ulg", ""),
    ("recording.mf4", ""),
    ("recording.h5", ""),
    ("recording_v73.mat", ""),
];

#[test]
fn a_recording_in_each_format_is_that_of_the_csv_file() {
    let [csv] = <[Record; 1]>::try_from(read(&golden("recording.csv"), &ReadOptions::default()).unwrap()).unwrap();
    let spec = IdentifySpec::default();
    let expected = identify(std::slice::from_ref(&csv), &spec).unwrap();
    for (name, columns) in RECORDINGS {
        let options = ReadOptions { columns: parse_columns(columns).unwrap(), ..ReadOptions::default() };
        let records = read(&golden(name), &options).unwrap_or_else(|error| panic!("{name}: {error}"));
        let [record] = <[Record; 1]>::try_from(records).map_err(|records| records.len()).unwrap();
        same_signals(name, record.samples(), csv.samples());
        let found = identify(&[record], &spec).unwrap();
        assert_eq!(found.parameters.to_array(), expected.parameters.to_array(), "{name}");
        let errors = |of: &motorfit::identify::Identification| of.uncertainty.as_ref().unwrap().std_error.clone();
        assert_eq!(errors(&found), errors(&expected), "{name}");
    }
}

/// Asserts that signals are equal to the last bit, and times relative to the first: a log may begin earlier.
fn same_signals(name: &str, own: &Samples, csv: &Samples) {
    let signals = |of: &Samples| [Some(of.voltage.clone()), of.current.clone(), of.speed.clone()];
    assert!(signals(own) == signals(csv), "{name}: the signals differ");
    let off = own.time_s.iter().zip(&csv.time_s).map(|(a, b)| (a - own.time_s[0] - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-9 && own.time_s.len() == csv.time_s.len(), "{name}: times differ by {off} s");
}

fn options(is_linear: bool) -> ReadOptions {
    ReadOptions { signals: mechanism_signals(is_linear), ..ReadOptions::default() }
}

fn fit(records: &[Record], kind: Option<MechanismKind>, is_linear: bool) -> Result<MechanismFit, Error> {
    let spec = MechanismSpec { kind, is_linear, seed: 1 };
    identify_mechanism(records, &spec, &mut |_| ControlFlow::Continue(()))
}

/// Asserts that estimates are within four standard errors of the truths, which 99.99 % of them are.
fn is_near(fit: &MechanismFit, truths: &[(&str, f64)]) {
    for (name, truth) in truths {
        let estimate = fit.estimate(name).unwrap();
        let (value, error) = (estimate.value.unwrap(), estimate.std_error.unwrap());
        assert!((value - truth).abs() < 4.0 * error, "{name}: {value} ± {error}, truth {truth}");
        assert!(error < 0.1 * truth.abs().max(0.1), "{name}: {error}");
    }
}

#[test]
fn the_tests_of_logs_by_wpilib_are_identified() {
    // The characteristics of make_wpilog.py.
    let simple = read(&golden("sysid_simple.wpilog"), &options(false)).unwrap();
    assert_eq!(simple.iter().map(|record| record.source().part.clone().unwrap()).collect::<Vec<_>>(), TESTS);
    let found = fit(&simple, None, false).unwrap();
    assert_eq!((found.kind, found.unit.symbol), (MechanismKind::Simple, "turn"));
    is_near(&found, &[("kS", 0.25), ("kV", 2.1), ("kA", 0.32)]);
    let per_turn = found.in_unit("kV").unwrap().0 / found.estimate("kV").unwrap().value.unwrap();
    assert!((per_turn - std::f64::consts::TAU).abs() < 1e-12);

    let elevator = read(&golden("sysid_elevator.wpilog"), &options(true)).unwrap();
    let found = fit(&elevator, None, true).unwrap();
    assert_eq!((found.kind, found.unit.symbol), (MechanismKind::Elevator, "m"));
    is_near(&found, &[("kS", 0.18), ("kG", 0.62), ("kV", 3.9), ("kA", 0.21)]);

    let arm = read(&golden("sysid_arm.wpilog"), &options(false)).unwrap();
    let found = fit(&arm, None, false).unwrap();
    assert_eq!(found.kind, MechanismKind::Arm);
    is_near(&found, &[("kS", 0.2), ("kG", 0.75), ("kV", 1.4), ("kA", 0.09), ("offset", 0.1)]);
}

#[test]
fn logs_of_changes_hold_their_values_and_duty_times_battery_is_the_voltage() {
    let records = read(&golden("advantage.wpilog"), &options(false)).unwrap();
    let of_wpilib = read(&golden("sysid_simple.wpilog"), &options(false)).unwrap();
    let note = &records[0].source().notes;
    assert!(note.iter().any(|note| note.contains("duty cycle times the supply voltage")), "{note:?}");
    for (record, other) in records.iter().zip(&of_wpilib) {
        assert_eq!(record.len(), other.len());
        let voltage = |of: &Record| of.samples().named.iter().find(|signal| signal.is_input).unwrap().values.clone();
        // The battery has 12.5 V.
        let off = voltage(record).iter().zip(&voltage(other)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{off}");
    }
    is_near(&fit(&records, None, false).unwrap(), &[("kS", 0.25), ("kV", 2.1), ("kA", 0.32)]);
}

#[test]
fn a_duty_cycle_in_percent_is_refused() {
    let mut log = Log::new();
    let entries = [("/Arm/DutyCycle", ""), ("/BatteryVoltage", "Volt"), ("/Arm/VelocityRadPerSec", "")]
        .map(|(name, unit)| log.start(name, "double", unit));
    for n in 0..60_u32 {
        for (entry, value) in entries.into_iter().zip([f64::from(n % 40), 12.0, f64::from(n)]) {
            log.double(entry, u64::from(n) * 20_000, value);
        }
    }
    let error = read_bytes(&log.bytes, None, &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("the duty cycle reaches 39"), "{error}");
    let named = error.hint().to_string();
    let request = "voltage=\"/Arm/DutyCycle\"/100*\"/BatteryVoltage\":V";
    assert!(named.contains("/100"), "{named}");
    let options = ReadOptions { columns: parse_columns(request).unwrap(), ..ReadOptions::default() };
    let record = read_bytes(&log.bytes, None, &options).unwrap().remove(0);
    assert!(record.samples().voltage.iter().all(|volts| (0.0..=0.39 * 12.0 + 1e-9).contains(volts)));
}

const ARM: Mechanism = Mechanism { ks: 0.2, kv: 1.4, ka: 0.09, kg: 0.75, offset: Some(0.1), noise: 0.01 };
const LIFT: Mechanism = Mechanism { ks: 0.18, kv: 3.9, ka: 0.21, kg: 0.62, offset: None, noise: 0.01 };
const WHEEL: Mechanism = Mechanism { ks: 0.25, kv: 2.1, ka: 0.32, kg: 0.0, offset: None, noise: 0.02 };

/// Returns the rows of a test of a mechanism.
fn rows(of: &Mechanism, test: &str, seed: u64) -> Rows {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let start = match of.offset {
        Some(_) if test.ends_with("forward") => -0.8,
        Some(_) => 0.8,
        None => 0.0,
    };
    simulated(of, start, &volts(test), 0.02, &mut || StandardNormal.sample(&mut random))
}

fn log_of(routine: &Routine<'_>, of: &Mechanism) -> Vec<u8> {
    let mut log = Log::new();
    write(&mut log, routine, &|test| rows(of, test, 7 + test.len() as u64), 1_000_000);
    log.bytes
}

fn read_log(bytes: &[u8]) -> Result<Vec<Record>, Error> {
    read_bytes(bytes, None, &options(false))
}

#[test]
fn intervals_hold_95_percent_of_the_truths() {
    // Of the 780 intervals of 60 routines of each mechanism between 91.9 % and 97.6 % hold the truth (four standard errors of a binomial,
    // with parameters of a routine as independent).
    let routines = cases(12, 60);
    let (mut held, mut all) = (0, 0);
    for (of, kind) in [(ARM, MechanismKind::Arm), (LIFT, MechanismKind::Elevator), (WHEEL, MechanismKind::Simple)] {
        for seed in 0..routines {
            let mut log = Log::new();
            let tests = |test: &str| rows(&of, test, 1000 * seed + test.len() as u64);
            write(&mut log, &Routine::default(), &tests, 1_000_000);
            let found = fit(&read_log(&log.bytes).unwrap(), None, false).unwrap();
            assert_eq!(found.kind, kind, "seed {seed}");
            let truths =
                [("kS", of.ks), ("kV", of.kv), ("kA", of.ka), ("kG", of.kg), ("offset", of.offset.unwrap_or(0.0))];
            for (name, truth) in truths {
                let Some([low, high]) = found.estimate(name).and_then(|estimate| estimate.ci95) else { continue };
                all += 1;
                held += usize::from(low <= truth && truth <= high);
            }
        }
    }
    println!("{held} of {all} intervals hold the truth");
    assert!(all > 11 * usize::try_from(routines).unwrap() && covers(held, all, [0.919, 0.976]), "{held} of {all}");
}

/// Returns the codes of the warnings, and asserts that they are reasons of the trust.
fn codes(found: &MechanismFit) -> Vec<&'static str> {
    let reasons: Vec<&str> = found.found.trust.reasons.iter().map(|reason| reason.code).collect();
    let known = ["test_missing", "one_direction", "units_disagree", "test_without_motion"];
    let codes: Vec<&'static str> =
        found.found.warnings.iter().map(|warning| warning.code).filter(|code| known.contains(code)).collect();
    assert!(codes.iter().all(|code| reasons.contains(code)), "{codes:?} {reasons:?}");
    assert!(codes.is_empty() || found.found.trust.level != TrustLevel::Good);
    codes
}

#[test]
fn a_sound_log_has_no_fault() {
    let found = fit(&read_log(&log_of(&Routine::default(), &ARM)).unwrap(), None, false).unwrap();
    assert_eq!(codes(&found), [""; 0]);
    assert_eq!(found.found.trust.level, TrustLevel::Good, "{:?}", found.found.trust.reasons);
}

#[test]
fn missing_tests_and_directions_are_named() {
    let three = Routine { tests: &TESTS[..3], ..Routine::default() };
    let records = read_log(&log_of(&three, &ARM)).unwrap();
    let note = "test dynamic-reverse is missing";
    assert!(records[0].source().notes.iter().any(|own| own == note), "{:?}", records[0].source().notes);
    let found = fit(&records, None, false).unwrap();
    assert_eq!(codes(&found), ["test_missing"]);
    assert!(found.found.warnings.iter().any(|warning| warning.message.to_string().contains("dynamic-reverse")));

    let forward = Routine { tests: &[TESTS[0], TESTS[2]], ..Routine::default() };
    let found = fit(&read_log(&log_of(&forward, &WHEEL)).unwrap(), None, false).unwrap();
    assert_eq!(codes(&found), ["test_missing", "one_direction"]);
}

#[test]
fn two_mechanisms_must_be_chosen_from() {
    let mut log = Log::new();
    let end = write(&mut log, &Routine::default(), &|test| rows(&ARM, test, 1), 1_000_000);
    let wheel = Routine { mechanism: "wheel", ..Routine::default() };
    write(&mut log, &wheel, &|test| rows(&WHEEL, test, 2), end);
    let error = read_log(&log.bytes).unwrap_err();
    assert!(error.to_string().contains("tests of 2 mechanisms: \"arm\" and \"wheel\""), "{error}");
    for (sheet, kind) in
        [("arm", MechanismKind::Arm), ("wheel", MechanismKind::Simple), ("wheel:main", MechanismKind::Simple)]
    {
        let options = ReadOptions { sheet: Some(sheet.to_owned()), ..options(false) };
        let records = read_bytes(&log.bytes, None, &options).unwrap();
        assert_eq!(fit(&records, None, false).unwrap().kind, kind, "{sheet}");
    }
}

#[test]
fn an_entry_without_records_is_named() {
    let empty = Routine { is_empty: true, ..Routine::default() };
    let error = read_log(&log_of(&empty, &ARM)).map(|records| fit(&records, None, false).err().unwrap());
    let error = error.unwrap_or_else(|error| error).to_string();
    assert!(error.contains("velocity-main-arm"), "{error}");
}

#[test]
fn a_restarted_clock_is_named() {
    let mut log = Log::new();
    write(&mut log, &Routine::default(), &|test| rows(&ARM, test, 1), 5_000_000);
    // A second boot writes on from a clock of 0.1 s, with the entries declared again.
    write(&mut log, &Routine::default(), &|test| rows(&ARM, test, 3), 100_000);
    let records = read_log(&log.bytes).unwrap();
    let notes = &records[0].source().notes;
    assert!(notes.iter().any(|note| note.contains("the clock restarts after")), "{notes:?}");
    assert!(notes.iter().any(|note| note.contains("test dynamic-forward ran 2 times")), "{notes:?}");
    assert_eq!(records.len(), 8, "the tests of both boots");
    assert_eq!(codes(&fit(&records, None, false).unwrap()), [""; 0]);
    // A clock that restarts within a test is a gap.
    let mut log = Log::new();
    let (time, speed) = (log.start("/motor/voltage", "double", "V"), log.start("/motor/speed", "double", "rad/s"));
    for n in 0..100_u32 {
        let at = u64::from(if n < 50 { 5_000_000 + n * 20_000 } else { (n - 50) * 20_000 });
        log.double(time, at, 1.0 + f64::from(n % 3));
        log.double(speed, at, f64::from(n));
    }
    let error = read_bytes(&log.bytes, None, &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("gap") || error.to_string().contains("long"), "{error}");
    let split = ReadOptions { gaps: Gaps::Split, ..ReadOptions::default() };
    assert_eq!(read_bytes(&log.bytes, None, &split).unwrap().len(), 2);
}

#[test]
fn wrong_units_and_reversed_sensors_are_named() {
    let degrees = Routine { factors: [1.0, 180.0 / std::f64::consts::PI], ..Routine::default() };
    let found = fit(&read_log(&log_of(&degrees, &ARM)).unwrap(), None, false).unwrap();
    assert_eq!(codes(&found), ["units_disagree"]);
    assert_eq!(found.found.trust.level, TrustLevel::Poor);
    let message = found.found.warnings.iter().find(|warning| warning.code == "units_disagree").unwrap();
    assert!(message.message.to_string().contains("degrees per second"), "{}", message.message);

    let reversed = Routine { factors: [-1.0, -1.0], ..Routine::default() };
    let error = fit(&read_log(&log_of(&reversed, &ARM)).unwrap(), None, false).unwrap_err().to_string();
    assert!(error.contains("reversed"), "{error}");

    let half = Routine { factors: [-1.0, 1.0], ..Routine::default() };
    let found = fit(&read_log(&log_of(&half, &WHEEL)).unwrap(), None, false).unwrap();
    assert_eq!(codes(&found), ["units_disagree"]);

    // A unit that is no unit of an angle or a length.
    let wrong = Routine { units: ["Volt", "Volt"], ..Routine::default() };
    let error = read_log(&log_of(&wrong, &ARM)).unwrap_err().to_string();
    assert!(error.contains("velocity-main-arm") && error.contains("does not convert"), "{error}");
}

#[test]
fn a_mechanism_that_does_not_move_is_named() {
    let stuck = Mechanism { ks: 100.0, ..WHEEL };
    let error = fit(&read_log(&log_of(&Routine::default(), &stuck)).unwrap(), None, false).unwrap_err().to_string();
    assert!(error.contains("nothing moves"), "{error}");
    let mut log = Log::new();
    let one = |test: &str| rows(if test == TESTS[3] { &stuck } else { &WHEEL }, test, 1);
    write(&mut log, &Routine::default(), &one, 1_000_000);
    let found = fit(&read_log(&log.bytes).unwrap(), None, false).unwrap();
    assert_eq!(codes(&found), ["test_without_motion"]);
}

#[test]
fn truncated_and_doubled_logs_are_named() {
    let whole = log_of(&Routine::default(), &ARM);
    let records = read_log(&whole[..whole.len() * 9 / 10 - 3]).unwrap();
    let notes = &records[0].source().notes;
    assert!(notes.iter().any(|note| note.contains("cut off after")), "{notes:?}");

    let doubled = Routine { is_doubled: true, ..Routine::default() };
    let records = read_log(&log_of(&doubled, &ARM)).unwrap();
    let notes = &records[0].source().notes;
    assert!(notes.iter().any(|note| note.contains("repeat")), "{notes:?}");
    let single = read_log(&whole).unwrap();
    assert!(records[0].samples() == single[0].samples(), "the samples differ");
}

#[test]
fn several_motors_must_be_chosen_from() {
    let mut log = Log::new();
    let state = log.start("sysid-test-state-drive", "string", "");
    for side in ["left", "right"] {
        for (name, unit) in [("voltage", "Volt"), ("position", "Meter"), ("velocity", "Meter per Second")] {
            let entry = log.start(&format!("{name}-{side}-drive"), "double", unit);
            for n in 0..50_u32 {
                log.double(entry, u64::from(n) * 20_000, f64::from(n));
            }
        }
    }
    log.text(state, 0, TESTS[0]);
    let error = read_bytes(&log.bytes, None, &options(true)).unwrap_err();
    assert!(error.to_string().contains("2 motors: left and right"), "{error}");
    let left = ReadOptions { sheet: Some("drive:left".to_owned()), ..options(true) };
    assert_eq!(read_bytes(&log.bytes, None, &left).unwrap().len(), 1);
}

#[test]
fn closed_formats_name_their_converters() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    for (name, bytes, converter) in [
        ("match.hoot", &b"anything"[..], "owlet"),
        ("match.rlog", b"anything", "AdvantageScope"),
        ("bag.db3", b"SQLite format 3\0", "ros2 bag convert"),
        ("old.bag", b"#ROSBAG V2.0\n", "mcap convert"),
    ] {
        let path = folder.join(name);
        std::fs::write(&path, bytes).unwrap();
        let error = read(&path, &ReadOptions::default()).unwrap_err();
        assert!(error.hint().to_string().contains(converter), "{name}: {error} {}", error.hint());
    }
}

#[test]
fn the_command_prints_characteristics_gains_and_code() {
    let log = path("sysid_elevator.wpilog");
    let document = program::json(&["sysid", &log, "--json", "--controller", "rev-neo"]);
    assert_eq!((&document["mechanism"], &document["unit"]), (&"elevator".into(), &"m".into()));
    for (name, unit) in [("kS", "V"), ("kG", "V"), ("kV", "V*s/m"), ("kA", "V*s^2/m")] {
        let entry = &document["parameters"][name];
        assert_eq!(entry["unit"], unit);
        let [value, error] = ["value", "std_error"].map(|key| entry[key].as_f64().unwrap());
        assert!(value > 0.0 && error > 0.0 && entry["ci95"][0].as_f64().unwrap() < value, "{entry}");
    }
    let feedback = &document["feedback"];
    assert_eq!((feedback["period_s"].as_f64(), feedback["delay_s"].as_f64()), (Some(0.001), Some(0.112)));
    let [kp, error] = ["value", "std_error"].map(|key| feedback["velocity"]["kP"][key].as_f64().unwrap());
    assert!(kp > 0.0 && error > 0.0 && error < 0.1 * kp, "{feedback}");
    let text = program::ok(&["sysid", &log]);
    for part in ["kG", "elevator, selected", "new ElevatorFeedforward(", "trust     good", "velocity kP"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let arm = program::ok(&["sysid", &path("sysid_arm.wpilog"), "--mechanism", "arm", "-q"]);
    assert!(arm.contains("offset") && arm.contains("new ArmFeedforward("), "{arm}");
}

#[test]
fn the_command_writes_a_report() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("sysid-report");
    let _ = std::fs::remove_dir_all(&folder);
    program::ok(&["sysid", &path("sysid_simple.wpilog"), "--out", folder.to_str().unwrap(), "-q"]);
    let file = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    for part in ["Feedforward and feedback", "SimpleMotorFeedforward", "turn"] {
        assert!(file("report.html").contains(part), "{part}");
    }
    assert!(file("curves.csv").starts_with("test,time_s,voltage [V],velocity [turn/s],velocity model [turn/s]"));
    // Before a step there is a sample without voltage.
    assert_eq!(file("curves.csv").lines().count(), 1 + 2 * 150 + 2 * 61);
    let document: serde_json::Value = serde_json::from_str(&file("result.json")).unwrap();
    assert_eq!(document["mechanism"], "simple");
}

#[test]
fn the_command_refuses_what_it_cannot_use() {
    let log = path("sysid_simple.wpilog");
    for (args, code, part) in [
        (&["--period", "0"][..], 2, "--period is 0"),
        (&["--delay", "-1"], 2, "--delay is -1"),
        (&["--velocity-error", "0"], 2, "--velocity-error is 0"),
        (&["--max-voltage", "nan"], 2, "--max-voltage is NaN"),
        (&["--controller", "none"], 2, "none"),
        (&["--sheet", "turret"], 3, "no channel has \"turret\" in its name"),
    ] {
        let output = program::run(&[&["sysid", &log][..], args].concat());
        let error = program::text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {error}");
        assert!(error.contains(part) && (code == 2 || error.contains("help:")), "{args:?}: {error}");
    }
    let csv = program::run(&["sysid", program::EXAMPLE]);
    let error = program::text(&csv.stderr);
    assert_eq!(csv.status.code(), Some(4), "a step of one voltage: {error}");
    assert!(error.contains("10.5 V whenever the mechanism moves") && error.contains("quasistatic"), "{error}");
}

#[test]
fn inspect_lists_the_channels_of_a_log() {
    let text = program::ok(&["inspect", &path("recording.wpilog")]);
    for part in ["/motor/voltage", "rad/s", "500.0", "401"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let document = program::json(&["inspect", &path("recording.wpilog"), "--json"]);
    let channels = document["logs"][0]["channels"].as_array().unwrap();
    let speed = channels.iter().find(|channel| channel["name"] == "/motor/speed").unwrap();
    assert_eq!(
        (&speed["quantity"], &speed["unit"], &speed["samples"]),
        (&"speed".into(), &"rad/s".into(), &401.into())
    );
    assert!((speed["rate_hz"].as_f64().unwrap() - 500.0).abs() < 1e-6);
    // The channels are listed also if no recording can be made of them.
    let output = program::run(&["inspect", &path("sysid_elevator.wpilog")]);
    assert_eq!(output.status.code(), Some(3));
    assert!(program::text(&output.stdout).contains("velocity-main-elevator"));
    let output = program::run(&["inspect", &path("sysid_elevator.wpilog"), "--json"]);
    assert_eq!(output.status.code(), Some(3));
    let document: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(document["error"]["exit_code"], 3);
    let channels = document["logs"][0]["channels"].as_array().unwrap();
    assert!(channels.iter().any(|channel| channel["name"] == "velocity-main-elevator"), "{document}");
}
