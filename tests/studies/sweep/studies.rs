//! Proves: errors of a study are reported with their line and a remedy, and nothing is written.

use super::*;

const GOOD: &str = "name = \"night\"\nrecordings = [\"a.csv\"]\nmethods = [\"sm\"]\n";

/// Asserts that a study is rejected with its file, a remedy and all parts of a message, and leaves no files.
fn refused(folder: &Folder, study: &str, expected: &str, code: i32) {
    let path = folder.file("wrong.toml", study);
    let (found, out, err) = sweep(&["plan", &path, "--out", &folder.path("wrong")]);
    assert_eq!((found, out.as_str()), (code, ""), "{study}: {err}");
    assert!(err.contains("wrong.toml") && err.contains("help: "), "{study}: {err}");
    for part in expected.split('|') {
        assert!(err.contains(part), "{study}: {err} lacks {part}");
    }
    assert!(!std::path::Path::new(&folder.path("wrong")).exists(), "{study}: nothing is left");
}

#[test]
fn wrong_studies() {
    let (folder, _) = with_study(GOOD);
    let cases: [(&str, &str, i32); 40] = [
        ("seedz = \"1..5\"", "line 4: unknown key \"seedz\"|Did you mean \"seeds\"?", 2),
        ("Population = [10]", "unknown key \"Population\"|Did you mean \"population\"?", 2),
        ("xyzzy = 1", "unknown key \"xyzzy\"|A study has name, recordings", 2),
        ("[noise_level]\na = 1", "line 4: unknown key \"noise_level\"", 2),
        ("seeds = \"5..1\"", "line 4: seeds: \"5..1\" is not a range|both included", 2),
        ("seeds = []", "seeds is empty", 2),
        ("seeds = [1, 1]", "seeds has a value twice", 2),
        ("seeds = [-1]", "seeds: found -1, expected a whole number", 2),
        ("seeds = 1.5", "seeds: found 1.5", 2),
        ("population = [0]", "population is 0", 2),
        ("population = \"many\"", "population: found \"many\"", 2),
        ("polish = [\"ml\"]", "polish: \"ml\" is unknown|Did you mean \"lm\"?", 2),
        ("criterion = [\"nmse\"]", "criterion: \"nmse\" is unknown|Did you mean", 2),
        ("scale = [\"standard\"]", "scale: \"standard\" is unknown|none, peak, std or noise", 2),
        ("noise = [\"loud\"]", "line 4: noise", 2),
        ("noise = [40]", "noise: found 40, expected \"40dB\"", 2),
        ("bounds = \"table3\"", "bounds: \"table3\" is unknown|table2", 2),
        ("bounds = {R = [1.0, 0.1]}", "line 4: the bounds of R, 1:0.1, are reversed", 2),
        ("bounds = {R = [0.1]}", "R is not [MIN, MAX]", 2),
        ("bounds = {Q = [0.1, 1.0]}", "unknown key \"Q\"", 2),
        ("bounds = 3", "bounds is not a table", 2),
        ("fix = {R = \"a\"}", "fix: found \"a\", expected a number", 2),
        ("fix = {R = -1.0}", "line 4: fix: R is -1, expected a positive value", 2),
        ("fix = {R = 0.92}", "Steiglitz–McBride estimates all five", 2),
        ("device = \"tpu\"", "line 4: device: \"tpu\" is no device", 2),
        ("device = \"cpu\"\nprecision = \"f32\"", "f32 is for GPUs", 2),
        ("device = \"cpu\"\nfallback = \"cpu\"", "line 5: fallback has no effect", 2),
        ("precision = \"f16\"", "precision: \"f16\" is unknown", 2),
        ("discretization = \"zho\"", "Did you mean \"zoh\"?", 2),
        ("time_origin = 1.0", "time_origin has no effect", 2),
        ("set = [\"gwo.a-start=3\"]", "set: \"gwo\" is not among the methods", 2),
        ("set = [\"sm.a=3\"]", "is not a setting of this method", 2),
        ("rate = -5", "rate is -5", 2),
        ("crop = \"a\"", "line 4: crop: \"a\" is not FROM:TO", 2),
        ("columns = \"x=y\"", "line 4: ", 2),
        ("gaps = \"fill\"", "gaps: \"fill\" is unknown|error, keep or split", 2),
        ("drop_repeats = 1", "drop_repeats: found 1, expected true or false", 2),
        ("seeds = \"1..100000001\"", "the study has 100000001 runs", 2),
        ("name = \"again\"", "line 4: is not valid TOML", 2),
        ("a = [", "is not valid TOML", 2),
    ];
    for (line, expected, code) in cases {
        refused(&folder, &format!("{GOOD}{line}\n"), expected, code);
    }
}

