//! Proves: faults of recordings, studies, folders and disks affect only the runs concerned, and are reported.

use super::*;
use std::process::Command;

const LINE: &str = "recordings = [\"m*.csv\"]\nmethods = [\"sm\", \"gwo\"]\npolish = [\"lm\"]\npopulation = [20]\ngenerations = [20]\nseeds = [1, 2]\ndevice = \"cpu\"\n";

fn line_of_motors(count: u64) -> (Folder, String) {
    let folder = Folder::new();
    for n in 0..count {
        recording(&folder, &format!("m{n}.csv"), M2, n);
    }
    let study = folder.file("study.toml", LINE);
    (folder, study)
}

#[test]
fn an_invalid_recording_affects_only_its_runs() {
    let (folder, study) = line_of_motors(6);
    let good = std::fs::read(folder.path("m5.csv")).unwrap();
    folder.file("m1.csv", "time_s,voltage_V,current_A,speed_rad_s\n0,1,x,3\n");
    // A motor without excitation.
    let rows: String = (0..300)
        .map(|n| {
            format!(
                "{},0,{},{}\n",
                f64::from(n) * 0.001,
                0.01 * f64::from((n + 3) % 7 - 3),
                0.1 * f64::from((n + 1) % 3 - 1)
            )
        })
        .collect();
    folder.file("m2.csv", format!("time_s,voltage_V,current_A,speed_rad_s\n{rows}"));
    let dir = folder.path("out");
    done(&["plan", &study, "--out", &dir]);
    std::fs::remove_file(folder.path("m3.csv")).unwrap();
    std::fs::write(folder.path("m4.csv"), &good).unwrap();
    let (code, out, err) = sweep(&["run", &dir]);
    assert_eq!(code, 4, "{err}");
    assert!(out.contains("24 of 24 runs finished"), "{out}");
    for part in ["m1.csv, line 2", "nothing drives the motor", "m3.csv: cannot be read", "has changed since"] {
        assert!(err.contains(part), "{part}: {err}");
    }
    let (code, _, _) = sweep(&["merge", &dir]);
    assert_eq!(code, 4);
    let failed = |dir: &str| {
        let all = results(dir);
        assert_eq!(all.len(), 24);
        let failed = all.iter().filter(|line| line["stop"] == "failed");
        let mut motors: Vec<String> = failed
            .map(|line| {
                assert!(line["parameters"].is_null() && line["cost"].is_null());
                let message = line["error"]["message"].as_str().unwrap();
                assert!(
                    !message.contains(folder.0.path().to_str().unwrap()),
                    "where files lie is no result: {message}"
                );
                line["motor"].as_str().unwrap().to_owned()
            })
            .collect();
        motors.dedup();
        motors
    };
    assert_eq!(failed(&dir), ["m1", "m2", "m3", "m4"]);
    // Runs of a repaired recording are done once; unidentifiable ones stay so, and are reported by every run.
    recording(&folder, "m3.csv", M2, 3);
    recording(&folder, "m4.csv", M2, 4);
    let (code, _, _) = sweep(&["run", &dir, "--shard", "1/2"]);
    assert_eq!(code, 4);
    let (code, _, _) = sweep(&["run", &dir, "--shard", "2/2"]);
    assert_eq!(code, 4);
    let lines = ids(&dir).len();
    let (code, out, _) = sweep(&["run", &dir, "--json"]);
    assert_eq!(code, 4);
    let tally: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(
        (&tally["failed"], &tally["failures"][0]["motor"], &tally["finished"]),
        (&8.into(), &"m1".into(), &4.into())
    );
    assert_eq!(ids(&dir).len(), lines + 4, "only the broken recording is tried again");
    let _ = sweep(&["merge", &dir]);
    assert_eq!(failed(&dir), ["m1", "m2"]);
    // An uninterrupted run gives the same results.
    let other = folder.path("other");
    let _ = sweep(&[&study, "--out", &other]);
    assert!(bytes(&dir) == bytes(&other));
}

