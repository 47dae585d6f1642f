//! Proves: success is reported only for stored results, and damage loses only the affected lines.

use super::*;
use motorfit::study::sweep::{Shard, Sweep};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::Stdio;

const LOG: &str = "results-1-of-1.jsonl";
/// Study with many runs that take some tenths of a second in total.
const MANY: &str = r#"
recordings = ["a.csv"]
methods = ["gwo"]
polish = ["none"]
population = [40]
generations = [60]
seeds = "1..1500"
bounds = "table2"
device = "cpu"
"#;
const FEW: &str = "recordings = [\"a.csv\"]\nmethods = [\"sm\"]\nseeds = \"1..6\"\nnoise = [\"40dB\"]";

/// Runs a sweep and disturbs its results file as soon as it has lines. Returns exit code, message, and the numbers of the runs
/// in the file at the end.
fn disturbed(dir: &str, what: impl FnOnce(&str)) -> (i32, String, Vec<u64>) {
    let log = format!("{dir}/{LOG}");
    let mut command = motorfit();
    let child = command.args(["sweep", "run", dir]).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    while std::fs::read(&log).map_or(0, |bytes| bytes.iter().filter(|b| **b == b'\n').count()) < 2 {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    what(&log);
    let output = child.wait_with_output().unwrap();
    let kept = if Path::new(&log).exists() { ids(dir) } else { Vec::new() };
    (output.status.code().unwrap(), text(&output.stderr), kept)
}

#[test]
fn success_is_reported_only_for_stored_results() {
    let (folder, study) = with_study(MANY);
    let whole = folder.path("whole");
    done(&[&study, "--out", &whole]);
    let disturb = |name: &str, what: &dyn Fn(&str)| {
        let dir = folder.path(name);
        done(&["plan", &study, "--out", &dir]);
        let (code, err, kept) = disturbed(&dir, what);
        // In every case the next run does exactly the missing runs.
        done(&["run", &dir]);
        let all = ids(&dir);
        assert_eq!(all.len(), 1500, "{name}: none was done twice");
        assert_eq!(all[..kept.len()], kept[..], "{name}: lines that were there stay");
        done(&["merge", &dir]);
        assert!(bytes(&dir) == bytes(&whole), "{name}");
        (code, err, kept.len())
    };
    // A removed file is restored from the open one.
    let (code, err, kept) = disturb("removed", &|log| std::fs::remove_file(log).unwrap());
    assert_eq!((code, kept), (0, 1500), "{err}");
    let (code, err, kept) = disturb("shortened", &|log| {
        std::fs::OpenOptions::new().write(true).open(log).unwrap().set_len(0).unwrap();
    });
    assert!(
        code == 4 && kept < 1500 && err.contains("was shortened while it was being written"),
        "{code}, {kept}: {err}"
    );
    assert!(err.contains("finished runs could not be written"), "{kept}: {err}");
    let (code, err, kept) = disturb("replaced", &|log| {
        std::fs::copy(log, format!("{log}.copy")).unwrap();
        std::fs::rename(format!("{log}.copy"), log).unwrap();
    });
    assert!(
        code == 4 && kept < 1500 && err.contains("was replaced while it was being written"),
        "{code}, {kept}: {err}"
    );
}

#[test]
fn a_folder_removed_during_a_run_is_reported() {
    let (folder, study) = with_study(MANY);
    let dir = folder.path("out");
    done(&["plan", &study, "--out", &dir]);
    let (code, err, _) = disturbed(&dir, |_| {
        // Repeated, because the run may be writing there.
        while std::fs::remove_dir_all(&dir).is_err() {}
    });
    assert_eq!(code, 4, "{err}");
    assert!(err.contains("was removed") && err.contains("finished runs could not be written"), "{err}");
}

/// Damages bytes in one of four ways: a bit, a byte, a removed piece, a repeated piece.
fn damaged(bytes: &[u8], range: std::ops::Range<usize>, numbers: &mut Xoshiro256PlusPlus) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let at = numbers.random_range(range.clone());
    let until = numbers.random_range(at..range.end) + 1;
    match numbers.random_range(0..4) {
        0 => bytes[at] ^= 1 << numbers.random_range(0..8),
        1 => bytes[at] = bytes[at].wrapping_add(numbers.random_range(1..=255)),
        2 => drop(bytes.drain(at..until)),
        _ => drop(bytes.splice(at..at, bytes[at..until].to_vec())),
    }
    bytes
}

/// Finishes a sweep; returns the number of repeated runs.
fn finished(dir: &Path) -> u64 {
    let sweep = Sweep::open(dir).unwrap();
    let tally = sweep.run(Shard::ALL, &mut |_| ControlFlow::Continue(())).unwrap();
    assert!(tally.fault.is_none() && tally.before + tally.finished == tally.total);
    let merged = sweep.merge().unwrap();
    assert_eq!(merged.summary.missing, 0);
    tally.finished
}

