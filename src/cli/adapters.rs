//! The environment of graphics drivers.

/// Runs the program again with a runtime folder in its environment if it is about to open graphics adapters without one: a driver
/// would print "error: XDG_RUNTIME_DIR is invalid or not set" among the messages of this program. The process stays the same, and
/// nothing has been read or written yet. Returns if there is nothing to do or the program cannot be run again.
#[cfg(all(unix, feature = "gpu"))]
pub(super) fn with_runtime_folder() {
    use std::os::unix::process::CommandExt as _;
    const NAME: &str = "XDG_RUNTIME_DIR";
    let opens =
        |word: std::ffi::OsString| word == "devices" || word == "bench" || word.to_string_lossy().contains("gpu");
    if std::env::var_os(NAME).is_some() || !std::env::args_os().skip(1).any(opens) {
        return;
    }
    let Ok(program) = std::env::current_exe() else { return };
    // Only a failure returns; the driver's message is then printed.
    let mut again = std::process::Command::new(program);
    let _ = again.args(std::env::args_os().skip(1)).env(NAME, std::env::temp_dir()).exec();
}

/// Does nothing: only drivers of Unix systems print the message.
#[cfg(not(all(unix, feature = "gpu")))]
pub(super) fn with_runtime_folder() {}
