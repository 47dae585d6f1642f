//! Runs the command line program.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test may stop and print")]

use serde_json::Value;
use std::process::{Command, Output};

pub const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/m2-step.csv");
pub const M2: &str = "R=0.921042,L=0.007759,K=0.073472,B=0.000678,J=0.000136";

pub fn motorfit() -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("motorfit"));
    // The user's throughput profile is neither used nor changed.
    command.env("XDG_CACHE_HOME", concat!(env!("CARGO_TARGET_TMPDIR"), "/cache"));
    command
}

pub fn run(args: &[&str]) -> Output {
    motorfit().args(args).output().unwrap()
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

pub fn ok(args: &[&str]) -> String {
    let output = run(args);
    assert!(output.status.success(), "{args:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

pub fn json(args: &[&str]) -> Value {
    serde_json::from_str(&ok(args)).unwrap()
}

/// Writes a simulated recording of a motor with 40 dB of noise.
pub fn simulated(path: &str, parameters: &str, input: &str, [duration, seed]: [&str; 2]) {
    let motor = ["simulate", "--parameters", parameters, "--input", input, "--duration", duration];
    ok(&[&motor[..], &["--noise", "40dB", "--seed", seed, "--out", path]].concat());
}

/// Asserts that a run fails with an exit code and a message that contains `part`, by the rules for every failure. Returns the
/// message.
pub fn fails(args: &[&str], code: i32, part: &str) -> String {
    let output = run(args);
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "{args:?}: {err}");
    if args.contains(&"--json") {
        let document: Value = serde_json::from_str(&out).unwrap();
        assert_eq!(document["error"]["exit_code"], code, "{args:?}: {out}");
        assert!(document["error"]["message"].as_str().is_some_and(|message| !message.is_empty()), "{out}");
    } else {
        assert!(out.is_empty(), "{args:?} printed on stdout: {out}");
    }
    assert!(err.contains(part), "{args:?}: {err}\nlacks {part}");
    assert!(!err.contains("panicked"), "{err}");
    assert!(!err.chars().any(|c| c.is_control() && c != '\n'), "{args:?}: control characters in {err:?}");
    assert!(err.contains("help:") || err.contains("tip:") || err.contains("--help"), "{args:?}: no remedy in {err}");
    err
}

pub struct Folder(pub tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_owned()
    }

    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        std::fs::write(self.path(name), content).unwrap();
        self.path(name)
    }
}

/// Mounted file system in memory.
pub struct Mounted(pub String);

impl Mounted {
    pub fn new(folder: &Folder, options: &str) -> Option<Self> {
        let at = folder.path("mounted");
        std::fs::create_dir_all(&at).unwrap();
        let done = Command::new("mount").args(["-t", "tmpfs", "-o", options, "tmpfs", &at]).output();
        let mounted = done.is_ok_and(|output| output.status.success());
        assert!(mounted || std::env::var_os("MOTORFIT_NO_SKIP").is_none(), "no file system may be mounted here");
        if !mounted {
            eprintln!("skipped: no file system may be mounted here");
        }
        mounted.then_some(Self(at))
    }
}

impl Drop for Mounted {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}
