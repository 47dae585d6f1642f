//! Proves: `compare --model` searches the problem of the model: equal seeds give the runs of the DC motor's own comparison where the
//! model is the DC motor, and the first run is that of `identify --method`; names, units, bounds and fixed values are those of the
//! model; the refined estimate is the lowest cost known without noise; results do not depend on threads; what a model does not
//! have is refused with a remedy.
//! Does not prove: that a method is good on a model.
#![allow(clippy::unwrap_used, clippy::float_cmp, reason = "a test may stop; exact equality is meant")]

use crate::support::program::{Folder, M2, fails, json, ok};
use motorfit::criterion::Scale;
use motorfit::identify::model::ModelSpec;
use motorfit::model::BuiltIn;
use motorfit::optimize::Progress;
use motorfit::record::{ReadOptions, read};
use motorfit::study::compare::{CompareSpec, Comparison, ComparisonSetting, ComparisonSubject, compare};
use serde_json::Value;
use std::ops::ControlFlow;

/// Settings of a small comparison.
const SMALL: [&str; 8] = ["--runs", "3", "--population", "12", "--generations", "10", "--seed", "3"];

/// Writes a recording of the paper's motor without noise, 151 samples.
fn motor(folder: &Folder) -> String {
    let path = folder.path("motor.csv");
    ok(&["simulate", "--parameters", M2, "--input", "step:10.5@0.02", "--duration", "0.15", "--out", &path]);
    path
}

/// Writes a recording of a synchronous motor with noise, 61 samples.
fn pmsm(folder: &Folder) -> String {
    let path = folder.path("pmsm.csv");
    let values = "R=0.5,Ld=0.001,Lq=0.0015,psi=0.05,B=1e-4,J=2e-4";
    let motor = ["simulate", "--model", "pmsm", "--parameters", values, "--input", "vq=step:6@0.002"];
    ok(&[&motor[..], &["--duration", "0.03", "--period", "0.0005", "--noise", "40dB", "--out", &path]].concat());
    path
}

fn compared(path: &str, more: &[&str]) -> Value {
    json(&[&["compare", path, "--json", "-q"], &SMALL[..], more].concat())
}

/// Returns the results of the methods of a block.
fn methods(document: &Value, block: usize) -> &[Value] {
    document["blocks"][block]["methods"].as_array().unwrap()
}

fn names(of: &Value) -> Vec<&str> {
    of.as_object().unwrap().keys().map(String::as_str).collect()
}

#[test]
fn the_motor_written_as_a_model_has_the_runs_of_the_motor() {
    let folder = Folder::new();
    let path = motor(&folder);
    let searches = ["--methods", "gwo,jaya,ga,de,cmaes"];
    let own = compared(&path, &[&searches[..], &["--bounds", "table2"]].concat());
    let model = compared(&path, &[&searches[..], &["--model", "dc-motor"]].concat());
    assert_eq!(own["bounds"], model["bounds"]);
    assert_eq!(own["blocks"][0]["ranking"], model["blocks"][0]["ranking"]);
    let reference = model["blocks"][0]["refined_cost"].as_f64().unwrap();
    assert!(reference < 1e-9, "without noise the refined estimate is exact: {reference}");
    for (of, other) in methods(&own, 0).iter().zip(methods(&model, 0)) {
        assert_eq!(of["method"], other["method"]);
        for (run, same) in of["runs"].as_array().unwrap().iter().zip(other["runs"].as_array().unwrap()) {
            let [a, b] = [run, same].map(|run| run["cost"].as_f64().unwrap());
            // Both sum the errors of the same trajectories, which agree to rounding.
            assert!((a / b - 1.0).abs() < 1e-9, "{}: {a} and {b}", of["method"]);
            assert_eq!(run["evaluations"], same["evaluations"]);
            assert!(b >= reference);
            for name in ["R", "L", "K", "B", "J"] {
                let [a, b] = [run, same].map(|run| run["parameters"][name].as_f64().unwrap());
                assert!((a / b - 1.0).abs() < 1e-9, "{}: {name} is {a} and {b}", of["method"]);
            }
        }
    }
    // The entries of the document are those of the DC motor and three of the model.
    let added: Vec<&str> = names(&model).into_iter().filter(|name| !names(&own).contains(name)).collect();
    assert_eq!(added, ["model", "units", "integration"]);
    assert!(names(&own).iter().all(|name| names(&model).contains(name)));
}

