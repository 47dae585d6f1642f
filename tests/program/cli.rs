//! Proves: the commands follow their contract of documents, tables and exit codes; bad input gives its exit code and a message
//! with a remedy on stderr, nothing on stdout, no panic and no control characters; Ctrl-C prints the best candidate found.
//! Does not prove: that estimates are right (see optimizers.rs, recovery.rs).
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_possible_truncation, clippy::float_cmp, reason = "small numbers; exact equality is meant")]

use crate::support::program::{EXAMPLE, Folder, M2, fails, json, motorfit, ok, run, simulated, text};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

#[test]
fn identify_prints_the_contract_s_document() {
    let search = ["--method", "gwo", "--polish", "none", "--bounds", "table2"];
    let document = json(&[&["identify", EXAMPLE, "--json"][..], &search[..]].concat());
    for (key, value) in [
        ("method", "gwo"),
        ("polish", "none"),
        ("criterion", "nrmse"),
        ("scale", "std"),
        ("discretization", "zoh"),
        ("stop", "budget_spent"),
    ] {
        assert_eq!(document[key], value, "{key}");
    }
    for (key, value) in [("seed", 1), ("population", 100), ("generations", 100), ("evaluations", 10_000)] {
        assert_eq!(document[key], value, "{key}");
    }
    assert_eq!(document["motorfit"], env!("CARGO_PKG_VERSION"));
    let record = &document["records"][0];
    assert_eq!((&record["samples"], &record["period_s"]), (&3001.into(), &0.001.into()));
    assert_eq!(record["sha256"].as_str().unwrap().len(), 64);
    assert_eq!(document["bounds"]["R"], serde_json::json!([0.1, 1.0]));
    assert_eq!((&document["device"]["kind"], &document["device"]["precision"]), (&"cpu".into(), &"f64".into()));
    // Tolerance 5 % for a population search at 40 dB; optimizers.rs tests the distribution.
    for (symbol, truth, unit) in [
        ("R", 0.921_042, "ohm"),
        ("L", 0.007_759, "H"),
        ("K", 0.073_472, "V*s/rad"),
        ("B", 0.000_678, "N*m*s/rad"),
        ("J", 0.000_136, "kg*m^2"),
    ] {
        let p = &document["parameters"][symbol];
        let value = p["value"].as_f64().unwrap();
        assert!((value / truth - 1.0).abs() < 0.05, "{symbol} {value}");
        assert_eq!((&p["unit"], &p["fixed"]), (&unit.into(), &false.into()));
        assert!(["std_error", "ci95", "at_bound"].iter().all(|key| p.get(key).unwrap().is_null()));
        assert_eq!(document["searched"]["parameters"][symbol], p["value"]);
    }
    assert_eq!(document["history"].as_array().unwrap().len(), 100);
    let last = document["history"][99].as_f64().unwrap();
    // The cost is computed by the oracle, the history by the evaluator.
    assert!((document["cost"].as_f64().unwrap() / last - 1.0).abs() < 1e-11);
    assert_eq!(document["searched"]["cost"], document["cost"]);
    assert!(document["fit_percent"]["current"].as_f64().unwrap() > 98.0);
    // The search ended in the basin of the optimum.
    assert_eq!(document["verification"]["status"], "agrees");
    assert!((1e-6..1.0).contains(&document["verification"]["cost_gap"].as_f64().unwrap()));
    assert!(document["correlation"].is_null() && document["warnings"].as_array().unwrap().is_empty());
    assert!(document["seconds"].as_f64().unwrap() > 0.0);
}

#[test]
fn identify_without_flags_reports_standard_errors() {
    let document = json(&["identify", EXAMPLE, "--json"]);
    for (key, value) in [("method", "auto"), ("polish", "lm"), ("stop", "converged")] {
        assert_eq!(document[key], value, "{key}");
    }
    assert_eq!(document["searched"]["method"], "sm");
    // Cramér–Rao bounds at 40 dB [%].
    for (symbol, truth, percent) in [
        ("R", 0.921_042, 0.0490),
        ("L", 0.007_759, 0.0900),
        ("K", 0.073_472, 0.0194),
        ("B", 0.000_678, 0.0427),
        ("J", 0.000_136, 0.0634),
    ] {
        let p = &document["parameters"][symbol];
        let (value, error) = (p["value"].as_f64().unwrap(), p["std_error"].as_f64().unwrap());
        assert!((error / (0.01 * percent * truth) - 1.0).abs() < 0.05, "{symbol}: {error}");
        assert!((value - truth).abs() < 4.0 * error, "{symbol}: {value} ± {error}");
        let [low, high] = [0, 1].map(|n| p["ci95"][n].as_f64().unwrap());
        assert!((high - low - 3.92 * error).abs() < 0.01 * error && low < value && value < high);
        let bounds: Vec<f64> = (0..2).map(|n| document["bounds"][symbol][n].as_f64().unwrap()).collect();
        assert!((bounds[1] / bounds[0] - 100.0).abs() < 1e-9, "a decade to each side");
    }
    let correlation = |a: usize, b: usize| document["correlation"][a][b].as_f64().unwrap();
    assert!((0..5).all(|a| (correlation(a, a) - 1.0).abs() < 1e-12 && correlation(a, 0) == correlation(0, a)));
    let check = &document["verification"];
    assert_eq!((&check["status"], &check["reference"]), (&"agrees".into(), &"variable_projection".into()));
    assert!(check["cost_gap"].as_f64().unwrap().abs() < 1e-6);
    for method in ["steiglitz_mcbride", "levenberg_marquardt"] {
        assert!((check[method]["K"].as_f64().unwrap() / 0.073_472 - 1.0).abs() < 1e-3, "{method}");
    }
    assert_eq!(document["residuals"]["speed"]["white"], true);
    assert!(document["warnings"].as_array().unwrap().is_empty());
    let text = ok(&["identify", EXAMPLE]);
    assert!(
        text.starts_with("  trust     good for R, L, K, B and J: ")
            && text.contains("std. error")
            && text.contains("search    agrees with"),
        "{text}"
    );
    let sm = json(&["identify", EXAMPLE, "--json", "--method", "sm", "--polish", "none"]);
    assert!(sm["parameters"]["R"]["std_error"].is_null() && sm["verification"]["status"] == "agrees");
    fails(&["identify", EXAMPLE, "--method", "sm", "--fix", "R=0.9"], 2, "cannot fix any");
}

#[test]
fn a_failed_fit_names_what_was_found_before_its_hint() {
    let folder = Folder::new();
    let file = folder.path("still.csv");
    // A motor at rest whose encoder flickers by one count.
    let flicker = |n: u32| if n % 190 == 150 { 0.5 } else { 0.0 };
    let row = |n: u32| format!("{},{},{}\n", f64::from(n) * 1e-3, if n < 100 { 0.0 } else { 6.0 }, flicker(n));
    let rows: String = (0..400).map(row).collect();
    std::fs::write(&file, format!("time_s,voltage_V,speed_rad_s\n{rows}")).unwrap();
    let output = run(&["identify", &file, "--json"]);
    assert_eq!(output.status.code(), Some(4));
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(document["error"]["kind"], "not_identified");
    let errors = text(&output.stderr);
    let order = ["[no_motion]", "error:", "First check", "did not move", "Otherwise:"];
    let places = order.map(|what| errors.rfind(what).unwrap());
    assert!(errors.find(order[0]) < errors.find(order[1]) && places[1..].is_sorted(), "{errors}");
}

#[test]
fn a_result_that_cannot_be_trusted_names_the_next_command() {
    let good = json(&["identify", EXAMPLE, "--json", "--strict"]);
    let of = ["R", "L", "K", "B", "J"];
    let expected =
        serde_json::json!({"level": "good", "of": of, "open": [], "needs": null, "reasons": [], "next": null});
    assert_eq!(good["trust"], expected);
    let folder = Folder::new();
    let file = folder.path("with friction.csv");
    // Several levels, because under a single step Coulomb friction is like viscous friction.
    let level = |n: u32| [0.0, 8.0, 3.0, -6.0][(n / 250) as usize % 4];
    let rows: String = (0..1500).map(|n| format!("{},{}\n", f64::from(n) * 1e-3, level(n))).collect();
    let input = folder.file("input.csv", format!("time_s,voltage_V\n{rows}"));
    ok(&["simulate", "--parameters", "m2,Tc=0.03", "--input", &input, "--noise", "40dB", "--out", &file]);
    let output = run(&["identify", &file, "--json", "--strict"]);
    assert_eq!(output.status.code(), Some(4), "{output:?}");
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    let trust = &document["trust"];
    assert!(trust["level"] != "good" && !trust["reasons"].as_array().unwrap().is_empty(), "{trust}");
    assert!(trust["reasons"].as_array().unwrap().iter().all(|r| r["code"].is_string() && r["message"].is_string()));
    assert_eq!(trust["next"], format!("motorfit identify '{file}' --json --strict --with auto"), "{trust}");
    let text = ok(&["identify", &file]);
    assert!(text.starts_with("  trust     ") && text.contains("\n  next      motorfit identify '"), "{text}");
    // The advised command gives a trusted result.
    let again = json(&["identify", &file, "--json", "--strict", "--with", "auto"]);
    assert_eq!(
        (&again["trust"]["level"], &again["with"]),
        (&"good".into(), &serde_json::json!(["coulomb"])),
        "{again}"
    );
}

#[test]
fn a_reversed_sign_is_named() {
    let folder = Folder::new();
    let text = std::fs::read_to_string(EXAMPLE).unwrap();
    for (column, name) in [(1, "voltage"), (2, "current"), (3, "speed")] {
        let flip = |line: &str| -> String {
            let cells: Vec<&str> = line.split(',').collect();
            let flipped = |(n, cell): (usize, &&str)| match cell.strip_prefix('-') {
                _ if n != column => (*cell).to_owned(),
                Some(positive) => positive.to_owned(),
                None => format!("-{cell}"),
            };
            cells.iter().enumerate().map(flipped).collect::<Vec<_>>().join(",") + "\n"
        };
        let rows: String = text.lines().skip(1).map(flip).collect();
        let file = folder.file(name, format!("time_s,voltage_V,current_A,speed_rad_s\n{rows}"));
        fails(&["identify", &file], 4, &format!("the sign of the {name} is reversed"));
    }
}

