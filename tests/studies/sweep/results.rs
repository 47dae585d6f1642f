//! Proves: runs of a sweep equal those of `identify`, the results file does not depend on shards and threads, and estimates
//! spread as their standard errors.

use super::*;
use std::collections::BTreeSet;

/// Study with several levels of every factor, and both kinds of runs.
const STUDY: &str = r#"
name = "night"
recordings = ["a.csv"]
methods = ["gwo", "jaya", "ga", "sm"]
polish = ["none", "lm"]
population = [10, 20]
generations = [15, 8]
seeds = "3..5"
criterion = ["nrmse", "iae"]
scale = ["std", "peak"]
noise = ["none", "40dB"]
bounds = "table2"
device = "cpu"
precision = "f64"
"#;
/// Number of runs of the study.
const RUNS: usize = 4 * 2 * 2 * 2 * 3 * 2 * 2 * 2;

#[test]
fn the_study_is_the_product_of_its_factors() {
    let (folder, study) = with_study(STUDY);
    let dir = folder.path("out");
    done(&[&study, "--out", &dir]);
    let all = results(&dir);
    assert_eq!(all.len(), RUNS);
    let keys = ["motor", "method", "polish", "population", "generations", "criterion", "scale", "noise", "seed"];
    let mut seen = BTreeSet::new();
    for (n, line) in all.iter().enumerate() {
        assert_eq!(line["id"], n, "sorted by number");
        assert!(seen.insert(keys.map(|key| line[key].to_string())), "each once");
        for key in ["parameters", "cost", "evaluations", "stop", "device", "precision"] {
            assert!(!line[key].is_null(), "{key}: {line}");
        }
        assert!(line.get("seconds").is_none() && line.get("timing").is_none(), "no times");
        assert_eq!(line["std_error"].is_null(), line["polish"] == "none", "{line}");
    }
    let times = lines(&format!("{dir}/timings.jsonl"));
    assert!(times.iter().enumerate().all(|(n, time)| time["id"] == n && time["seconds"].as_f64().unwrap() >= 0.0));
    assert_eq!(times.len(), RUNS);
}

#[test]
fn a_run_equals_that_of_identify() {
    let (folder, study) = with_study(STUDY);
    let dir = folder.path("out");
    done(&[&study, "--out", &dir]);
    let (all, record) = (results(&dir), folder.path("a.csv"));
    let of = |line: &&Value| {
        line["noise"] == "none" && line["seed"] == 4 && line["scale"] == "peak" && line["population"] == 20
    };
    let some: Vec<&Value> = all.iter().filter(of).collect();
    assert_eq!(some.len(), 4 * 2 * 2 * 2);
    for line in some {
        let word = |key: &str| line[key].as_str().unwrap().to_owned();
        let generations = line["generations"].to_string();
        let found = program::json(&[
            "identify",
            &record,
            "--json",
            "--method",
            &word("method"),
            "--polish",
            &word("polish"),
            "--criterion",
            &word("criterion"),
            "--scale",
            "peak",
            "--population",
            "20",
            "--generations",
            &generations,
            "--seed",
            "4",
            "--bounds",
            "table2",
            "--device",
            "cpu",
        ]);
        for p in ["R", "L", "K", "B", "J"] {
            assert_eq!(line["parameters"][p], found["parameters"][p]["value"], "{p} of {line}");
            assert_eq!(line["std_error"][p], found["parameters"][p]["std_error"], "{p} of {line}");
            assert_eq!(line["ci95"][p], found["parameters"][p]["ci95"], "{p} of {line}");
        }
        assert_eq!(
            (&line["cost"], &line["evaluations"], &line["stop"]),
            (&found["cost"], &found["evaluations"], &found["stop"])
        );
        assert_eq!(line["trust"], extensions::trust(&found), "{line}");
        for p in ["R", "L", "K", "B", "J"] {
            assert_eq!(line["at_bound"][p], found["parameters"][p]["at_bound"], "{p} of {line}");
        }
        for channel in ["current", "speed"] {
            // A sweep computes the fit from the sums of the refinement, `identify` by another simulation: equal up to rounding.
            let [fit, other] = [&line, &&found].map(|of| of["fit_percent"][channel].as_f64().unwrap());
            assert!((fit - other).abs() < if line["polish"] == "none" { f64::MIN_POSITIVE } else { 1e-6 });
        }
    }
}

#[test]
fn shards_and_threads_change_no_byte() {
    no_byte_changes(STUDY);
    // The kernel evaluates the criterion that tables do not serve.
    no_byte_changes(&format!("{STUDY}evaluator = \"tables\"\n"));
}