#[test]
fn the_first_run_is_that_of_identify() {
    let folder = Folder::new();
    let path = pmsm(&folder);
    let fixed = ["--model", "pmsm", "--fix", "psi=0.05,J=2e-4", "--bounds", "R=0.1:2"];
    let document = compared(&path, &[&fixed[..], &["--methods", "jaya,gwo"]].concat());
    for result in methods(&document, 0) {
        let method = result["method"].as_str().unwrap();
        let identify = ["identify", &path, "--json", "-q", "--polish", "none", "--method", method, "--seed", "3"];
        let size = ["--population", "12", "--generations", "10"];
        let alone = json(&[&identify[..], &size, &fixed].concat());
        let first = &result["runs"][0];
        assert_eq!(first["cost"], alone["searched"]["cost"], "{method}");
        assert_eq!(first["history"], alone["history"], "{method}");
        assert_eq!(first["evaluations"], alone["evaluations"], "{method}");
        for (name, value) in alone["searched"]["parameters"].as_object().unwrap() {
            assert_eq!(&first["parameters"][name], value, "{method} {name}");
        }
    }
}

#[test]
fn a_document_has_the_names_and_units_of_the_model() {
    let folder = Folder::new();
    let path = pmsm(&folder);
    let more =
        ["--model", "pmsm", "--fix", "psi=0.05,J=2e-4", "--criteria", "nrmse:std,iae:peak", "--transform", "mirror"];
    let document = compared(&path, &more);
    let all = ["R", "Ld", "Lq", "psi", "B", "J"];
    assert_eq!(names(&document["units"]), all);
    assert_eq!((&document["units"]["Ld"], &document["units"]["psi"]), (&"H".into(), &"V*s".into()));
    assert_eq!(names(&document["bounds"]), ["R", "Ld", "Lq", "B"]);
    assert_eq!(document["fixed"], serde_json::json!({"psi": 0.05, "J": 2e-4}));
    assert_eq!(document["model"]["name"], "PMSM in rotor coordinates");
    let trust = &json(&["identify", &path, "--json", "-q", "--model", "pmsm", "--fix", "psi=0.05,J=2e-4"])["trust"];
    assert_eq!(document["refined_trust"]["level"], trust["level"]);
    let codes = trust["reasons"].as_array().unwrap().iter().map(|reason| reason["code"].clone()).collect();
    assert_eq!(document["refined_trust"]["reasons"], Value::Array(codes));
    for (name, value) in [("R", 0.5), ("Ld", 0.001), ("Lq", 0.0015), ("psi", 0.05)] {
        let refined = document["refined"][name].as_f64().unwrap();
        assert!((refined / value - 1.0).abs() < 0.05, "{name}: {refined}");
    }
    assert_eq!(document["blocks"].as_array().unwrap().len(), 4, "two criteria in two coordinates each");
    assert_eq!(document["invariance"].as_array().unwrap().len(), 6, "three methods under two criteria");
    for block in document["blocks"].as_array().unwrap() {
        let (mut ranking, mut tested) = (names(&block["reached"]), block["ranking"].as_array().unwrap().clone());
        ranking.sort_unstable();
        tested.sort_by_key(Value::to_string);
        assert_eq!(ranking, tested);
        assert_eq!(block["pairs"].as_array().unwrap().len(), 3);
        assert!(block["refined_cost"].as_f64().unwrap() > 0.0);
        for result in block["methods"].as_array().unwrap() {
            assert_eq!(names(&result["standard_deviations"]), all);
            assert_eq!(names(&result["mean_relative_errors_percent"]), all);
            for run in result["runs"].as_array().unwrap() {
                assert_eq!(names(&run["parameters"]), all);
                assert_eq!(run["parameters"]["psi"], 0.05);
                let (cost, lowest) = (run["cost"].as_f64().unwrap(), block["refined_cost"].as_f64().unwrap());
                assert!(cost > lowest, "a short search is not better than the refined estimate: {cost}, {lowest}");
            }
        }
        let tables = block["tables"].as_array().unwrap();
        let table = |id: &str| tables.iter().find(|table| table["id"] == id).unwrap();
        assert_eq!(table("parameters")["heads"][2], "Ld [H]");
        assert_eq!(table("fit")["heads"], serde_json::json!(["method", "id", "iq", "w"]));
        assert_eq!(table("errors")["rows"][0][4], "fixed");
    }
}

