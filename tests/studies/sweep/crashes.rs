//! Proves: a sweep that is killed at any instant is completed by the same command, with the results of an uninterrupted one.

use super::*;
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::collections::BTreeSet;
use std::process::{Child, Stdio};
use std::time::Duration;

/// Study with several batches of searches and fits, some with noise.
const STUDY: &str = r#"
recordings = ["long.csv"]
methods = ["gwo", "sm", "jaya"]
polish = ["none", "lm"]
population = [40]
generations = [60]
seeds = "1..90"
noise = ["none", "40dB"]
bounds = "table2"
device = "cpu"
"#;
const RUNS: usize = 3 * 2 * 90 * 2;

/// Writes the study with a recording of 3001 samples.
fn with_long_study() -> (Folder, String) {
    let (folder, study) = with_study(STUDY);
    program::simulated(&folder.path("long.csv"), M2, "step:10.5@1", ["3", "1"]);
    (folder, study)
}

fn start(dir: &str, shard: &str) -> Child {
    let mut command = motorfit();
    command.args(["sweep", "run", dir, "--shard", shard, "-q"]).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().unwrap()
}

#[test]
fn a_hundred_kills_lose_nothing() {
    let (folder, study) = with_long_study();
    let whole = folder.path("whole");
    let begun = std::time::Instant::now();
    done(&[&study, "--out", &whole]);
    let seconds = begun.elapsed().as_secs_f64();
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(1);
    let (mut kills, mut sweeps, mut in_the_middle) = (0, 0, 0);
    while kills < 100 {
        let dir = folder.path(&format!("killed{sweeps}"));
        done(&["plan", &study, "--out", &dir]);
        while kills < 100 && ids(&dir).len() < RUNS {
            // Two shards alternate; kills occur at any instant, including start-up.
            let mut child = start(&dir, if kills % 2 == 0 { "1/2" } else { "2/2" });
            std::thread::sleep(Duration::from_secs_f64(numbers.random_range(0.0..0.02 + seconds / 4.0)));
            child.kill().unwrap();
            child.wait().unwrap();
            kills += 1;
            in_the_middle += usize::from((1..RUNS).contains(&ids(&dir).len()));
        }
        for shard in ["1/2", "2/2"] {
            done(&["run", &dir, "--shard", shard]);
        }
        done(&["merge", &dir]);
        assert!(bytes(&dir) == bytes(&whole), "after {kills} kills");
        let all = ids(&dir);
        assert_eq!(all.len(), all.iter().collect::<BTreeSet<_>>().len(), "none was done twice");
        assert_eq!(all.len(), RUNS);
        sweeps += 1;
    }
    assert!(in_the_middle > 50, "{in_the_middle} kills came in the middle of the work, in {sweeps} sweeps");
}