#[test]
fn every_method_criterion_and_setting_runs() {
    for method in ["gwo", "jaya", "ga", "random"] {
        let args = [
            "identify",
            EXAMPLE,
            "--json",
            "--method",
            method,
            "--population",
            "17",
            "--generations",
            "5",
            "--threads",
            "1",
        ];
        assert_eq!(json(&args)["evaluations"], 85, "{method}");
    }
    for criterion in ["euclidean", "ise", "iae", "itse", "itae", "mse", "nrmse"] {
        for scale in ["none", "peak", "std", "noise"] {
            let args =
                ["identify", EXAMPLE, "--json", "--criterion", criterion, "--scale", scale, "--generations", "3"];
            let document = json(&args);
            assert_eq!((&document["criterion"], &document["scale"]), (&criterion.into(), &scale.into()));
            assert!(document["cost"].as_f64().unwrap() > 0.0);
        }
    }
    for (method, set) in [
        ("gwo", "a-start=1.5,a-end=0.1"),
        ("jaya", "sharing=agent,greedy=false"),
        ("ga", "mutation=0.1,pressure=0.5,crossover=0.9,elites=2"),
    ] {
        ok(&["identify", EXAMPLE, "--method", method, "--set", set, "--generations", "3"]);
    }
    for (flag, value) in [
        ("--discretization", "foh"),
        ("--discretization", "rk4"),
        ("--initial", "zero"),
        ("--initial", "measured"),
        ("--device", "cpu"),
        ("--device", "auto"),
        ("--precision", "f64"),
    ] {
        ok(&["identify", EXAMPLE, flag, value, "--generations", "3"]);
    }
}

#[test]
fn noise_and_time_origin_change_the_cost() {
    let cost = |args: &[&str]| {
        let all: Vec<&str> =
            ["identify", EXAMPLE, "--json", "--generations", "2"].iter().chain(args).copied().collect();
        json(&all)["cost"].as_f64().unwrap()
    };
    let noise = |value| cost(&["--scale", "noise", "--noise", value]);
    // Twice the noise halves the cost; the 40 dB of the example are 12 mA and 1.04 rad/s.
    assert!((noise("i=0.01,w=1") / noise("i=0.02,w=2") - 2.0).abs() < 1e-9);
    assert!((noise("40dB") / noise("i=0.012025,w=1.0390") - 1.0).abs() < 0.01);
    let late = |origin| cost(&["--criterion", "itae", "--time-origin", origin]);
    assert!(late("2") < late("1") && late("1") < late("0"));
}

#[test]
fn bounds_and_fixed_parameters() {
    let document = json(&[
        "identify",
        EXAMPLE,
        "--json",
        "--fix",
        "R=0.92",
        "--fix",
        "B=0.0007",
        "--bounds",
        "table2,L=0.002:0.02",
        "--bounds",
        "J=1e-4:2e-4",
    ]);
    assert_eq!(
        (&document["parameters"]["R"]["value"], &document["parameters"]["R"]["fixed"]),
        (&0.92.into(), &true.into())
    );
    assert_eq!(document["bounds"], serde_json::json!({"L": [0.002, 0.02], "K": [0.005, 0.1], "J": [1e-4, 2e-4]}));
    assert_eq!(document["verification"]["reference"], "multi_start");
    assert!(document["correlation"][0][1].is_null() && document["correlation"][1][2].is_f64());
    let wide = json(&["identify", EXAMPLE, "--json", "--polish", "none", "--bounds", "B=1e-6:10"]);
    assert!(wide["parameters"]["B"]["at_bound"].is_null(), "far from its minimum on its own scale");
    let tight = json(&["identify", EXAMPLE, "--json", "--bounds", "R=0.1:0.5"]);
    assert_eq!(tight["parameters"]["R"]["at_bound"], "max");
    assert!(tight["warnings"].as_array().unwrap().iter().any(|w| w["code"] == "at_bound"));
}

#[test]
fn the_same_seed_is_the_same_result_on_any_number_of_threads() {
    let found = |threads: &str, seed: &str| {
        let search = ["identify", EXAMPLE, "--json", "--method", "gwo", "--polish", "none"];
        json(&[&search[..], &["--threads", threads, "--seed", seed]].concat())["parameters"].clone()
    };
    let polished = |threads: &str| json(&["identify", EXAMPLE, "--json", "--threads", threads])["parameters"].clone();
    assert_eq!(polished("1"), polished("3"));
    assert_eq!(found("1", "1"), found("3", "1"));
    assert_ne!(found("1", "1"), found("1", "2"));
}

#[test]
fn several_recordings_are_one_fit() {
    let folder = Folder::new();
    let other = folder.path("other.csv");
    simulated(&other, M2, "step:6@0.2", ["1", "1"]);
    let document = json(&["identify", EXAMPLE, &other, "--json"]);
    assert_eq!(document["records"].as_array().unwrap().len(), 2);
    assert!((document["parameters"]["K"]["value"].as_f64().unwrap() / 0.073_472 - 1.0).abs() < 0.05);
}

#[test]
fn evaluate_gives_costs_of_any_candidates() {
    let folder = Folder::new();
    // Candidates from a file: columns in any order, others and comments ignored; the cost is that of identify.
    let found = json(&["identify", EXAMPLE, "--json"]);
    let value = |symbol: &str| found["parameters"][symbol]["value"].as_f64().unwrap();
    let row = ["J", "R", "L", "K", "B"].map(|symbol| value(symbol).to_string()).join(",");
    let file = folder.file("c.csv", format!("J, R, L, K, B, note\n# best\n{row},a\n1e-4,0.5,0.01,0.05,1e-4,b\n"));
    let out = ok(&["-q", "evaluate", EXAMPLE, "--candidates", &file]);
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!((lines.len(), lines[0]), (3, "R,L,K,B,J,cost"));
    let cells: Vec<f64> = lines[1].split(',').map(|cell| cell.parse().unwrap()).collect();
    assert_eq!(cells[0].to_bits(), value("R").to_bits());
    assert!((cells[5] / found["cost"].as_f64().unwrap() - 1.0).abs() < 1e-9);
    // Sampled candidates: all, the best of them, and the best as JSON.
    let sample = ["-q", "evaluate", EXAMPLE, "--bounds", "table2", "--sample", "lhs:3000"];
    let all = ok(&sample);
    let mut costs: Vec<f64> = all.lines().skip(1).map(|l| l.rsplit(',').next().unwrap().parse().unwrap()).collect();
    assert_eq!(costs.len(), 3000);
    costs.sort_by(f64::total_cmp);
    let best = ok(&[&sample[..], &["--top", "3"]].concat());
    let best: Vec<f64> = best.lines().skip(1).map(|l| l.rsplit(',').next().unwrap().parse().unwrap()).collect();
    assert_eq!(best, costs[..3]);
    let document = json(&[&sample[..], &["--json", "--top", "3", "--threads", "1"]].concat());
    assert_eq!(document["best"][2]["cost"].as_f64().unwrap().to_bits(), costs[2].to_bits());
    assert_eq!((&document["candidates"], &document["device"]["kind"]), (&3000.into(), &"cpu".into()));
    // Every parameter is listed: extensions, free or fixed, and a list of values for parameters per recording.
    let extended = ["--with", "coulomb,load", "--fix", "TL=0.01", "--per-recording", "R", "--sample", "lhs:50"];
    let document = json(&[&["evaluate", EXAMPLE, EXAMPLE][..], &extended, &["--json", "--top", "1"]].concat());
    let best = &document["best"][0]["parameters"];
    let named: Vec<&str> = best.as_object().unwrap().keys().map(String::as_str).collect();
    assert_eq!(named, ["R", "L", "K", "B", "J", "Tc", "TL"]);
    assert!(best["Tc"].as_f64().unwrap() > 0.0 && best["TL"] == 0.01);
    let own = best["R"].as_array().unwrap();
    assert!(own.len() == 2 && own[0] != own[1] && best["K"].is_f64());
    let grid = ok(&["-q", "evaluate", EXAMPLE, "--sample", "grid:4", "--fix", "L=0.0078,B=0.00068,J=0.000136"]);
    assert_eq!((grid.lines().count(), grid.lines().next()), (17, Some("R,K,cost")));
    for (args, code, part) in [
        (&["--sample", "lhs"][..], 2, "is not a kind of sample"),
        (&["--sample", "cube:3"], 2, "is not a kind of sample"),
        (&["--sample", "uniform:0"], 2, "is not a kind of sample"),
        (&["--sample", "uniform:3", "--top", "0"], 2, "--top is 0"),
        (&["--sample", "grid:1e6"], 2, "too large"),
        (&["--slice", "R"], 2, "two parameters"),
        (&["--slice", "R,R"], 2, "two different"),
        (&["--slice", "R,L", "--fix", "R=0.9"], 2, "R is fixed"),
        (&["--slice", "R,L", "--sample", "lhs:9"], 2, "grid:N"),
        (&["--profile", "--sample", "lhs:9"], 2, "cannot be used with"),
        (&["--profile", "--polish", "none"], 2, "unexpected argument"),
        (&["--sample", "lhs:9", "--svg", "x.svg"], 2, "required"),
        (&["--sample", "lhs:9", "--evaluator", "tables", "--device", "gpu"], 2, "--evaluator applies to the CPU"),
        (&["--sample", "lhs:9", "--evaluator", "table"], 2, "auto, kernel, tables"),
        (&[], 2, "--candidates <FILE>|--sample <SAMPLE>|--slice <P,Q>|--profile"),
        (&["--candidates", "nowhere.csv"], 3, "cannot be read"),
        (&["--candidates", "x.parquet"], 3, if cfg!(feature = "parquet") { "cannot be read" } else { "Parquet" }),
    ] {
        fails(&[&["evaluate", EXAMPLE][..], args].concat(), code, part);
    }
    for (text, part) in [("R,L\n1,2\n", "no column K"), ("R,L,K,B,J\n", "no candidates")] {
        let args = ["evaluate", EXAMPLE, "--top", "1", "--candidates", &folder.file("bad.csv", text)];
        fails(&args, 3, part);
    }
    let wrong = folder.file("wrong.csv", "R,L,K,B,J\n1,2,x,4,5\n");
    fails(&["evaluate", EXAMPLE, "--top", "1", "--candidates", &wrong], 3, "line 2, column K: found \"x\"");
}

