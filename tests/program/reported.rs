//! Proves: recordings that users reported as wrong give the right value within its errors, or a level below good with a reason that names
//! the fault and a next command that mends it.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]

use crate::support::program::{Folder, json, motorfit, run, simulated as simulated_to, text};
use crate::support::rates::full;
use crate::support::recordings::set;
use rayon::prelude::*;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Returns the path of a file of a case.
fn case(folder: &str, file: &str) -> Option<String> {
    Some(set("cases-2026-11-28")?.join(folder).join(file).to_str().unwrap().to_owned())
}

fn level(document: &Value) -> &str {
    document["trust"]["level"].as_str().unwrap()
}

fn reasons(document: &Value) -> Vec<&str> {
    document["trust"]["reasons"].as_array().unwrap().iter().map(|reason| reason["code"].as_str().unwrap()).collect()
}

/// Returns the words of a command as a shell divides it.
fn words(command: &str) -> Vec<String> {
    let output = Command::new("sh").args(["-c", &format!("printf '%s\\n' {command}")]).output().unwrap();
    text(&output.stdout).lines().map(str::to_owned).collect()
}

/// Runs the command of the next step, with `--json` if it has none.
fn followed(document: &Value) -> Value {
    let next = document["trust"]["next"].as_str().unwrap();
    let output = motorfit()
        .args(&words(next)[1..])
        .args(["--json"].iter().filter(|_| !next.contains("--json")))
        .output()
        .unwrap();
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{next}: {}", text(&output.stderr)))
}

/// Returns true if the 99.7 % interval of a parameter contains a value.
fn is_right(entry: &Value, truth: f64) -> bool {
    let [value, error] = ["value", "std_error"].map(|key| entry[key].as_f64().unwrap());
    (value - truth).abs() < 3.0 * error
}

#[test]
fn a_level_of_trust_names_the_parameters_to_which_it_applies() {
    let Some(file) = case("trust-good-nothing", "vw.csv") else { return };
    let of = ["kV", "kA", "time_constant"];
    let motor = json(&["identify", &file, "--json", "--strict"]);
    let model = json(&["identify", &file, "--json", "--strict", "--model", "dc-motor"]);
    for document in [&motor, &model] {
        assert_eq!((level(document), &document["trust"]["of"]), ("good", &serde_json::json!(of)));
        assert_eq!(document["trust"]["open"], serde_json::json!(["R", "L", "K", "B", "J"]));
    }
    // The motor and its model estimate the same, by other coordinates.
    for (n, name) in of.iter().enumerate() {
        let own = &motor["characteristics"]["output_error"][name];
        let [a, b] = [own, &model["combinations"][n]].map(|entry| entry["value"].as_f64().unwrap());
        assert!((a - b).abs() < 0.02 * own["std_error"].as_f64().unwrap(), "{name}: {a} and {b}");
    }
    let printed = text(&run(&["identify", &file]).stdout);
    let places = ["good for kV, kA and the time constant; R, L, K, B and J need a current", "kV  ", "R, L, K, B, J "]
        .map(|part| printed.find(part).unwrap_or_else(|| panic!("{part}: {printed}")));
    assert!(places.is_sorted(), "{printed}");
    // One of the others is fixed, which asks for the rest.
    let asked = run(&["identify", &file, "--fix", "R=0.9", "--strict"]);
    assert!(!asked.status.success() && text(&asked.stdout).contains("trust     check"), "{}", text(&asked.stdout));
    let asked = run(&["identify", &file, "--fix", "R=0.9", "--strict", "--model", "dc-motor"]);
    assert!(!asked.status.success() && text(&asked.stdout).contains("trust     check"), "{}", text(&asked.stdout));
}

#[test]
fn an_assumed_unit_is_never_good_and_the_next_command_names_it() {
    let Some(file) = case("unit_assumed_yet_good", "units_unnamed.csv") else { return };
    let found = json(&["identify", &file, "--json", "--with", "auto"]);
    assert_eq!((level(&found), reasons(&found)), ("check", vec!["units_assumed"]));
    let named = followed(&found);
    assert_eq!((level(&named), reasons(&named)), ("good", vec![]));
    let parameters = &named["parameters"];
    for (name, truth) in [("R", 4.0), ("K", 0.35), ("B", 2e-3), ("J", 2e-3), ("Tc", 0.05)] {
        assert!(is_right(&parameters[name], truth), "{name}: {}", parameters[name]);
    }
    // The text of a model names the units of its columns, a built-in model does not.
    let model = json(&["identify", &file, "--json", "--model", "dc-motor"]);
    assert!(reasons(&model).contains(&"units_assumed"), "{}", model["trust"]);
}

