//! Proves: SIGINT, SIGTERM and SIGHUP end every command with their exit codes; finished results are kept, and no temporary
//! files remain.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test may stop")]

mod support;

use crate::support::program::{EXAMPLE, Folder, M2, motorfit, text};
use std::io::{BufRead as _, Write as _};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

/// Names, numbers and exit codes of the signals.
const SIGNALS: [(&str, u32, i32); 3] = [("INT", 2, 130), ("TERM", 15, 143), ("HUP", 1, 129)];

/// Study with far more runs than a test can complete.
const STUDY: &str = r#"
methods = ["gwo"]
population = [100]
generations = [5000]
seeds = "1..1000"
bounds = "table2"
device = "cpu"
"#;

/// Returns the program with default signal dispositions, independent of those of the test runner.
fn program() -> Command {
    let mut command = Command::new("env");
    command.args(["--default-signal=INT,TERM,HUP", env!("CARGO_BIN_EXE_motorfit")]);
    // The environment of the other tests.
    for (name, value) in motorfit().get_envs() {
        command.env(name, value.unwrap());
    }
    command
}

fn started(args: &[&str]) -> Child {
    let mut command = program();
    command.args(args).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().unwrap();
    listens(&child);
    child
}

/// Waits until the program has installed its signal handlers and their thread runs.
fn listens(child: &Child) {
    for _ in 0..10_000 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
        let field = |name: &str| status.lines().find_map(|line| line.strip_prefix(name)).unwrap().trim().to_owned();
        let caught = u64::from_str_radix(&field("SigCgt:"), 16).unwrap();
        let threads = std::fs::read_dir(format!("/proc/{}/task", child.id())).unwrap();
        let mut names = threads.filter_map(|task| std::fs::read_to_string(task.unwrap().path().join("comm")).ok());
        if caught >> 24 & 1 == 1 && names.any(|name| name.trim() == "signals") {
            return;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("the signal handlers were not installed in time");
}

fn send(child: &Child, signals: &[&str]) {
    let script = signals.iter().map(|signal| format!("kill -{signal} {};", child.id())).collect::<String>();
    assert!(Command::new("sh").args(["-c", &script]).status().unwrap().success());
}

/// Waits for the first line on stderr, which shows that the computation has started.
fn is_on_its_way(child: &mut Child) -> std::thread::JoinHandle<String> {
    let mut stderr = std::io::BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    stderr.read_line(&mut line).unwrap();
    std::thread::spawn(move || {
        let rest = stderr.lines().map_while(Result::ok).map(|line| line + "\n").collect::<String>();
        line + &rest
    })
}

fn ended(mut child: Child, code: i32) -> Output {
    // `wait` would close stdin, and the program would read the end of file.
    let _stdin = child.stdin.take();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(code), "{}", text(&output.stderr));
    output
}

#[test]
fn a_search_ends_with_its_best() {
    let budget = ["--method", "gwo", "--generations", "1000000000", "--json", "--progress", "json"];
    for (name, _, code) in SIGNALS {
        let mut child = started(&[&["identify", EXAMPLE][..], &budget].concat());
        let _rest = is_on_its_way(&mut child);
        send(&child, &[name]);
        let document: serde_json::Value = serde_json::from_slice(&ended(child, code).stdout).unwrap();
        assert_eq!(document["stop"], "interrupted");
        assert!(document["parameters"]["R"]["value"].is_f64());
    }
}

#[test]
fn comparisons_and_benchmarks_print_finished_results() {
    let compare =
        ["compare", EXAMPLE, "--methods", "gwo,jaya", "--generations", "1000000", "--json", "--progress", "json"];
    let bench = ["bench", "--no-gpu", "--no-keep", "--seconds", "1000", "--json", "--progress", "json"];
    let evaluate = ["evaluate", EXAMPLE, "--sample", "uniform:1000000000000", "--json", "--progress", "json"];
    for args in [&compare[..], &bench, &evaluate] {
        for (name, _, code) in SIGNALS {
            let mut child = started(args);
            // A benchmark prints nothing before its first case is finished.
            let rest = (args[0] != "bench").then(|| is_on_its_way(&mut child));
            send(&child, &[name]);
            let output = ended(child, code);
            drop(rest);
            if args[0] != "bench" {
                serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap();
            }
        }
    }
}

#[test]
fn a_sweep_keeps_finished_runs() {
    for (name, _, code) in SIGNALS {
        let folder = Folder::new();
        let study = folder.file("study.toml", format!("recordings = [\"{EXAMPLE}\"]\n{STUDY}"));
        let dir = folder.path("out");
        let mut child = started(&["sweep", &study, "--out", &dir, "--progress", "json"]);
        let _rest = is_on_its_way(&mut child);
        send(&child, &[name]);
        ended(child, code);
        let status = program().args(["sweep", "status", &dir, "--json"]).output().unwrap();
        assert!(status.status.success(), "{}", text(&status.stderr));
    }
}