#[test]
fn the_evaluator_is_chosen_by_the_work_and_named() {
    let sample = ["evaluate", EXAMPLE, "--bounds", "table2", "--top", "20", "--json", "--sample"];
    let with = |own: &[&str]| json(&[&sample[..], own].concat());
    let kernel = with(&["sobol:1e5", "--evaluator", "kernel"]);
    let tables = with(&["sobol:1e5", "--evaluator", "tables"]);
    let auto = with(&["sobol:1e5"]);
    let named = |of: &Value| of["device"]["evaluator"].as_str().unwrap().to_owned();
    assert_eq!([&kernel, &tables, &auto].map(named), ["kernel", "tables", "tables"]);
    assert_eq!(named(&with(&["sobol:2000"])), "kernel", "too few candidates for tables");
    assert_eq!(tables["best"], auto["best"]);
    for n in 0..20 {
        let [a, b] = [&kernel, &tables].map(|of| &of["best"][n]);
        assert_eq!(a["parameters"], b["parameters"]);
        assert!((a["cost"].as_f64().unwrap() / b["cost"].as_f64().unwrap() - 1.0).abs() < 1e-9);
    }
    // The kernel evaluates what tables do not serve, with a warning if they were requested.
    let unserved = with(&["sobol:1e5", "--criterion", "iae"]);
    assert_eq!((named(&unserved), unserved["warnings"].as_array().unwrap().len()), ("kernel".to_owned(), 0));
    let unserved = with(&["sobol:100", "--criterion", "iae", "--evaluator", "tables"]);
    assert_eq!((named(&unserved).as_str(), &unserved["warnings"][0]["code"]), ("kernel", &"tables_unsuited".into()));
    // A search has the same optimum with both.
    let search = ["identify", EXAMPLE, "--method", "gwo", "--polish", "none", "--json", "--evaluator"];
    let [kernel, tables] = ["kernel", "tables"].map(|of| json(&[&search[..], &[of]].concat()));
    assert_eq!([&kernel, &tables].map(named), ["kernel", "tables"]);
    let [a, b] = [&kernel, &tables].map(|of| of["cost"].as_f64().unwrap());
    assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
}

#[test]
fn profiles_have_intervals_beside_those_of_the_standard_errors() {
    let folder = Folder::new();
    let svg = folder.path("profile.svg");
    let args = ["-q", "evaluate", EXAMPLE, "--profile"];
    let text = ok(&args);
    assert!(text.contains("trust     good") && text.contains("95 % by likelihood"), "{text}");
    let document = json(&[&args[..], &["--json", "--svg", &svg]].concat());
    let profiles = document["profiles"].as_array().unwrap();
    assert_eq!((profiles.len(), &document["trust"]["level"]), (5, &"good".into()));
    for of in profiles {
        let ends = |key: &str| [0, 1].map(|n| of[key][n].as_f64().unwrap());
        let [normal, own] = ["ci95", "likelihood95"].map(ends);
        // With 3001 samples and 40 dB both agree to a part of their width.
        let width = normal[1] - normal[0];
        assert!((0..2).all(|n| (normal[n] - own[n]).abs() < 0.01 * width), "{of}");
        assert!(of["points"].as_array().unwrap().len() > 10);
    }
    let of_model = json(&[&args[..], &["--model", "dc-motor", "--json"]].concat());
    assert_eq!(of_model["model"]["name"], "DC motor");
    assert_eq!(of_model["profiles"].as_array().unwrap().len(), 5);
    let plot = std::fs::read_to_string(&svg).unwrap();
    assert!(plot.starts_with("<svg") && plot.contains("likelihood ratio over inertia"));
    let drawn = ok(&[&args[..], &["--fix", "L=0.0078,B=0.00068", "--svg", "-"]].concat());
    assert!(drawn.starts_with("<svg") && !drawn.contains("inductance"));
}

#[test]
fn parameters_per_recording_have_a_column_each() {
    let folder = Folder::new();
    let joint = ["-q", "evaluate", EXAMPLE, EXAMPLE, "--per-recording", "R"];
    let sampled = ok(&[&joint[..], &["--sample", "lhs:5"]].concat());
    assert_eq!(sampled.lines().next(), Some("R[0],R[1],L,K,B,J,cost"));
    let again = folder.file("joint.csv", &sampled);
    assert_eq!(ok(&[&joint[..], &["--candidates", &again]].concat()), sampled);
    for (heads, part) in [("R,R,L,K,B,J", "no column R[0]"), ("R[0],R[0],L,K,B,J", "several columns R[0]")] {
        let text = format!("{heads}\n1,2,0.01,0.07,0.0007,0.0001\n");
        fails(&[&joint[..], &["--candidates", &folder.file("heads.csv", &text)]].concat(), 3, part);
    }
}

