//! Proves: by its `crate::` paths, a module uses only modules before it in the flow record → motor → model → criterion → optimize →
//! experiment → evaluate → estimate → device → analysis → identify → settings → study → report → cli; files of the folders
//! below have no cyclic dependencies; the library names no flag of the program; files of `src` have at most 400 lines.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_possible_truncation, clippy::float_cmp, reason = "small numbers; exact equality is meant")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Modules in the order of the flow. Each may use those before it, which include the base modules.
const ORDER: [&str; 25] = [
    "clock",
    "error",
    "limit",
    "named",
    "text",
    "units",
    "setting",
    "file",
    "numeric",
    "candidates",
    "channels",
    "record",
    "warning",
    "motor",
    "model",
    "criterion",
    "optimize",
    "experiment",
    "evaluate",
    "estimate",
    "device",
    "analysis",
    "identify",
    "settings",
    "study",
];
/// Modules that a module may not use although they are before it.
const FORBIDDEN: [(&str, &[&str]); 6] = [
    ("motor", &["record", "warning"]),
    ("model", &["record", "warning", "motor"]),
    ("criterion", &["record", "warning", "motor", "model"]),
    ("optimize", &["record", "warning", "motor", "model", "criterion"]),
    ("evaluate", &["optimize", "experiment", "warning"]),
    ("estimate", &["optimize", "experiment", "warning"]),
];
/// Number of base modules, the first in [`ORDER`], which every module may use.
const BASE: usize = 11;
/// Root exports, which every module may use.
const EXPORTS: [&str; 3] = ["Error", "ErrorKind", "Result"];

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

/// Returns the first segment after each `crate::`, with braces expanded.
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
fn modules_use_only_earlier_ones() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut seen = BTreeSet::new();
    for path in files(&source) {
        let relative = path.strip_prefix(&source).unwrap();
        let first = relative.iter().next().unwrap().to_str().unwrap();
        let module = first.trim_end_matches(".rs");
        if ["lib", "main", "cli"].contains(&module) {
            continue;
        }
        seen.insert(module.to_owned());
        // Modules that are not in the list may use all others.
        let place = ORDER.iter().position(|name| *name == module).unwrap_or(ORDER.len());
        assert!(place < ORDER.len() || module == "report", "{module} is new");
        let forbidden = FORBIDDEN.iter().find(|(name, _)| *name == module).map_or(&[][..], |(_, list)| list);
        for name in used(&std::fs::read_to_string(&path).unwrap()) {
            let before = ORDER[..place].contains(&name.as_str()) && !forbidden.contains(&name.as_str());
            let fine =
                name == module || ORDER[..BASE].contains(&name.as_str()) || EXPORTS.contains(&name.as_str()) || before;
            assert!(fine || name.is_empty(), "{} uses {name}", relative.display());
        }
    }
    assert_eq!(seen.len(), ORDER.len() + 1, "{seen:?}");
}

/// Returns the module path of a file: `identify/mod.rs` is `[identify]`.
fn module_of(relative: &Path) -> Vec<String> {
    let mut parts: Vec<String> = relative.iter().map(|part| part.to_str().unwrap().to_owned()).collect();
    let last = parts.pop().unwrap();
    if !["mod.rs", "lib.rs", "main.rs"].contains(&last.as_str()) {
        parts.push(last.trim_end_matches(".rs").to_owned());
    }
    parts
}

/// Returns the code of a file without comments and unit tests.
fn code(text: &str) -> String {
    let tests = ["#[cfg(test)]\nmod tests {", "#[cfg(all(test, feature = \"gpu\"))]\nmod tests {"];
    let end = tests.iter().filter_map(|start| text.find(start)).min().unwrap_or(text.len());
    text[..end].lines().map(|line| line.split("//").next().unwrap_or(line).to_owned() + "\n").collect()
}

/// Returns the paths in code that begin with `start`, as the segments after it, with braces expanded.
fn paths(code: &str, start: &str) -> Vec<Vec<String>> {
    let mut all = Vec::new();
    for (at, _) in code.match_indices(start) {
        let before = code[..at].chars().next_back();
        if before.is_none_or(|c| !c.is_alphanumeric() && c != '_' && c != ':') {
            opened(&code[at + start.len()..], &mut Vec::new(), &mut all);
        }
    }
    all
}