#[test]
fn wrong_recordings() {
    let (folder, _) = with_study(GOOD);
    std::fs::copy(folder.path("a.csv"), folder.path("b.csv")).unwrap();
    std::fs::create_dir(folder.path("sub")).unwrap();
    std::fs::copy(folder.path("a.csv"), folder.path("sub/a.csv")).unwrap();
    let cases = [
        ("[]", "recordings is empty", 2),
        ("[\"no*.csv\"]", "\"no*.csv\" does not exist", 3),
        ("[\"a.csv\", \"a.csv\"]", "recordings has a value twice", 2),
        ("[\"*.csv\", \"a.csv\"]", "a.csv is named twice", 2),
        ("[{motor = \"m\", files = [\"a.csv\"]}, {motor = \"m\", files = [\"b.csv\"]}]", "two motors m", 2),
        ("[{motor = \"m\"}]", "a motor lacks \"files\"", 2),
        ("[{motor = \"m\", file = \"a.csv\"}]", "unknown key \"file\"|Did you mean \"files\"?", 2),
        ("[3]", "recordings: found 3", 2),
    ];
    for (list, expected, code) in cases {
        refused(&folder, &format!("recordings = {list}\nmethods = [\"sm\"]\n"), expected, code);
    }
    for (lacking, key) in [("methods = [\"sm\"]\n", "recordings"), ("recordings = [\"a.csv\"]\n", "methods")] {
        refused(&folder, lacking, &format!("lacks the key \"{key}\""), 2);
    }
    // Files of the same name in two folders are two motors, named by their paths.
    let study = folder.file("two.toml", "recordings = [\"a.csv\", \"sub/*.csv\"]\nmethods = [\"sm\"]\n");
    done(&[&study, "--out", &folder.path("two")]);
    let motors: Vec<String> =
        results(&folder.path("two")).iter().map(|l| l["motor"].as_str().unwrap().to_owned()).collect();
    assert_eq!(motors, ["a.csv", "sub/a.csv"]);
}

/// `auto` alone is the pipeline of `identify`, which refines; searches are not refined unless the study says so.
#[test]
fn a_study_of_auto_alone_has_standard_errors() {
    let cases = [
        ("methods = [\"auto\"]\n", [true, true]),
        ("methods = [\"auto\"]\npolish = [\"none\"]\n", [false, false]),
        ("methods = [\"auto\", \"gwo\"]\npopulation = 10\ngenerations = 5\n", [false, false]),
    ];
    for (n, (text, expected)) in cases.into_iter().enumerate() {
        let (folder, study) = with_study(&format!("recordings = [\"a.csv\"]\n{text}"));
        let dir = folder.path(&format!("out-{n}"));
        done(&[&study, "--out", &dir]);
        let all = results(&dir);
        let has = [&all[0], &all[all.len() - 1]].map(|line| !line["std_error"].is_null());
        assert_eq!(has, expected, "{text}: {}", all[0]);
    }
}

#[test]
fn settings_reach_the_runs() {
    let (folder, study) = with_study(
        "recordings = [\"a.csv\"]\nmethods = \"ga\"\npopulation = 30\ngenerations = 20\nseeds = 4\nset = [\"ga.mutation=0.5\"]\n\
         crop = \":0.2\"\ndecimate = 2\ndiscretization = \"foh\"\nbounds = {R = [0.5, 2.0]}\nfix = {J = 0.000136}\ninitial = \"zero\"\n\
         criterion = \"itae\"\ntime_origin = 0.05\n",
    );
    let dir = folder.path("out");
    done(&[&study, "--out", &dir]);
    let found = program::json(&[
        "identify",
        &folder.path("a.csv"),
        "--json",
        "--method",
        "ga",
        "--population",
        "30",
        "--generations",
        "20",
        "--seed",
        "4",
        "--set",
        "mutation=0.5",
        "--crop",
        ":0.2",
        "--decimate",
        "2",
        "--discretization",
        "foh",
        "--bounds",
        "R=0.5:2",
        "--fix",
        "J=0.000136",
        "--initial",
        "zero",
        "--criterion",
        "itae",
        "--time-origin",
        "0.05",
        "--polish",
        "none",
        "--device",
        "cpu",
    ]);
    let line = &results(&dir)[0];
    assert_eq!(line["cost"], found["cost"], "{line}");
    assert_eq!(line["parameters"]["R"], found["parameters"]["R"]["value"]);
    assert_eq!(line["parameters"]["J"], 0.000136);
}

#[test]
fn wrong_usage() {
    let (folder, study) = with_study(GOOD);
    let dir = folder.path("out");
    done(&["plan", &study, "--out", &dir]);
    for (args, part) in [
        (vec!["run", &dir, "--shard", "3/2"], "is not a shard"),
        (vec!["run", &dir, "--shard", "x"], "is not a shard"),
        (vec!["run", &dir, "--threads", "0"], "--threads is 0"),
        (vec!["merge", &dir, "--limits", "R=1:0.5"], "is empty"),
        (vec!["merge", &dir, "--limits", "Q=1:2"], "Q"),
        (vec![&study], "--out"),
        (vec![], "STUDY"),
        (vec!["rum", &dir], ""),
    ] {
        let (code, _, err) = sweep(&args);
        assert_eq!(code, 2, "{args:?}: {err}");
        assert!(err.contains(part), "{args:?}: {err}");
    }
    let (code, _, err) = sweep(&[&folder.path("none.toml"), "--out", &dir]);
    assert_eq!(code, 3, "{err}");
    assert!(err.contains("none.toml: cannot be read"), "{err}");
}

#[test]
fn progress_is_lines_of_json() {
    let (folder, study) = with_study(
        "recordings = [\"a.csv\"]\nmethods = [\"gwo\"]\npopulation = [10]\ngenerations = [10]\nseeds = \"1..20\"\ndevice = \"cpu\"\n",
    );
    let dir = folder.path("out");
    done(&["plan", &study, "--out", &dir]);
    let (code, _, err) = sweep(&["run", &dir, "--progress", "json"]);
    assert_eq!(code, 0);
    let progress: Vec<Value> = err.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    let last = progress.last().unwrap();
    assert_eq!((&last["runs"], &last["of"], &last["failed"]), (&20.into(), &20.into(), &0.into()), "{err}");
    assert!(last["runs_per_second"].as_f64().unwrap() > 0.0 && last["remaining_s"] == 0.0);
}
