//! Proves, without a network: every dependency has a licence that deny.toml allows, comes from crates.io, and is present in one
//! version, except those that deny.toml skips. Cargo.lock is up to date. docs/dependencies.md lists the direct dependencies
//! with their versions, and the unmaintained crates that deny.toml allows.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_possible_truncation, clippy::float_cmp, reason = "small numbers; exact equality is meant")]

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
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
    include_str!("../deny.toml").parse().unwrap()
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

/// Returns the crates of a table of Cargo.toml.
fn direct(manifest: &toml::Table, table: &str) -> Vec<String> {
    manifest[table].as_table().unwrap().keys().cloned().collect()
}

#[test]
fn the_document_lists_direct_dependencies() {
    let document = include_str!("../docs/dependencies.md");
    let manifest: toml::Table = include_str!("../Cargo.toml").parse().unwrap();
    let lock: toml::Table = include_str!("../Cargo.lock").parse().unwrap();
    let built: BTreeSet<(&str, &str)> = lock["package"]
        .as_array()
        .unwrap()
        .iter()
        .map(|package| (package["name"].as_str().unwrap(), package["version"].as_str().unwrap()))
        .collect();
    let mut wanted: BTreeSet<String> = direct(&manifest, "dependencies").into_iter().collect();
    wanted.extend(direct(&manifest, "dev-dependencies"));
    for target in manifest["target"].as_table().unwrap().values() {
        wanted.extend(target["dependencies"].as_table().unwrap().keys().cloned());
    }
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

/// Returns the number of crates that a build of the library with these features compiles on Linux, itself included.
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
        .collect::<BTreeSet<_>>()
        .len()
}

#[test]
fn the_library_alone_stays_small() {
    // A bound leaves no room: a crate more is a decision, which changes the bound here and the table in docs/dependencies.md.
    let table = include_str!("../docs/dependencies.md");
    for (features, bound) in
        [(&["--no-default-features"][..], 69), (&["--no-default-features", "--features", "cli"], 112), (&[], 203)]
    {
        let own = crates(features);
        assert!(own <= bound, "{features:?}: {own} crates, expected at most {bound}");
        assert!(
            table.contains(&format!("| {bound} |")),
            "docs/dependencies.md does not state {bound} crates for {features:?}"
        );
    }
}