#[test]
fn a_slice_is_a_map_around_the_optimum() {
    let folder = Folder::new();
    let svg = folder.path("map.svg");
    let args = ["-q", "evaluate", EXAMPLE, "--slice", "R,L", "--sample", "grid:21", "--scale", "noise"];
    let out = ok(&args);
    ok(&[&args[..], &["--svg", &svg]].concat());
    assert_eq!((out.lines().count(), out.lines().next()), (442, Some("R,L,cost")));
    let rows: Vec<Vec<f64>> =
        out.lines().skip(1).map(|l| l.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    let lowest = rows.iter().min_by(|a, b| a[2].total_cmp(&b[2])).unwrap();
    assert!((lowest[0] / 0.921 - 1.0).abs() < 2e-3 && (lowest[1] / 0.00776 - 1.0).abs() < 4e-3, "{lowest:?}");
    let plot = std::fs::read_to_string(&svg).unwrap();
    assert!(plot.starts_with("<svg") && plot.contains("R, resistance [ohm]") && plot.contains("log10 of nrmse"));
}

#[test]
fn commands_take_a_model_of_another_machine() {
    let folder = Folder::new();
    let model = folder.file("machine.toml", ok(&["model", "show", "pmsm"]));
    let log = folder.file("log.csv", "");
    let truth = "R=0.5,Ld=0.001,Lq=0.0015,psi=0.05,B=1e-4,J=2e-4";
    let input = ["--input", "vq=step:6@0.005,vd=step:1@0.02", "--duration", "0.04", "--period", "0.0001"];
    let simulate = ["-q", "simulate", "--model", &model, "--parameters", truth, "--noise", "40dB", "--out", &log];
    ok(&[&simulate[..], &input].concat());
    let found = json(&["identify", &log, "--model", &model, "--json"]);
    let value = |name: &str| found["parameters"][name]["value"].as_f64().unwrap();
    let error = |name: &str| found["parameters"][name]["std_error"].as_f64().unwrap();
    for (name, truth) in [("R", 0.5), ("Ld", 1e-3), ("Lq", 1.5e-3), ("psi", 0.05), ("J", 2e-4)] {
        assert!((value(name) - truth).abs() < 5.0 * error(name), "{name}: {} ± {}", value(name), error(name));
    }
    assert_eq!(found["device"]["kind"], "cpu");
    // From the measured initial states the cost of the estimates as a candidate is that of the identification, up to its finer steps;
    // with estimated ones that of the identification is lower.
    let measured = json(&["identify", &log, "--model", &model, "--initial", "measured", "--json"]);
    assert!(found["cost"].as_f64().unwrap() < measured["cost"].as_f64().unwrap());
    let names = ["psi", "R", "Ld", "Lq", "B", "J"];
    let row = names.map(|name| measured["parameters"][name]["value"].as_f64().unwrap().to_string()).join(",");
    let file = folder.file("c.csv", format!("{}\n{row}\n", names.join(",")));
    let evaluate = ["-q", "evaluate", &log, "--model", &model];
    let out = ok(&[&evaluate[..], &["--candidates", &file]].concat());
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!((lines.len(), lines[0]), (2, "R,Ld,Lq,psi,B,J,cost"));
    let cost: f64 = lines[1].rsplit(',').next().unwrap().parse().unwrap();
    assert!((cost / measured["cost"].as_f64().unwrap() - 1.0).abs() < 1e-2, "{cost} {}", measured["cost"]);
    // Samples lie within the bounds; those of logarithmic parameters are even in the logarithm.
    let sample = ["--sample", "lhs:200", "--bounds", "R=0.1:10", "--fix", "B=1e-4"];
    let document = json(&[&evaluate[..], &sample, &["--json", "--top", "200"]].concat());
    let best = document["best"].as_array().unwrap();
    let resistance: Vec<f64> = best.iter().map(|of| of["parameters"]["R"].as_f64().unwrap()).collect();
    assert_eq!(resistance.iter().filter(|r| **r < 1.0).count(), 100);
    assert!(resistance.iter().all(|r| (0.1..=10.0).contains(r)) && best[0]["parameters"]["B"].is_null());
    fails(&[&evaluate[..], &["--candidates", &file, "--fix", "K=1"]].concat(), 2, "is not a parameter of the model");
    let inspected = json(&["inspect", &log, "--model", &model, "--json"]);
    let inspected = &inspected["records"][0];
    assert_eq!(
        (&inspected["signals"]["vq"]["max"], &inspected["signals"]["w"]["unit"]),
        (&6.0.into(), &"rad/s".into())
    );
    let relative = inspected["identifiability"]["relative_std_error"]["R"].as_f64().unwrap();
    assert!((relative / (error("R") / value("R")) - 1.0).abs() < 1e-6);
    assert_eq!(inspected["identifiability"]["identifies"], true);
    let shown = ok(&["inspect", &log, "--model", &model]);
    assert!(shown.contains("identifies") && shown.contains("Ld ±") && shown.contains("noise σ"), "{shown}");
    // Wrong samples are named, and the next step of the result excludes all of them.
    let mut lines: Vec<String> = std::fs::read_to_string(&log).unwrap().lines().map(str::to_owned).collect();
    for n in [200, 201, 333] {
        let mut cells: Vec<&str> = lines[n].split(',').collect();
        cells[4] = "50";
        lines[n] = cells.join(",");
    }
    assert!(lines[0].split(',').nth(4).unwrap().starts_with("id"), "{}", lines[0]);
    let spoilt = folder.file("spoilt.csv", lines.join("\n"));
    let trust = &json(&["identify", &spoilt, "--model", &model, "--json"])["trust"];
    assert!(trust["level"] != "good" && trust["reasons"].to_string().contains("3 samples of id are far"), "{trust}");
    let next = trust["next"].as_str().unwrap();
    let mask = next.split_once("--mask ").unwrap().1.trim_end_matches('.').trim_matches('\'');
    let mended = json(&["identify", &spoilt, "--model", &model, "--mask", mask, "--json"]);
    assert_eq!(mended["trust"]["level"], "good", "{mask}: {}", mended["trust"]);
    assert!(ok(&["inspect", &spoilt, "--model", &model]).contains("suspect: 3 samples of id are far from the model"));
    assert!(ok(&["model", "check", &model, "--wgsl"]).contains("alias Scalar = f64;"));
    assert!(ok(&["model", "check", "two-mass", "--wgsl=f32"]).contains("alias Scalar = f32;"));
    fails(&["model", "check", &model, "--wgsl=f16"], 2, "f16");
    fails(&["identify", &log, "--model", &model, "--precision", "f32"], 2, "f32 is available on GPUs only");
}

#[test]
fn a_model_is_drawn_mapped_inspected_and_measured() {
    let folder = Folder::new();
    let (log, model) = (folder.file("log.csv", ""), "pmsm");
    let simulate =
        ["-q", "simulate", "--model", model, "--parameters", "R=0.5,Ld=1e-3,Lq=1.5e-3,psi=0.05,B=1e-4,J=2e-4"];
    let input = ["--input", "vq=step:6@0.005,vd=step:1@0.02", "--duration", "0.04", "--period", "0.0001"];
    ok(&[&simulate[..], &input, &["--noise", "40dB", "--out", &log]].concat());
    let svg = folder.path("fit.svg");
    let found = json(&["identify", &log, "--model", model, "--json", "--svg", &svg]);
    let drawn = std::fs::read_to_string(&svg).unwrap();
    assert!(drawn.starts_with("<svg") && drawn.contains("iq [A]") && drawn.contains("residual of w [rad/s]"));
    assert!(ok(&["identify", &log, "--model", model, "--svg", "-"]).starts_with("<svg"));
    fails(&["identify", &log, "--model", model, "--svg", "-", "--json"], 2, "--svg -");
    // The map is lowest near the optimum, within three of the sixteen standard errors that it spans: the criterion has the noise of the
    // signals in place of that of the residuals.
    let evaluate = ["-q", "evaluate", &log, "--model", model, "--slice", "R,psi", "--scale", "noise"];
    let map = ok(&[&evaluate[..], &["--sample", "grid:33"]].concat());
    let rows: Vec<Vec<f64>> =
        map.lines().skip(1).map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    assert_eq!((map.lines().next(), rows.len()), (Some("R,psi,cost"), 33 * 33));
    let lowest = rows.iter().min_by(|a, b| a[2].total_cmp(&b[2])).unwrap();
    for (name, place) in [("R", 0), ("psi", 1)] {
        let of = |key: &str| found["parameters"][name][key].as_f64().unwrap();
        assert!((lowest[place] - of("value")).abs() < 3.0 * of("std_error"), "{name}: {lowest:?}");
    }
    let heat = folder.path("map.svg");
    let told = ok(&[&evaluate[..], &["--sample", "grid:9", "--svg", &heat]].concat());
    assert!(told.contains("9 × 9 points") && told.contains("psi "), "{told}");
    assert!(std::fs::read_to_string(&heat).unwrap().contains("R, Resistance of a phase [ohm]"));
    fails(&["evaluate", &log, "--model", model, "--slice", "R,psj"], 2, "Did you mean psi?");
    let out = folder.path("inspected");
    ok(&["-q", "inspect", &log, "--model", model, "--out", &out]);
    let page = std::fs::read_to_string(format!("{out}/report.html")).unwrap();
    assert!(page.contains("Inspection of log.csv") && page.contains("Standard errors") && page.contains("vq [V]"));
    let inspected: Value =
        serde_json::from_str(&std::fs::read_to_string(format!("{out}/result.json")).unwrap()).unwrap();
    assert_eq!(inspected["records"][0]["identifiability"]["identifies"], true);
    let bench = ["bench", "--model", "two-mass", "--populations", "1,300", "--samples", "100", "--seconds", "0.3"];
    let measured = json(&[&bench[..], &["--no-gpu", "--no-keep", "--json"]].concat());
    let rates = measured["measurements"].as_array().unwrap();
    assert!(
        rates.len() >= 2 && rates.iter().any(|m| m["candidate_steps_per_second"].as_f64() > Some(0.0)),
        "{measured}"
    );
    // A step of two masses with a backlash has far more operations than one of the linear motor, which has eight.
    assert!(measured["contenders"][0]["operations_per_candidate_step"].as_f64() > Some(50.0));
    fails(&["bench", "--model", "two-mass", "--plain"], 2, "--plain is a form of the DC motor");
}

#[test]
#[cfg(feature = "parquet")]
fn evaluate_reads_parquet_as_it_reads_csv() {
    let golden = |name: &str| format!("{}/tests/golden/candidates{name}", env!("CARGO_MANIFEST_DIR"));
    let evaluate = |file: &str| ok(&["-q", "evaluate", EXAMPLE, "--candidates", file]);
    let expected = evaluate(&golden(".csv"));
    assert_eq!(expected.lines().count(), 26);
    assert_eq!(evaluate(&golden("-snappy.parquet")), expected);
    assert_eq!(evaluate(&golden("-zstd.parquet")), expected);
    // R and K in single precision, the columns in another order.
    let floats = evaluate(&golden("-float.parquet"));
    for (ours, theirs) in floats.lines().zip(expected.lines()).skip(1) {
        for (a, b) in ours.split(',').zip(theirs.split(',')) {
            let (a, b): (f64, f64) = (a.parse().unwrap(), b.parse().unwrap());
            assert!((a / b - 1.0).abs() < 1e-5, "{a} for {b}");
        }
    }
    let null = golden("-null.parquet");
    fails(&["evaluate", EXAMPLE, "--top", "1", "--candidates", &null], 3, "row 17, column K: null or not finite");
    fails(&["evaluate", EXAMPLE, "--candidates", &golden("-text.parquet")], 3, "column B: is BYTE_ARRAY");
    // Damaged files: truncated, or with inverted bytes.
    let (folder, whole) = (Folder::new(), std::fs::read(golden("-snappy.parquet")).unwrap());
    for cut in (0..whole.len()).step_by(571) {
        fails(&["evaluate", EXAMPLE, "--candidates", &folder.file("cut.parquet", &whole[..cut])], 3, "Parquet");
    }
    for at in (0..whole.len()).step_by(67) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x80;
        let output = run(&["evaluate", EXAMPLE, "--candidates", &folder.file("turned.parquet", bytes)]);
        assert!(matches!(output.status.code(), Some(0 | 3)), "{at}: {}", text(&output.stderr));
        assert!(!text(&output.stderr).contains("panicked"));
    }
}

