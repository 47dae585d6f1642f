//! Proves: the level of trust of a line is that of `identify`, for good and for corrupted recordings; levels are counted, and
//! `--strict` requires good ones; folders of earlier versions, whose lines have no level, are not changed.

use super::extensions::same;
use super::*;
use motorfit::identify::REASONS;
use std::collections::BTreeSet;

/// Rewrites the samples of a recording: time, voltage, current and speed of each row.
fn corrupt(folder: &Folder, from: &str, to: &str, change: fn(&mut [f64; 4])) {
    let text = std::fs::read_to_string(folder.path(from)).unwrap();
    let (heading, rows) = text.split_once('\n').unwrap();
    let row = |line: &str| {
        let mut cells: [f64; 4] = std::array::from_fn(|n| line.split(',').nth(n).unwrap().parse().unwrap());
        change(&mut cells);
        cells.map(|cell| cell.to_string()).join(",") + "\n"
    };
    folder.file(to, format!("{heading}\n{}", rows.lines().map(row).collect::<String>()));
}

/// Writes a good recording, one of another motor, one of a motor with Coulomb friction under several levels, and copies of the
/// first with a wrong sign, with exchanged channels, and with a unit wrong by a factor of 1000.
fn recordings() -> Folder {
    let folder = Folder::new();
    recording(&folder, "good.csv", M2, 1);
    recording(&folder, "other.csv", "R=1.2,L=0.007759,K=0.073472,B=0.000678,J=0.00018", 3);
    let level = |n: u32| [0.0, 8.0, 3.0, -6.0][(n / 100) as usize % 4];
    let rows: String = (0..600).map(|n| format!("{},{}\n", f64::from(n) * 1e-3, level(n))).collect();
    let input = folder.file("input.csv", format!("time_s,voltage_V\n{rows}"));
    program::simulated(&folder.path("friction.csv"), "m2,Tc=0.03", &input, ["0.6", "2"]);
    std::fs::remove_file(input).unwrap();
    corrupt(&folder, "good.csv", "sign.csv", |row| row[2] = -row[2]);
    corrupt(&folder, "good.csv", "order.csv", |row| row.swap(2, 3));
    corrupt(&folder, "good.csv", "unit.csv", |row| row[2] *= 1000.0);
    folder
}

/// Asserts that every line of a study equals `identify` with the same bounds; returns the levels and codes of the results.
fn check_lines(folder: &Folder, study: &str, flags: &[&str]) -> BTreeSet<String> {
    let (path, dir) = (folder.file("study.toml", study), folder.path("out"));
    let (code, _, err) = sweep(&[&path, "--out", &dir]);
    assert!([0, 4].contains(&code), "{err}");
    let mut seen = BTreeSet::new();
    for line in results(&dir) {
        let file = format!("{}.csv", line["motor"].as_str().unwrap());
        let files: Vec<&str> = if file == "joint.csv" { vec!["good.csv", "other.csv"] } else { vec![&file] };
        for code in line["trust"]["reasons"].as_array().into_iter().flatten() {
            assert!(REASONS.iter().any(|(known, _)| code == known), "{code} is not in the table");
        }
        if same(&line, &extensions::identified(folder, &line, &files, flags)) {
            let trust = &line["trust"];
            seen.extend(trust["reasons"].as_array().unwrap().iter().map(|code| code.as_str().unwrap().to_owned()));
            seen.insert(trust["level"].as_str().unwrap().to_owned());
        } else {
            assert!(line.get("trust").is_none(), "{line}");
        }
    }
    seen
}

/// Study with methods of different code paths, a search that ends early and one that does not.
const STUDY: &str = r#"
methods = ["sm", "gwo", "auto"]
polish = ["lm", "none"]
population = [6, 40]
generations = 20
seeds = [5]
device = "cpu"
"#;

fn has(seen: &BTreeSet<String>, expected: &[&str]) {
    assert!(expected.iter().all(|code| seen.contains(*code)), "{expected:?} of {seen:?}");
}

#[test]
fn levels_are_those_of_identify() {
    let folder = recordings();
    let seen = check_lines(
        &folder,
        &format!("recordings = [\"*.csv\"]\nwith = [\"none\", \"coulomb\"]\n{STUDY}"),
        &["--device", "cpu"],
    );
    has(&seen, &["good", "check", "poor", "residuals", "search_stuck", "implausible"]);
}

