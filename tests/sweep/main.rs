//! Proves: a sweep finds what single runs find, whatever shards, threads and interruptions; it loses nothing, does
//! nothing twice, and says what is wrong.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test may stop and print")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::float_cmp,
    reason = "small numbers; exact equality is meant"
)]

#[path = "../support/program.rs"]
mod program;

mod crashes;
mod faults;
mod models;
mod results;
mod storage;
mod studies;
mod trust;

use program::{Folder, M2, Mounted, motorfit, run, text};
use serde_json::Value;
use std::process::Output;

/// A recording of a motor near M2: 301 samples, 40 dB.
fn recording(folder: &Folder, name: &str, parameters: &str, seed: u64) {
    program::simulated(&folder.path(name), parameters, "step:10.5@0.05", ["0.3", &seed.to_string()]);
}

/// A folder with a recording `a.csv` and a study.
fn with_study(study: &str) -> (Folder, String) {
    let folder = Folder::new();
    recording(&folder, "a.csv", M2, 1);
    let study = folder.file("study.toml", study);
    (folder, study)
}

/// Exit code, stdout and stderr of a sweep command.
fn sweep(args: &[&str]) -> (i32, String, String) {
    let args: Vec<&str> = std::iter::once("sweep").chain(args.iter().copied()).collect();
    let Output { status, stdout, stderr } = run(&args);
    let (out, err) = (text(&stdout), text(&stderr));
    assert!(!err.contains("panicked"), "{err}");
    (status.code().unwrap_or(-1), out, err)
}

/// The same, which must end well.
fn done(args: &[&str]) -> String {
    let (code, out, err) = sweep(args);
    assert_eq!(code, 0, "{args:?}: {err}");
    out
}

fn lines(path: &str) -> Vec<Value> {
    std::fs::read_to_string(path).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// The merged results of a sweep's folder.
fn results(dir: &str) -> Vec<Value> {
    lines(&format!("{dir}/results.jsonl"))
}

fn bytes(dir: &str) -> Vec<u8> {
    std::fs::read(format!("{dir}/results.jsonl")).unwrap()
}

/// The numbers of all runs in the files of shards, in their order, the torn ones left out.
fn ids(dir: &str) -> Vec<u64> {
    let entries = std::fs::read_dir(dir).unwrap().map(|entry| entry.unwrap());
    let logs = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with("results-"));
    let read = |entry: std::fs::DirEntry| std::fs::read_to_string(entry.path()).unwrap();
    let line = |line: &str| serde_json::from_str::<Value>(line).ok()?["id"].as_u64();
    logs.flat_map(|entry| read(entry).lines().filter_map(line).collect::<Vec<u64>>()).collect()
}
