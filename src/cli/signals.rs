//! Signals that end the program. After the first the computation stops and its partial result is reported; if it does not react
//! within [`GRACE`] ([`SEARCH_GRACE`] for a search), the program ends without a result, but not before a file that is being
//! written is complete or removed. A second signal ends the program at once.

use motorfit::{Error, Result};
use std::io::{IsTerminal as _, Write as _};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time in which a computation must react to a signal.
const GRACE: Duration = Duration::from_millis(200);
/// Time in which a search must react. It is longer, since a search checks for signals after each part of a generation only and
/// its best candidate would be lost.
const SEARCH_GRACE: Duration = Duration::from_secs(2);
/// Time between two checks of a running computation.
const LOOK: Duration = Duration::from_millis(5);
/// Number of the signal of Ctrl-C.
const INTERRUPT: usize = 2;

/// Number of the first signal received; 0 if there was none.
static SIGNAL: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);
/// True once the computation has seen the signal and is stopping.
static ANSWERED: AtomicBool = AtomicBool::new(false);
/// True while a search runs that has a best candidate.
static SEARCHING: AtomicBool = AtomicBool::new(false);
/// Number of files that are being written.
static FILES: Mutex<usize> = Mutex::new(0);
/// Message printed if the computation does not react.
static REMARK: Mutex<&str> = Mutex::new(NO_RESULT);

pub(crate) const NO_RESULT: &str = "interrupted before there was a result";

/// Returns the exit code of an interrupted program: 128 plus the number of the signal.
pub(crate) fn exit_code() -> u8 {
    u8::try_from(128 + number()).unwrap_or(u8::MAX)
}

/// Returns the value for an observer to return: `Break` after a signal.
pub(crate) fn interrupted() -> ControlFlow<()> {
    if is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// Returns true after a signal. The caller must then stop.
pub(crate) fn is_interrupted() -> bool {
    let is = SIGNAL.load(Ordering::Relaxed) != 0;
    if is {
        ANSWERED.store(true, Ordering::Relaxed);
    }
    is
}

/// Marks the start or the end of a search that has a best candidate.
pub(crate) fn searching(is: bool) {
    SEARCHING.store(is, Ordering::Relaxed);
}

/// Replaces the message printed if the computation does not react.
pub(crate) fn remark(text: &'static str) {
    *REMARK.lock().unwrap_or_else(PoisonError::into_inner) = text;
}

/// Guard of a file that is being written: the program is not ended before the file is complete or removed.
pub(crate) struct FileUnderWay(());

impl FileUnderWay {
    pub(crate) fn begin() -> Self {
        *FILES.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        Self(())
    }
}

impl Drop for FileUnderWay {
    fn drop(&mut self) {
        *FILES.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
    }
}

fn number() -> usize {
    match SIGNAL.load(Ordering::Relaxed) {
        0 => INTERRUPT,
        number => number,
    }
}

/// Writes a line to stderr in place of a progress bar.
fn say(is_quiet: bool, text: &str) {
    if !is_quiet {
        let mut stderr = std::io::stderr();
        let clear = if stderr.is_terminal() { "\r\x1b[K" } else { "" };
        let _ = writeln!(stderr, "{clear}{text}");
    }
}

/// Ends the program if its computation does not react to a signal in time.
fn give_up(is_quiet: bool, end: impl FnOnce(i32)) {
    let begun = Instant::now();
    loop {
        std::thread::sleep(LOOK);
        if ANSWERED.load(Ordering::Relaxed) {
            std::thread::sleep(GRACE.saturating_sub(begun.elapsed()));
            return say(
                is_quiet,
                "interrupted: completing the result so far; a second signal ends the program at once",
            );
        }
        let grace = if SEARCHING.load(Ordering::Relaxed) { SEARCH_GRACE } else { GRACE };
        if begun.elapsed() < grace {
            continue;
        }
        // The lock is kept until the program ends, so that no other file is begun.
        let files = FILES.lock().unwrap_or_else(PoisonError::into_inner);
        if *files == 0 {
            say(is_quiet, &REMARK.lock().unwrap_or_else(PoisonError::into_inner));
            return end(exit_code().into());
        }
    }
}

fn failed(error: &std::io::Error) -> Error {
    Error::data(format!("signals cannot be handled: {error}"), "Try again.")
}

/// Installs handlers of SIGINT, SIGTERM and SIGHUP, except for signals that the parent process ignored. SIGXFSZ is caught too,
/// so that the write that exceeds the limit returns an error.
#[cfg(unix)]
pub(crate) fn listen(is_quiet: bool) -> Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    use signal_hook::flag;
    use signal_hook::iterator::Signals;

    let failed = |error: std::io::Error| failed(&error);
    let is_second = Arc::new(AtomicBool::new(false));
    let ignored = ignored();
    let heard = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    for signal in heard.clone() {
        // The order matters: the first handler ends the program only if an earlier signal has set the flag.
        flag::register_conditional_shutdown(signal, 128 + signal, is_second.clone()).map_err(failed)?;
        flag::register(signal, is_second.clone()).map_err(failed)?;
        flag::register_usize(signal, SIGNAL.clone(), signal.unsigned_abs() as usize).map_err(failed)?;
    }
    // With any handler the write fails with an error instead of ending the program.
    flag::register(SIGXFSZ, Arc::default()).map_err(failed)?;
    let mut signals = Signals::new(heard).map_err(failed)?;
    let wait = move || {
        // A signal may have arrived before this iterator was created.
        if SIGNAL.load(Ordering::Relaxed) != 0 || signals.forever().next().is_some() {
            give_up(is_quiet, |code| signal_hook::low_level::exit(code));
        }
    };
    std::thread::Builder::new().name("signals".to_owned()).spawn(wait).map_err(failed)?;
    Ok(())
}

/// Installs a handler of Ctrl-C.
#[cfg(not(unix))]
pub(crate) fn listen(is_quiet: bool) -> Result<()> {
    let interrupted = move || {
        if SIGNAL.swap(INTERRUPT, Ordering::Relaxed) != 0 {
            std::process::exit(exit_code().into());
        }
        std::thread::spawn(move || give_up(is_quiet, |code| std::process::exit(code)));
    };
    ctrlc::set_handler(interrupted).map_err(|error| failed(&std::io::Error::other(error)))
}

/// Returns the set of signals that the parent process ignored, signal n at bit n − 1; empty if the system does not list them.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let set = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    set.and_then(|set| u64::from_str_radix(set.trim(), 16).ok()).unwrap_or(0)
}
