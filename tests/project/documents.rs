//! Proves: links of the documents are valid, the book lists all pages, README and ARCHITECTURE have at most 150 lines, and
//! expressions that were replaced by terms of the field do not return; doc comments do not begin as riddles.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}

/// Returns a folder of each crate.
fn in_crates(folder: &str) -> Vec<String> {
    let crates = std::fs::read_dir(Path::new(ROOT).join("crates")).unwrap();
    let names = crates.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.map(|name| format!("crates/{name}{folder}")).collect()
}

/// Returns the Markdown files of the project's root, of `docs`, of the crates, of the Python package and of the measurements.
fn documents() -> Vec<PathBuf> {
    let folders = ["", "docs", "bindings/python", "benches/results"].map(str::to_owned);
    let folders = folders.into_iter().chain(in_crates(""));
    let entries = folders.flat_map(|folder| std::fs::read_dir(Path::new(ROOT).join(folder)).unwrap());
    let mut all: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    all.retain(|path| path.extension().is_some_and(|ending| ending == "md"));
    all.sort();
    all
}

/// Returns a document without its code blocks.
fn prose(text: &str) -> String {
    let mut inside = false;
    let mut outside = |line: &&str| {
        let fence = line.starts_with("```");
        inside ^= fence;
        !inside && !fence
    };
    text.lines().filter(|line| outside(line)).map(|line| line.to_owned() + "\n").collect()
}

/// Returns the targets of the links of a text.
fn links(text: &str) -> Vec<String> {
    let ends = text.split("](").skip(1);
    ends.filter_map(|rest| rest.split_once(')')).map(|(target, _)| target.split_whitespace().collect()).collect()
}

/// Returns the anchor that forges generate for a heading.
fn anchor(heading: &str) -> String {
    let kept = heading
        .to_lowercase()
        .chars()
        .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
        .collect::<String>();
    kept.trim().replace(' ', "-")
}

fn anchors(path: &Path) -> BTreeSet<String> {
    prose(&read(path))
        .lines()
        .filter(|line| line.starts_with('#'))
        .map(|line| anchor(line.trim_start_matches('#')))
        .collect()
}

#[test]
fn links_are_valid() {
    let mut broken = Vec::new();
    let mut count = 0;
    for document in documents() {
        for link in links(&prose(&read(&document))) {
            if link.starts_with("https://") {
                continue;
            }
            count += 1;
            let (file, place) = link.split_once('#').map_or((link.as_str(), None), |(file, place)| (file, Some(place)));
            let target = if file.is_empty() { document.clone() } else { document.parent().unwrap().join(file) };
            let is_there = target.exists() && place.is_none_or(|place| anchors(&target).contains(place));
            if !is_there {
                broken.push(format!("{}: {link}", document.display()));
            }
        }
    }
    assert!(broken.is_empty() && count > 60, "{count} links: {broken:#?}");
}

#[test]
fn the_book_lists_every_page() {
    let docs = Path::new(ROOT).join("docs");
    let listed: BTreeSet<String> = links(&read(&docs.join("SUMMARY.md"))).into_iter().collect();
    let pages = documents().into_iter().filter(|path| path.parent() == Some(&docs));
    let names: BTreeSet<String> = pages.map(|path| path.file_name().unwrap().to_str().unwrap().to_owned()).collect();
    let pages: BTreeSet<String> = names.into_iter().filter(|name| name != "SUMMARY.md").collect();
    assert_eq!(listed, pages);
}

#[test]
fn readme_and_architecture_are_short() {
    for name in ["README.md", "ARCHITECTURE.md"] {
        let lines = read(&Path::new(ROOT).join(name)).lines().count();
        assert!(lines <= 150, "{name} has {lines} lines");
    }
}

/// Expressions for which the field has terms.
const GONE: [&str; 28] = [
    "so-manieth",
    "stand-in motor",
    "below which difference nothing is said",
    "imitate each other",
    "nothing is half understood",
    "unpacked once into nothing",
    "a test that finds nothing says nothing",
    "the last lasts on",
    "does not spoil the rest",
    "react over a step with as much",
    "shows the ladder",
    "as may be elsewhere",
    "cannot tell",
    "does not tell",
    "do not tell",
    "nothing would tell",
    "error in words",
    "held, it would act",
    "stands for those",
    "unknown by itself",
    "a map without numbers",
    "course of the voltage",
    "line between samples",
    "lines between samples",
    "what is left of",
    "speaks for",
    "whole box",
    "repeatability ceiling",
];

fn sources(folder: &Path, all: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() {
            sources(&entry, all);
        } else if entry.extension().is_some_and(|ending| ["rs", "wgsl", "py", "toml"].iter().any(|of| ending == *of)) {
            all.push(entry);
        }
    }
}

#[test]
fn replaced_expressions_do_not_return() {
    let mut all = documents();
    let folders = ["src", "shaders", "examples", "benches", "bindings/python/src", "bindings/python/python"];
    for folder in folders.map(str::to_owned).into_iter().chain(in_crates("/src")) {
        sources(&Path::new(ROOT).join(folder), &mut all);
    }
    let mut found = Vec::new();
    for path in all {
        // Lines are joined, because sentences span several lines.
        let text = read(&path).to_lowercase();
        let words: Vec<&str> =
            text.split_whitespace().filter(|word| !["//", "///", "//!", "#"].contains(word)).collect();
        let text = words.join(" ");
        found.extend(GONE.iter().filter(|gone| text.contains(*gone)).map(|gone| format!("{}: {gone}", path.display())));
    }
    assert!(found.is_empty(), "{found:#?}");
}

/// First words of doc comments that are riddles, or fragments that need the comment before them.
const RIDDLES: [&str; 11] = ["What", "Whether", "How", "Why", "Of", "Those", "That", "Its", "Such", "Who", "Which"];

#[test]
fn doc_comments_are_sentences_not_riddles() {
    let mut all = Vec::new();
    let folders = ["src", "shaders", "examples", "benches", "tests", "bindings/python/src", "fuzz"];
    for folder in folders.map(str::to_owned).into_iter().chain(in_crates("/src")) {
        sources(&Path::new(ROOT).join(folder), &mut all);
    }
    let mut found = Vec::new();
    for path in all {
        let text = read(&path);
        let mut before = "";
        for line in text.lines().map(str::trim) {
            let begins = |mark: &str| {
                line.strip_prefix(mark).is_some_and(|rest| {
                    !before.starts_with(mark.trim()) && {
                        RIDDLES.iter().any(|word| rest.split(' ').next() == Some(word))
                    }
                })
            };
            if begins("/// ") || begins("//! ") {
                found.push(format!("{}: {line}", path.display()));
            }
            before = if line == "///" || line == "//!" { "" } else { line };
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}
