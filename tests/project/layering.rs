//! Proves: no file depends on itself through the files that it uses, in any crate, the program and the bindings; some folders within a
//! crate use only those before them (Cargo holds the order of the crates); the library names no flag of the program; files have at
//! most 400 lines.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_possible_truncation, clippy::float_cmp, reason = "small numbers; exact equality is meant")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Folders of crates in their order. Each may use those before it, but no other file of its crate; other files may use all.
const ORDER: [(&str, &[&str]); 3] =
    [("evaluate", &["criterion", "experiment"]), ("identify", &["device", "analysis"]), ("study", &["settings"])];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Returns the Rust files of a folder and those below it.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let all = entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] });
    all.filter(|path| path.extension().is_some_and(|kind| kind == "rs")).collect()
}

/// Returns the source folders of the library's crates, by name.
fn crates() -> BTreeMap<String, PathBuf> {
    let entries = std::fs::read_dir(root().join("crates")).unwrap().map(|e| e.unwrap().path());
    entries.map(|path| (path.file_name().unwrap().to_str().unwrap().to_owned(), path.join("src"))).collect()
}

/// Returns the texts of the files of a crate by module path. The program's crate is beside the facade `lib.rs`, which is left out.
fn texts(source: &Path) -> BTreeMap<Vec<String>, String> {
    let is_program = source.join("main.rs").exists();
    let own = files(source).into_iter().filter(|path| !is_program || *path != source.join("lib.rs"));
    own.map(|path| (module_of(path.strip_prefix(source).unwrap()), std::fs::read_to_string(&path).unwrap())).collect()
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
        // The scope of a visibility is not a use.
        let is_scope = code[..at].ends_with("pub(in ");
        if !is_scope && before.is_none_or(|c| !c.is_alphanumeric() && c != '_' && c != ':') {
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
        let mut targets = BTreeSet::new();
        let from = |base: &[String], path: Vec<String>| resolved(&[base.to_vec(), path].concat());
        targets.extend(paths(&code, "crate::").into_iter().filter_map(|path| from(&[], path)));
        for path in paths(&code, "super::") {
            let up = path.iter().take_while(|word| *word == "super").count();
            targets.extend(from(&parent[..parent.len().saturating_sub(up)], path[up..].to_vec()));
        }
        // Items that a module uses from its children: `use child::Item`, `child::function()`.
        for child in texts.keys().filter(|m| m.len() == module.len() + 1 && m.starts_with(module)) {
            let name = format!("{}::", child[child.len() - 1]);
            targets.extend(paths(&code, &name).into_iter().filter_map(|path| from(child, path)));
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

#[test]
fn files_have_no_cyclic_dependencies() {
    let crates = crates();
    let sources = crates.into_values().chain([root().join("src"), root().join("bindings/python/src")]);
    let circles = sources.filter_map(|source| Some((source.clone(), cycle(&uses(&texts(&source)))?)));
    assert_eq!(circles.collect::<Vec<_>>(), []);
}

#[test]
fn folders_use_only_earlier_ones() {
    for (name, order) in ORDER {
        let uses = uses(&texts(&crates()[name]));
        for (n, folder) in order.iter().enumerate() {
            let is_of = |module: &Vec<String>, folder: &str| module.first().is_some_and(|first| first == folder);
            let own: Vec<_> = uses.iter().filter(|(module, _)| is_of(module, folder)).collect();
            assert!(!own.is_empty(), "{name} has no {folder}");
            for (module, targets) in own {
                let wrong = targets.iter().find(|target| !order[..=n].iter().any(|earlier| is_of(target, earlier)));
                assert_eq!(wrong, None, "{name}: {} uses it", module.join("/"));
            }
        }
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
    // A visibility is no use, and each `super` goes one folder up.
    assert!(of(&[("a", "b::go();"), ("a/b", "pub(in crate::a) fn go() {}")]).is_none());
    assert!(of(&[("d", "use e::f::g::go;"), ("d/e", ""), ("d/e/f/g", "use super::super::super::I;")]).is_some());
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

/// The sources of the library are without unit tests and without the command line.
#[test]
fn the_library_names_no_flag() {
    let of_crates = crates().into_values().flat_map(|source| files(&source));
    for path in of_crates.chain([root().join("src/lib.rs")]) {
        let relative = path.strip_prefix(root()).unwrap();
        let is_test = relative.iter().any(|part| ["tests", "tests.rs", "sample.rs"].iter().any(|name| part == *name));
        // This module spells settings for the command line.
        if is_test || relative == Path::new("crates/report/src/spelling.rs") {
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
    for source in crates().into_values().chain([root().join("src"), root().join("bindings/python/src")]) {
        for path in files(&source) {
            let lines = std::fs::read_to_string(&path).unwrap().lines().count();
            assert!(lines <= 400, "{} has {lines} lines: it is two things", path.display());
        }
    }
}
