//! Proves: runs with users' models are those of `identify --model`, beside those of the DC motor; models are pinned with the study,
//! and wrong ones are reported with their line.

use super::{bytes, done, results, sweep, with_study};
use crate::support::program::{Folder, run, text};
use serde_json::Value;

/// A first-order lag with the gain and the time constant of the speed.
const LAG: &str = r#"
format = 1
name = "Lag"
[inputs]
u = { unit = "V", column = "voltage" }
[parameters]
gain = { unit = "rad/s/V", min = 1, max = 100, log = true, description = "Gain of the speed" }
T = { unit = "ms", min = 1, max = 1000, log = true, description = "Time constant" }
[states]
w = { unit = "rad/s", d = "(gain*u - w)/T", initial = 0 }
[outputs]
w = { value = "w", unit = "rad/s", column = "speed" }
"#;

/// Returns what `identify` finds with a model.
fn identified(folder: &Folder, model: &str, flags: &[&str]) -> Value {
    let recording = folder.path("a.csv");
    let model = if model.ends_with(".toml") { folder.path(model) } else { model.to_owned() };
    let args = [&["identify", &recording, "--model", &model, "--json"], flags].concat();
    let output = run(&args);
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_str(&text(&output.stdout)).unwrap()
}

/// Checks that a line has the estimates and the level of trust of a result.
fn is_that_of_identify(line: &Value, found: &Value) {
    for (name, value) in line["parameters"].as_object().unwrap() {
        let own = &found["parameters"][name];
        assert_eq!((value, &line["std_error"][name]), (&own["value"], &own["std_error"]), "{name}: {line}");
    }
    assert_eq!(line["parameters"].as_object().unwrap().len(), found["parameters"].as_object().unwrap().len());
    assert_eq!((&line["cost"], &line["fit_percent"]), (&found["cost"], &found["fit_percent"]));
    assert_eq!(line["trust"]["level"], found["trust"]["level"]);
}

#[test]
fn a_run_with_a_model_is_that_of_identify() {
    let study = "recordings = [\"a.csv\"]\nmethods = [\"auto\", \"gwo\"]\npolish = [\"lm\", \"none\"]\npopulation = 20\n\
                 generations = 15\nmodel = [\"none\", \"lag.toml\", \"dc-motor\"]\nseeds = \"1..2\"\nbounds = {T = [1, 500]}\n";
    let (folder, study) = with_study(study);
    folder.file("lag.toml", LAG);
    let dir = folder.path("s");
    let shown = done(&[&study, "--out", &dir]);
    assert!(shown.contains("lag.toml") && shown.contains("dc-motor"), "{shown}");
    let lines = results(&dir);
    assert_eq!(lines.len(), 2 * 2 * 3 * 2);
    for line in &lines {
        let [model, method, polish] = ["model", "method", "polish"].map(|key| line[key].as_str().unwrap());
        let seed = line["seed"].to_string();
        assert!(line["error"].is_null(), "{line}");
        if model == "none" {
            assert!(line["parameters"]["J"].is_f64() && line["fit_percent"]["current"].is_f64(), "{line}");
            continue;
        }
        let mut flags = vec!["--method", method, "--polish", polish, "--seed", &seed];
        flags.extend(["--population", "20", "--generations", "15"]);
        flags.extend(if model == "lag.toml" { &["--bounds", "T=1:500"][..] } else { &[] });
        is_that_of_identify(line, &identified(&folder, model, &flags));
    }
    let of = |line: &&Value| line["model"] == "lag.toml" && line["polish"] == "lm" && line["method"] == "auto";
    let lag = lines.iter().find(of).unwrap();
    // The gain of the motor is K/(R B + K²); the lag of current and speed leaves residuals, so that a model alone is not trusted.
    let names: Vec<&String> = lag["parameters"].as_object().unwrap().keys().collect();
    assert_eq!(names, ["gain", "T"]);
    assert!(lag["fit_percent"]["w"].as_f64().unwrap() > 80.0 && lag["fit_percent"]["current"].is_null(), "{lag}");
}