fn planned(study: &str) -> (Folder, std::path::PathBuf) {
    let (folder, study) = with_study(study);
    let dir = Path::new(&folder.path("out")).to_path_buf();
    Sweep::plan(Path::new(&study), &dir, None).unwrap();
    finished(&dir);
    (folder, dir)
}

/// Number of cases of damage to a head, to lines, and to a manifest.
const CASES: usize = 250;

#[test]
fn a_damaged_log_loses_only_the_affected_lines() {
    let (_folder, dir) = planned(FEW);
    let (log, merged) = (dir.join(LOG), dir.join("results.jsonl"));
    let [whole, expected] = [&log, &merged].map(|path| std::fs::read(path).unwrap());
    let lines: Vec<&[u8]> = whole.split_inclusive(|b| *b == b'\n').collect();
    let head = lines[0].len();
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut mended = 0;
    for range in [0..head, head..whole.len()] {
        for case in 0..CASES {
            let spoiled = damaged(&whole, range.clone(), &mut numbers);
            std::fs::write(&log, &spoiled).unwrap();
            let kept = lines[1..].iter().filter(|line| memmem(&spoiled, line)).count() as u64;
            let again = finished(&dir);
            assert!(again <= 6 - kept, "case {case} in {range:?}: {again} done again, {kept} of 6 lines are whole");
            assert_eq!(std::fs::read(&merged).unwrap(), expected, "case {case} in {range:?}");
            mended += u64::from(spoiled != whole);
        }
    }
    assert!(mended > 490, "{mended}");
}

/// Returns true if a file has `line` as a complete line.
fn memmem(file: &[u8], line: &[u8]) -> bool {
    file.split_inclusive(|b| *b == b'\n').any(|found| found == line)
}

#[test]
fn a_damaged_manifest_is_detected_and_repaired_by_the_same_study() {
    let (folder, dir) = planned(FEW);
    let (path, log) = (dir.join("manifest.json"), dir.join(LOG));
    let [whole, results] = [&path, &log].map(|path| std::fs::read(path).unwrap());
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(6);
    for case in 0..CASES {
        let spoiled = damaged(&whole, 0..whole.len(), &mut numbers);
        std::fs::write(&path, &spoiled).unwrap();
        // Also before the first result, where only the digest in the manifest can reveal it.
        std::fs::remove_file(&log).unwrap();
        if spoiled != whole {
            let error = Sweep::open(&dir).map(|_| String::from_utf8_lossy(&spoiled).into_owned()).unwrap_err();
            assert!(error.to_string().contains("manifest.json"), "case {case}: {error}");
        }
        std::fs::write(&log, &results).unwrap();
        // A remnant that cannot be recognized as a manifest is kept.
        let left = String::from_utf8_lossy(&spoiled).into_owned();
        let alike = String::from_utf8_lossy(&whole).lines().filter(|line| left.lines().any(|l| l == *line)).count();
        let again = Sweep::plan(Path::new(&folder.path("study.toml")), &dir, None);
        if 2 * alike >= whole.iter().filter(|b| **b == b'\n').count() {
            assert!(again.unwrap().1 && std::fs::read(&path).unwrap() == whole, "case {case}");
            assert_eq!(Sweep::open(&dir).unwrap().status().unwrap().done, 6);
        } else {
            assert!(again.is_err() && std::fs::read(&path).unwrap() == spoiled, "case {case}");
        }
    }
}

#[test]
fn files_that_resemble_results_are_not_changed() {
    let (_folder, dir) = planned(FEW);
    let other = dir.join("results-2-of-2.jsonl");
    for text in ["mine\n", "{}\n", "{\"motorfit\":\"1\"}\nmine\n", "\n\n"] {
        std::fs::write(&other, text).unwrap();
        let error = Sweep::open(&dir).unwrap().merge().unwrap_err();
        assert!(error.to_string().contains("results-2-of-2.jsonl"), "{error}");
        let error = Sweep::open(&dir).unwrap().run("2/2".parse().unwrap(), &mut |_| ControlFlow::Continue(()));
        assert!(error.is_err() && std::fs::read_to_string(&other).unwrap() == text);
    }
}

#[test]
fn temporary_files_of_killed_merges_are_removed_by_the_next() {
    let (_folder, dir) = planned(FEW);
    let (left, mine) = (dir.join(".results.jsonl.4000000.0"), dir.join(".results.jsonl.mine"));
    std::fs::write(&left, "half").unwrap();
    std::fs::write(&mine, "mine").unwrap();
    // A file that is being written is locked.
    let busy = std::fs::File::create(dir.join(".timings.jsonl.4000001.3")).unwrap();
    busy.lock().unwrap();
    Sweep::open(&dir).unwrap().merge().unwrap();
    assert!(!left.exists() && mine.exists() && dir.join(".timings.jsonl.4000001.3").exists());
}