fn no_byte_changes(study: &str) {
    let (folder, study) = with_study(study);
    let whole = folder.path("whole");
    done(&[&study, "--out", &whole, "--threads", "1"]);
    for (shards, threads) in [(1, "2"), (2, "1"), (7, "2")] {
        let dir = folder.path(&format!("of{shards}"));
        done(&["plan", &study, "--out", &dir]);
        // In reverse order, because the order of shards has no effect.
        for shard in (1..=shards).rev() {
            done(&["run", &dir, "--shard", &format!("{shard}/{shards}"), "--threads", threads]);
        }
        done(&["merge", &dir]);
        assert!(bytes(&dir) == bytes(&whole), "{shards} shards");
        assert_eq!(ids(&dir).len(), RUNS, "none twice");
    }
}

#[test]
fn the_plan_pins_the_evaluator() {
    let folder = Folder::new();
    program::simulated(&folder.path("a.csv"), M2, "step:10.5@0.05", ["3", "1"]);
    let pinned = |keys: &str| {
        let study = format!("recordings = [\"a.csv\"]\nmethods = [\"gwo\"]\nbounds = \"table2\"\n{keys}");
        let (study, dir) = (folder.file("study.toml", study), folder.path("out"));
        let _ = std::fs::remove_dir_all(&dir);
        let out = done(&["plan", &study, "--out", &dir]);
        let manifest: Value = serde_json::from_slice(&std::fs::read(format!("{dir}/manifest.json")).unwrap()).unwrap();
        let tables = manifest["device"]["tables"] == true;
        assert_eq!(out.contains("with tables of poles"), tables, "{out}");
        tables
    };
    // Fifty searches on one recording pay for its tables; one does not, and neither do searches with a recording of their own each.
    assert!(pinned("seeds = \"1..50\""));
    assert!(!pinned("seeds = \"1..50\"\nevaluator = \"kernel\""));
    assert!(!pinned("seeds = [1]"));
    assert!(pinned("seeds = [1]\nevaluator = \"tables\""));
    assert!(!pinned("seeds = \"1..50\"\nnoise = [\"40dB\"]"));
    assert!(!pinned("seeds = \"1..50\"\ncriterion = [\"iae\"]"));
}

#[test]
fn shards_have_complete_motors_and_limits_list_motors_outside() {
    let folder = Folder::new();
    let motor = |n: usize| format!("R={},L=0.0078,K=0.0735,B=0.00068,J=0.000136", 0.8 + 0.02 * n as f64);
    for n in 0..20 {
        recording(&folder, &format!("m{n:02}.csv"), &motor(n), n as u64);
    }
    let study = folder.file(
        "study.toml",
        "recordings = [\"m*.csv\"]\nmethods = [\"sm\", \"auto\"]\npolish = [\"lm\"]\ndevice = \"cpu\"\n",
    );
    let (one, two) = (folder.path("one"), folder.path("two"));
    done(&[&study, "--out", &one]);
    done(&["plan", &study, "--out", &two]);
    for shard in ["2/2", "1/2"] {
        done(&["run", &two, "--shard", shard]);
    }
    let report = folder.path("report");
    let merged = sweep(&["merge", &two, "--json", "--limits", "R=0.835:1.075", "--out", &report]);
    assert_eq!(merged.0, 0, "{}", merged.2);
    assert!(bytes(&one) == bytes(&two));
    let mut z = Vec::new();
    for line in results(&one) {
        let n: usize = line["motor"].as_str().unwrap()[1..].parse().unwrap();
        let (value, error) = (line["parameters"]["R"].as_f64().unwrap(), line["std_error"]["R"].as_f64().unwrap());
        z.push((value - 0.8 - 0.02 * n as f64) / error);
    }
    // Both methods have the same noise, so there are 20 independent values; the bounds are 3.5 standard errors of the mean,
    // and 4 of a single value.
    let mean = z.iter().sum::<f64>() / 40.0;
    assert!(mean.abs() < 3.5 / 20_f64.sqrt() && z.iter().all(|z| z.abs() < 4.0), "{mean} {z:?}");
    let document: Value = serde_json::from_str(&merged.1).unwrap();
    let outside: Vec<&str> =
        document["outside"].as_array().unwrap().iter().map(|o| o["motor"].as_str().unwrap()).collect();
    let expected: BTreeSet<&str> = ["m00", "m01", "m14", "m15", "m16", "m17", "m18", "m19"].into();
    assert_eq!(outside.iter().copied().collect::<BTreeSet<&str>>(), expected);
    let page = std::fs::read_to_string(format!("{report}/report.html")).unwrap();
    assert!(page.contains("m19") && page.contains("<svg"));
}