#[test]
fn blocked_reads_are_abandoned() {
    // These wait for an input that never arrives.
    for args in
        [["evaluate", EXAMPLE, "--candidates", "-"].as_slice(), &["inspect", "/dev/stdin"], &["identify", "/dev/stdin"]]
    {
        for (name, _, code) in SIGNALS {
            let mut child = started(args);
            let mut stdin = child.stdin.take().unwrap();
            if args[0] == "evaluate" {
                stdin.write_all(b"R,L,K,B,J\n").unwrap();
            }
            send(&child, &[name]);
            let output = ended(child, code);
            assert_eq!(text(&output.stderr), "interrupted before there was a result\n", "{args:?}");
            assert!(output.stdout.is_empty());
        }
        let mut child = started(&[args, &["--quiet"]].concat());
        let mut stdin = child.stdin.take().unwrap();
        if args[0] == "evaluate" {
            stdin.write_all(b"R,L,K,B,J\n").unwrap();
        }
        send(&child, &["TERM"]);
        assert!(ended(child, 143).stderr.is_empty());
    }
}

#[test]
fn a_second_signal_ends_the_program_at_once() {
    for ((first, ..), (second, _, code)) in SIGNALS.into_iter().zip(SIGNALS.into_iter().cycle().skip(1)) {
        // On a slow machine the program may have ended before the second signal.
        let is_ended = (0..20).any(|_| {
            let mut child = started(&["inspect", "/dev/stdin"]);
            let _stdin = child.stdin.take();
            send(&child, &[first]);
            while pending(&child) {
                std::thread::yield_now();
            }
            send(&child, &[second]);
            let output = child.wait_with_output().unwrap();
            output.status.code() == Some(code) && output.stderr.is_empty()
        });
        assert!(is_ended, "{first}, {second}");
    }
}

/// Returns true while a signal is pending for the program.
fn pending(child: &Child) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
    let set = status.lines().find_map(|line| line.strip_prefix("ShdPnd:"));
    set.is_some_and(|set| set.trim().contains(|digit| digit != '0'))
}

#[test]
fn signals_that_the_caller_ignores_stay_ignored() {
    let head = "time_s,voltage_V,current_A,speed_rad_s\n";
    let rows: String = (0..50).map(|n| format!("{},{},{},{}\n", f64::from(n) * 0.001, n % 3, n % 5, n % 7)).collect();
    for (name, number, _) in SIGNALS {
        let script = format!("trap '' {name}; exec \"$0\" inspect /dev/stdin");
        let mut command = Command::new("env");
        command.args(["--default-signal=INT,TERM,HUP", "sh", "-c", &script, env!("CARGO_BIN_EXE_motorfit")]);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        listens(&child);
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
        let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap().trim().to_owned();
        assert_eq!(u64::from_str_radix(&ignored, 16).unwrap() >> (number - 1) & 1, 1, "{name}: {ignored}");
        send(&child, &[name, name]);
        child.stdin.take().unwrap().write_all(format!("{head}{rows}").as_bytes()).unwrap();
        ended(child, 0);
    }
}

const LONG: [&str; 8] = ["simulate", "--parameters", M2, "--input", "step:10@1", "--noise", "40dB", "--duration"];

#[test]
fn a_simulation_that_is_interrupted_leaves_no_file() {
    for (name, _, code) in SIGNALS {
        let folder = Folder::new();
        let child = started(&[&LONG[..], &["99999", "--out", &folder.path("recording.csv")]].concat());
        // The file is written in the second pass.
        while std::fs::read_dir(folder.0.path()).unwrap().count() == 0 {
            std::thread::sleep(Duration::from_millis(5));
        }
        send(&child, &[name]);
        let output = ended(child, code);
        assert_eq!(text(&output.stderr), "interrupted before there was a result\n");
        assert_eq!(std::fs::read_dir(folder.0.path()).unwrap().count(), 0);
    }
}

/// The CSV text of 3,000,001 samples has 150 MB.
#[test]
fn a_simulation_needs_little_memory() {
    let mut child = started(&[&LONG[..], &["3000", "--out", "-"]].concat());
    let mut stdout = child.stdout.take().unwrap();
    let read = std::io::copy(&mut std::io::Read::take(&mut stdout, 120_000_000), &mut std::io::sink()).unwrap();
    assert_eq!(read, 120_000_000);
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap().trim().trim_end_matches(" kB");
    assert!(peak.parse::<u64>().unwrap() < 60_000, "{peak} kB");
    std::io::copy(&mut stdout, &mut std::io::sink()).unwrap();
    ended(child, 0);
}

#[test]
fn a_file_size_limit_is_reported_for_the_file() {
    let folder = Folder::new();
    let motor = ["simulate", "--parameters", M2, "--input", "step:10@0.1", "--duration", "5", "--out"];
    for out in ["recording.csv", "-"] {
        let out = if out == "-" { out.to_owned() } else { folder.path(out) };
        let stdout = std::fs::File::create(folder.path("stdout")).unwrap();
        let mut command = Command::new("sh");
        command.args(["-c", "ulimit -f 8; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_motorfit")]).args(motor);
        let output =
            command.arg(&out).stdout(stdout).stderr(Stdio::piped()).spawn().unwrap().wait_with_output().unwrap();
        let err = text(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{err}");
        assert!(err.contains("cannot be written: File too large"), "{err}");
    }
    // Neither a recording nor a partial file remains.
    let left: Vec<_> = std::fs::read_dir(folder.0.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["stdout"]);
}
