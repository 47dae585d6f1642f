//! Signals that end the program. The first asks the work to end with what it has; work that does not answer is given up after
//! [`GRACE`]. A second signal ends the program at once.

use motorfit::{Error, Result};
use std::io::{IsTerminal as _, Write as _};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The time that work has to answer a signal.
const GRACE: Duration = Duration::from_millis(200);
/// The time that a search has, whose best so far would be lost: one that asks after each piece of a generation.
const SEARCH_GRACE: Duration = Duration::from_secs(2);
/// The time between two looks at work under way.
const LOOK: Duration = Duration::from_millis(5);
/// The signal of Ctrl-C.
const INTERRUPT: usize = 2;

/// The number of the first signal; 0 before.
static SIGNAL: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);
/// True once the work has seen the signal, and ends by itself.
static ANSWERED: AtomicBool = AtomicBool::new(false);
/// True while a search is on its way that has a best so far.
static SEARCHING: AtomicBool = AtomicBool::new(false);
/// The number of files that are being written.
static FILES: Mutex<usize> = Mutex::new(0);
/// The remark on work that is given up.
static REMARK: Mutex<&str> = Mutex::new(NO_RESULT);

pub(crate) const NO_RESULT: &str = "interrupted before there was a result";

/// Returns the exit code of an interrupted program: 128 and the number of the signal.
pub(crate) fn exit_code() -> u8 {
    u8::try_from(128 + number()).unwrap_or(u8::MAX)
}

/// Returns the answer of an observer: work ends after a signal.
pub(crate) fn interrupted() -> ControlFlow<()> {
    if is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// Returns true after a signal. Work that asks has to end when it is.
pub(crate) fn is_interrupted() -> bool {
    let is = SIGNAL.load(Ordering::Relaxed) != 0;
    if is {
        ANSWERED.store(true, Ordering::Relaxed);
    }
    is
}

/// Marks the beginning or the end of a search that has a best so far.
pub(crate) fn searching(is: bool) {
    SEARCHING.store(is, Ordering::Relaxed);
}

/// Replaces the remark on work that is given up.
pub(crate) fn remark(text: &'static str) {
    *REMARK.lock().unwrap_or_else(PoisonError::into_inner) = text;
}

/// A file that is being written: the program is not given up before it is whole, or gone.
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

/// Writes a line on stderr; a line of progress is cleared.
fn say(is_quiet: bool, text: &str) {
    if !is_quiet {
        let mut stderr = std::io::stderr();
        let clear = if stderr.is_terminal() { "\r\x1b[K" } else { "" };
        let _ = writeln!(stderr, "{clear}{text}");
    }
}

/// Ends a program whose work does not answer a signal.
fn give_up(is_quiet: bool, end: impl FnOnce(i32)) {
    let begun = Instant::now();
    loop {
        std::thread::sleep(LOOK);
        if ANSWERED.load(Ordering::Relaxed) {
            std::thread::sleep(GRACE.saturating_sub(begun.elapsed()));
            return say(is_quiet, "interrupted: completing what was found; a second signal ends the program at once");
        }
        let grace = if SEARCHING.load(Ordering::Relaxed) { SEARCH_GRACE } else { GRACE };
        if begun.elapsed() < grace {
            continue;
        }
        // Held to the end: no file is begun any more.
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

/// Listens to Ctrl-C, and where there are such signals to SIGTERM and SIGHUP; one that the caller had ignored stays ignored.
/// SIGXFSZ becomes an error of the write that exceeds the limit.
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
        // In this order: a signal ends the program if there was one before.
        flag::register_conditional_shutdown(signal, 128 + signal, is_second.clone()).map_err(failed)?;
        flag::register(signal, is_second.clone()).map_err(failed)?;
        flag::register_usize(signal, SIGNAL.clone(), signal.unsigned_abs() as usize).map_err(failed)?;
    }
    // Any handler will do: the write is then refused.
    flag::register(SIGXFSZ, Arc::default()).map_err(failed)?;
    let mut signals = Signals::new(heard).map_err(failed)?;
    let wait = move || {
        // One may have come before this could hear it.
        if SIGNAL.load(Ordering::Relaxed) != 0 || signals.forever().next().is_some() {
            give_up(is_quiet, |code| signal_hook::low_level::exit(code));
        }
    };
    std::thread::Builder::new().name("signals".to_owned()).spawn(wait).map_err(failed)?;
    Ok(())
}

/// Listens to Ctrl-C.
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

/// Returns the set of signals that the caller had ignored, signal n at bit n − 1; none where the system does not list them.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let set = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    set.and_then(|set| u64::from_str_radix(set.trim(), 16).ok()).unwrap_or(0)
}
