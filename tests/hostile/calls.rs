//! Calls of public functions, each under its name, and the faults that they showed.

use motorfit::Error;
use std::collections::BTreeSet;
use std::fmt::Debug;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

/// A call that takes longer hangs: the slowest takes some seconds where a machine is busy.
const HANG: Duration = Duration::from_secs(60);

/// Names of the functions that were called, and what went wrong.
#[derive(Default)]
pub struct Calls {
    /// Functions called, by their public paths.
    pub called: BTreeSet<&'static str>,
    /// Functions that panicked where it is said that they may.
    pub panicked: BTreeSet<&'static str>,
    /// Panics that nothing announces, errors without a remedy, calls that hung.
    pub faults: Vec<String>,
}

impl Calls {
    /// Calls a function that answers whatever its arguments are.
    pub fn call<T>(&mut self, name: &'static str, with: &dyn Debug, work: impl FnOnce() -> T) -> Option<T> {
        let start = Instant::now();
        let answer = self.caught(name, work);
        if answer.is_err() {
            self.fault(name, with, "panicked");
        } else if start.elapsed() > HANG {
            self.fault(name, with, &format!("took {:.0} s", start.elapsed().as_secs_f64()));
        }
        answer.ok()
    }

    /// Calls a function that may refuse its arguments: with a message and a remedy that a terminal can show.
    pub fn ask<T>(
        &mut self,
        name: &'static str,
        with: &dyn Debug,
        work: impl FnOnce() -> motorfit::Result<T>,
    ) -> Option<T> {
        match self.call(name, with, work)? {
            Ok(answer) => Some(answer),
            Err(error) => {
                if let Some(fault) = fault_of(&error) {
                    self.fault(name, with, &fault);
                }
                None
            }
        }
    }

    /// Calls a function whose documentation says for which arguments it panics.
    pub fn may_panic<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> Option<T> {
        let answer = self.caught(name, work);
        if answer.is_err() {
            self.panicked.insert(name);
        }
        answer.ok()
    }

    fn caught<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> std::thread::Result<T> {
        self.called.insert(name);
        catch_unwind(AssertUnwindSafe(work))
    }

    fn fault(&mut self, name: &str, with: &dyn Debug, fault: &str) {
        let shown: String = format!("{with:?}").chars().take(300).collect();
        self.faults.push(format!("{name} of {shown} {fault}"));
    }
}

/// The fault of an error: no remedy, or characters that steer a terminal.
fn fault_of(error: &Error) -> Option<String> {
    let shown = format!("{error} {}", error.hint());
    if error.message().is_empty() || error.hint().is_empty() {
        return Some(format!("is refused without a message and a remedy: {shown}"));
    }
    shown.chars().any(|c| motorfit::text::is_unsafe(c) && c != '\n').then(|| format!("is refused with {shown:?}"))
}

/// Drives functions that answer whatever their arguments are: `drive!(calls, (arguments); "name" => call, …)`.
macro_rules! drive {
    ($calls:expr, $with:expr; $($name:literal => $work:expr),+ $(,)?) => {
        $($calls.call($name, &$with, || { std::hint::black_box(&$work); });)+
    };
}
pub(crate) use drive;

/// The same for functions that may refuse them.
macro_rules! ask {
    ($calls:expr, $with:expr; $($name:literal => $work:expr),+ $(,)?) => {
        $($calls.ask($name, &$with, || $work);)+
    };
}
pub(crate) use ask;