/// Rows of a motor under steps, voltage \[V\] and speed \[rad/s\], simulated by the program.
fn steps(folder: &Folder) -> Vec<[f64; 3]> {
    let path = folder.path("steps.csv");
    let arguments = [
        "simulate",
        "--parameters",
        "m2",
        "--input",
        "step:8@0.2",
        "--duration",
        "2",
        "--noise",
        "40dB",
        "--out",
        &path,
    ];
    assert!(run(&arguments).status.success(), "{}", text(&run(&arguments).stderr));
    let rows = std::fs::read_to_string(&path).unwrap();
    let numbers = |row: &str| row.split(',').map(|cell| cell.parse::<f64>().unwrap()).collect::<Vec<f64>>();
    rows.lines().skip(1).map(numbers).map(|row| [row[0], row[1], row[3]]).collect()
}

#[test]
fn a_hint_never_scales_a_column_whose_unit_is_known() {
    let folder = Folder::new();
    let rows = steps(&folder);
    let write = |name: &str, head: &str, scale: f64| {
        let row = |[t, v, w]: &[f64; 3]| format!("{t},{},{w}", v * scale);
        folder.file(name, format!("{head}\n{}\n", rows.iter().map(row).collect::<Vec<_>>().join("\n")))
    };
    let one = |heading: &str, scale: f64| write("log.csv", &format!("time_s,{heading},speed_rad_s"), scale);
    let kv = |document: &Value| document["characteristics"]["output_error"]["kV"]["value"].as_f64().unwrap();
    let check = |file: &str, what: &str| {
        let read = run(&["identify", file, "--json"]);
        let document: Value = serde_json::from_slice(&read.stdout).unwrap();
        let document = match document["error"]["hint"].as_str() {
            None => document,
            Some(hint) => {
                assert!(!hint.contains("*12") && !hint.contains("0..12"), "{what}: {hint}");
                let request = hint.split("--columns ").nth(1).unwrap().split(['.', ';']).next().unwrap();
                let request = &words(request)[0];
                json(&["identify", file, "--json", "--columns", request])
            }
        };
        assert!((kv(&document) / 0.08196 - 1.0).abs() < 0.01, "{what}: kV {}", kv(&document));
    };
    for heading in
        ["u_a [V]", "Vm (V)", "CH1 (V)", "applied (V)", "Armature (V)", "input_V", "bus_V", "Ankerspannung (V)"]
    {
        check(&one(heading, 1.0), heading);
    }
    check(&one("drive (mV)", 1e3), "drive (mV)");
    check(&write("units.csv", "t,u_a,w\ns,V,rad/s", 1.0), "a row of units");
    // A duty cycle has no unit of voltage.
    let duty = run(&["inspect", &one("duty", 255.0 / 12.0)]);
    assert!(text(&duty.stderr).contains("*12/255"), "{}", text(&duty.stderr));
}

#[test]
fn the_example_of_a_log_gives_the_motor_that_it_was_simulated_with() {
    let columns = "time=ms:ms,voltage=pwm*12/255:V,speed=rpm:rpm,current=mA:mA";
    let found = json(&["identify", "examples/pwm-log.csv", "--json", "--columns", columns, "--with", "auto"]);
    assert_eq!((level(&found), &found["with"]), ("good", &serde_json::json!(["coulomb"])));
    // The constants of `tests/golden/pwm_log.py`.
    let truth =
        [("R", 0.921_042), ("L", 0.007_759), ("K", 0.073_472), ("B", 0.000_678), ("J", 0.000_136), ("Tc", 0.02)];
    for (name, truth) in truth {
        assert!(is_right(&found["parameters"][name], truth), "{name}: {}", found["parameters"][name]);
    }
}