#[test]
fn added_noise_is_seeded_and_estimates_spread_as_their_standard_errors() {
    let folder = Folder::new();
    program::ok(&[
        "simulate",
        "--parameters",
        M2,
        "--input",
        "step:10.5@0.05",
        "--duration",
        "0.3",
        "--out",
        &folder.path("a.csv"),
    ]);
    let study = "recordings = [\"a.csv\"]\nmethods = [\"sm\", \"gwo\"]\npolish = [\"lm\"]\nseeds = \"1..80\"\nnoise = [\"40dB\"]\ndevice = \"cpu\"\n";
    let study = folder.file("study.toml", study);
    let dir = folder.path("out");
    done(&[&study, "--out", &dir]);
    let all = results(&dir);
    let truth = [("R", 0.921042), ("L", 0.007759), ("K", 0.073472), ("B", 0.000678), ("J", 0.000136)];
    for (p, truth) in truth {
        let sm = all.iter().filter(|line| line["method"] == "sm");
        let z: Vec<f64> =
            sm.map(|l| (l["parameters"][p].as_f64().unwrap() - truth) / l["std_error"][p].as_f64().unwrap()).collect();
        let mean = z.iter().sum::<f64>() / 80.0;
        let rms = (z.iter().map(|z| z * z).sum::<f64>() / 80.0).sqrt();
        // Over 80 seeds the standard errors of mean and rms are 0.11 and 0.08; the bounds are four of them.
        assert!(mean.abs() < 0.45 && (rms - 1.0).abs() < 0.32, "{p}: {mean} {rms}");
    }
    // Both methods have the same noise and end in the same optimum.
    for (sm, gwo) in all[..80].iter().zip(&all[80..]) {
        assert_eq!(
            (&sm["seed"], sm["method"].as_str(), gwo["method"].as_str()),
            (&gwo["seed"], Some("sm"), Some("gwo"))
        );
        let of = |line: &Value| line["parameters"]["R"].as_f64().unwrap();
        assert!((of(sm) / of(gwo) - 1.0).abs() < 1e-5, "{sm} {gwo}");
    }
}

#[test]
fn a_joint_fit_is_one_motor() {
    let folder = Folder::new();
    for seed in 1..=3 {
        recording(&folder, &format!("r{seed}.csv"), M2, seed);
    }
    let study = "recordings = [{motor = \"m1\", files = [\"r1.csv\", \"r2.csv\"]}, \"r3.csv\"]\nmethods = [\"sm\", \"jaya\"]\npolish = [\"lm\"]\n";
    let study = folder.file("study.toml", study);
    let dir = folder.path("out");
    done(&[&study, "--out", &dir, "--json"]);
    let joint =
        program::json(&["identify", &folder.path("r1.csv"), &folder.path("r2.csv"), "--json", "--method", "sm"]);
    let first = &results(&dir)[0];
    assert_eq!((&first["motor"], &first["parameters"]["J"]), (&"m1".into(), &joint["parameters"]["J"]["value"]));
    assert_eq!(results(&dir)[2]["motor"], "r3");
}

/// Returns true if there is an adapter; without one the test is skipped, or fails if skips are not allowed.
pub(super) fn has_gpu() -> bool {
    let devices = program::json(&["devices", "--json"]);
    let has = devices["devices"].as_array().unwrap().iter().any(|device| device["kind"] == "gpu");
    assert!(has || std::env::var_os("MOTORFIT_NO_SKIP").is_none(), "no adapter");
    has
}

#[test]
fn a_gpu_gives_the_same_results_in_any_shards() {
    if !has_gpu() {
        return;
    }
    let gpu = |precision: &str| {
        let study = format!(
            "recordings = [\"a.csv\"]\nmethods = [\"gwo\", \"jaya\"]\npopulation = [16]\ngenerations = [12]\nseeds = \"1..6\"\n\
             bounds = \"table2\"\ndevice = \"gpu\"\nprecision = \"{precision}\"\n"
        );
        let (folder, study) = with_study(&study);
        let (one, three) = (folder.path("one"), folder.path("three"));
        done(&[&study, "--out", &one]);
        done(&["plan", &study, "--out", &three]);
        for shard in ["1/3", "2/3", "3/3"] {
            done(&["run", &three, "--shard", shard]);
        }
        done(&["merge", &three]);
        assert!(bytes(&one) == bytes(&three), "{precision}");
        let all = results(&one);
        assert!(all.iter().all(|line| line["device"] == "gpu" && line["precision"] == precision));
        all
    };
    let study = "recordings = [\"a.csv\"]\nmethods = [\"gwo\", \"jaya\"]\npopulation = [16]\ngenerations = [12]\nseeds = \"1..6\"\nbounds = \"table2\"\ndevice = \"cpu\"\n";
    let (folder, study) = with_study(study);
    let dir = folder.path("out");
    done(&[&study, "--out", &dir]);
    gpu("f32");
    // In f64 the searches take the same steps, up to rounding.
    for (gpu, cpu) in gpu("f64").iter().zip(results(&dir)) {
        let cost = |line: &Value| line["cost"].as_f64().unwrap();
        assert!((cost(gpu) / cost(&cpu) - 1.0).abs() < 1e-6, "{gpu} {cpu}");
    }
}