#[test]
fn a_method_that_ends_at_a_bound_is_reported() {
    let folder = Folder::new();
    let path = motor(&folder);
    let args = ["--model", "dc-motor", "--bounds", "R=0.1:0.5", "--methods", "cmaes", "--generations", "60"];
    let document =
        json(&[&["compare", &path, "--json", "-q", "--runs", "2", "--population", "20"][..], &args].concat());
    let warnings = document["warnings"].as_array().unwrap();
    let found =
        warnings.iter().find(|w| w["code"] == "at_bound" && w["message"].to_string().contains("bound of R, 0.5"));
    let message = found.unwrap_or_else(|| panic!("{warnings:?}"))["message"].to_string();
    assert!(message.contains("widen the box, as with --bounds R=0.1:5"), "{message}");
}

#[test]
fn results_do_not_depend_on_threads() {
    let folder = Folder::new();
    let path = motor(&folder);
    let without_times = |threads: &str| {
        let more = ["--model", "dc-motor", "--threads", threads, "--methods", "gwo,de", "--population", "70"];
        let mut document =
            json(&[&["compare", &path, "--json", "-q", "--runs", "5", "--generations", "6"], &more[..]].concat());
        document["seconds"] = Value::Null;
        document["device"] = Value::Null;
        for block in document["blocks"].as_array_mut().unwrap() {
            block["tables"] = Value::Null;
            block["reached"] = Value::Null;
            block["methods"].as_array_mut().unwrap().iter_mut().for_each(|of| of["seconds_one_run"] = Value::Null);
        }
        document
    };
    let one = without_times("1");
    assert!(one["refined"]["R"].is_f64() && one["blocks"][0]["methods"][1]["runs"][4]["cost"].is_f64());
    assert_eq!(one, without_times("3"));
}

#[test]
fn a_report_has_the_columns_of_the_model() {
    let folder = Folder::new();
    let (path, out) = (pmsm(&folder), folder.path("out"));
    let args = ["compare", &path, "--model", "pmsm", "--fix", "psi=0.05,J=2e-4", "--out", &out];
    let printed = ok(&[&args[..], &SMALL].concat());
    for part in ["Ld [H]", "psi [V s]", "J [kg m²]", "Fit of the outputs", "refined"] {
        assert!(printed.contains(part), "{printed}\nlacks {part}");
    }
    assert!(!printed.contains("Steiglitz"), "{printed}");
    // The first line, which describes the recording, is as long as its columns.
    assert!(printed.lines().skip(1).all(|line| line.chars().count() <= 80), "{printed}");
    let file = |name: &str| std::fs::read_to_string(format!("{out}/{name}")).unwrap();
    let runs = file("block1-runs.csv");
    let lines: Vec<&str> = runs.lines().collect();
    assert_eq!(lines[0], "method,run,cost,evaluations,R,Ld,Lq,psi,B,J");
    assert_eq!(lines.len(), 1 + 3 * 3);
    assert!(lines[1].starts_with("gwo,0,") && lines[1].split(',').nth(7) == Some("0.05"), "{}", lines[1]);
    let curves = file("curves.csv");
    let heading = curves.lines().next().unwrap();
    assert!(heading.starts_with("time_s,vd [V],vq [V],TL [N*m],id [A],iq [A],w [rad/s],id gwo [A],"), "{heading}");
    assert!(heading.ends_with(",w ga [rad/s]"), "{heading}");
    assert_eq!(curves.lines().count(), 1 + 61);
    assert!(curves.lines().all(|line| line.split(',').count() == 7 + 3 * 3));
    assert!(file("block1-parameters.csv").starts_with("method,R [ohm],Ld [H],"));
    assert!(file("block1-fit.csv").lines().last().unwrap().starts_with("refined,"));
    let page = file("report.html");
    for part in ["Methods compared: PMSM in rotor coordinates", "residual of iq", "Integration", "id=\"block1-errors\""]
    {
        assert!(page.to_lowercase().contains(&part.to_lowercase()), "the page lacks {part}");
    }
    assert!(!page.contains("NaN") && !page.contains("Steiglitz"));
    let document: Value = serde_json::from_str(&file("result.json")).unwrap();
    assert_eq!(document["model"]["name"], "PMSM in rotor coordinates");
}