#[test]
fn bench_describes_its_measurements() {
    let args = ["bench", "--seconds", "1", "--populations", "1,50", "--samples", "10,20", "--no-gpu", "--json"];
    let document = json(&args);
    let contenders = document["contenders"].as_array().unwrap();
    assert!(contenders.len() >= 2 && contenders.iter().all(|c| c["kind"] == "cpu"), "{contenders:?}");
    assert!(contenders[0]["name"].as_str().unwrap().contains("scalar f64, 1 thread"));
    let measurements = document["measurements"].as_array().unwrap();
    assert_eq!(measurements.len(), 4 * contenders.len());
    for m in measurements {
        let steps = m["samples"].as_f64().unwrap() * m["population"].as_f64().unwrap();
        let rate = steps / m["seconds"].as_f64().unwrap();
        assert!((m["candidate_steps_per_second"].as_f64().unwrap() / rate - 1.0).abs() < 1e-12);
        assert!(m["rounds"].as_u64().unwrap() >= 1);
        if m["rounds"].as_u64().unwrap() >= 6 {
            let interval = [0, 1].map(|n| m["interval95"][n].as_f64().unwrap());
            assert!((interval[0]..=interval[1]).contains(&m["seconds"].as_f64().unwrap()));
        } else {
            assert!(m["interval95"].is_null() && m["spread"].is_null(), "{m}");
        }
    }
    let control = &document["control"];
    let of = |evaluator: &'static str| contenders.iter().filter(move |c| c["evaluator"] == evaluator);
    assert_eq!(control["contender"], of("kernel").next_back().unwrap()["name"]);
    assert!(of("tables").count() > 0 && of("tables").all(|c| c["operations_per_candidate_step"].is_null()));
    let compared: Vec<&Value> = document["crossover"].as_array().unwrap().iter().map(|c| &c["contender"]).collect();
    assert_eq!(compared, of("tables").map(|c| &c["name"]).collect::<Vec<_>>());
    assert!(control["apart"].as_u64().unwrap() <= control["cases"].as_u64().unwrap());
    let folder = Folder::new();
    let plot = folder.path("rates.svg");
    ok(&["bench", "--seconds", "0.2", "--populations", "1,10", "--samples", "10,20", "--no-gpu", "--svg", &plot]);
    let plot = std::fs::read_to_string(folder.path("rates-20.svg")).unwrap();
    assert!(plot.contains("20 samples, end to end") && plot.contains("scalar f64, 1 thread"));
    let table = ok(&["bench", "--seconds", "0.2", "--populations", "10", "--samples", "10", "--no-gpu"]);
    assert!(table.contains("10 samples") && table.contains("No GPU was measured"), "{table}");
    for args in [
        ["--populations", "0"],
        ["--populations", "18446744073709551615"],
        ["--populations", "10000000000"],
        ["--samples", "1"],
        ["--samples", "300,100000000000"],
        ["--seconds", "0"],
        ["--seconds", "nan"],
        ["--threads", "0"],
    ] {
        fails(&[&["bench"][..], &args].concat(), 2, args[0]);
    }
    // Measurements are printed even if the plot cannot be written.
    let nowhere = folder.path("nowhere/rates.svg");
    let bench = ["bench", "--seconds", "0.2", "--populations", "10", "--samples", "10", "--no-gpu", "--svg", &nowhere];
    let output = run(&bench);
    assert_eq!(output.status.code(), Some(3));
    assert!(text(&output.stdout).contains("10 samples"), "{}", text(&output.stdout));
}

#[test]
fn bench_stores_a_profile_and_auto_reads_it() {
    let folder = Folder::new();
    let with_cache = |args: &[&str]| {
        let output = motorfit().args(args).env("XDG_CACHE_HOME", folder.path("cache")).output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stderr)
    };
    let kept = folder.path("cache/motorfit/bench.json");
    let bench = ["bench", "--seconds", "0.5", "--populations", "1,70,10000", "--samples", "10"];
    with_cache(&[&bench[..], &["--no-gpu"]].concat());
    with_cache(&[&bench[..], &["--no-keep"]].concat());
    with_cache(&["bench", "--seconds", "0.5", "--populations", "1,70", "--samples", "10"]);
    assert!(!Path::new(&kept).exists(), "not without adapters, not where it is declined, not from small populations");
    let said = with_cache(&bench);
    if Path::new(&kept).exists() {
        assert!(said.contains(&kept), "{said}");
        let file: Value = serde_json::from_str(&std::fs::read_to_string(&kept).unwrap()).unwrap();
        assert_eq!(file["motorfit"], env!("CARGO_PKG_VERSION"));
        assert_eq!(file["pace"]["points"].as_array().unwrap().len(), 3);
        for adapter in file["adapters"].as_array().unwrap() {
            assert!(adapter["opening_s"].as_f64().unwrap() > 0.0, "{adapter}");
            assert!(["name", "kind", "backend", "driver"].iter().all(|key| adapter[key].is_string()), "{adapter}");
        }
    } else {
        assert!(std::env::var_os("MOTORFIT_NO_SKIP").is_none(), "no adapter: {said}");
    }
    let identify = ["identify", EXAMPLE, "--method", "jaya", "--population", "9", "--generations", "3"];
    assert!(!with_cache(&identify).contains("bench.json"));
    std::fs::create_dir_all(folder.path("cache/motorfit")).unwrap();
    for broken in ["{", "[]", "{\"motorfit\": 1}", ""] {
        std::fs::write(&kept, broken).unwrap();
        assert!(with_cache(&identify).contains("bench.json"), "{broken}: it is said, and does no harm");
        assert!(!with_cache(&[&identify[..], &["--device", "cpu"]].concat()).contains("bench.json"));
    }
}

#[test]
fn simulate_writes_what_identify_reads() {
    let folder = Folder::new();
    let file = folder.path("m2.csv");
    // The example in the repository is the output of this command, byte for byte on this kind of machine, and up to
    // the last digits of a logarithm on others.
    ok(&[
        "simulate",
        "--parameters",
        M2,
        "--input",
        "step:10.5@1",
        "--duration",
        "3",
        "--period",
        "0.001",
        "--noise",
        "40dB",
        "--seed",
        "1",
        "--out",
        &file,
    ]);
    let (ours, kept) = (std::fs::read_to_string(&file).unwrap(), std::fs::read_to_string(EXAMPLE).unwrap());
    assert_eq!(ours.lines().count(), 3002);
    for (ours, kept) in ours.lines().skip(1).zip(kept.lines().skip(1)) {
        for (a, b) in ours.split(',').zip(kept.split(',')) {
            let (a, b): (f64, f64) = (a.parse().unwrap(), b.parse().unwrap());
            assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{ours} {kept}");
        }
    }
    // The output can be the input of another simulation, with load torque and other units.
    let input = folder.file("in.csv", "t[ms],U (V),load_torque_mNm\n0,0,0\n1,5,0\n2,5,10\n3,5,10\n4,5,10\n");
    let out = ok(&["simulate", "--parameters", "m2", "--input", &input, "--out", "-"]);
    assert!(out.starts_with("time_s,voltage_V,current_A,speed_rad_s,load_torque_Nm\n"), "{out}");
    assert_eq!(out.lines().count(), 6);
    let clean =
        ok(&["simulate", "-q", "--parameters", "m2", "--input", "step:10.5@1", "--noise", "i=0,w=0", "--out", "-"]);
    assert_eq!(clean, ok(&["simulate", "-q", "--parameters", "m2", "--input", "step:10.5@1", "--out", "-"]));
}

#[test]
fn inspect_devices_completions_man() {
    let document = json(&["inspect", EXAMPLE, "--json", "--settling-band", "5"]);
    let record = &document["records"][0];
    assert_eq!(record["columns"][2]["heading"], "current_A");
    let noise = record["signals"]["current"]["noise_sigma"].as_f64().unwrap();
    assert!((noise / 0.012_015_7 - 1.0).abs() < 0.1, "1.2 A rms at 40 dB: {noise}");
    assert_eq!(record["signals"]["voltage"]["max"], 10.5);
    let text = ok(&["inspect", EXAMPLE]);
    assert!(text.contains("3001 samples every 1.000 ms") && text.contains("peak 7.8"), "{text}");
    assert!(text.contains("identifies: R ± 0.050 %"), "{text}");
    let error = record["identifiability"]["relative_std_error"]["K"].as_f64().unwrap();
    assert!((error / 1.94e-4 - 1.0).abs() < 0.05, "the Cramér–Rao bound at 40 dB: {error}");
    assert_eq!(json(&["devices", "--json"])["devices"][0]["kind"], "cpu");
    assert!(ok(&["devices"]).contains("f64"));
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        assert!(ok(&["completions", shell]).contains("identify"));
    }
    assert!(ok(&["man"]).contains(".TH motorfit"));
    let folder = tempfile::tempdir().unwrap();
    let man = folder.path().join("man1").to_str().unwrap().to_owned();
    ok(&["man", &man]);
    let examples = ["identify log.csv", "identify log.csv \\-\\-columns", "sweep run night"];
    for (page, example) in ["motorfit", "motorfit-identify", "motorfit-sweep-run"].into_iter().zip(examples) {
        let page = std::fs::read_to_string(format!("{man}/{page}.1")).unwrap();
        let (_, section) = page.split_once(".SH EXAMPLES").unwrap();
        assert!(page.contains(".TH motorfit") && section.contains(&format!("motorfit {example}")), "{page}");
    }
    // The version alone is answered before arguments are parsed; with another flag the parser answers.
    let version = format!("motorfit {}\n", env!("CARGO_PKG_VERSION"));
    for asked in [&["--version"][..], &["-V"], &["-q", "--version"], &["--no-progress", "-V"]] {
        assert_eq!(ok(asked), version, "{asked:?}");
    }
    assert!(ok(&["--help"]).contains("identify") && ok(&["identify", "--help"]).contains("--criterion"));
}

#[test]
fn output_goes_where_it_belongs() {
    let quiet = run(&["-q", "identify", EXAMPLE, "--bounds", "R=0.1:0.5"]);
    assert!(quiet.stderr.is_empty() && !quiet.stdout.is_empty());
    let plain = run(&["identify", EXAMPLE]);
    assert!(plain.stderr.is_empty(), "no progress where stderr is no terminal: {}", text(&plain.stderr));
    assert!(!plain.stdout.contains(&0x1b), "no colour into a pipe");
    assert!(run(&["--color", "always", "identify", EXAMPLE]).stdout.contains(&0x1b));
    let no_color =
        motorfit().env("NO_COLOR", "1").env("CLICOLOR_FORCE", "0").args(["identify", EXAMPLE]).output().unwrap();
    assert!(!no_color.stdout.contains(&0x1b));
    let progress = run(&["identify", EXAMPLE, "--method", "gwo", "--progress", "json", "--json"]);
    let lines = text(&progress.stderr);
    let last: Value = serde_json::from_str(lines.lines().last().unwrap()).unwrap();
    assert_eq!((&last["generation"], &last["generations"]), (&100.into(), &100.into()));
    serde_json::from_slice::<Value>(&progress.stdout).unwrap();
    assert!(run(&["identify", EXAMPLE, "--method", "gwo", "--progress", "json", "--no-progress"]).stderr.is_empty());
}

