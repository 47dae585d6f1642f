//! Proves: the files of a report in `--out` are replaced as a unit, and other files in the folder are left as they are.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test may stop and print")]

use crate::support::program::{self, EXAMPLE, Folder, Mounted, fails, motorfit, ok, run, text};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

const INDEX: &str = "motorfit-files.json";

/// Returns the names and contents of the files of a folder.
fn contents(dir: &str) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(dir).unwrap().map(|entry| entry.unwrap());
    let mut all: Vec<(String, Vec<u8>)> = entries
        .map(|entry| (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap_or_default()))
        .collect();
    all.sort();
    all
}

fn names(dir: &str) -> Vec<String> {
    contents(dir).into_iter().map(|(name, _)| name).collect()
}

/// Asserts that the files of the index exist with their digests. Returns their names.
fn indexed(dir: &str) -> Vec<String> {
    use sha2::{Digest as _, Sha256};
    let index: Value = serde_json::from_slice(&std::fs::read(format!("{dir}/{INDEX}")).unwrap()).unwrap();
    let list = index["files"].as_object().unwrap();
    for (name, entry) in list {
        let bytes = std::fs::read(format!("{dir}/{name}")).unwrap();
        let digest: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(
            (entry["bytes"].as_u64(), entry["sha256"].as_str()),
            (Some(bytes.len() as u64), Some(&*digest)),
            "{name}"
        );
    }
    list.keys().cloned().collect()
}

fn compare(dir: &str) {
    ok(&["compare", EXAMPLE, "--runs", "2", "--generations", "5", "--bounds", "table2", "--out", dir]);
}

#[test]
fn a_report_replaces_the_last_one_and_nothing_else() {
    let folder = Folder::new();
    let dir = folder.path("report");
    std::fs::create_dir_all(format!("{dir}/own")).unwrap();
    let own = [".DS_Store", "thesis.txt", "block1.csv.bak", "block1-mine.csv", "table-mine.csv", "own/report.html"];
    own.iter().for_each(|name| std::fs::write(format!("{dir}/{name}"), "mine").unwrap());
    compare(&dir);
    let first = indexed(&dir);
    assert!(first.iter().any(|name| name.starts_with("block1")), "{first:?}");
    ok(&["identify", EXAMPLE, "--out", &dir]);
    let second = indexed(&dir);
    assert_eq!(second, ["curves.csv", "report.html", "result.json"]);
    // Tables of the first report are removed, those of the user are kept.
    let mut expected: Vec<String> = second
        .iter()
        .map(String::as_str)
        .chain(own[..5].iter().copied())
        .chain([INDEX, "own"])
        .map(str::to_owned)
        .collect();
    expected.sort();
    assert_eq!(names(&dir), expected);
    assert!(own.iter().all(|name| std::fs::read(format!("{dir}/{name}")).unwrap() == b"mine"));
}

#[test]
fn a_table_of_the_last_report_that_the_user_has_changed_stays() {
    let folder = Folder::new();
    let dir = folder.path("report");
    compare(&dir);
    let table = indexed(&dir).into_iter().find(|name| name.starts_with("block1")).unwrap();
    std::fs::write(format!("{dir}/{table}"), "with notes of mine").unwrap();
    ok(&["identify", EXAMPLE, "--out", &dir]);
    assert_eq!(std::fs::read(format!("{dir}/{table}")).unwrap(), b"with notes of mine");
}

#[test]
fn other_files_with_names_of_a_report_are_kept() {
    let folder = Folder::new();
    // A conflicting page or document is reported before the computation.
    for name in ["report.html", "result.json"] {
        let dir = folder.path(name.split('.').next().unwrap());
        std::fs::create_dir(&dir).unwrap();
        std::fs::write(format!("{dir}/{name}"), "{\"mine\":1}").unwrap();
        fails(&["identify", EXAMPLE, "--out", &dir], 3, "left unchanged");
        assert_eq!(contents(&dir), [(name.to_owned(), b"{\"mine\":1}".to_vec())]);
    }
    // If a table of that name exists, the report uses another name.
    let dir = folder.path("curves");
    std::fs::create_dir(&dir).unwrap();
    std::fs::write(format!("{dir}/curves.csv"), "mine").unwrap();
    for number in [2, 3] {
        let output = run(&["identify", EXAMPLE, "--out", &dir]);
        let err = text(&output.stderr);
        assert!(output.status.success() && err.contains("curves.csv was not written by this program"), "{err}");
        assert!(err.contains(&format!("curves-{number}/report.html")), "{err}");
        assert_eq!(indexed(&format!("{dir}-{number}")).len(), 3);
        assert_eq!(contents(&dir), [("curves.csv".to_owned(), b"mine".to_vec())]);
    }
}