#[test]
fn what_a_model_does_not_have_is_refused() {
    let folder = Folder::new();
    let path = motor(&folder);
    let with = |more: &[&str], code: i32, part: &str| {
        let args = [&["compare", &path, "--model", "dc-motor", "--runs", "2", "--population", "4"], more].concat();
        fails(&args, code, part);
    };
    with(&["--methods", "gwo,sm"], 2, "Steiglitz–McBride is a method of the linear DC motor");
    with(&["--methods", "gwo,sm"], 2, "Leave it out of --methods");
    with(&["--methods", "multistart"], 2, "--methods: multistart");
    with(&["--methods", "auto"], 2, "auto");
    with(&["--noise-records", "5"], 2, "--noise-records");
    with(&["--preset", "paper"], 2, "--preset");
    with(&["--suite", "motors"], 2, "--suite");
    with(&["--discretization", "euler"], 2, "Choose zoh, foh or rk4 for a model");
    with(&["--bounds", "Q=1:2"], 2, "\"Q\" is not a parameter of the model DC motor");
    with(&["--bounds", "R=2:1"], 2, "the lower first");
    with(&["--fix", "R=1,L=1e-3,K=0.1,B=1e-4,J=1e-4"], 2, "every parameter is fixed");
    with(&["--device", "cpu", "--precision", "f32"], 2, "f32 is available on GPUs only");
    with(&["--json", "--criteria", "foo"], 2, "is not a criterion");
    fails(&["compare", "--model", "dc-motor"], 2, "--model has no recording");
    fails(&["compare", "--model", "dc-motor", "--suite", "motors"], 2, "cannot be used with");
    fails(&["compare", &path, "--model", "pmsm"], 3, "no column for vd and vq");
    fails(&["compare", &path, "--model", &folder.path("missing.toml")], 3, "neither a file nor a built-in model");
}

/// Compares on the motor as a model with an observer.
fn observed(path: &str, observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>) -> Comparison {
    let model = BuiltIn::DcMotor.model().unwrap();
    let signals = motorfit::evaluate::model::signal_requests(&model);
    let records = read(path.as_ref(), &ReadOptions { signals, ..ReadOptions::default() }).unwrap();
    let subject = ComparisonSubject::of_model(model, records, ModelSpec::default()).unwrap();
    let setting = ComparisonSetting { population: 10, generations: 8, ..ComparisonSetting::paper(Scale::Std) };
    let spec = CompareSpec { settings: vec![setting], runs: 3, steiglitz_mcbride: false, ..CompareSpec::default() };
    compare(subject, &spec, observe).unwrap()
}

#[test]
fn a_comparison_that_is_ended_keeps_its_runs() {
    let folder = Folder::new();
    let path = motor(&folder);
    let mut calls = 0;
    let whole = observed(&path, &mut |_| {
        calls += 1;
        ControlFlow::Continue(())
    });
    assert!(!whole.interrupted && whole.reference.is_ok() && whole.initial.is_empty());
    let ended_after = |last: usize| {
        let mut seen = 0;
        observed(&path, &mut |_| {
            seen += 1;
            if seen < last { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        })
    };
    let early = ended_after(4);
    assert!(early.interrupted && early.reference.is_err());
    for (result, complete) in early.blocks[0].results.iter().zip(&whole.blocks[0].results) {
        for (run, complete) in result.runs.iter().zip(&complete.runs) {
            assert_eq!(run.history, complete.history[..4], "{}", result.method.name());
        }
    }
    // The last call is one of the refined estimate.
    let late = ended_after(calls);
    assert!(late.interrupted && late.reference.is_err(), "{:?}", late.reference);
    assert_eq!(late.blocks[0].results[2].runs, whole.blocks[0].results[2].runs);
}

#[test]
fn several_recordings_have_their_own_parameters() {
    let folder = Folder::new();
    let other = folder.path("other.csv");
    ok(&["simulate", "--parameters", M2, "--input", "step:7@0.02", "--duration", "0.12", "--out", &other]);
    let text_of = BuiltIn::DcMotor.source().replace("R = { unit", "R = { per_recording = true, unit");
    let model = folder.file("own.toml", text_of);
    let document = compared(&motor(&folder), &[&other, "--model", &model, "--methods", "de"]);
    let expected = ["R[0]", "R[1]", "L", "K", "B", "J"];
    assert_eq!(names(&document["units"]), expected);
    assert_eq!(names(&methods(&document, 0)[0]["runs"][0]["parameters"]), expected);
    for (name, truth) in expected.into_iter().zip([0.921_042, 0.921_042, 0.007_759, 0.073_472, 0.000_678, 0.000_136]) {
        let refined = document["refined"][name].as_f64().unwrap();
        assert!((refined / truth - 1.0).abs() < 1e-6, "{name}: {refined}");
        assert!(document["bounds"][name][0].as_f64().unwrap() < refined);
    }
}