#[test]
#[cfg(unix)]
fn a_broken_pipe_is_success_and_a_full_device_is_not() {
    let mut child = motorfit().args(["identify", EXAMPLE, "--json"]).stdout(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    if let Ok(full) = std::fs::OpenOptions::new().write(true).open("/dev/full") {
        let output = motorfit().args(["identify", EXAMPLE]).stdout(full).stderr(Stdio::piped()).output().unwrap();
        assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    }
}

#[test]
#[cfg(unix)]
fn an_interrupt_prints_the_best_candidate() {
    let document = interrupted(&["--generations", "1000000000"]);
    assert_eq!(document["stop"], "interrupted");
    assert!(document["parameters"]["R"]["value"].is_f64() && document["evaluations"].as_u64().unwrap() >= 100);
}

#[test]
#[cfg(unix)]
fn an_interrupt_ends_a_generation_too() {
    let document = interrupted(&["--population", "5000000", "--generations", "2"]);
    let evaluations = document["evaluations"].as_u64().unwrap();
    assert!((1..5_000_000).contains(&evaluations), "{evaluations}");
}

/// Returns the document of a search that is interrupted at its first line of progress, by SIGTERM, which background jobs do
/// not ignore.
#[cfg(unix)]
fn interrupted(args: &[&str]) -> Value {
    let mut command = motorfit();
    command.args(["identify", EXAMPLE, "--method", "gwo", "--json", "--progress", "json"]).args(args);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut stderr = std::io::BufReader::new(child.stderr.take().unwrap());
    // A driver may write lines of its own before.
    let mut line = String::new();
    while !line.starts_with("{\"generation\"") {
        line.clear();
        assert!(std::io::BufRead::read_line(&mut stderr, &mut line).unwrap() > 0, "no progress");
    }
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success());
    std::io::copy(&mut stderr, &mut std::io::sink()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(143));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn bad_recordings() {
    let folder = Folder::new();
    let head = "time_s,voltage_V,current_A,speed_rad_s\n";
    let rows = |row: &str| format!("{head}0,0,0,0\n{row}\n0.002,1,1,1\n0.003,1,1,1\n");
    let cases: [(&str, Vec<u8>, &str); 19] = [
        ("empty", Vec::new(), "is empty"),
        ("heading", head.into(), "found 0 rows"),
        ("one-row", format!("{head}0,0,0,0\n").into(), "found 1 row"),
        ("missing", "time_s,current_A\n0,0\n1,1\n".into(), "no column for voltage_V or speed_rad_s"),
        ("text", rows("0.001,1,abc,1").into(), "line 3, column current_A: found \"abc\""),
        ("nan", rows("0.001,nan,1,1").into(), "line 3, column voltage_V"),
        ("inf", rows("0.001,1,1,inf").into(), "line 3, column speed_rad_s"),
        ("back", rows("-0.001,1,1,1").into(), "line 3: time goes back"),
        ("repeated", rows("0,1,1,1").into(), "line 3: time is repeated"),
        ("gap", format!("{}0.009,1,1,1\n", rows("0.001,1,1,1")).into(), "line 6: gap in time"),
        ("binary", b"\x7fELF\x02\x01\0\0\0\0".to_vec(), "expected text"),
        ("utf-16", b"\xff\xfet\0i\0m\0e\0".to_vec(), "UTF-16"),
        ("utf-16-bare", b"t\0i\0m\0e\0".to_vec(), "UTF-16"),
        ("1e308", rows("0.001,1e308,1,1").into(), "line 3, column voltage_V"),
        ("1e308-time", rows("1e308,1,1,1").into(), "time goes back"),
        ("1e400", rows("0.001,1,1e400,1").into(), "too large"),
        ("cut", format!("{}0.004,1", rows("0.001,1,1,1")).into(), "line 6: the last line is cut off"),
        ("escape", rows("0.001,\u{9b}31m,1,1").into(), "found \"\\u{9b}31m\""),
        ("long", [head.as_bytes(), &vec![b'1'; 100_000_000]].concat(), "line 2: is "),
    ];
    for (name, content, part) in cases {
        let file = folder.file(name, content);
        for command in ["identify", "inspect"] {
            let err = fails(&[command, &file], 3, part);
            assert!(err.contains(&format!("{name}: ")) || err.contains(&format!("{name}, ")), "no file in {err}");
        }
    }
    fails(&["identify", folder.0.path().to_str().unwrap()], 3, "is a folder");
    fails(&["identify", &folder.path("nowhere.csv")], 3, "cannot be read");
    fails(&["identify", &folder.path("no\u{1b}[31mwhere")], 3, "no\\u{1b}[31mwhere");
    let still = rows("0.001,0,0,0").replace("1,1,1\n", "0,0,0\n");
    fails(&["identify", &folder.file("still", still)], 4, "is constant");
    fails(
        &["simulate", "--parameters", "m2", "--input", &folder.file("bad", "t,u\n0,0\n0,1\n"), "--out", "-"],
        3,
        "line 3",
    );
}

#[test]
#[cfg(unix)]
fn a_file_without_permission() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = Folder::new();
    let file = folder.file("locked.csv", std::fs::read(EXAMPLE).unwrap());
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o000)).unwrap();
    let output = if std::fs::File::open(&file).is_err() {
        run(&["identify", &file])
    } else {
        // The superuser can read every file, so a copy of the program is run as the user nobody.
        let program = folder.path("motorfit");
        std::fs::copy(assert_cmd::cargo::cargo_bin!("motorfit"), &program).unwrap();
        std::fs::set_permissions(folder.0.path(), std::fs::Permissions::from_mode(0o755)).unwrap();
        let ids = ["--reuid=65534", "--regid=65534", "--clear-groups"];
        Command::new("setpriv").args(ids).args([&program, "identify", &file]).output().unwrap()
    };
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("denied") && text(&output.stderr).contains("help:"));
}

#[test]
fn a_suspicious_period_is_pointed_out() {
    let folder = Folder::new();
    let rows: String = (0..50).map(|n| format!("{n},{},{},{}\n", u8::from(n > 5), f64::from(n) * 0.1, n)).collect();
    let file = folder.file("ms.csv", format!("time_s,voltage_V,current_A,speed_rad_s\n{rows}"));
    let output = run(&["inspect", &file]);
    assert!(text(&output.stderr).contains("milliseconds"), "{}", text(&output.stderr));
    assert_eq!(json(&["inspect", &file, "--json"])["records"][0]["warnings"][0]["code"], "units");
    let named = ok(&["inspect", &file, "--columns", "time=time_s:ms"]);
    assert!(named.contains("every 1.000 ms"), "{named}");
}

#[test]
fn unidentifiable_recordings_are_errors() {
    let folder = Folder::new();
    let head = "time_s,voltage_V,current_A,speed_rad_s\n";
    let rows = |voltage: f64| -> String {
        (0..200)
            .map(|n| format!("{},{voltage},{},{}\n", 0.001 * f64::from(n), (0.5 * f64::from(n)).sin(), n % 7))
            .collect()
    };
    let still = folder.file("still.csv", format!("{head}{}", rows(0.0)));
    fails(&["identify", &still, "--initial", "zero"], 4, "nothing drives the motor");
    let short = folder.file("short.csv", format!("{head}0,1,0,0\n0.001,1,0.1,0.1\n"));
    fails(&["identify", &short], 4, "4 measured values under voltage for 5 free parameters");
    fails(&["identify", EXAMPLE, "--criterion", "itae", "--time-origin", "100"], 4, "no sample has weight");
    fails(&["identify", &folder.file("far.csv", format!("{head}-1e308,1,0,0\n1e308,1,1,1\n"))], 3, "are out of range");
    let nonsense = folder.file("nonsense.csv", format!("{head}{}", rows(5.0)));
    fails(&["identify", &nonsense], 4, "the recordings");
    let document = json(&["identify", &nonsense, "--json", "--method", "gwo", "--polish", "none"]);
    assert!(document["warnings"].as_array().unwrap().iter().any(|w| w["code"] == "poor_fit"), "{document}");
}

#[test]
fn missing_channels_and_units_are_pointed_out() {
    let folder = Folder::new();
    let text = std::fs::read_to_string(EXAMPLE).unwrap();
    let without = |column: usize| -> String {
        let cells = |line: &str| {
            line.split(',').enumerate().filter(|(n, _)| *n != column).map(|(_, c)| c).collect::<Vec<_>>().join(",")
        };
        text.lines().map(|line| cells(line) + "\n").collect()
    };
    let codes = |args: &[&str]| -> Vec<String> {
        let search = ["identify", "--json", "--generations", "5", "--polish", "none"];
        let all: Vec<&str> = search.iter().chain(args).copied().collect();
        json(&all)["warnings"].as_array().unwrap().iter().map(|w| w["code"].as_str().unwrap().to_owned()).collect()
    };
    let (speed, current) = (folder.file("speed.csv", without(2)), folder.file("current.csv", without(3)));
    let missing = "channel_missing".to_owned();
    assert!(codes(&[&speed]).contains(&missing) && codes(&[&current, "--fix", "R=0.92"]).contains(&missing));
    assert!(!codes(&[&speed, "--fix", "R=0.92,K=0.0735"]).contains(&missing));
    assert!(!codes(&[&current, "--fix", "K=0.0735"]).contains(&missing));
    // Three or four combinations do not determine five parameters: the identifiable ones are given, the others reported.
    let told = |path: &str| {
        let document = json(&["identify", "--json", path]);
        let identified = |p: &&str| document["parameters"][*p]["identified"] == true;
        let symbols: Vec<&str> = ["R", "L", "K", "B", "J"].into_iter().filter(identified).collect();
        (symbols.join(" "), document["warnings"][0]["message"].as_str().unwrap().to_owned())
    };
    let (parameters, message) = told(&speed);
    assert!(
        parameters.is_empty() && message.contains("speed alone identifies three combinations"),
        "{parameters} {message}"
    );
    let (parameters, message) = told(&current);
    assert!(parameters == "R L" && message.contains("c·K, c²·B and c²·J fit equally well"), "{parameters} {message}");
    // One fixed constant is not enough.
    fails(&["identify", &speed, "--fix", "K=0.0735"], 4, "speed alone identifies three combinations");
    for args in [[&speed, "--fix", "R=0.921042,K=0.073472"], [&current, "--fix", "K=0.073472"]] {
        let document = json(&[&["identify", "--json"][..], &args[..]].concat());
        let j = &document["parameters"]["J"];
        let (value, error) = (j["value"].as_f64().unwrap(), j["std_error"].as_f64().unwrap());
        assert!((value - 0.000_136).abs() < 4.0 * error && error < 0.02 * value, "{args:?}: {value} ± {error}");
    }
    let bare =
        folder.file("bare.csv", text.replace("time_s,voltage_V,current_A,speed_rad_s", "t,u,i,omega").trim_end());
    let found = codes(&[&bare]);
    assert!(found.contains(&"unit_assumed".to_owned()) && found.contains(&"no_line_end".to_owned()), "{found:?}");
    let twice = ["identify", EXAMPLE, "--columns", "current=current_A,speed=current_A"];
    fails(&twice, 3, "named for two quantities");
    fails(&["identify", EXAMPLE, "--columns", "current=current_A:furlong"], 3, "--columns current=HEADING:UNIT");
}

