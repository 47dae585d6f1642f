//! Proves: a module uses only the modules that stand before it in the flow
//! record → motor → criterion → evaluate → optimize → estimate → identify → report → cli, by its `crate::` paths.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_possible_truncation, clippy::float_cmp, reason = "small numbers; exact equality is meant")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Each module with those that it may use. Every module may use the ground: error, named, setting, text, candidates.
const ALLOWED: [(&str, &[&str]); 15] = [
    ("error", &[]),
    ("named", &[]),
    ("text", &[]),
    ("setting", &[]),
    ("candidates", &[]),
    ("record", &[]),
    ("motor", &[]),
    ("criterion", &[]),
    ("optimize", &[]),
    ("experiment", &["record", "motor", "criterion"]),
    ("evaluate", &["record", "motor", "criterion"]),
    ("estimate", &["record", "motor", "criterion", "evaluate"]),
    ("identify", &["record", "motor", "criterion", "evaluate", "optimize", "estimate"]),
    ("study", &["record", "motor", "criterion", "experiment", "evaluate", "optimize", "estimate", "identify"]),
    (
        "report",
        &[
            "record",
            "motor",
            "criterion",
            "experiment",
            "evaluate",
            "optimize",
            "estimate",
            "identify",
            "study",
            "report",
        ],
    ),
];
const GROUND: [&str; 8] = ["error", "named", "text", "setting", "candidates", "Error", "ErrorKind", "Result"];

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

/// The first word after each `crate::`, braces opened.
fn used(text: &str) -> BTreeSet<String> {
    let code: Vec<&str> = text.lines().map(|line| line.split("//").next().unwrap_or(line)).collect();
    let code = code.join("\n");
    let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut used = BTreeSet::new();
    for rest in code.split("crate::").skip(1) {
        match rest.strip_prefix('{') {
            Some(list) => used.extend(list.split('}').next().unwrap_or(list).split(',').map(|w| word(w.trim()))),
            None => {
                used.insert(word(rest));
            }
        }
    }
    used
}

#[test]
fn data_flow_one_way() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut seen = BTreeSet::new();
    for path in files(&source) {
        let relative = path.strip_prefix(&source).unwrap();
        let first = relative.iter().next().unwrap().to_str().unwrap();
        let module = first.trim_end_matches(".rs");
        if ["lib", "main", "cli"].contains(&module) {
            continue;
        }
        let (_, allowed) =
            ALLOWED.iter().find(|(name, _)| *name == module).unwrap_or_else(|| panic!("{module} is new"));
        seen.insert(module.to_owned());
        for name in used(&std::fs::read_to_string(&path).unwrap()) {
            let fine = name == module || GROUND.contains(&name.as_str()) || allowed.contains(&name.as_str());
            assert!(fine || name.is_empty(), "{} uses {name}", relative.display());
        }
    }
    assert_eq!(seen.len(), ALLOWED.len(), "{seen:?}");
}

#[test]
fn the_reader_of_paths_reads_paths() {
    let text = "use crate::{Error, motor::X};\nlet a = crate::study::go(); // crate::cli";
    assert_eq!(used(text).into_iter().collect::<Vec<_>>(), ["Error", "motor", "study"]);
}

#[test]
fn files_stay_short() {
    for path in files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src")) {
        let lines = std::fs::read_to_string(&path).unwrap().lines().count();
        assert!(lines <= 400, "{} has {lines} lines: it is two things", path.display());
    }
}
