//! Proves: the addresses from which cargo-binstall installs are those of the archives that packaging/make writes, and the release has
//! each of its five platforms built and tried. Does not prove: that they build there; the workflow itself does.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

const TARGETS: [(&str, &str); 5] = [
    ("x86_64-unknown-linux-gnu", ".tar.gz"),
    ("aarch64-unknown-linux-gnu", ".tar.gz"),
    ("x86_64-apple-darwin", ".tar.gz"),
    ("aarch64-apple-darwin", ".tar.gz"),
    ("x86_64-pc-windows-msvc", ".zip"),
];

#[test]
fn binstall_finds_the_archives_of_the_release() {
    let manifest: toml::Table = include_str!("../../Cargo.toml").parse().unwrap();
    let metadata = &manifest["package"]["metadata"]["binstall"];
    let version = env!("CARGO_PKG_VERSION");
    for (target, suffix) in TARGETS {
        let format =
            metadata["overrides"].get(target).map_or(&metadata["pkg-fmt"], |own| &own["pkg-fmt"]).as_str().unwrap();
        assert_eq!(format, if suffix == ".zip" { "zip" } else { "tgz" }, "{target}");
        let spelled = |template: &str| {
            template.replace("{ name }", "motorfit").replace("{ version }", version).replace("{ target }", target)
        };
        let folder = format!("motorfit-{version}-{target}");
        let address = spelled(metadata["pkg-url"].as_str().unwrap());
        assert_eq!(address, format!("{{ repo }}/releases/download/v{version}/{folder}{{ archive-suffix }}"));
        assert_eq!(spelled(metadata["bin-dir"].as_str().unwrap()), format!("{folder}/{{ bin }}{{ binary-ext }}"));
    }
    let make = include_str!("../../packaging/make");
    assert!(make.contains(r#"f"motorfit-{version()}-{target()}""#), "packaging/make names archives otherwise");
    for suffix in [r#"f"{name}.tar.gz""#, r#"f"{name}.zip""#, r#"f"{name}/{path}""#] {
        assert!(make.contains(suffix), "packaging/make does not write {suffix}");
    }
}

#[test]
fn each_platform_is_built_and_tried() {
    let workflow = include_str!("../../.github/workflows/release.yml");
    let (built, tried) = workflow.split_once("\n  try:\n").unwrap();
    for (target, _) in TARGETS {
        let line = format!("- target: {target}\n");
        assert_eq!((built.matches(&line).count(), tried.matches(&line).count()), (1, 1), "{target}");
    }
}
