//! Calls of public functions with hostile arguments, and the faults that they reveal.

use motorfit::Error;
use std::collections::BTreeSet;
use std::fmt::Debug;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

/// Time after which a call counts as hanging; the slowest takes some seconds on a busy machine.
const HANG: Duration = Duration::from_secs(60);

/// Record of the calls and their faults.
#[derive(Default)]
pub struct Calls {
    /// Public paths of the called functions.
    pub called: BTreeSet<&'static str>,
    /// Functions with a documented panic that occurred.
    pub panicked: BTreeSet<&'static str>,
    /// Undocumented panics, errors without a remedy, and calls that hung.
    pub faults: Vec<String>,
}

impl Calls {
    /// Calls a function that must return for all arguments.
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

    /// Calls a function that may return an error, with a message and a remedy without control characters.
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

    /// Calls a function whose documentation has a section on panics.
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

/// Returns the fault of an error: no remedy, or control characters.
fn fault_of(error: &Error) -> Option<String> {
    let shown = format!("{error} {}", error.hint());
    if error.message().is_empty() || error.hint().is_empty() {
        return Some(format!("is refused without a message and a remedy: {shown}"));
    }
    shown.chars().any(|c| motorfit::text::is_unsafe(c) && c != '\n').then(|| format!("is refused with {shown:?}"))
}

/// Calls functions that must return for all arguments: `drive!(calls, (arguments); "name" => call, …)`.
macro_rules! drive {
    ($calls:expr, $with:expr; $($name:literal => $work:expr),+ $(,)?) => {
        $($calls.call($name, &$with, || { std::hint::black_box(&$work); });)+
    };
}
pub(crate) use drive;

/// Calls functions that may return an error: `ask!(calls, (arguments); "name" => call, …)`.
macro_rules! ask {
    ($calls:expr, $with:expr; $($name:literal => $work:expr),+ $(,)?) => {
        $($calls.ask($name, &$with, || $work);)+
    };
}
pub(crate) use ask;