#[test]
fn limits_count_what_was_not_tested() {
    let Some(line) = set("cases-2026-11-28").map(|folder| folder.join("limit-ignored/line")) else { return };
    let folder = Folder::new();
    let sweep = |name: &str, keys: &str| {
        let study = format!("recordings = [\"{}/*.csv\"]\nmethods = [\"auto\"]\n{keys}\n", line.display());
        let path = folder.file(&format!("{name}.toml"), study);
        run(&["sweep", &path, "--out", &folder.path(name), "--strict-limits"])
    };
    // No model of the study has friction.
    let refused = sweep("refused", "limits = {Tc = [0.0, 0.005]}");
    let message = text(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{message}");
    assert!(message.contains("line 3") && message.contains("Tc") && message.contains("coulomb"), "{message}");
    let outside = sweep("outside", "with = [\"coulomb\"]\nlimits = {Tc = [0.0, 0.005]}");
    assert_eq!(outside.status.code(), Some(6));
    assert!(text(&outside.stdout).contains("4 are outside the limits"), "{}", text(&outside.stdout));
    // Without a current the resistance is not tested, and characteristics are.
    let without = "columns = \"current=-\"\nlimits = {R = [0.5, 0.6], kV = [0.05, 0.1], time_constant = [0.01, 0.03]}";
    let open = sweep("open", without);
    assert_eq!(open.status.code(), Some(6), "{}", text(&open.stderr));
    let printed = text(&open.stdout);
    assert!(printed.contains("not tested: R in 4 motors") && !printed.contains("all of them are within"), "{printed}");
    let merged = json(&["sweep", "merge", &folder.path("open"), "--json"]);
    let of = |name: &str, key: &str| merged["motors"]["parameters"][name][key].clone();
    assert_eq!([of("R", "not_tested"), of("kV", "not_tested"), of("kV", "outside")], [4, 0, 0].map(Value::from));
    let inside = sweep("inside", "with = [\"coulomb\"]\nlimits = {kS = [0.0, 0.3], gain = [10.0, 14.0]}");
    assert_eq!(inside.status.code(), Some(0), "{}", text(&inside.stdout));
    assert!(text(&inside.stdout).contains("all of them are within the limits"), "{}", text(&inside.stdout));
}

#[test]
fn a_held_out_recording_judges_too() {
    let folder = Folder::new();
    let simulated = |name: &str, parameters: &str, seed: &str| {
        let path = folder.path(name);
        simulated_to(&path, parameters, "step:6@0.5", ["2", seed]);
        path
    };
    let [own, same, other] = [("own.csv", "m2", "1"), ("same.csv", "m2", "2"), ("other.csv", "m2,K=0.05", "3")]
        .map(|(name, parameters, seed)| simulated(name, parameters, seed));
    for more in [&[][..], &["--model", "dc-motor"]] {
        let found = |held_out: &str| json(&[&["identify", &own, "--json", "--validate", held_out], more].concat());
        assert_eq!((level(&found(&same)), reasons(&found(&same))), ("good", vec![]), "{more:?}");
        let wrong = found(&other);
        assert_eq!((level(&wrong), reasons(&wrong)), ("poor", vec!["validation"]), "{more:?}: {}", wrong["trust"]);
        assert!(!wrong["trust"]["next"].is_null());
    }
    // A sweep judges as the identification of each recording alone.
    let keys = format!("recordings = [\"{own}\"]\nvalidate = [\"{other}\"]\nmethods = [\"auto\"]\n");
    let study = folder.file("study.toml", keys);
    assert!(run(&["sweep", &study, "--out", &folder.path("sweep")]).status.success());
    let lines = std::fs::read_to_string(folder.path("sweep/results.jsonl")).unwrap();
    assert!(lines.contains(r#""trust":{"level":"poor","reasons":["validation"]}"#), "{lines}");
}

#[test]
fn a_speed_is_compared_with_the_position_beside_it() {
    let Some(file) = case("speed_contradicts_position", "speed_2pi.csv") else { return };
    let found = json(&["identify", &file, "--json", "--with", "auto"]);
    assert_eq!((level(&found), reasons(&found)), ("poor", vec!["units_disagree"]));
    let mended = followed(&found);
    assert_eq!((level(&mended), reasons(&mended)), ("good", vec![]));
    for (name, truth) in [("R", 1.2), ("L", 8e-4), ("K", 0.025), ("B", 1.5e-5), ("J", 8e-6), ("Tc", 0.003)] {
        assert!(is_right(&mended["parameters"][name], truth), "{name}: {}", mended["parameters"][name]);
    }
    // Behind a gear the position is not that of the motor: the level is good once this is stated.
    let folder = Folder::new();
    let mut angle = 0.0;
    let row = |[t, v, w]: &[f64; 3]| {
        angle += w * 1e-3 / 7.3;
        format!("{t},{v},{w},{angle}\n")
    };
    let rows: String = steps(&folder).iter().map(row).collect();
    let geared = folder.file("geared.csv", format!("time_s,voltage_V,speed_rad_s,position_rad\n{rows}"));
    let found = json(&["identify", &geared, "--json"]);
    assert_eq!((level(&found), reasons(&found)), ("check", vec!["position_ratio"]), "{}", found["trust"]);
    let stated = followed(&found);
    assert_eq!((level(&stated), &stated["trust"]["of"][0]), ("good", &"kV".into()), "{}", stated["trust"]);
    // A position that is named takes the place of a speed that is not.
    let Some(file) = case("position_beside_speed", "position_and_omega.csv") else { return };
    let columns = "time=t:s,voltage=u:V,position=theta:turns";
    let found = json(&["identify", &file, "--json", "--columns", columns, "--with", "auto"]);
    let kv = found["characteristics"]["output_error"]["kV"]["value"].as_f64().unwrap();
    assert!((kv / 0.02572 - 1.0).abs() < 0.01, "{kv}");
}

#[test]
fn the_selection_fits_no_worse_than_a_model_that_is_named() {
    let Some(file) = case("auto_misses_coulomb", "operating_point.csv") else { return };
    let found = json(&["identify", &file, "--json", "--with", "auto"]);
    let fit = |document: &Value| document["fit_percent"]["speed"].as_f64().unwrap();
    for extension in ["coulomb", "load", "dead-time", "deadband", "offset", "sensor-average"] {
        let named = json(&["identify", &file, "--json", "--with", extension]);
        assert!(fit(&found) > fit(&named) - 0.5, "{extension}: {} after {}", fit(&found), fit(&named));
    }
    // One step between two speeds does not tell friction from a load.
    let of = &found["characteristics"]["output_error"];
    for (name, truth) in [("kV", 0.0474), ("kA", 0.0133)] {
        assert!(is_right(&of[name], truth), "{name}: {}", of[name]);
    }
    assert_eq!(level(&found), "check");
    // An optimum that the search itself finds is taken.
    let Some(file) = case("search_stuck_own_optimum", "nathan_1.csv") else { return };
    let columns = "time=t:s,voltage=PWM*12/255:V,speed=SPEED:rpm";
    let found = json(&["identify", &file, "--json", "--with", "auto", "--columns", columns]);
    assert!(!reasons(&found).contains(&"search_stuck"), "{}", found["trust"]);
}

/// The end of a walk along the next steps.
#[derive(Debug, PartialEq)]
enum End {
    Good,
    Advice,
    Refusal,
}

/// Follows the next steps from the command without options to their end.
fn walked(file: &str) -> End {
    let mut seen: Vec<Vec<String>> = Vec::new();
    let mut command = vec!["identify".to_owned(), file.to_owned(), "--json".to_owned()];
    loop {
        assert!(!seen.contains(&command), "a circle: {command:?}");
        assert!(seen.len() <= 3, "more than three commands: {command:?}");
        seen.push(command.clone());
        let output = run(&command.iter().map(String::as_str).collect::<Vec<_>>());
        let document: Value = serde_json::from_slice(&output.stdout).unwrap();
        if !document["error"].is_null() {
            return End::Refusal;
        }
        if level(&document) == "good" {
            return End::Good;
        }
        let next = document["trust"]["next"].as_str().unwrap_or_else(|| panic!("no next step: {command:?}"));
        if !next.starts_with("motorfit ") {
            return End::Advice;
        }
        assert!(next.starts_with("motorfit identify"), "{next}");
        command = words(next)[1..].to_vec();
    }
}

/// Largest file that is walked from without `MOTORFIT_FULL` \[bytes\].
const BYTES: u64 = 60_000;

#[test]
fn a_next_step_leads_on() {
    let Some(cases) = set("cases-2026-11-28") else { return };
    let paths = |folder: &Path| -> Vec<PathBuf> {
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
    };
    let folders: Vec<PathBuf> = paths(&cases).into_iter().chain([cases.join("../newcomer-logs")]).collect();
    let files = folders.iter().filter(|path| path.is_dir()).flat_map(|folder| paths(folder));
    let is_small = |path: &PathBuf| full() || path.metadata().unwrap().len() < BYTES;
    let files: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|of| of == "csv") && is_small(path)).collect();
    let ends: Vec<End> = files.par_iter().map(|path| walked(path.to_str().unwrap())).collect();
    let count = |end: End| ends.iter().filter(|own| **own == end).count();
    let [good, advised, refused] = [End::Good, End::Advice, End::Refusal].map(count);
    println!("{good} good, {advised} with advice, {refused} refused");
    assert!(good >= 3 && advised >= 10, "{good} {advised} {refused}");
}