/// Parses a path with braces; returns its length in the text.
fn opened(text: &str, head: &mut Vec<String>, all: &mut Vec<Vec<String>>) -> usize {
    let word: String = text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    let mut at = word.len();
    if !word.is_empty() {
        head.push(word.clone());
    }
    if text[at..].starts_with("::") && !text[at..].starts_with("::<") {
        at += 2;
        at += opened(&text[at..], head, all);
    } else if word.is_empty() && text.starts_with('{') {
        at = 1;
        while !text[at..].starts_with('}') && at < text.len() {
            let skipped = text[at..].find(|c: char| !c.is_whitespace() && c != ',').unwrap_or(text.len() - at);
            at += skipped;
            if !text[at..].starts_with('}') {
                let depth = head.len();
                at += opened(&text[at..], head, all).max(1);
                head.truncate(depth);
                // `as NAME`
                at += text[at..].find([',', '}']).unwrap_or(0);
            }
        }
        return (at + 1).min(text.len());
    } else {
        all.push(head.clone());
    }
    at
}

/// Returns the files that each file uses, by module path.
fn uses(texts: &BTreeMap<Vec<String>, String>) -> BTreeMap<Vec<String>, BTreeSet<Vec<String>>> {
    let resolved = |path: &[String]| (0..=path.len()).rev().map(|n| path[..n].to_vec()).find(|p| texts.contains_key(p));
    let mut all = BTreeMap::new();
    for (module, text) in texts {
        let code = code(text);
        let parent = &module[..module.len().saturating_sub(1)];
        let grandparent = &parent[..parent.len().saturating_sub(1)];
        let mut targets = BTreeSet::new();
        let from = |base: &[String], path: Vec<String>| resolved(&[base.to_vec(), path].concat());
        targets.extend(paths(&code, "crate::").into_iter().filter_map(|path| from(&[], path)));
        for path in paths(&code, "super::") {
            let up = path.iter().take_while(|word| *word == "super").count();
            let base = if up > 0 { grandparent } else { parent };
            targets.extend(from(base, path[up..].to_vec()));
        }
        // Items that a module uses from its children: `use child::Item`, `child::function()`.
        for child in texts.keys().filter(|m| m.len() == module.len() + 1 && m.starts_with(module)) {
            let name = format!("{}::", child[child.len() - 1]);
            if !paths(&code, &name).is_empty() {
                targets.insert(child.clone());
            }
        }
        targets.remove(module);
        all.insert(module.clone(), targets);
    }
    all
}

/// Returns a cycle of files, if there is one.
fn cycle(uses: &BTreeMap<Vec<String>, BTreeSet<Vec<String>>>) -> Option<Vec<String>> {
    fn visit<'a>(
        at: &'a Vec<String>,
        uses: &'a BTreeMap<Vec<String>, BTreeSet<Vec<String>>>,
        way: &mut Vec<&'a Vec<String>>,
        done: &mut BTreeSet<&'a Vec<String>>,
    ) -> Option<Vec<String>> {
        if let Some(start) = way.iter().position(|step| *step == at) {
            return Some(way[start..].iter().chain([&at]).map(|step| step.join("/")).collect());
        }
        if done.contains(at) {
            return None;
        }
        way.push(at);
        let found = uses[at].iter().find_map(|next| visit(next, uses, way, done));
        way.pop();
        done.insert(at);
        found
    }
    let mut done = BTreeSet::new();
    uses.keys().find_map(|start| visit(start, uses, &mut Vec::new(), &mut done))
}

/// Folders without cyclic dependencies of files.
const STRAIGHT: [&str; 7] = ["identify", "analysis", "device", "estimate", "optimize", "evaluate", "motor"];

