//! Calls of `study::sweep` with invalid studies, folders and results.

use crate::hostile::arguments::{COUNTS, FEW, NUMBERS, WIDE, signals, step, texts};
use crate::hostile::calls::{Calls, ask, drive};
use crate::hostile::drivers::identify::{fitted, mangled};
use motorfit::Error;
use motorfit::identify::{Trust, TrustLevel, TrustReason};
use motorfit::motor::{Parameter, Scope};
use motorfit::record::write_csv;
use motorfit::study::sweep::{
    Failures, LevelCounts, Limits, Outcome, OutputFits, Quantiles, RunTrust, Shard, Sweep, SweepParameter,
    SweepProgress, SweepSummary, TrustCounts,
};
use std::ops::ControlFlow;
use std::path::Path;

const SHARDS: [Shard; 5] = [
    Shard::ALL,
    Shard { index: 0, count: 0 },
    Shard { index: 2, count: 1 },
    Shard { index: u64::MAX, count: u64::MAX },
    Shard { index: 1, count: u64::MAX },
];

/// Plans and runs a sweep in a folder.
fn swept(folder: &Path) -> Sweep {
    std::fs::write(folder.join("a.csv"), write_csv(&step(80))).unwrap();
    std::fs::write(folder.join("b.csv"), "time,voltage\n0,1\n").unwrap();
    let study = "recordings = [\"*.csv\"]\nmethods = [\"sm\", \"ga\"]\nseeds = 2\npopulation = [5]\ngenerations = [3]\n\
                 device = \"cpu\"\n";
    std::fs::write(folder.join("study.toml"), study).unwrap();
    let (sweep, _) = Sweep::plan(&folder.join("study.toml"), &folder.join("out"), None).unwrap();
    sweep.run(Shard::ALL, &mut |_| ControlFlow::Continue(())).unwrap();
    sweep
}

/// Returns summaries of a small sweep, most of them inconsistent.
pub fn summaries() -> Vec<SweepSummary> {
    let folder = tempfile::tempdir().unwrap();
    let merged = swept(folder.path()).merge().unwrap().summary;
    let mut all = vec![merged.clone(), SweepSummary::default()];
    let mut with = |change: &dyn Fn(&mut SweepSummary)| {
        let mut other = merged.clone();
        change(&mut other);
        all.push(other);
    };
    with(&|s| s.blocks.clear());
    with(&|s| s.blocks.iter_mut().for_each(|b| b.cells.clear()));
    with(&|s| s.blocks.iter_mut().for_each(|b| b.worst.clear()));
    with(&|s| s.results.clear());
    with(&|s| s.parameters.clear());
    with(&|s| s.parameters.push(SweepParameter::of_motor(Parameter::Load, Scope::Recording(u32::MAX))));
    with(&|s| (s.motors, s.stride) = (0, 0));
    with(&|s| (s.runs, s.missing, s.failed, s.taken_over) = (0, u64::MAX, u64::MAX, u64::MAX));
    with(&|s| s.trust.levels = LevelCounts { good: u64::MAX, check: u64::MAX, poor: u64::MAX, unknown: u64::MAX });
    with(&|s| s.varied = vec!["", "\0", "method"]);
    with(&|s| s.name = "\u{202e}".repeat(9));
    with(&|s| (s.names_with, s.holds_out) = (true, true));
    for value in FEW {
        with(&|s| {
            for cell in s.blocks.iter_mut().flat_map(|b| &mut b.cells) {
                cell.costs.iter_mut().for_each(|cost| *cost = value);
                cell.parameters.iter_mut().flat_map(|(_, values)| values).for_each(|v| *v = value);
                cell.seconds = value;
            }
            for run in &mut s.results {
                run.outcome.cost = Some(value);
                for e in run.outcome.estimates.iter_mut().flat_map(|e| &mut e.list) {
                    (e.value, e.std_error, e.ci95) = (Some(value), Some(value), Some([value; 2]));
                }
            }
        });
    }
    all
}

