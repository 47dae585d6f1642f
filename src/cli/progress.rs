//! Progress on stderr: a bar on a terminal, JSON lines on request.

use super::output::{Progress as Kind, Style};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use motorfit::optimize::Progress;
use motorfit::text::significant;
use serde_json::{Value, json};
use std::io::Write as _;
use std::time::{Duration, Instant};

/// A run shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_millis(300);
/// Time between JSON lines.
const PACE: Duration = Duration::from_millis(100);

/// How far something is.
pub(crate) struct State {
    pub done: u64,
    pub of: u64,
    /// What stands behind the bar.
    pub message: String,
    /// The same as a line of JSON.
    pub line: Value,
}

/// Where progress is shown, whatever it is of.
pub(crate) struct Meter {
    kind: Kind,
    /// Of the bar.
    template: String,
    bar: Option<ProgressBar>,
    started: Instant,
    last: Option<Instant>,
}

impl Meter {
    pub(crate) fn new(style: &Style, template: String) -> Self {
        Self { kind: style.progress, template, bar: None, started: Instant::now(), last: None }
    }

    /// Shows a state, which is asked for where it is due.
    pub(crate) fn show(&mut self, at_end: bool, state: impl FnOnce() -> State) {
        match self.kind {
            Kind::Json if at_end || self.last.is_none_or(|last| last.elapsed() >= PACE) => {
                self.last = Some(Instant::now());
                let _ = writeln!(std::io::stderr(), "{}", state().line);
            }
            Kind::Bar if self.started.elapsed() >= PATIENCE => {
                let State { done, of, message, .. } = state();
                let bar = self.bar.get_or_insert_with(|| {
                    let style =
                        ProgressStyle::with_template(&self.template).unwrap_or_else(|_| ProgressStyle::default_bar());
                    ProgressBar::with_draw_target(Some(of), ProgressDrawTarget::stderr_with_hz(10)).with_style(style)
                });
                bar.set_message(message);
                bar.set_position(done);
            }
            _ => {}
        }
    }
}

impl Drop for Meter {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Shows the progress of one search.
pub(crate) struct Reporter {
    meter: Meter,
    /// What is counted.
    what: &'static str,
}

impl Reporter {
    pub(crate) fn new(style: &Style) -> Self {
        Self::of(style, "generation")
    }

    pub(crate) fn of(style: &Style, what: &'static str) -> Self {
        let template = format!("{{bar:40}} {what} {{pos}}/{{len}}  {{msg}}  {{eta}} left");
        Self { meter: Meter::new(style, template), what }
    }

    pub(crate) fn show(&mut self, progress: &Progress) {
        let what = self.what;
        self.meter.show(progress.generation == progress.generations, || {
            let known = !progress.cost.is_nan();
            let many = format!("{what}{}", if what == "batch" { "es" } else { "s" });
            State {
                done: progress.generation as u64,
                of: progress.generations as u64,
                message: if known { format!("cost {}", significant(progress.cost, 4)) } else { String::new() },
                line: json!({
                    what: progress.generation, many: progress.generations, "evaluations": progress.evaluations,
                    "cost": progress.cost,
                }),
            }
        });
    }
}
