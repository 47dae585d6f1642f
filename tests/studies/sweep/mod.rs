//! Proves: the runs of a sweep equal single runs of `identify` for any shards, threads and interruptions; no run is lost or
//! repeated, and faults are reported.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test may stop and print")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::float_cmp,
    reason = "small numbers; exact equality is meant"
)]

mod crashes;
mod extensions;
mod faults;
mod models;
mod results;
mod storage;
mod studies;
mod trust;

use crate::support::program::{self, Folder, M2, Mounted, motorfit, run, text};
use serde_json::Value;
use std::process::Output;

/// Writes a recording of a motor: 301 samples, 40 dB.
fn recording(folder: &Folder, name: &str, parameters: &str, seed: u64) {
    program::simulated(&folder.path(name), parameters, "step:10.5@0.05", ["0.3", &seed.to_string()]);
}

/// Returns a folder with a recording `a.csv` and a study, and the path of the study.
fn with_study(study: &str) -> (Folder, String) {
    let folder = Folder::new();
    recording(&folder, "a.csv", M2, 1);
    let study = folder.file("study.toml", study);
    (folder, study)
}

/// Runs a sweep command; returns exit code, stdout and stderr.
fn sweep(args: &[&str]) -> (i32, String, String) {
    let args: Vec<&str> = std::iter::once("sweep").chain(args.iter().copied()).collect();
    let Output { status, stdout, stderr } = run(&args);
    let (out, err) = (text(&stdout), text(&stderr));
    assert!(!err.contains("panicked"), "{err}");
    (status.code().unwrap_or(-1), out, err)
}

/// Runs a sweep command that must succeed; returns stdout.
fn done(args: &[&str]) -> String {
    let (code, out, err) = sweep(args);
    assert_eq!(code, 0, "{args:?}: {err}");
    out
}

fn lines(path: &str) -> Vec<Value> {
    std::fs::read_to_string(path).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Returns the merged results of a sweep.
fn results(dir: &str) -> Vec<Value> {
    lines(&format!("{dir}/results.jsonl"))
}

fn bytes(dir: &str) -> Vec<u8> {
    std::fs::read(format!("{dir}/results.jsonl")).unwrap()
}

/// Returns the numbers of the runs in the results files of shards, without incomplete lines.
fn ids(dir: &str) -> Vec<u64> {
    let entries = std::fs::read_dir(dir).unwrap().map(|entry| entry.unwrap());
    let logs = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with("results-"));
    let read = |entry: std::fs::DirEntry| std::fs::read_to_string(entry.path()).unwrap();
    let line = |line: &str| serde_json::from_str::<Value>(line).ok()?["id"].as_u64();
    logs.flat_map(|entry| read(entry).lines().filter_map(line).collect::<Vec<u64>>()).collect()
}