pub fn figures(calls: &mut Calls) {
    for values in signals() {
        drive!(calls, values; "study::sweep::Quantiles::of" => Quantiles::of(&values));
    }
    for (a, b) in NUMBERS.into_iter().flat_map(|a| NUMBERS.map(|b| (a, b))) {
        let made = calls.ask("study::sweep::Limits::new", &(a, b), || Limits::new(vec![("R".to_owned(), a, b); 2]));
        let Some(limits) = made else { continue };
        drive!(calls, limits;
            "study::sweep::Limits::of" => [limits.of("R"), limits.of("TL")],
            "study::sweep::Limits::symbols" => limits.symbols().count(),
            "study::sweep::Limits::is_empty" => limits.is_empty(),
        );
    }
    for (a, b) in WIDE.into_iter().flat_map(|a| WIDE.map(|b| (a, b))) {
        let levels = LevelCounts { good: a, check: b, poor: a, unknown: b };
        drive!(calls, (a, b);
            "study::sweep::LevelCounts::is_known" => levels.is_known(),
            "study::sweep::LevelCounts::not_good" => levels.not_good(),
            "study::sweep::Shard::new" => Shard::new(a, b),
        );
        for value in FEW {
            let progress = SweepProgress { done: a, total: b, before: a, failed: b, under_way: value, seconds: value };
            drive!(calls, progress;
                "study::sweep::SweepProgress::rate" => progress.rate(),
                "study::sweep::SweepProgress::remaining" => progress.remaining(),
            );
        }
    }
    for (value, scope) in NUMBERS.into_iter().flat_map(|v| [(v, Scope::Shared), (v, Scope::Recording(u32::MAX))]) {
        let fits = OutputFits(vec![("current".to_owned(), Some(value)), (String::new(), None)]);
        drive!(calls, (value, scope);
            "study::sweep::SweepParameter::of_motor" => SweepParameter::of_motor(Parameter::Load, scope),
            "study::sweep::SweepParameter::motor" => SweepParameter::motor(),
            "study::sweep::OutputFits::of" => (fits.of("current"), fits.of("")),
        );
    }
    let mut failures = Failures::default();
    for (word, id) in texts().into_iter().zip(WIDE.into_iter().cycle()) {
        ask!(calls, word; "study::sweep::Shard::from_str" => word.parse::<Shard>());
        let mut trust = Trust::default();
        trust.reasons.push(TrustReason { code: "", message: word.clone().into() });
        drive!(calls, word;
            "study::sweep::Failures::add" => failures.add(id, &word, &word),
            "study::sweep::RunTrust::from" => RunTrust::from(&trust),
            "study::sweep::Outcome::failed" => {
                [Outcome::failed(&Error::usage("a", "b"), &word), Outcome::failed(&Error::data(word.clone(), ""), "")]
            },
        );
    }
    let counts = TrustCounts { reasons: [(String::new(), u64::MAX)].into(), ..TrustCounts::default() };
    drive!(calls, TrustLevel::Poor; "study::sweep::TrustCounts::commonest" => counts.commonest());
    for found in mangled(&fitted()) {
        let outcome =
            calls.call("study::sweep::Outcome::of", &found.values, || Outcome::of(&found, &Limits::default()));
        drive!(calls, outcome; "study::sweep::Outcome::stop_name" => outcome.as_ref().map(Outcome::stop_name));
    }
    for summary in summaries() {
        drive!(calls, summary;
            "study::sweep::SweepSummary::is_complete" => summary.is_complete(),
            "study::sweep::Cell::values" => {
                summary.blocks.iter().flat_map(|b| &b.cells).map(|cell| cell.values("R").len() + cell.values("TL[4294967295]").len()).sum::<usize>()
            },
            "study::sweep::NamedRun::estimate" => {
                summary.results.iter().filter_map(|run| run.estimate("TL[4294967295]")).count()
            },
        );
    }
}

