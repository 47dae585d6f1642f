//! Folder of real recordings.
#![allow(clippy::print_stdout, reason = "a skip is printed")]

use std::path::{Path, PathBuf};

/// Returns the folder of a set of real recordings; prints a note and returns `None` if it does not exist. With
/// `MOTORFIT_NO_SKIP` that is a failure.
pub fn set(name: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("MOTORFIT_RECORDINGS") else {
        assert!(std::env::var_os("MOTORFIT_NO_SKIP").is_none(), "MOTORFIT_RECORDINGS is not set: skips are failures");
        println!("SKIPPED: set MOTORFIT_RECORDINGS to the folder of real recordings");
        return None;
    };
    Some(Path::new(&folder).join(name))
}
