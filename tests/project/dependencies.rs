//! Proves, without a network: every dependency has a licence that deny.toml allows, comes from crates.io, and is present in one
//! version, except those that deny.toml skips. Cargo.lock is up to date. docs/dependencies.md lists the direct dependencies
//! of all crates of the workspace with their versions, and the unmaintained crates that deny.toml allows.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_possible_truncation, clippy::float_cmp, reason = "small numbers; exact equality is meant")]

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

/// Returns the packages of the program, the library and the Python package on any platform, without those of tests.
fn packages() -> Vec<Value> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--offline", "--locked", "--format-version", "1"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let nodes = metadata["resolve"]["nodes"].as_array().unwrap();
    let roots = metadata["workspace_members"].as_array().unwrap();
    let (mut wanted, mut next) = (BTreeSet::new(), roots.iter().map(|id| id.as_str().unwrap()).collect::<Vec<_>>());
    while let Some(id) = next.pop() {
        if wanted.insert(id) {
            let node = nodes.iter().find(|n| n["id"] == id).unwrap();
            let normal = node["deps"]
                .as_array()
                .unwrap()
                .iter()
                .filter(|dep| dep["dep_kinds"].as_array().unwrap().iter().any(|kind| kind["kind"] != "dev"));
            next.extend(normal.map(|dep| dep["pkg"].as_str().unwrap()));
        }
    }
    let packages = metadata["packages"].as_array().unwrap().iter();
    packages.filter(|p| wanted.contains(p["id"].as_str().unwrap())).cloned().collect()
}

fn rules() -> toml::Table {
    include_str!("../../deny.toml").parse().unwrap()
}

fn strings(value: &toml::Value) -> Vec<String> {
    value.as_array().unwrap().iter().map(|v| v.as_str().unwrap().to_owned()).collect()
}

#[test]
fn licences_are_allowed() {
    let allowed: Vec<spdx::Licensee> =
        strings(&rules()["licenses"]["allow"]).iter().map(|l| spdx::Licensee::parse(l).unwrap()).collect();
    let packages = packages();
    assert!(packages.len() > 30, "the list of packages is too short to be true");
    for package in packages {
        let licence = package["license"].as_str().unwrap_or_else(|| panic!("{} states no licence", package["name"]));
        let expression = spdx::Expression::parse_mode(licence, spdx::ParseMode::LAX).unwrap();
        let fine = expression.evaluate(|requirement| allowed.iter().any(|a| a.satisfies(requirement)));
        assert!(fine, "{} is licensed {licence}, which deny.toml does not allow", package["name"]);
    }
}

#[test]
fn one_version_of_each_from_one_registry() {
    let skipped = strings(&rules()["bans"]["skip"]);
    let mut versions: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for package in packages() {
        let name = package["name"].as_str().unwrap();
        if let Some(source) = package["source"].as_str() {
            assert!(source.contains("crates.io"), "{name} comes from {source}");
        }
        versions.entry(name.to_owned()).or_default().push(package["version"].to_string());
    }
    for (name, versions) in versions {
        assert!(versions.len() == 1 || skipped.contains(&name), "{name} is there in versions {versions:?}");
    }
}

/// Prefix of the crates of the workspace, which are no dependencies.
const OWN: &str = "motorfit";

/// Returns the crates in the tables of a manifest whose names end with "dependencies".
fn direct(manifest: &toml::Table) -> BTreeSet<String> {
    let mut all = BTreeSet::new();
    for (name, table) in manifest.iter().filter_map(|(name, value)| Some((name, value.as_table()?))) {
        match name.as_str() {
            "dependencies" | "dev-dependencies" | "build-dependencies" => all.extend(table.keys().cloned()),
            "target" => all.extend(table.values().flat_map(|of| direct(of.as_table().unwrap()))),
            _ => {}
        }
    }
    all.retain(|name| !name.starts_with(OWN));
    all
}

/// Returns the manifests of the program and of the crates of the library.
fn manifests() -> Vec<toml::Table> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let crates = std::fs::read_dir(root.join("crates")).unwrap().map(|entry| entry.unwrap().path());
    let folders = crates.chain([root.to_owned()]);
    folders.map(|folder| std::fs::read_to_string(folder.join("Cargo.toml")).unwrap().parse().unwrap()).collect()
}

