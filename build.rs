//! Links the program at fixed addresses on Linux: 47,000 relocations would otherwise add 0.4 ms to every start (`docs/benchmarks.md`).
//! Libraries, stack and heap stay at random addresses.
//!
//! Puts the page into the program if `MOTORFIT_PAGE` names the folder that `web/build` made.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=MOTORFIT_PAGE");
    let of = |key: &str| std::env::var(key).unwrap_or_default();
    let target = ["CARGO_CFG_TARGET_OS", "CARGO_CFG_TARGET_ARCH", "CARGO_CFG_TARGET_ENV"].map(of);
    if target == ["linux", "x86_64", "gnu"] {
        println!("cargo::rustc-link-arg-bins=-no-pie");
    }
    // Only the program serves the page.
    let page = if of("CARGO_FEATURE_VIEW").is_empty() { String::new() } else { of("MOTORFIT_PAGE") };
    let mut files = Vec::new();
    if !page.is_empty() {
        println!("cargo::rerun-if-changed={page}");
        let folder = Path::new(&page);
        collect(folder, folder, &mut files);
        assert!(
            files.iter().any(|(name, _)| name == "index.html"),
            "MOTORFIT_PAGE: {page} has no index.html; run web/build"
        );
    }
    let mut text = "&[".to_owned();
    for (name, path) in &files {
        let _ = write!(text, "({name:?}, include_bytes!({:?})),", path.display().to_string());
    }
    text.push(']');
    let to = Path::new(&of("OUT_DIR")).join("page.rs");
    if let Err(error) = std::fs::write(&to, text) {
        panic!("{}: {error}", to.display());
    }
}

/// Collects the names of files relative to `root`, and their paths. A file that is compressed too is left out for its compressed form.
fn collect(root: &Path, folder: &Path, files: &mut Vec<(String, PathBuf)>) {
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            collect(root, &path, files);
            continue;
        }
        let compressed = PathBuf::from(format!("{}.gz", path.display()));
        let name = path.strip_prefix(root).map(|name| name.to_string_lossy().replace('\\', "/")).unwrap_or_default();
        // The page itself is changed where it is served.
        let is_left_out = if name.starts_with("index.html") { name.ends_with(".gz") } else { compressed.exists() };
        if !is_left_out && !name.starts_with("service-worker.js") && name != "_headers" {
            let path = path.canonicalize().unwrap_or(path);
            files.push((name, path));
        }
    }
}
