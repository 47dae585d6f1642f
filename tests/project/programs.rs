//! Proves: each file of `tests` is a module of a program that Cargo.toml declares; there are at most twelve programs, and the number
//! of tests does not shrink.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use syn::{Expr, ExprLit, Item, Lit};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
/// Largest number of test programs, each of which links the whole library.
const PROGRAMS: usize = 12;
/// Smallest number of tests in the workspace, unit tests included.
const TESTS: usize = 922;

fn sources(folder: &Path, all: &mut BTreeSet<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() {
            sources(&entry, all);
        } else if entry.extension().is_some_and(|ending| ending == "rs") {
            all.insert(entry);
        }
    }
}

/// Returns the sources below folders of the project.
fn below(folders: &[&str]) -> BTreeSet<PathBuf> {
    let mut all = BTreeSet::new();
    folders.iter().for_each(|folder| sources(&Path::new(ROOT).join(folder), &mut all));
    all
}

/// Returns the files of the test programs that a manifest declares.
fn declared(manifest: &Path) -> Vec<PathBuf> {
    let text: toml::Table = std::fs::read_to_string(manifest).unwrap().parse().unwrap();
    let tests = text.get("test").and_then(|tests| tests.as_array()).cloned().unwrap_or_default();
    tests.iter().map(|test| manifest.with_file_name(test["path"].as_str().unwrap())).collect()
}

/// Returns the path that an attribute gives a module.
fn given(attributes: &[syn::Attribute]) -> Option<String> {
    let attribute = attributes.iter().find(|attribute| attribute.path().is_ident("path"))?;
    match &attribute.meta.require_name_value().unwrap().value {
        Expr::Lit(ExprLit { lit: Lit::Str(path), .. }) => Some(path.value()),
        _ => None,
    }
}

/// Returns the path without its components `..`.
fn straight(path: &Path) -> PathBuf {
    let mut straight = PathBuf::new();
    for part in path.components() {
        if part.as_os_str() == ".." {
            straight.pop();
        } else {
            straight.push(part);
        }
    }
    straight
}

/// Collects a file and those of its modules, whose folder is `folder`.
fn reach(file: &Path, folder: &Path, all: &mut BTreeSet<PathBuf>) {
    if !all.insert(file.to_owned()) {
        return;
    }
    for item in syn::parse_file(&std::fs::read_to_string(file).unwrap()).unwrap().items {
        let Item::Mod(module) = item else { continue };
        if module.content.is_some() {
            continue;
        }
        let name = module.ident.to_string();
        let next = match given(&module.attrs) {
            Some(path) => straight(&file.with_file_name(path)),
            None => folder.join(format!("{name}.rs")),
        };
        let next = if next.exists() { next } else { folder.join(&name).join("mod.rs") };
        let is_named = next.file_stem().is_some_and(|stem| stem != "mod");
        reach(&next, &if is_named { next.with_extension("") } else { next.parent().unwrap().to_owned() }, all);
    }
}

#[test]
fn each_file_is_part_of_a_program() {
    let programs = declared(&Path::new(ROOT).join("Cargo.toml"));
    let mut reached = BTreeSet::new();
    for program in &programs {
        reach(program, program.parent().unwrap(), &mut reached);
    }
    let left_out: Vec<PathBuf> = below(&["tests"]).into_iter().filter(|file| !reached.contains(file)).collect();
    assert!(left_out.is_empty(), "no program of Cargo.toml declares {left_out:#?}");
}

#[test]
fn the_workspace_has_few_programs() {
    let crates = std::fs::read_dir(Path::new(ROOT).join("crates")).unwrap().map(|entry| entry.unwrap().path());
    let mut count = declared(&Path::new(ROOT).join("Cargo.toml")).len();
    for folder in crates {
        // A crate that declares its programs has them counted by its manifest, another by its files.
        let declared = declared(&folder.join("Cargo.toml")).len();
        let files = std::fs::read_dir(folder.join("tests")).into_iter().flatten();
        count += if declared > 0 { declared } else { files.count() };
    }
    assert!((5..=PROGRAMS).contains(&count), "{count} programs link the library");
}

#[test]
fn no_test_is_lost() {
    let attribute = |line: &&str| line.trim() == "#[test]";
    let count: usize = below(&["src", "crates", "tests"])
        .into_iter()
        .map(|file| std::fs::read_to_string(file).unwrap().lines().filter(attribute).count())
        .sum();
    assert!(count >= TESTS, "{count} tests, of {TESTS}");
}