#[test]
fn the_cpu_takes_over_by_request_and_is_reported() {
    let study = |fallback: &str| {
        format!(
            "recordings = [\"a.csv\"]\nmethods = [\"gwo\"]\npopulation = [8]\ngenerations = [5]\ndevice = \"gpu:no such\"\nprecision = \"f64\"\n{fallback}"
        )
    };
    let (folder, with) = with_study(&study("fallback = \"cpu\"\n"));
    let dir = folder.path("out");
    let (code, _, err) = sweep(&[&with, "--out", &dir]);
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("gpu_failed"), "{err}");
    let line = &results(&dir)[0];
    assert_eq!(line["device"], "cpu");
    assert!(line["warnings"].as_array().unwrap().contains(&"gpu_failed".into()), "{line}");
    let without = folder.file("without.toml", study(""));
    let (code, _, err) = sweep(&[&without, "--out", &folder.path("other")]);
    assert_eq!(code, 5, "{err}");
}

#[test]
fn limits_of_a_production_line() {
    let folder = Folder::new();
    for (n, r) in [(1, "0.90"), (2, "0.91"), (3, "0.92"), (4, "0.93"), (5, "0.99")] {
        let motor = format!("R={r},L=0.007759,K=0.073472,B=0.000678,J=0.000136");
        recording(&folder, &format!("m{n}.csv"), &motor, n);
    }
    let lines = "recordings = [\"m*.csv\"]\nmethods = [\"sm\"]\npolish = [\"lm\"]\n";
    let study = folder.file("study.toml", format!("{lines}limits = {{R = [0.88, 0.96]}}\n"));
    let (dir, report) = (folder.path("out"), folder.path("report"));
    let (code, out, err) = sweep(&[&study, "--out", &dir, "--report", &report, "--strict-limits"]);
    assert_eq!(code, 6, "{err}");
    assert!(out.contains("1 is outside the limits") && out.contains("Process capability"), "{out}");
    // Without the flag, and with limits that all motors keep, the exit code is 0.
    assert_eq!(sweep(&["merge", &dir]).0, 0);
    assert_eq!(sweep(&["merge", &dir, "--limits", "R=0.5:1.5", "--strict-limits"]).0, 0);
    let document: Value = serde_json::from_str(&done(&["merge", &dir, "--json"])).unwrap();
    let r = &document["motors"]["parameters"]["R"]["capability"];
    let number = |key: &str| r[key].as_f64().unwrap();
    let (mean, deviation) = (number("mean"), number("standard_deviation"));
    // R is known to 0.2 % here; the deviation of the five true values is 0.0354.
    assert!((mean - 0.93).abs() < 0.003 && (deviation - 0.0354).abs() < 0.003, "{r}");
    assert!((number("cp") - 0.08 / (6.0 * deviation)).abs() < 1e-9, "{r}");
    assert!((number("cpk") - (0.96 - mean) / (3.0 * deviation)).abs() < 1e-9, "{r}");
    assert!(document["motors"]["parameters"]["K"]["capability"].is_null());
    // All motors as one table.
    let csv = done(&["merge", &dir, "--csv", "-"]);
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert!(rows.len() == 6 && rows.iter().all(|row| row.len() == rows[0].len()), "{csv}");
    let outside = rows[0].iter().position(|head| *head == "outside").unwrap();
    let listed: Vec<[&str; 2]> = rows[1..].iter().map(|row| [row[0], row[outside]]).collect();
    assert_eq!(listed, [["m1", ""], ["m2", ""], ["m3", ""], ["m4", ""], ["m5", "R"]]);
    assert_eq!(std::fs::read_to_string(format!("{report}/motors.csv")).unwrap(), csv);
    let page = std::fs::read_to_string(format!("{report}/report.html")).unwrap();
    assert!(page.contains("id=\"run-chart\"") && page.contains("Process capability"));
    // Limits that are none.
    for (limits, part) in [("{R = [1, 0.5]}", "R=1:0.5 is empty"), ("3", "not a table"), ("{Q = [0, 1]}", "Q")] {
        let study = folder.file("wrong.toml", format!("{lines}limits = {limits}\n"));
        let (code, _, err) = sweep(&["plan", &study, "--out", &folder.path("wrong")]);
        assert!(code == 2 && err.contains(part) && err.contains("line 4"), "{err}");
    }
    let study = folder.file("free.toml", lines);
    let (code, _, err) = sweep(&[&study, "--out", &folder.path("free"), "--strict-limits"]);
    assert!(code == 2 && err.contains("has no limits"), "{err}");
}
