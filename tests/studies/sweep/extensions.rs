//! Proves: runs with extensions, held-out recordings, parameters per recording or missing channels equal those of `identify`
//! bit for bit, except the fit after a refinement, which is equal to 1e-6 %; wrong models in a study are errors. Recovery of
//! extensions is tested in `tests/evaluate/extensions`.

use super::results::has_gpu;
use super::*;

/// Writes three recordings of a motor with Coulomb friction and a dead time.
fn recordings() -> Folder {
    let folder = Folder::new();
    for n in 1..=3 {
        recording(&folder, &format!("r{n}.csv"), "m2,Tc=0.02,td=0.004", n);
    }
    folder
}

/// Returns the exit code and the document of `identify` for a run.
pub(super) fn identified(folder: &Folder, line: &Value, files: &[&str], flags: &[&str]) -> (i32, Value) {
    let paths: Vec<String> = files.iter().map(|file| folder.path(file)).collect();
    let mut args: Vec<String> = vec!["identify".to_owned()];
    args.extend(paths);
    for key in ["method", "polish", "criterion", "scale", "population", "generations", "seed"] {
        let value = line[key].as_str().map_or_else(|| line[key].to_string(), str::to_owned);
        args.extend([format!("--{key}"), value]);
    }
    if let Some(with) = line["with"].as_str().filter(|with| *with != "none") {
        args.extend(["--with".to_owned(), with.to_owned()]);
    }
    args.extend(["--bounds", "auto", "--json"].iter().chain(flags).map(|flag| (*flag).to_owned()));
    let output = run(&args.iter().map(String::as_str).collect::<Vec<_>>());
    (output.status.code().unwrap(), serde_json::from_slice(&output.stdout).unwrap_or_default())
}

/// Returns the estimate by `identify` of a parameter of a line.
fn estimate<'a>(found: &'a Value, name: &str) -> &'a Value {
    let (symbol, index) = name.trim_end_matches(']').split_once('[').unwrap_or((name, ""));
    let all = &found["parameters"][symbol];
    if index.is_empty() { all } else { &all["recordings"][index.parse::<usize>().unwrap()] }
}

/// Returns the level of trust of a document in the format of a line, with the codes of its reasons.
pub(super) fn trust(found: &Value) -> Value {
    let codes: Vec<&Value> =
        found["trust"]["reasons"].as_array().unwrap().iter().map(|reason| &reason["code"]).collect();
    serde_json::json!({"level": found["trust"]["level"], "reasons": codes})
}

/// Asserts that every number of a line equals that of `identify`. Returns true if there is a result.
pub(super) fn same(line: &Value, (code, found): &(i32, Value)) -> bool {
    if line["stop"] == "failed" {
        assert!([2, 4].contains(code), "only the sweep fails: {line}");
        return false;
    }
    assert_eq!(*code, 0, "only identify fails: {line}");
    let parameters = line["parameters"].as_object().unwrap();
    let each = |of: &Value| of["recordings"].as_array().map_or(1, Vec::len);
    assert_eq!(parameters.len(), found["parameters"].as_object().unwrap().values().map(each).sum::<usize>(), "{line}");
    for (name, value) in parameters {
        let own = estimate(found, name);
        assert_eq!(value, &own["value"], "{name} of {line}");
        for key in ["std_error", "ci95"] {
            assert_eq!(if line[key].is_null() { &line[key] } else { &line[key][name] }, &own[key], "{name} of {line}");
        }
        assert_eq!(line["at_bound"][name], own["at_bound"], "{name} of {line}");
    }
    for key in ["cost", "evaluations", "stop"] {
        assert_eq!(line[key], found[key], "{key} of {line}");
    }
    for channel in ["current", "speed"] {
        // A sweep computes the fit from the sums of the refinement, `identify` by another simulation: equal up to rounding.
        let [fit, other] = [&line, &found].map(|of| of["fit_percent"][channel].as_f64());
        let tolerance = if line["polish"] == "none" { f64::MIN_POSITIVE } else { 1e-6 };
        assert!(fit.zip(other).is_none_or(|(a, b)| (a - b).abs() < tolerance), "{line}");
        assert_eq!(fit.is_some(), other.is_some(), "{line}");
        assert_eq!(line["validation"]["fit_percent"][channel], found["validation"]["fit_percent"][channel], "{line}");
    }
    assert_eq!(line["trust"], trust(found), "{line}");
    true
}

/// Study with every kind of run: methods with different code paths, with and without refinement, several models.
const MODELS: &str = r#"
methods = ["gwo", "sm", "auto"]
polish = ["lm", "none"]
with = ["none", "coulomb", "dead-time,coulomb", "auto"]
population = 16
generations = 12
seeds = [3]
criterion = ["nrmse", "iae"]
bounds = "auto"
device = "cpu"
"#;