#[test]
fn an_interruption_keeps_finished_runs() {
    let (folder, study) = with_long_study();
    let dir = folder.path("out");
    done(&["plan", &study, "--out", &dir]);
    let child = start(&dir, "1/1");
    let log = format!("{dir}/results-1-of-1.jsonl");
    for _ in 0..2000 {
        if std::fs::read_to_string(&log).is_ok_and(|text| text.lines().count() > 1) {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let kill = std::process::Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(143));
    let kept = ids(&dir).len();
    assert!(kept > 0);
    let status: Value = serde_json::from_str(&done(&["status", &dir, "--json"])).unwrap();
    assert_eq!((status["done"].as_u64(), &status["merged"]), (Some(kept as u64), &false.into()));
    // Missing runs are reported, and finished ones merged.
    let (code, _, err) = sweep(&["merge", &dir]);
    assert_eq!(code, 4, "{err}");
    assert!(err.contains("are missing"), "{err}");
    assert_eq!(results(&dir).len(), kept);
    done(&["run", &dir]);
    done(&["merge", &dir]);
    assert_eq!(results(&dir).len(), RUNS);
    assert_eq!(ids(&dir).len(), RUNS);
}

#[test]
fn a_second_run_of_a_shard_is_rejected() {
    let (folder, study) = with_long_study();
    let dir = folder.path("out");
    done(&["plan", &study, "--out", &dir]);
    let mut first = start(&dir, "1/2");
    while !std::path::Path::new(&format!("{dir}/results-1-of-2.jsonl")).exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
    std::thread::sleep(Duration::from_millis(20));
    let (code, _, err) = sweep(&["run", &dir, "--shard", "1/2"]);
    let status = done(&["status", &dir]);
    first.kill().unwrap();
    first.wait().unwrap();
    assert_eq!(code, 3, "{err}");
    assert!(err.contains("another run of this shard"), "{err}");
    assert!(status.contains("running"), "{status}");
}

#[test]
fn an_incomplete_line_is_repeated() {
    let (folder, study) = with_study(
        "recordings = [\"a.csv\"]\nmethods = [\"sm\", \"gwo\"]\npopulation = [8]\ngenerations = [5]\nseeds = \"1..4\"\ndevice = \"cpu\"\n",
    );
    let (whole, torn) = (folder.path("whole"), folder.path("torn"));
    done(&[&study, "--out", &whole]);
    done(&[&study, "--out", &torn]);
    let log = format!("{torn}/results-1-of-1.jsonl");
    let all = std::fs::read(&log).unwrap();
    for cut in [0, 1, all.len() / 3, all.len() / 2, all.len() - 2, all.len() - 1] {
        std::fs::write(&log, &all[..cut]).unwrap();
        done(&[&study, "--out", &torn]);
        assert!(bytes(&torn) == bytes(&whole), "cut at {cut}");
        assert_eq!(ids(&torn).len(), 8);
    }
    // Damage in the middle loses that run and is reported: an invalid byte, a digit, a key.
    let (text, middle) = (String::from_utf8(all.clone()).unwrap(), all.len() / 2);
    let mut zero = all.clone();
    zero[middle] = 0;
    let digit = text.replacen("\"cost\":0.0", "\"cost\":0.1", 1).into_bytes();
    let key = text.replacen("\"stop\":\"budget", "\"stoq\":\"budget", 1).into_bytes();
    for damaged in [zero, digit, key] {
        assert!(damaged != all);
        std::fs::write(&log, &damaged).unwrap();
        let (code, _, err) = sweep(&[&study, "--out", &torn]);
        assert_eq!(code, 0, "{err}");
        assert!(err.contains("damaged"), "{err}");
        assert!(bytes(&torn) == bytes(&whole));
        // Repaired damage is not reported again.
        let (code, _, err) = sweep(&[&study, "--out", &torn]);
        assert!(code == 0 && !err.contains("damaged"), "{err}");
    }
}

#[test]
fn searches_of_auto_are_stored_one_by_one() {
    // With an extension and without refinement every run searches.
    let (folder, study) = with_study(
        "recordings = [\"a.csv\"]\nmethods = [\"auto\"]\nwith = [\"coulomb\"]\npolish = [\"none\"]\nseeds = \"1..60\"\npopulation = [400]\ngenerations = [150]\n",
    );
    let dir = folder.path("out");
    done(&["plan", &study, "--out", &dir]);
    let mut child = start(&dir, "1/1");
    while ids_if_any(&dir).is_empty() {
        assert!(child.try_wait().unwrap().is_none(), "nothing was kept until the end");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let kept = ids(&dir).len();
    assert!(kept < 60, "{kept} of 60");
    done(&["run", &dir]);
    assert_eq!(ids(&dir).len(), 60);
}

fn ids_if_any(dir: &str) -> Vec<u64> {
    if std::path::Path::new(&format!("{dir}/results-1-of-1.jsonl")).exists() { ids(dir) } else { Vec::new() }
}

/// Runs the template with a mock of `sbatch` that executes each task at once; the second task is killed in its first attempt.
#[test]
fn the_slurm_template_runs_and_merges() {
    let (folder, study) = with_study(
        "recordings = [\"a.csv\"]\nmethods = [\"sm\", \"gwo\"]\npopulation = [8]\ngenerations = [5]\nseeds = \"1..9\"\ndevice = \"cpu\"\n",
    );
    folder.file("sbatch", SBATCH);
    std::process::Command::new("chmod").args(["+x", &folder.path("sbatch")]).status().unwrap();
    let program = assert_cmd::cargo::cargo_bin!("motorfit");
    let template = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/slurm.sh");
    let dir = folder.path("out with a blank");
    let submit = || {
        let path = format!("{}:{}", folder.0.path().display(), std::env::var("PATH").unwrap());
        let mut command = std::process::Command::new(template);
        command.args([&study, &dir, "3"]).env("PATH", path).env("MOTORFIT", program).env("QUEUE", folder.0.path());
        command.output().unwrap()
    };
    let first = submit();
    assert!(first.status.success(), "{}", text(&first.stderr));
    assert!(text(&first.stdout).contains("array job 7 of 3 shards, then 8 merges"), "{}", text(&first.stdout));
    let report = format!("{dir}-report/report.html");
    assert!(std::path::Path::new(&report).exists());
    assert!(results(&dir).len() < 18, "a shard is missing");
    assert!(submit().status.success());
    let whole = folder.path("whole");
    done(&[&study, "--out", &whole]);
    assert!(bytes(&dir) == bytes(&whole));
    assert_eq!(ids(&dir).len(), 18);
}

const SBATCH: &str = r#"#!/usr/bin/env bash
script=${@: -1}
for word in "$@"; do
    case $word in
        --array=1-*) tasks=${word#--array=1-} ;;
        --wrap) wrap=1 ;;
        --dependency=afterany:7) after=1 ;;
    esac
done
if [ -n "$tasks" ]; then
    for task in $(seq "$tasks"); do
        if [ "$task" = 2 ] && [ ! -e "$QUEUE/killed" ]; then touch "$QUEUE/killed"; continue; fi
        SLURM_ARRAY_TASK_ID=$task SLURM_CPUS_PER_TASK=1 bash "$script" >&2
    done
    echo "7;cluster"
else
    [ -n "$wrap" ] && [ -n "$after" ] || exit 1
    bash -c "$script" >&2
    echo 8
fi
"#;