#[test]
fn levels_within_a_box_without_the_motor_are_those_of_identify() {
    let folder = recordings();
    let study = format!("recordings = [\"good.csv\", \"friction.csv\"]\nbounds = {{R = [2.0, 5.0]}}\n{STUDY}");
    let seen = check_lines(&folder, &study, &["--bounds", "R=2:5", "--device", "cpu"]);
    has(&seen, &["poor", "at_bound"]);
}

#[test]
fn levels_of_joint_fits_are_those_of_identify() {
    let folder = recordings();
    let joint = "recordings = [{motor = \"joint\", files = [\"good.csv\", \"other.csv\"]}]";
    let seen = check_lines(&folder, &format!("{joint}\n{STUDY}"), &["--device", "cpu"]);
    has(&seen, &["poor", "recordings_differ"]);
}

#[test]
fn strict_requires_good_results_of_all_runs() {
    let folder = recordings();
    let study = |name: &str, motors: &str| {
        let text = format!("recordings = [{motors}]\nmethods = [\"sm\"]\npolish = [\"lm\"]\ndevice = \"cpu\"\n");
        folder.file(name, text)
    };
    let (good, mixed) = (study("good.toml", "\"good.csv\""), study("mixed.toml", "\"good.csv\", \"friction.csv\""));
    done(&[&good, "--out", &folder.path("good"), "--strict"]);
    let dir = folder.path("mixed");
    let (code, out, _) = sweep(&[&mixed, "--out", &dir, "--strict"]);
    assert_eq!(code, 4, "{out}");
    assert!(out.contains("Trust in the results: 1 good, 1 ") && out.contains("commonest reasons"), "{out}");
    // `--strict` changes the exit code, and includes the runs of earlier calls.
    done(&[&mixed, "--out", &dir]);
    let (code, out, _) = sweep(&["run", &dir, "--strict", "--json"]);
    let tally: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, &tally["finished"], &tally["trust"]["good"]), (4, &0.into(), &1.into()), "{out}");
    let (code, out, _) = sweep(&["merge", &dir, "--strict", "--json"]);
    let document: Value = serde_json::from_str(&out).unwrap();
    let trust = &document["trust"];
    assert_eq!((code, &trust["good"]), (4, &1.into()), "{trust}");
    assert_eq!(trust["check"].as_u64().unwrap() + trust["poor"].as_u64().unwrap(), 1, "{trust}");
    assert_eq!(trust, &document["blocks"][0]["cells"][0]["trust"]);
    let codes: BTreeSet<&str> =
        trust["reasons"].as_array().unwrap().iter().map(|reason| reason["code"].as_str().unwrap()).collect();
    let all = results(&dir);
    let line = all.iter().find(|line| line["motor"] == "friction").unwrap();
    assert_eq!(codes, line["trust"]["reasons"].as_array().unwrap().iter().map(|code| code.as_str().unwrap()).collect());
    // For a shard only its own runs count.
    let shards = folder.path("shards");
    done(&["plan", &mixed, "--out", &shards]);
    let codes = ["1/2", "2/2"].map(|shard| sweep(&["run", &shards, "--shard", shard, "--strict"]).0);
    assert_eq!(codes, [0, 4]);
}

/// The golden sweep was planned and run by a version without levels.
#[test]
fn folders_of_earlier_versions_are_not_changed() {
    let golden = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/sweep");
    let folder = Folder::new();
    for file in ["manifest.json", "results-1-of-1.jsonl"] {
        folder.file(file, std::fs::read(format!("{golden}/{file}")).unwrap());
    }
    let (dir, parquet) = (folder.path(""), folder.path("all.parquet"));
    let out = done(&["merge", &dir, "--json", "--parquet", &parquet]);
    assert!(bytes(&dir) == std::fs::read(format!("{golden}/results.jsonl")).unwrap());
    let document: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&document["failed"], &document["trust"]), (&0.into(), &Value::Null));
    let columns = std::fs::read(&parquet).unwrap();
    assert!(!columns.windows(5).any(|name| name == b"trust"), "no column without a value");
    let out = done(&["run", &dir]);
    assert!(out.starts_with("4 of 4 runs finished\n"), "{out}");
    // A result without a level does not count as good.
    assert_eq!(sweep(&["merge", &dir, "--strict"]).0, 4);
}