#[test]
fn a_run_with_extensions_is_that_of_identify() {
    let folder = recordings();
    let study = format!("recordings = [\"r1.csv\"]\nvalidate = \"r2.csv\"\nsplit = 0.8\n{MODELS}");
    let (study, dir) = (folder.file("study.toml", study), folder.path("out"));
    let (code, _, err) = sweep(&[&study, "--out", &dir]);
    assert!([0, 4].contains(&code), "{err}");
    let held_out = folder.path("r2.csv");
    let flags = ["--validate", &held_out, "--split", "0.8", "--device", "cpu"];
    let all = results(&dir);
    let found = all.iter().filter(|line| same(line, &identified(&folder, line, &["r1.csv"], &flags))).count();
    // Without refinement extensions need a population search, so Steiglitz–McBride fails.
    assert!(all.len() == 48 && found >= 38, "{found} of {} runs have a result", all.len());
    let extended = all.iter().filter(|line| line["parameters"].get("td").is_some());
    assert!(extended.clone().count() > 10 && extended.clone().all(|line| !line["validation"].is_null()));
}

#[test]
fn a_joint_fit_with_parameters_of_each_recording_is_that_of_identify() {
    let folder = recordings();
    let motor = "recordings = [{motor = \"m\", files = [\"r1.csv\", \"r2.csv\"], validate = [\"r3.csv\"]}]";
    let study = format!("{motor}\nper_recording = [\"Tc\", \"K\"]\n{MODELS}");
    let (study, dir) = (folder.file("study.toml", study), folder.path("out"));
    let (code, _, err) = sweep(&[&study, "--out", &dir]);
    assert!([0, 4].contains(&code), "{err}");
    let held_out = folder.path("r3.csv");
    let all = results(&dir);
    let mut own = 0;
    for line in &all {
        // A model without friction has no friction per recording.
        let has_friction = line["with"].as_str().unwrap().contains("coulomb") || line["with"] == "auto";
        let parameters = if has_friction { "Tc,K" } else { "K" };
        let flags = ["--validate", &held_out, "--per-recording", parameters, "--device", "cpu"];
        same(line, &identified(&folder, line, &["r1.csv", "r2.csv"], &flags));
        own += usize::from(line["parameters"].get("Tc[1]").is_some());
    }
    assert!(own >= 8, "{own}");
}

#[test]
fn a_run_without_a_channel_is_that_of_identify() {
    let folder = recordings();
    for missing in ["current=-", "speed=-"] {
        let study = format!("recordings = [\"r1.csv\"]\ncolumns = \"{missing}\"\n{MODELS}")
            .replace("\"none\", \"coulomb\", ", "\"none\", ");
        let (study, dir) = (folder.file("study.toml", study), folder.path(missing));
        let (code, _, err) = sweep(&[&study, "--out", &dir]);
        assert!([0, 4].contains(&code), "{err}");
        let flags = ["--columns", missing, "--device", "cpu"];
        let all = results(&dir);
        let found = all.iter().filter(|line| same(line, &identified(&folder, line, &["r1.csv"], &flags))).count();
        assert!(found >= 12, "{missing}: {found} of {}", all.len());
        let untold = all.iter().filter(|line| line["parameters"].get("K").is_some_and(Value::is_null)).count();
        assert!(untold > 0, "{missing}: what is not identifiable is null");
    }
}

#[test]
fn a_gpu_runs_extensions_as_identify_does() {
    if !has_gpu() {
        return;
    }
    for precision in ["f64", "f32"] {
        let folder = recordings();
        let study = format!(
            "recordings = [\"r1.csv\", {{motor = \"two\", files = [\"r2.csv\", \"r3.csv\"]}}]\nmethods = [\"gwo\", \"ga\"]\n\
             polish = [\"lm\", \"none\"]\nwith = [\"none\", \"coulomb,dead-time\", \"auto\"]\npopulation = 12\n\
             generations = 8\nbounds = \"auto\"\ndevice = \"gpu\"\nprecision = \"{precision}\"\n"
        );
        let (study, dir) = (folder.file("study.toml", study), folder.path("out"));
        done(&[&study, "--out", &dir]);
        for line in results(&dir) {
            let files: &[&str] = if line["motor"] == "two" { &["r2.csv", "r3.csv"] } else { &["r1.csv"] };
            assert_eq!((&line["device"], &line["precision"]), (&"gpu".into(), &precision.into()));
            let flags = ["--device", "gpu", "--precision", precision];
            assert!(same(&line, &identified(&folder, &line, files, &flags)), "{line}");
        }
    }
}