#[test]
fn shards_change_no_byte_and_need_no_files_of_models() {
    let study = "recordings = [\"a.csv\"]\nmethods = [\"auto\"]\nmodel = \"lag.toml\"\nseeds = \"1..4\"\nnoise = [\"none\", \"30dB\"]\n\
                 limits = {gain = [1, 2]}\nsplit = 0.7\n";
    let (folder, study) = with_study(study);
    let model = folder.file("lag.toml", LAG);
    let [one, two] = ["one", "two"].map(|name| folder.path(name));
    done(&[&study, "--out", &one, "--threads", "1"]);
    done(&["plan", &study, "--out", &two]);
    std::fs::remove_file(&model).unwrap();
    for shard in ["1/3", "2/3", "3/3"] {
        done(&["run", &two, "--shard", shard]);
    }
    let parquet = folder.path("r.parquet");
    let merged = done(&["merge", &two, "--json", "--parquet", &parquet]);
    assert_eq!(bytes(&one), bytes(&two));
    let merged: Value = serde_json::from_str(&merged).unwrap();
    assert_eq!(merged["motors"]["parameters"]["gain"]["unit"], "rad/s/V");
    assert_eq!(merged["outside"][0]["parameter"], "gain", "{merged}");
    assert_eq!(merged["blocks"][0]["cells"][0]["model"], "lag.toml");
    let lines = results(&one);
    let value = |line: &Value| line["parameters"]["gain"].as_f64().unwrap();
    let of = |noise: &str| lines.iter().filter(|l| l["noise"] == noise).map(value).collect::<Vec<_>>();
    let (clean, noisy) = (of("none"), of("30dB"));
    // Descents end where a step changes the estimates by far less than a standard error.
    let error = lines[0]["std_error"]["gain"].as_f64().unwrap();
    assert!(clean.windows(2).all(|pair| (pair[0] - pair[1]).abs() < 1e-3 * error), "one optimum: {clean:?}");
    assert!(noisy.windows(2).all(|pair| pair[0] != pair[1]), "each seed has its own noise: {noisy:?}");
    // The held-out part has the fit that identify finds; the model starts it at 0, the motor does not.
    folder.file("lag.toml", LAG);
    let first = lines.iter().find(|line| line["noise"] == "none" && line["seed"] == 1).unwrap();
    let found = identified(&folder, "lag.toml", &["--split", "0.7", "--seed", "1"]);
    assert_eq!(first["validation"]["fit_percent"], found["validation"]["fit_percent"]);
    let csv = done(&["merge", &one, "--csv", "-"]);
    assert!(csv.starts_with("motor,gain,gain_std_error,") && csv.contains(",outside,fit_w_percent,cost"), "{csv}");
    let (code, _, err) = sweep(&["merge", &one, "--limits", "gian=1:2"]);
    assert!(code == 2 && err.contains("gian") && err.contains("Did you mean gain?"), "{code}: {err}");
}

#[test]
fn a_changed_model_is_another_sweep() {
    let (folder, study) = with_study("recordings = [\"a.csv\"]\nmethods = [\"auto\"]\nmodel = \"lag.toml\"\n");
    folder.file("lag.toml", LAG);
    let dir = folder.path("s");
    done(&[&study, "--out", &dir]);
    folder.file("lag.toml", LAG.replace("max = 100,", "max = 200,"));
    let (code, _, err) = sweep(&[&study, "--out", &dir]);
    assert!(code == 3 && err.contains("the model lag.toml has changed"), "{code}: {err}");
}

#[test]
fn wrong_models_of_a_study_are_reported_with_their_line() {
    let cases = [
        ("model = \"pmsn\"", "Did you mean the built-in model \"pmsm\"?"),
        ("model = \"bad.toml\"", "bad.toml"),
        ("model = \"pmsm\"\nwith = \"coulomb\"", "line 4"),
        ("model = \"pmsm\"\nbounds = {Rx = [1, 2]}", "unknown key \"Rx\""),
        ("model = \"pmsm\"\nbounds = {R = [2, 1]}", "R"),
        ("model = [\"pmsm\", \"pmsm\"]", "twice"),
        ("model = \"pmsm\"\ndevice = \"gpu\"", "evaluated on the CPU"),
        ("model = \"lag.toml\"\nlimits = {R = [1, 2]}", "unknown key \"R\""),
        ("model = [\"lag.toml\", \"other.toml\"]", "gain is in rad/s/V in one model and in rpm/V in another"),
    ];
    for (keys, expected) in cases {
        let (folder, study) = with_study(&format!("recordings = [\"a.csv\"]\nmethods = [\"auto\"]\n{keys}\n"));
        folder.file("lag.toml", LAG);
        folder.file("other.toml", LAG.replace("unit = \"rad/s/V\"", "unit = \"rpm/V\""));
        folder.file("bad.toml", LAG.replace("(gain*u - w)/T", "(gain*v - w)/T"));
        let (code, _, err) = sweep(&[&study, "--out", &folder.path("s")]);
        assert!((code == 2 || code == 3) && err.contains(expected), "{keys}: {code}: {err}");
    }
    let (folder, study) = with_study("recordings = [\"a.csv\"]\nmethods = [\"auto\", \"sm\"]\nmodel = \"pmsm\"\n");
    let (code, _, err) = sweep(&[&study, "--out", &folder.path("s")]);
    assert!(code == 2 && err.contains("Steiglitz–McBride"), "{code}: {err}");
}