#[test]
fn reports_of_earlier_versions_and_interrupted_ones_are_replaced() {
    let folder = Folder::new();
    let dir = folder.path("report");
    ok(&["identify", EXAMPLE, "--out", &dir]);
    // Earlier versions wrote no index.
    std::fs::remove_file(format!("{dir}/{INDEX}")).unwrap();
    ok(&["identify", EXAMPLE, "--out", &dir]);
    assert_eq!(indexed(&dir).len(), 3);
    let whole = contents(&dir);
    // After a kill while files were moved, any next command completes the new report.
    for moved in 0..=whole.len() {
        let committed = format!("{dir}/.motorfit-new");
        std::fs::create_dir(&committed).unwrap();
        for (n, (name, bytes)) in whole
            .iter()
            .filter(|(name, _)| name != INDEX)
            .chain(whole.iter().filter(|(name, _)| name == INDEX))
            .enumerate()
        {
            let old = if name == INDEX { b"{}".to_vec() } else { b"old".to_vec() };
            let (at, other) = if n < moved { (&dir, None) } else { (&committed, Some(old)) };
            if let Some(old) = other {
                std::fs::write(format!("{dir}/{name}"), old).unwrap();
            }
            std::fs::write(format!("{at}/{name}"), bytes).unwrap();
        }
        // This command fails before it writes anything.
        assert_ne!(run(&["identify", "/nonexistent.csv", "--out", &dir]).status.code(), Some(0));
        ok(&["inspect", EXAMPLE, "--out", &dir]);
        assert_eq!(indexed(&dir), ["report.html", "result.json"].map(str::to_owned));
        assert_eq!(names(&dir), [INDEX, "report.html", "result.json"].map(str::to_owned));
    }
    // After a kill before that, the old report is kept and the temporary files are removed.
    let staged = format!("{dir}/.motorfit-staged-4000000");
    std::fs::create_dir(&staged).unwrap();
    std::fs::write(format!("{staged}/.lock"), "").unwrap();
    std::fs::write(format!("{staged}/report.html"), "half").unwrap();
    ok(&["inspect", EXAMPLE, "--out", &dir]);
    assert_eq!(names(&dir), [INDEX, "report.html", "result.json"].map(str::to_owned));
}

#[test]
fn an_index_that_leads_out_of_the_folder_is_not_followed() {
    let folder = Folder::new();
    let (dir, outside) = (folder.path("report"), folder.file("outside.txt", "mine"));
    ok(&["identify", EXAMPLE, "--out", &dir]);
    let index = std::fs::read_to_string(format!("{dir}/{INDEX}")).unwrap();
    let entry = format!("\"../outside.txt\": {{\"bytes\": 4, \"sha256\": \"{}\"}}, \"curves.csv\"", "0".repeat(64));
    std::fs::write(format!("{dir}/{INDEX}"), index.replacen("\"curves.csv\"", &entry, 1)).unwrap();
    std::fs::create_dir(format!("{dir}/.motorfit-new")).unwrap();
    std::fs::copy(format!("{dir}/{INDEX}"), format!("{dir}/.motorfit-new/{INDEX}")).unwrap();
    ok(&["inspect", EXAMPLE, "--out", &dir]);
    assert_eq!(std::fs::read(&outside).unwrap(), b"mine");
}

#[test]
fn a_full_disk_keeps_the_old_report() {
    let folder = Folder::new();
    let dir = folder.path("limited");
    compare(&dir);
    let before = contents(&dir);
    // Limits the size of files to eight blocks of 512 bytes.
    let program = motorfit().get_program().to_owned().into_string().unwrap();
    let script = format!("trap '' XFSZ; ulimit -f 8; exec '{program}' identify '{EXAMPLE}' --out '{dir}'");
    let output = Command::new("sh").args(["-c", &script]).output().unwrap();
    let err = text(&output.stderr);
    assert!(
        output.status.code() == Some(3) && err.contains("cannot be written") && err.contains("are unchanged"),
        "{err}"
    );
    assert!(contents(&dir) == before);

    let Some(mounted) = Mounted::new(&folder, "size=1m") else { return };
    // Two reports of 300 samples fit into a megabyte.
    let (short, dir) = (folder.path("short.csv"), format!("{}/report", mounted.0));
    program::simulated(&short, program::M2, "step:10.5@0.05", ["0.3", "1"]);
    ok(&["identify", &short, "--out", &dir]);
    let before = contents(&dir);
    let filler = format!("{}/filler", mounted.0);
    let mut file = std::fs::File::create(&filler).unwrap();
    while std::io::Write::write_all(&mut file, &[1; 4096]).is_ok() {}
    let output = run(&["identify", &short, "--out", &dir]);
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.code() == Some(3) && err.contains("No space left"), "{err}");
    assert!(out.contains("motor constant"), "the result is not lost with the report");
    assert!(contents(&dir) == before);
    drop(file);
    std::fs::remove_file(&filler).unwrap();
    ok(&["identify", &short, "--out", &dir]);
    indexed(&dir);

    let remounted = Command::new("mount").args(["-o", "remount,ro", &mounted.0]).status().unwrap();
    assert!(remounted.success());
    let before = contents(&dir);
    fails(&["inspect", &short, "--out", &dir], 3, "cannot be used");
    assert!(contents(&dir) == before && Path::new(&dir).exists());
}