#[test]
fn bounds_and_fixed_values_of_extensions_are_those_of_the_flags() {
    let folder = recordings();
    let common = "recordings = [\"r1.csv\"]\nmethods = [\"jaya\"]\npolish = [\"lm\"]\npopulation = 12\ngenerations = 8\n\
                  bounds = {td = [0.0, 0.01], R = [0.5, 1.5], Tc = [0.0, 0.05]}\nfix = {v0 = 0.1}\ndevice = \"cpu\"\n";
    let flags = ["--bounds", "td=0:0.01,R=0.5:1.5,Tc=0:0.05", "--fix", "v0=0.1", "--device", "cpu"];
    // Without the factor they define the extensions of the model.
    let (study, dir) = (folder.file("plain.toml", common), folder.path("plain"));
    done(&[&study, "--out", &dir]);
    let line = &results(&dir)[0];
    assert!(line.get("with").is_none() && line["parameters"]["v0"] == 0.1, "{line}");
    assert!(same(line, &identified(&folder, line, &["r1.csv"], &flags)));
    // With the factor each model uses those of its extensions.
    let levels = format!("with = [\"none\", \"dead-time\", \"offset,coulomb,dead-time\"]\n{common}");
    let (study, dir) = (folder.file("levels.toml", levels), folder.path("levels"));
    done(&[&study, "--out", &dir]);
    let all = results(&dir);
    let names = |line: &Value| line["parameters"].as_object().unwrap().keys().skip(5).cloned().collect::<Vec<_>>();
    assert_eq!([names(&all[0]), names(&all[1]), names(&all[2])].map(|names| names.join(" ")), ["", "td", "Tc td v0"]);
    let own = ["--bounds", "td=0:0.01,R=0.5:1.5", "--device", "cpu"];
    assert!(same(&all[1], &identified(&folder, &all[1], &["r1.csv"], &own)));
    assert!(same(&all[2], &identified(&folder, &all[2], &["r1.csv"], &flags)));
}

#[test]
fn shards_change_no_byte_of_extended_runs_and_the_merge_shows_them() {
    let folder = recordings();
    let study = format!("recordings = [\"r*.csv\"]\nsplit = 0.7\nnoise = [\"none\", \"50dB\"]\n{MODELS}")
        .replace(", \"iae\"", "");
    let study = folder.file("study.toml", study);
    let (one, three) = (folder.path("one"), folder.path("three"));
    sweep(&[&study, "--out", &one, "--threads", "1"]);
    done(&["plan", &study, "--out", &three]);
    for shard in ["2/3", "3/3", "1/3"] {
        sweep(&["run", &three, "--shard", shard, "--threads", "2"]);
    }
    let (parquet, report) = (folder.path("all.parquet"), folder.path("report"));
    let (_, out, err) =
        sweep(&["merge", &three, "--json", "--parquet", &parquet, "--out", &report, "--limits", "Tc=0:0.001,td=0:1"]);
    assert!(bytes(&one) == bytes(&three), "{err}");
    let document: Value = serde_json::from_str(&out).unwrap();
    let cells = document["blocks"][0]["cells"].as_array().unwrap();
    let names: Vec<&str> = cells.iter().map(|cell| cell["with"].as_str().unwrap()).collect();
    assert!(names.contains(&"dead-time,coulomb") && document["varied"].as_array().unwrap().contains(&"with".into()));
    assert!(document["motors"]["parameters"]["td"]["median"].as_f64().is_some_and(|td| td > 0.003), "{document}");
    assert!(document["outside"].as_array().unwrap().iter().all(|of| of["parameter"] == "Tc"));
    let page = std::fs::read_to_string(format!("{report}/report.html")).unwrap();
    assert!(page.contains("td [ms]") && page.contains("Dead time"));
    let parquet = std::fs::read(parquet).unwrap();
    for column in ["std_error_td", "ci95_low_Tc", "validation_fit_speed", "with"] {
        assert!(parquet.windows(column.len()).any(|name| name == column.as_bytes()), "{column}");
    }
}

#[test]
fn wrong_models_are_reported_with_their_line() {
    let folder = recordings();
    let good = "recordings = [\"r1.csv\"]\nmethods = [\"gwo\"]\n";
    for (line, expected) in [
        ("with = [\"coulom\"]", "line 3|\"coulom\" is not an extension; did you mean coulomb?"),
        ("with = [[\"coulomb\", \"load\"]]", "with: found a value of type array, expected \"coulomb,dead-time\""),
        ("with = [\"auto,load\"]", "auto"),
        ("with = [\"load\", \"load\"]", "with has a value twice"),
        ("with = []", "with is empty"),
        ("with = [\"load\"]\nbounds = {Tc = [0.0, 1.0]}", "line 4: bounds: Tc is in no model of the study"),
        ("with = [\"load\"]\nfix = {vd = 0.5}", "line 4: fix: vd is in no model of the study"),
        ("per_recording = [\"TL\"]", "line 3: per_recording: TL is in no model of the study"),
        ("per_recording = [\"Q\"]", "line 3: per_recording: \"Q\" is not a parameter"),
        ("bounds = {t0 = [-1.0, 1.0]}", "line 3: the bounds of t0, -1:1, are not zero or positive"),
        ("split = 1.5", "line 3: split is 1.5"),
        ("split = \"half\"", "split: found \"half\""),
        ("validate = [\"no.csv\"]", "\"no.csv\" does not exist"),
    ] {
        let path = folder.file("wrong.toml", format!("{good}{line}\n"));
        let (code, _, err) = sweep(&["plan", &path, "--out", &folder.path("wrong")]);
        assert!([2, 3].contains(&code), "{line}: {err}");
        assert!(expected.split('|').all(|part| err.contains(part)) && err.contains("help: "), "{line}: {err}");
    }
}