#[test]
fn files_have_no_cyclic_dependencies() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for folder in STRAIGHT {
        let read =
            |path: &PathBuf| (module_of(path.strip_prefix(&source).unwrap()), std::fs::read_to_string(path).unwrap());
        let texts: BTreeMap<Vec<String>, String> = files(&source.join(folder)).iter().map(read).collect();
        assert_eq!(cycle(&uses(&texts)), None, "a circle in {folder}");
    }
}

#[test]
fn a_cycle_of_files_is_found() {
    let of = |texts: &[(&str, &str)]| {
        let path = |name: &str| name.split('/').map(str::to_owned).collect();
        cycle(&uses(&texts.iter().map(|(name, text)| (path(name), (*text).to_owned())).collect()))
    };
    let circle = of(&[("a", "mod b;\nmod c;"), ("a/b", "use super::c::C;"), ("a/c", "use super::{b::{B as D, E}};")]);
    assert_eq!(circle.unwrap(), ["a/b", "a/c", "a/b"]);
    // Using a name through the parent depends on the parent.
    assert!(of(&[("a", "pub use b::B;"), ("a/b", "use super::Item;")]).is_some());
    assert!(
        of(&[("a", "pub use b::B;\npub use c::C;"), ("a/b", "use crate::a::c::C; // super::Item"), ("a/c", "")])
            .is_none()
    );
    let tests = "fn f() {}\n#[cfg(test)]\nmod tests {\n    use super::super::b;\n}";
    assert!(of(&[("a", "use b::B;\nuse c::C;"), ("a/b", "crate::a::c::go();"), ("a/c", tests)]).is_none());
}

#[test]
fn paths_are_parsed() {
    let text = "use crate::{Error, motor::X};\nlet a = crate::study::go(); // crate::cli";
    assert_eq!(used(text).into_iter().collect::<Vec<_>>(), ["Error", "motor", "study"]);
}

/// Returns the flags and commands of the program in a source: `--word`, or `motorfit` before a command.
fn spelled(source: &str) -> Vec<String> {
    const COMMANDS: [&str; 10] =
        ["identify", "evaluate", "compare", "sweep", "simulate", "inspect", "bench", "devices", "completions", "man"];
    let word = |text: &str| text.chars().take_while(|c| c.is_ascii_lowercase() || *c == '-').collect::<String>();
    let follows = |before: &str| !before.ends_with(|c: char| c.is_alphanumeric() || c == '-');
    let mut found = Vec::new();
    for (at, dashes) in source.match_indices("--") {
        let name = word(&source[at + dashes.len()..]);
        let is_made = source[at + dashes.len()..].starts_with('{');
        if follows(&source[..at]) && (is_made || name.starts_with(|c: char| c.is_ascii_lowercase())) {
            found.push(format!("--{name}"));
        }
    }
    for (at, program) in source.match_indices("motorfit ") {
        let name = word(&source[at + program.len()..]);
        found.extend(COMMANDS.contains(&name.as_str()).then(|| format!("{program}{name}")));
    }
    found
}

/// The sources of the library, without unit tests and without the command line.
#[test]
fn the_library_names_no_flag() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for path in files(&source) {
        let relative = path.strip_prefix(&source).unwrap();
        let parts: Vec<&str> = relative.iter().map(|part| part.to_str().unwrap()).collect();
        let is_test = parts.iter().any(|part| ["tests", "tests.rs", "sample.rs"].contains(part));
        // This module spells settings for the command line.
        let is_spelling = relative == Path::new("report/spelling.rs");
        if parts[0] == "cli" || is_spelling || is_test || relative.extension().is_none_or(|kind| kind != "rs") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let library = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
        assert_eq!(spelled(library), Vec::<String>::new(), "{}", relative.display());
    }
}

#[test]
fn flags_are_parsed() {
    let text = "\"use --fix K=1 (--time-origin)\" --{name} a --> b // `motorfit sweep run`, motorfit records, x--y";
    assert_eq!(spelled(text), ["--fix", "--time-origin", "--", "motorfit sweep"]);
}

#[test]
fn files_stay_short() {
    for path in files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src")) {
        let lines = std::fs::read_to_string(&path).unwrap().lines().count();
        assert!(lines <= 400, "{} has {lines} lines: it is two things", path.display());
    }
}