pub fn sweeps(calls: &mut Calls) {
    let folder = tempfile::tempdir().unwrap();
    let sweep = swept(folder.path());
    drive!(calls, ();
        "study::sweep::Sweep::digest" => sweep.digest().len(),
        "study::sweep::Sweep::folder" => sweep.folder(),
        "study::sweep::Sweep::manifest" => sweep.manifest().runs,
        "study::sweep::Motor::all_files" => sweep.manifest().motors.iter().map(|motor| motor.all_files().count()).sum::<usize>(),
        "study::sweep::SweepSummary::new" => SweepSummary::new(&sweep),
    );
    for word in texts() {
        let given = || Limits::new(vec![(word.clone(), 0.0, 1.0)]).unwrap_or_default();
        ask!(calls, word;
            "study::sweep::Sweep::limits_or_own" => sweep.limits_or_own(given()).map(drop),
            "study::sweep::Limits::parse" => Limits::parse(&[word.clone(), format!("{word}=0:1")]).map(drop),
        );
    }
    ask!(calls, ();
        "study::sweep::Sweep::status" => sweep.status(),
        "study::sweep::Sweep::merge" => sweep.merge().map(drop),
    );
    for count in WIDE {
        ask!(calls, count; "study::sweep::Sweep::left" => sweep.left(count));
    }
    for shard in SHARDS {
        drive!(calls, shard; "study::sweep::Sweep::recordings" => sweep.recordings(shard));
        let kept = calls.ask("study::sweep::Sweep::finished", &shard, || sweep.finished(shard)).unwrap_or_default();
        ask!(calls, shard; "study::sweep::Sweep::run" => sweep.run(shard, &mut |_| ControlFlow::Continue(())).map(drop));
        let texts = texts();
        for bytes in kept.iter().map(|(_, bytes)| &bytes[..]).chain(texts.iter().map(|word| word.as_bytes())) {
            for end in [bytes.len(), bytes.len() / 2, bytes.len().saturating_sub(1)] {
                ask!(calls, (shard, bytes.len(), end); "study::sweep::Sweep::take" => sweep.take(shard, &bytes[..end]));
            }
        }
    }
    studies(calls, folder.path());
    for word in texts().into_iter().filter(|word| word.len() < 100) {
        let moved = calls
            .call("study::sweep::Sweep::with_recordings", &word, || sweep.clone().with_recordings(Path::new(&word)));
        let Some(moved) = moved else { continue };
        drive!(calls, word; "study::sweep::Sweep::recordings" => moved.recordings(Shard::ALL));
        ask!(calls, word; "study::sweep::Sweep::run" => moved.run(Shard::ALL, &mut |_| ControlFlow::Break(())).map(drop));
    }
}

/// Calls the reader of studies with each text as each value.
fn studies(calls: &mut Calls, folder: &Path) {
    let keys = [
        "recordings",
        "methods",
        "seeds",
        "population",
        "generations",
        "criteria",
        "noise",
        "device",
        "mask",
        "fix",
        "\0",
    ];
    for (n, word) in texts().into_iter().enumerate() {
        let key = keys[n % keys.len()];
        let quoted = format!("{word:?}");
        let texts = [
            word.clone(),
            format!("recordings = [\"a.csv\"]\nmethods = [\"sm\"]\ndevice = \"cpu\"\n{key} = {word}\n"),
            format!("recordings = [\"a.csv\"]\nmethods = [\"sm\"]\ndevice = \"cpu\"\n{key} = {quoted}\n"),
            format!("methods = [\"sm\"]\n{key} = [{quoted}, {quoted}]\n"),
        ];
        for (m, text) in texts.iter().enumerate() {
            let path = folder.join(format!("{n}-{m}.toml"));
            std::fs::write(&path, text).unwrap();
            ask!(calls, text; "study::sweep::Sweep::plan" => Sweep::plan(&path, &folder.join(format!("{n}-{m}")), None).map(drop));
        }
    }
    let manifest = std::fs::read_to_string(folder.join("out/manifest.json")).unwrap();
    for part in COUNTS.into_iter().filter(|part| *part < manifest.len()) {
        let broken = folder.join("broken");
        std::fs::create_dir_all(&broken).unwrap();
        std::fs::write(broken.join("manifest.json"), manifest.replacen(|c: char| c.is_ascii_digit(), "9", part))
            .unwrap();
        ask!(calls, part; "study::sweep::Sweep::open" => Sweep::open(&broken));
        std::fs::write(broken.join("manifest.json"), &manifest.as_bytes()[..part]).unwrap();
        ask!(calls, part; "study::sweep::Sweep::open" => Sweep::open(&broken));
    }
}