#[test]
#[cfg(unix)]
fn simulate_writes_through_links_and_spares_protected_files() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = Folder::new();
    let target = folder.file("target.csv", "old");
    std::os::unix::fs::symlink(&target, folder.path("link.csv")).unwrap();
    let simulate = |out: &str| {
        run(&[
            "simulate",
            "--parameters",
            "m2",
            "--input",
            "step:5@0",
            "--duration",
            "1e-10",
            "--period",
            "1e-12",
            "--out",
            out,
        ])
    };
    assert!(simulate(&folder.path("link.csv")).status.success());
    assert!(std::fs::symlink_metadata(folder.path("link.csv")).unwrap().is_symlink());
    assert!(std::fs::read_to_string(&target).unwrap().starts_with("time_s"));
    ok(&["inspect", &target]);
    std::fs::set_permissions(&target, std::fs::Permissions::from_mode(0o444)).unwrap();
    assert_eq!(simulate(&target).status.code(), Some(3));
}

/// Without a driver, as on a machine without a GPU. The example is too small for `auto` to open one; its fallback after a
/// failure is tested in `device`.
#[test]
fn without_an_adapter_gpu_is_exit_5_and_auto_carries_on() {
    let bare = |device: &str| {
        let mut command = motorfit();
        command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent");
        command.args(["identify", EXAMPLE, "--json", "--device", device]).output().unwrap()
    };
    let auto = bare("auto");
    assert_eq!(serde_json::from_slice::<Value>(&auto.stdout).unwrap()["device"]["kind"], "cpu");
    if cfg!(all(feature = "gpu", target_os = "linux")) {
        let gpu = bare("gpu");
        let document: Value = serde_json::from_slice(&gpu.stdout).unwrap();
        assert_eq!((gpu.status.code(), &document["error"]["kind"]), (Some(5), &"device".into()));
        assert!(text(&gpu.stderr).contains("no GPU adapter") && text(&gpu.stderr).contains("help:"));
    }
    fails(&["identify", EXAMPLE, "--device", "gpu:99"], 5, "adapter");
    fails(&["identify", EXAMPLE, "--device", "gpu:no such thing"], 5, "adapter");
}

#[test]
fn extensions_alone_are_estimated() {
    let folder = Folder::new();
    let path = folder.path("loaded.csv");
    let motor = format!("{M2},TL=0.02,Tc=0.01");
    ok(&[
        "simulate",
        "--parameters",
        &motor,
        "--input",
        "step:8@0.2",
        "--duration",
        "1",
        "--noise",
        "40dB",
        "--out",
        &path,
    ]);
    let found = json(&["identify", &path, "--fix", M2, "--with", "load,coulomb", "--json"]);
    for (symbol, truth) in [("TL", 0.02), ("Tc", 0.01)] {
        let [value, error] = ["value", "std_error"].map(|part| found["parameters"][symbol][part].as_f64().unwrap());
        assert!(
            (value - truth).abs() < 4.0 * error && error < 0.1 * truth,
            "{symbol}: {}",
            found["parameters"][symbol]
        );
    }
    for symbol in ["R", "L", "K", "B", "J"] {
        assert_eq!(found["parameters"][symbol]["fixed"], true, "{symbol}");
    }
    // A parameter of an extension that `auto` does not select may be named.
    json(&["identify", EXAMPLE, "--with", "auto", "--per-recording", "TL", "--json"]);
}

#[test]
fn wrong_usage() {
    let identify = |args: &[&str], part: &str| {
        let all: Vec<&str> = ["identify", EXAMPLE].iter().chain(args).copied().collect();
        fails(&all, 2, part)
    };
    identify(&["--bounds", "R=1:0.1"], "reversed");
    identify(&["--bounds", "R=-1:1"], "not positive");
    identify(&["--bounds", "R=0:1"], "not positive");
    identify(&["--bounds", "R=0.5:0.5"], "reversed or equal");
    identify(&["--bounds", "R=1"], "not MIN:MAX");
    identify(&["--bounds", "Q=1:2"], "not a parameter");
    identify(&["--bounds", "R=nan:1"], "--bounds");
    identify(&["--fix", "R=-1"], "positive");
    identify(&["--fix", "R=1,R=2"], "twice");
    identify(&["--fix", M2], "nothing to estimate");
    identify(&["--fix", M2, "--with", "auto"], "Name the extensions");
    identify(&["--fix", &format!("{M2},TL=0.01"), "--with", "load"], "nothing to estimate");
    identify(&["--per-recording", "TL"], "--per-recording: TL is not in the model");
    identify(&["--per-recording", "TL,t0", "--with", "load"], "--per-recording: t0 is not in the model");
    identify(&["--per-recording", "R", "--fix", "R=0.92"], "--per-recording: R is fixed");
    identify(&["--population", "0"], "population is 0");
    identify(&["--generations", "0"], "generations is 0");
    identify(&["--population", "99999999999999999999"], "--population");
    identify(&["--population", "18446744073709551615"], "does not fit");
    identify(&["--population", "1000000", "--generations", "18446744073709551615"], "overflows");
    identify(&["--threads", "0"], "--threads is 0");
    identify(&["--seed", "-1"], "--seed");
    identify(&["--method", "gow"], "a similar value exists: 'gwo'");
    identify(&["--criterion", "nmrse"], "a similar value exists: 'nrmse'");
    identify(&["--metod", "gwo"], "--method");
    identify(&["--set", "mutation=0.1"], "not a setting of this method");
    identify(&["--method", "ga", "--set", "mutation=2"], "mutation");
    identify(&["--noise", "loud"], "--noise");
    identify(&["--columns", "power=x"], "not a quantity");
    identify(&["--device", "tpu"], "no device");
    identify(&["--noise", "40dB"], "without --scale noise");
    identify(&["--time-origin", "1"], "without --criterion itse or itae");
    identify(&["--fix", "R=1", "--bounds", "R=0.1:1"], "both bounded and fixed");
    identify(&["--bounds", "R=0.1:1,R=0.2:1"], "twice");
    identify(&["--threads", "100000"], "--threads is 100000");
    identify(&["--population", "150000000"], "does not fit");
    identify(&["--method", "\u{9b}31m"], "\\u{9b}");
    identify(&["--method", "\u{1b}[31m"], "invalid value");
    identify(&["--with", "coulom"], "did you mean coulomb?");
    identify(&["--with", "auto,load"], "other names are given too");
    identify(&["--with", "coulomb", "--bounds", "Tc=-1:1"], "not zero or positive");
    identify(&["--fix", "td=-0.1"], "less than minus one sampling period");
    identify(&["--per-recording", "Q"], "not a parameter");
    fails(&["identfy", EXAMPLE], 2, "identify");
    fails(&["identify"], 2, "RECORD");
    fails(&[], 2, "Usage");
    identify(&["--precision", "f32", "--device", "cpu"], "f64 only");
    fails(&["inspect", EXAMPLE, "--settling-band", "0"], 2, "--settling-band");
}

#[test]
fn simulate_rejects_wrong_arguments() {
    let folder = Folder::new();
    let simulate = |args: &[&str], code: i32, part: &str| {
        let mut all = vec!["simulate"];
        for (flag, value) in [("--parameters", M2), ("--input", "step:10.5@1"), ("--out", "-")] {
            if !args.contains(&flag) {
                all.extend([flag, value]);
            }
        }
        all.extend(args);
        fails(&all, code, part);
    };
    simulate(&["--parameters", "R=1,L=1"], 2, "lacks K");
    simulate(&["--parameters", "R=0,L=1"], 2, "positive");
    simulate(&["--input", "step:10"], 2, "step:VOLTS@SECONDS");
    simulate(&["--input", "stp:6@0.5"], 2, "neither step:VOLTS@SECONDS nor a file");
    simulate(&["--input", "step:x@1"], 2, "found \"x\"");
    simulate(&["--input", &folder.path("nowhere.csv")], 3, "cannot be read");
    simulate(&["--input", "step:10.5@0", "--duration", "0"], 2, "positive duration");
    simulate(&["--duration", "0.5"], 2, "after the end");
    simulate(&["--period", "nan"], 2, "positive period");
    simulate(&["--duration", "1e300"], 2, "steps");
    simulate(&["--noise", "i=-1"], 2, "negative");
    simulate(&["--out", folder.0.path().to_str().unwrap()], 3, "is a folder");
    simulate(&["--out", &folder.path("no/such/folder.csv")], 3, "cannot be written");
    if Path::new("/dev/full").exists() {
        simulate(&["--out", "/dev/full"], 3, "cannot be written");
    }
    let left: Vec<PathBuf> = std::fs::read_dir(folder.0.path()).unwrap().map(|e| e.unwrap().path()).collect();
    assert!(left.is_empty(), "a failed run leaves nothing behind: {left:?}");
}

