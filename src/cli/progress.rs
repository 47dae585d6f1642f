//! Progress on stderr: a bar on a terminal, JSON lines on request.

use super::output::{Progress as Kind, Style};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use motorfit::optimize::Progress;
use motorfit::text::significant;
use std::io::Write as _;
use std::time::{Duration, Instant};

/// A run shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_millis(300);
/// Time between JSON lines.
const PACE: Duration = Duration::from_millis(100);

/// Shows the progress of one search.
pub(crate) struct Reporter {
    kind: Kind,
    bar: Option<ProgressBar>,
    started: Instant,
    last: Option<Instant>,
    /// What is counted.
    what: &'static str,
}

impl Reporter {
    pub(crate) fn new(style: &Style) -> Self {
        Self::of(style, "generation")
    }

    pub(crate) fn of(style: &Style, what: &'static str) -> Self {
        Self { kind: style.progress, bar: None, started: Instant::now(), last: None, what }
    }

    pub(crate) fn show(&mut self, progress: &Progress) {
        match self.kind {
            Kind::Hidden => {}
            Kind::Json => self.json(progress),
            Kind::Bar => self.bar(progress),
        }
    }

    fn json(&mut self, progress: &Progress) {
        let done = progress.generation == progress.generations;
        if !done && self.last.is_some_and(|last| last.elapsed() < PACE) {
            return;
        }
        self.last = Some(Instant::now());
        let line = serde_json::json!({
            self.what: progress.generation, format!("{}{}", self.what, if self.what == "batch" { "es" } else { "s" }): progress.generations,
            "evaluations": progress.evaluations, "cost": progress.cost,
        });
        let _ = writeln!(std::io::stderr(), "{line}");
    }

    fn bar(&mut self, progress: &Progress) {
        if self.started.elapsed() < PATIENCE {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let template = format!("{{bar:40}} {} {{pos}}/{{len}}  {{msg}}  {{eta}} left", self.what);
            let style = ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar());
            let target = ProgressDrawTarget::stderr_with_hz(10);
            ProgressBar::with_draw_target(Some(progress.generations as u64), target).with_style(style)
        });
        if !progress.cost.is_nan() {
            bar.set_message(format!("cost {}", significant(progress.cost, 4)));
        }
        bar.set_position(progress.generation as u64);
    }
}

impl Drop for Reporter {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