#[test]
fn a_changed_study_or_recording_is_noticed() {
    let (folder, study) = line_of_motors(2);
    let dir = folder.path("out");
    done(&[&study, "--out", &dir]);
    recording(&folder, "m1.csv", M2, 77);
    let (code, _, err) = sweep(&[&study, "--out", &dir]);
    assert_eq!(code, 3, "{err}");
    assert!(err.contains("the recording of m1 has changed"), "{err}");
    recording(&folder, "m1.csv", M2, 1);
    done(&[&study, "--out", &dir]);
    folder.file("study.toml", LINE.replace("[1, 2]", "[1, 2, 3]"));
    let (code, _, err) = sweep(&[&study, "--out", &dir]);
    assert_eq!(code, 3, "{err}");
    assert!(err.contains("the study's text has changed"), "{err}");
    recording(&folder, "m2.csv", M2, 2);
    folder.file("study.toml", LINE);
    let (_, _, err) = sweep(&[&study, "--out", &dir]);
    assert!(err.contains("the motor m2 is new"), "{err}");
    // An edited manifest is rejected.
    let manifest = std::fs::read_to_string(format!("{dir}/manifest.json")).unwrap();
    std::fs::write(format!("{dir}/manifest.json"), manifest.replace("study.toml", "studi.toml")).unwrap();
    let (code, _, err) = sweep(&["run", &dir]);
    assert_eq!(code, 3, "{err}");
    assert!(err.contains("is not as it was planned"), "{err}");
    for broken in [
        "{",
        "",
        "{\"format\":1}",
        &manifest.replace("\"runs\": 8", "\"runs\": 9"),
        &manifest.replace("\"format\": 1", "\"format\": 7"),
    ] {
        std::fs::write(format!("{dir}/manifest.json"), broken).unwrap();
        let (code, _, err) = sweep(&["run", &dir]);
        assert_eq!(code, 3, "{broken}: {err}");
        assert!(err.contains("manifest.json") && err.contains("help:"), "{err}");
    }
}

#[test]
fn results_of_another_study_are_not_mixed_in() {
    let (folder, study) = line_of_motors(2);
    let (one, other) = (folder.path("one"), folder.path("other"));
    done(&[&study, "--out", &one]);
    let second = folder.file("second.toml", LINE.replace("[1, 2]", "[7, 8]"));
    done(&[&second, "--out", &other]);
    std::fs::copy(format!("{other}/results-1-of-1.jsonl"), format!("{one}/results-2-of-3.jsonl")).unwrap();
    for command in ["run", "merge", "status"] {
        let (code, _, err) = sweep(&[command, &one]);
        assert_eq!(code, 3, "{command}: {err}");
        assert!(err.contains("results-2-of-3.jsonl, line 1: holds results of another study"), "{err}");
    }
    std::fs::write(format!("{one}/results-2-of-3.jsonl"), "no results\n").unwrap();
    assert!(sweep(&["run", &one]).2.contains("is not a results file"));
}

#[test]
fn every_broken_recording_is_named() {
    let (folder, _) = line_of_motors(1);
    folder.file("m1.csv", "x");
    folder.file("m2.csv", "y");
    let study = folder.file(
        "study.toml",
        "recordings = [\"m*.csv\"]\nmethods = [\"sm\"]\nnoise = \"40dB\"\nseeds = \"1..300\"\ndevice = \"cpu\"\n",
    );
    let (code, out, err) = sweep(&[&study, "--out", &folder.path("out")]);
    assert_eq!(code, 4);
    for motor in ["m1", "m2"] {
        assert!(
            err.contains(&format!("and 299 more runs ({motor})")) && out.contains(&format!("  {motor}")),
            "{err}{out}"
        );
    }
}

#[test]
fn a_moved_study_is_resumed() {
    let (folder, _) = line_of_motors(2);
    let (old, new, dir) = (folder.path("old"), folder.path("new"), folder.path("out"));
    std::fs::create_dir(&old).unwrap();
    for name in ["m0.csv", "m1.csv", "study.toml"] {
        std::fs::rename(folder.path(name), format!("{old}/{name}")).unwrap();
    }
    done(&["plan", &format!("{old}/study.toml"), "--out", &dir]);
    std::fs::rename(&old, &new).unwrap();
    done(&[&format!("{new}/study.toml"), "--out", &dir]);
    assert_eq!(results(&dir).len(), 8);
}

#[test]
fn only_parquet_is_overwritten_and_paths_are_checked_first() {
    let (folder, study) = line_of_motors(1);
    let dir = folder.path("out");
    folder.file("occupied.txt", "mine");
    std::fs::create_dir(folder.path("full")).unwrap();
    folder.file("full/report.html", "mine");
    for (flag, place) in
        [("--parquet", folder.path("m0.csv")), ("--parquet", study.clone()), ("--report", folder.path("full"))]
    {
        let (code, _, err) = sweep(&[&study, "--out", &dir, flag, &place]);
        assert_eq!(code, 3, "{err}");
        assert!(err.contains("left unchanged"), "{err}");
        assert!(!std::path::Path::new(&dir).exists(), "before anything is done");
    }
    done(&[&study, "--out", &dir, "--parquet", &folder.path("all.parquet")]);
    done(&["merge", &dir, "--parquet", &folder.path("all.parquet")]);
    for name in ["manifest.json", "results-1-of-1.jsonl", "results.jsonl"] {
        let (code, _, err) = sweep(&["merge", &dir, "--parquet", &format!("{dir}/{name}")]);
        assert_eq!(code, 3, "{err}");
    }
    done(&["merge", &dir]);
}