#[test]
fn each_recording_has_a_line_and_shared_notes_are_printed_once() {
    let folder = Folder::new();
    let noted = ["1", "2", "3"].map(|seed| {
        let path = folder.path(&format!("r{seed}.csv"));
        simulated(&path, M2, "step:10.5@1", ["3", seed]);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text + "9,nan,nan,nan\n").unwrap();
        path
    });
    let output =
        text(&run(&["identify", &noted[0], &noted[1], "--validate", &noted[2], "--validate", &noted[2]]).stdout);
    let fits: Vec<&str> = output.lines().filter(|line| line.contains(".csv: current ")).collect();
    assert_eq!(fits.len(), 4, "{output}");
    assert!(fits.iter().all(|line| line.contains("%, speed ")), "{fits:?}");
    assert_eq!(output.matches("of nan left out").count(), 1, "{output}");
    assert!(output.contains("  both: "), "{output}");
}

#[test]
fn a_missing_channel_is_one_sentence() {
    let folder = Folder::new();
    let path = folder.path("speed.csv");
    let whole = std::fs::read_to_string(EXAMPLE).unwrap();
    let without: String = whole
        .lines()
        .map(|line| {
            line.split(',').enumerate().filter(|(n, _)| *n != 2).map(|(_, c)| c).collect::<Vec<_>>().join(",") + "\n"
        })
        .collect();
    std::fs::write(&path, without).unwrap();
    let said = text(&run(&["inspect", &path]).stdout);
    assert!(said.contains("for example. Identifiable: ") && !said.contains(".."), "{said}");
    // The error names the file with two samples.
    let two = folder.file("two.csv", "time_s,voltage_V,current_A,speed_rad_s\n0,0,0,0\n0.1,6,1,2\n");
    fails(&["identify", &two], 4, "two.csv: only 2 measured values");
}

#[test]
fn help_begins_with_examples_and_its_first_page_fits_a_screen() {
    for command in ["identify", "evaluate", "compare", "sweep", "simulate", "inspect", "bench", "devices"] {
        let help = ok(&[command, "--help"]);
        let examples = help.find("Examples:").unwrap();
        assert!(examples < help.find("Usage:").unwrap() && examples < 400, "{help}");
        assert!(help[examples..].lines().nth(1).unwrap().starts_with(&format!("  motorfit {command}")), "{help}");
    }
    let [short, long] = ["-h", "--help"].map(|flag| ok(&["identify", flag]));
    assert!(short.lines().count() <= 50, "{} lines", short.lines().count());
    for expert in ["--time-origin", "--per-recording", "--precision"] {
        assert!(!short.contains(expert) && long.contains(expert), "{expert}");
    }
}

#[test]
fn a_file_that_is_not_there_is_answered_with_a_similar_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::copy(EXAMPLE, path("motor-step.csv")).unwrap();
    fails(&["identify", &path("motor-stp.csv")], 3, "Did you mean");
    let err = fails(&["identify", &path("elsewhere.txt")], 3, "Check the path");
    assert!(!err.contains("Did you mean"), "{err}");
}

#[test]
fn a_fit_is_drawn_for_light_and_dark_backgrounds() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    ok(&["identify", EXAMPLE, "--svg", &path("fit.svg"), "-q"]);
    let svg = std::fs::read_to_string(path("fit.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("prefers-color-scheme: dark") && svg.contains("speed [rad/s]"));
    // The committed figure is the one that the program draws, up to the last digits on another instruction set.
    let committed = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/figures/m2-step.svg")).unwrap();
    let words = |svg: &str| svg.matches("<text").count();
    assert_eq!(words(&svg), words(&committed));
}

/// Runs the program with a width of the terminal and a text on stdin.
fn with_columns(args: &[&str], columns: &str, stdin: &[u8]) -> (i32, String, String) {
    use std::io::Write as _;
    let mut command = motorfit();
    command.args(args).env("COLUMNS", columns).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(stdin).unwrap();
    let output = child.wait_with_output().unwrap();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn output_wraps_to_a_narrow_terminal_between_words() {
    let folder = Folder::new();
    let jittered = folder.file("log.csv", {
        let row = |n: u32| {
            let t = 0.01 * f64::from(n) + if n.is_multiple_of(3) { 0.0 } else { 0.002 };
            format!("{t},{},{},{}\n", 5.0 + f64::from(n % 9), 0.1 * f64::from(n % 9), 20.0 + f64::from(n % 9))
        };
        "time_s,voltage_V,current_A,speed_rad_s\n".to_owned() + &(0..120).map(row).collect::<String>()
    });
    let small = ["--runs", "3", "--generations", "4", "--population", "8", "--noise-records", "3"];
    for args in [&["identify", EXAMPLE, "-v"][..], &["inspect", EXAMPLE], &["compare"], &["compare", &jittered]] {
        let args = if args[0] == "compare" { [args, &small].concat() } else { args.to_vec() };
        let (_, wide, _) = with_columns(&args, "200", b"");
        for columns in ["50", "60", "80"] {
            let (_, out, err) = with_columns(&args, columns, b"");
            let most = columns.parse().unwrap();
            // Paths have no spaces and are not broken.
            let is_path = |line: &str| line.split_whitespace().any(|word| word.chars().count() > most - 16);
            for line in out.lines().chain(err.lines()).filter(|line| !line.trim_start().starts_with("next ")) {
                assert!(line.chars().count() <= most || is_path(line), "{args:?} at {columns}: {line}");
            }
            // Numbers are whole: those of the parameters are in both outputs.
            let numbers = |text: &str| -> Vec<String> {
                let is_long = |word: &&str| word.len() > 8 && word.parse::<f64>().is_ok();
                text.split_whitespace().filter(is_long).map(str::to_owned).collect()
            };
            let narrow = numbers(&out);
            let has_times = args[0] == "compare";
            assert!(has_times || numbers(&wide).iter().all(|number| narrow.contains(number)), "{out}\n{wide}");
        }
    }
}

#[test]
fn a_dash_is_stdin_and_stdout() {
    let bytes = std::fs::read(EXAMPLE).unwrap();
    let (code, piped, err) = with_columns(&["identify", "-", "--json"], "", &bytes);
    let (piped, named): (Value, Value) =
        (serde_json::from_str(&piped).unwrap(), json(&["identify", EXAMPLE, "--json"]));
    assert_eq!((code, &piped["parameters"]), (0, &named["parameters"]), "{err}");
    assert_eq!(piped["records"][0]["sha256"], named["records"][0]["sha256"]);
    let (code, out, _) = with_columns(&["inspect", "-"], "", &bytes);
    assert!(code == 0 && out.starts_with("stdin: 3001 samples"), "{out}");
    let (code, svg, err) = with_columns(&["identify", "-", "--svg", "-"], "", &bytes);
    assert!(code == 0 && svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{err}");
    fails(&["identify", "-", "-"], 2, "stdin can be read once");
    fails(&["identify", EXAMPLE, "--svg", "-", "--json"], 2, "--svg");
    let (code, _, err) = with_columns(&["identify", "-"], "", b"nothing,here\n");
    assert!(code == 3 && err.contains("stdin"), "{err}");
}

#[test]
fn errors_are_json_documents_with_json() {
    let of = |args: &[&str]| -> (i32, Value) {
        let output = run(args);
        assert!(text(&output.stderr).contains("error:"), "{args:?}: the words stay on stderr");
        (output.status.code().unwrap(), serde_json::from_slice(&output.stdout).unwrap())
    };
    let folder = Folder::new();
    let bad = folder.file("bad.csv", "time_s,voltage_V,current_A,speed_rad_s\n0,1,1,1\n0.1,x,1,1\n");
    let (code, document) = of(&["identify", &bad, "--json"]);
    let error = &document["error"];
    assert_eq!((code, &error["kind"], &error["exit_code"]), (3, &"data".into(), &3.into()));
    assert_eq!(
        (&error["path"], &error["line"], &error["column"]),
        (&bad.as_str().into(), &3.into(), &"voltage_V".into())
    );
    assert!(error["hint"].as_str().is_some_and(|hint| !hint.is_empty()), "{document}");
    let (code, document) = of(&["identify", EXAMPLE, "--methd", "gwo", "--json"]);
    assert_eq!((code, &document["error"]["kind"]), (2, &"usage".into()));
    assert!(document["error"]["message"].as_str().unwrap().contains("--methd"), "{document}");
    assert!(document["error"]["hint"].as_str().unwrap().contains("--method"), "{document}");
    // A result that was printed stays the only document.
    let output = run(&["identify", EXAMPLE, "--json", "--svg", &folder.path("none/plot.svg")]);
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(3));
    assert!(document["error"].is_null() && document["parameters"].is_object());
}

#[test]
fn plots_are_for_terminals_and_maps_do_not_flood_them() {
    let (_, out, _) = with_columns(&["identify", EXAMPLE, "--plot", "-q"], "70", b"");
    for part in ["current [A]: o measured, line: model", "speed [rad/s]: o measured", "residual [A]", "3.00 s"] {
        assert!(out.contains(part), "{part}: {out}");
    }
    assert!(out.lines().all(|line| line.chars().count() <= 70), "{out}");
    assert!(out.chars().any(|c| ('\u{2801}'..='\u{28ff}').contains(&c)), "{out}");
    let folder = Folder::new();
    let map = folder.path("map.svg");
    let slice = ["evaluate", EXAMPLE, "--slice", "R,L", "--sample", "grid:9"];
    let drawn = ok(&[&slice[..], &["--svg", &map]].concat());
    assert!(drawn.lines().count() < 6 && drawn.contains("9 × 9 points"), "{drawn}");
    assert!(std::fs::read_to_string(map).unwrap().contains("<svg"));
    assert_eq!(ok(&slice).lines().count(), 82);
    assert!(ok(&[&slice[..], &["--svg", "-"]].concat()).starts_with("<svg"));
}
