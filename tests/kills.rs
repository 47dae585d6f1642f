//! Proves: every command that writes a recording, a sweep or a report can be killed at any instant. The old files are kept
//! until the new ones are complete, the same command succeeds afterwards, and other files are neither removed nor changed.
//!
//! `MOTORFIT_KILLS` sets the number of kills (200).
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]

mod support;

use crate::support::program::{EXAMPLE, Folder, M2, motorfit, ok, simulated};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde_json::Value;
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

const INDEX: &str = "motorfit-files.json";
/// Names of files of the user, some similar to those of the program.
const FOREIGN: [&str; 5] = [".DS_Store", "notes.txt", "table1.csv", "averages.csv", ".results.jsonl.mine"];

/// Command that writes: arguments, and the folder of its report.
struct Writer {
    name: &'static str,
    args: Vec<String>,
    report: Option<String>,
}

fn writers(folder: &Folder) -> Vec<Writer> {
    let of = |name: &'static str, args: &[&str], report: Option<String>| {
        let args = args.iter().map(|arg| (*arg).to_owned());
        let out = report.iter().flat_map(|dir| ["--out".to_owned(), dir.clone()]);
        Writer { name, args: args.chain(out).collect(), report }
    };
    let (study, dir) = (folder.path("study.toml"), folder.path("sweep"));
    let report = Some(folder.path("report"));
    let few = ["compare", EXAMPLE, "--runs", "2", "--generations", "5", "--bounds", "table2"];
    vec![
        of("plan", &["sweep", "plan", &study, "--out", &dir], None),
        of("run", &["sweep", "run", &dir], None),
        of("merge", &["sweep", "merge", &dir, "--parquet", &folder.path("all.parquet")], None),
        of("report", &["sweep", "merge", &dir], report.clone()),
        of("identify", &["identify", EXAMPLE], report.clone()),
        of("compare", &few, report.clone()),
        of("inspect", &["inspect", EXAMPLE], report),
        of(
            "simulate",
            &["simulate", "--parameters", M2, "--input", "step:10@0.1", "--out", &folder.path("new.csv")],
            None,
        ),
    ]
}

/// Kills a command after a time. Returns true if it was still running.
fn killed(args: &[String], after: Duration) -> bool {
    let mut command = motorfit();
    let mut child = command.args(args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(after);
    let is_running = child.try_wait().unwrap().is_none();
    child.kill().unwrap();
    child.wait().unwrap();
    is_running
}

/// Returns true if the files of a report are those that its index lists.
fn is_complete(dir: &str) -> bool {
    let Ok(index) = std::fs::read(format!("{dir}/{INDEX}")) else { return false };
    let index: Value = serde_json::from_slice(&index).unwrap();
    index["files"].as_object().unwrap().iter().all(|(name, entry)| {
        let bytes = std::fs::read(format!("{dir}/{name}")).unwrap_or_default();
        let digest: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        entry["sha256"] == digest.as_str()
    })
}

/// Returns the names of temporary files that a killed process left.
fn leftovers(dir: &str) -> Vec<String> {
    let entries = std::fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let is_own = |name: &String| FOREIGN.contains(&name.as_str()) || !name.starts_with('.');
    entries.filter(|name| !is_own(name)).collect()
}

#[test]
fn kills_of_every_command_that_writes_lose_nothing() {
    let kills: usize = std::env::var("MOTORFIT_KILLS").ok().and_then(|text| text.parse().ok()).unwrap_or(200);
    let folder = Folder::new();
    simulated(&folder.path("a.csv"), M2, "step:10.5@0.05", ["0.3", "1"]);
    folder.file("study.toml", "recordings = [\"a.csv\"]\nmethods = [\"gwo\", \"sm\"]\npopulation = [20]\ngenerations = [20]\nseeds = \"1..40\"\nbounds = \"table2\"\ndevice = \"cpu\"\n");
    let (dir, report) = (folder.path("sweep"), folder.path("report"));
    let writers = writers(&folder);
    // Results of an uninterrupted sweep, and the run time of each command.
    let mut times: Vec<Duration> = writers
        .iter()
        .map(|writer| {
            let begun = Instant::now();
            ok(&writer.args.iter().map(String::as_str).collect::<Vec<_>>());
            begun.elapsed()
        })
        .collect();
    let merged = std::fs::read(format!("{dir}/results.jsonl")).unwrap();
    for place in [&dir, &report] {
        FOREIGN.iter().for_each(|name| std::fs::write(format!("{place}/{name}"), "mine").unwrap());
    }
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut under_way: BTreeMap<&str, usize> = BTreeMap::new();
    for kill in 0..kills {
        let (writer, time) = (&writers[kill % writers.len()], &mut times[kill % writers.len()]);
        if writer.name == "plan" {
            // Starts a new sweep for the following commands.
            std::fs::remove_dir_all(&dir).unwrap();
        }
        // Most writes are at the end, so most kills are.
        let part =
            if numbers.random_bool(0.5) { numbers.random_range(0.0..1.1) } else { numbers.random_range(0.6..1.1) };
        *under_way.entry(writer.name).or_default() += usize::from(killed(&writer.args, time.mul_f64(part)));
        let what = format!("kill {kill}, {}", writer.name);
        if let Some(report) = &writer.report {
            let is_committed = Path::new(&format!("{report}/.motorfit-new")).exists();
            assert!(is_committed || is_complete(report), "{what}: neither the old report nor the new one");
        }
        let begun = Instant::now();
        ok(&writer.args.iter().map(String::as_str).collect::<Vec<_>>());
        *time = (*time + begun.elapsed()) / 2;
        if let Some(report) = &writer.report {
            assert!(is_complete(report), "{what}");
            assert!(leftovers(report).is_empty(), "{what}: {:?}", leftovers(report));
        }
        if writer.name == "plan" {
            FOREIGN.iter().for_each(|name| std::fs::write(format!("{dir}/{name}"), "mine").unwrap());
        }
        if matches!(writer.name, "merge" | "report") {
            assert!(std::fs::read(format!("{dir}/results.jsonl")).unwrap() == merged, "{what}");
            assert!(leftovers(&dir).is_empty(), "{what}: {:?}", leftovers(&dir));
        }
        for place in [&dir, &report] {
            let is_there = |name: &&str| std::fs::read(format!("{place}/{name}")).is_ok_and(|bytes| bytes == b"mine");
            assert!(FOREIGN.iter().all(is_there), "{what}: a file of the user's is gone");
        }
    }
    println!("{kills} kills, under way: {under_way:?}");
    assert!(3 * under_way.values().sum::<usize>() > kills, "{under_way:?}");
    assert!(leftovers(&folder.path(".")).is_empty(), "{:?}", leftovers(&folder.path(".")));
}