#[test]
fn every_file_of_a_pattern_is_used() {
    use std::os::unix::ffi::OsStrExt as _;
    let (folder, study) = line_of_motors(2);
    let odd = folder.0.path().join(std::ffi::OsStr::from_bytes(b"m\xff.csv"));
    std::fs::copy(folder.path("m0.csv"), &odd).unwrap();
    let (code, _, err) = sweep(&[&study, "--out", &folder.path("out")]);
    assert_eq!(code, 3, "{err}");
    assert!(err.contains("not UTF-8"), "{err}");
    std::fs::remove_file(odd).unwrap();
    for (list, part) in
        [("[\".\"]", "is not a file"), ("[\"\"]", "is not a file"), ("[\"m0.csv\", \"./m0.csv\"]", "named twice")]
    {
        let study = folder.file("odd.toml", format!("recordings = {list}\nmethods = [\"sm\"]\n"));
        let (code, _, err) = sweep(&["plan", &study, "--out", &folder.path("out")]);
        assert!((2..=3).contains(&code) && err.contains(part), "{list}: {err}");
    }
    // Files that a killed plan left are ignored.
    std::fs::create_dir(folder.path("left")).unwrap();
    folder.file("left/.manifest.json.4242", "{");
    done(&["plan", &study, "--out", &folder.path("left")]);
}

#[test]
fn other_folders_are_not_changed() {
    let (folder, study) = line_of_motors(1);
    let dir = folder.path("full");
    std::fs::create_dir(&dir).unwrap();
    folder.file("full/mine.txt", "mine");
    let (code, _, err) = sweep(&[&study, "--out", &dir]);
    assert_eq!(code, 3, "{err}");
    assert!(err.contains("is not empty"), "{err}");
    for command in ["run", "status", "merge"] {
        let (code, _, err) = sweep(&[command, &dir]);
        assert_eq!(code, 3, "{err}");
        assert!(err.contains("no manifest.json"), "{err}");
    }
    assert_eq!(std::fs::read_dir(&dir).unwrap().count(), 1);
}

/// Runs a sweep in a shell, after other shell commands.
fn by_shell(before: &str, dir: &str) -> (i32, String) {
    let program = assert_cmd::cargo::cargo_bin!("motorfit").display().to_string();
    let script = format!("{before}; exec '{program}' sweep run '{dir}'");
    let output = Command::new("sh").args(["-c", &script]).output().unwrap();
    (output.status.code().unwrap_or(-1), text(&output.stderr))
}

#[test]
fn a_full_disk_loses_only_unwritten_lines() {
    let (folder, study) = line_of_motors(6);
    let (whole, full) = (folder.path("whole"), folder.path("full"));
    done(&[&study, "--out", &whole]);
    done(&["plan", &study, "--out", &full]);
    // Limits files to eight blocks of 512 bytes: the head and a few of the 24 lines, the last of them incomplete.
    let (code, err) = by_shell("trap '' XFSZ; ulimit -f 8", &full);
    assert_eq!(code, 4, "{err}");
    assert!(err.contains("cannot be written") && err.contains("finished runs could not be written"), "{err}");
    let kept = ids(&full).len();
    assert!((1..24).contains(&kept), "{kept} lines are kept");
    let log = std::fs::read(format!("{full}/results-1-of-1.jsonl")).unwrap();
    assert!(log.ends_with(b"\n"), "what did not fit is cut off");
    done(&["run", &full]);
    done(&["merge", &full]);
    assert!(bytes(&full) == bytes(&whole));
    assert_eq!(ids(&full).len(), 24, "none was done twice");
}

#[test]
fn a_full_file_system_and_a_read_only_one() {
    let (folder, study) = line_of_motors(30);
    let Some(mounted) = Mounted::new(&folder, "size=24k") else { return };
    let dir = format!("{}/out", mounted.0);
    done(&["plan", &study, "--out", &dir]);
    let (code, _, err) = sweep(&["run", &dir]);
    assert_eq!(code, 4, "{err}");
    assert!(err.contains("No space left") && err.contains("Make room"), "{err}");
    let kept = ids(&dir).len();
    assert!((1..120).contains(&kept), "{kept}");
    let remount = |options: &str| {
        let done = Command::new("mount").args(["-o", options, &mounted.0]).status().unwrap();
        assert!(done.success());
    };
    remount("remount,ro,size=1m");
    let (code, _, err) = sweep(&["run", &dir]);
    assert_eq!(code, 3, "{err}");
    assert!(err.contains("cannot be written") && err.contains("results-1-of-1.jsonl"), "{err}");
    remount("remount,rw,size=1m");
    done(&["run", &dir]);
    done(&["merge", &dir]);
    assert_eq!(ids(&dir).len(), 120);
    let whole = folder.path("whole");
    done(&[&study, "--out", &whole]);
    assert!(bytes(&dir) == bytes(&whole));
}

#[test]
fn a_folder_that_cannot_be_created_is_reported() {
    let (_folder, study) = line_of_motors(1);
    let (code, _, err) = sweep(&["plan", &study, "--out", "/proc/motorfit"]);
    assert_eq!(code, 3, "{err}");
    assert!(err.contains("/proc/motorfit: cannot be written"), "{err}");
}