#[test]
fn versions_are_those_of_the_workspace() {
    let manifest: toml::Table = include_str!("../../Cargo.toml").parse().unwrap();
    let shared = manifest["workspace"]["dependencies"].as_table().unwrap();
    let used: BTreeSet<String> = manifests().iter().flat_map(direct).collect();
    let unused: Vec<&String> = shared.keys().filter(|name| !name.starts_with(OWN) && !used.contains(*name)).collect();
    assert!(unused.is_empty(), "no crate uses {unused:?}");
}

#[test]
fn prebuilt_programs_are_fully_optimized() {
    let manifest: toml::Table = include_str!("../../Cargo.toml").parse().unwrap();
    let packages = |profile: &str| manifest["profile"][profile]["package"].as_table().unwrap().clone();
    let (release, dist) = (packages("release"), packages("dist"));
    let key = |of: &toml::Table, name: &str, key: &str| of.get(name)?.get(key)?.as_integer();
    for name in release.keys() {
        for (what, best) in [("opt-level", 3), ("codegen-units", 1)] {
            let given = key(&release, name, what).is_some();
            assert!(!given || key(&dist, name, what) == Some(best), "profile.dist needs {name}.{what} = {best}");
        }
    }
}

#[test]
fn the_document_lists_direct_dependencies() {
    let document = include_str!("../../docs/dependencies.md");
    let lock: toml::Table = include_str!("../../Cargo.lock").parse().unwrap();
    let built: BTreeSet<(&str, &str)> = lock["package"]
        .as_array()
        .unwrap()
        .iter()
        .map(|package| (package["name"].as_str().unwrap(), package["version"].as_str().unwrap()))
        .collect();
    let wanted: BTreeSet<String> = manifests().iter().flat_map(direct).collect();
    let (of_builds, _) = document.split_once("## What a build costs").unwrap();
    let (_, of_tests) = document.split_once("## Tests alone").unwrap();
    let rows = of_builds.lines().chain(of_tests.lines());
    let rows = rows.filter(|line| line.starts_with("| ") && !line.starts_with("| crate"));
    let rows: Vec<Vec<&str>> = rows.map(|row| row.trim_matches('|').split('|').map(str::trim).collect()).collect();
    for row in &rows {
        assert!(built.contains(&(row[0], row[1])), "{} {} is not what Cargo.lock has", row[0], row[1]);
        assert!(row[2..].iter().all(|cell| !cell.is_empty()), "{} says nothing", row[0]);
    }
    let listed: BTreeSet<String> = rows.iter().map(|row| row[0].to_owned()).collect();
    assert_eq!(listed, wanted);
    for ignored in rules()["advisories"]["ignore"].as_array().unwrap() {
        let id = ignored["id"].as_str().unwrap();
        assert!(document.contains(id), "the document does not name {id}");
    }
}

/// Returns the number of crates that a build of the library with these features compiles on Linux, without those of the workspace.
fn crates(features: &[&str]) -> usize {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--locked", "--package", "motorfit", "--target", "x86_64-unknown-linux-gnu"])
        .args(["--edges", "normal,build", "--prefix", "none", "--format", "{p}"])
        .args(features)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .filter_map(|line| line.split(" (").next())
        .filter(|name| !name.starts_with(OWN))
        .collect::<BTreeSet<_>>()
        .len()
}

#[test]
fn the_library_alone_stays_small() {
    // A bound leaves no room: a crate more is a decision, which changes the bound here and the table in docs/dependencies.md.
    let table = include_str!("../../docs/dependencies.md");
    for (features, bound) in
        [(&["--no-default-features"][..], 68), (&["--no-default-features", "--features", "cli"], 111), (&[], 202)]
    {
        let count = crates(features);
        assert!(count <= bound, "{features:?}: {count} crates, expected at most {bound}");
        assert!(
            table.contains(&format!("| {bound} |")),
            "docs/dependencies.md does not state {bound} crates for {features:?}"
        );
    }
}
