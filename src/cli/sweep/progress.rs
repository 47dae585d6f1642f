//! Progress of a sweep on stderr: runs, rate, remaining time; a bar on a terminal, JSON lines on request.

use crate::cli::output::{Progress as Kind, Style};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use motorfit::study::sweep::SweepProgress;
use motorfit::text::significant;
use std::io::Write as _;
use std::time::{Duration, Instant};

/// A run shorter than this shows no bar.
const PATIENCE_S: f64 = 0.3;
/// Time between JSON lines.
const PACE: Duration = Duration::from_millis(100);

/// Shows the progress of a sweep.
pub(super) struct SweepReporter {
    kind: Kind,
    bar: Option<ProgressBar>,
    last: Option<Instant>,
}

impl SweepReporter {
    pub(super) fn new(style: &Style) -> Self {
        Self { kind: style.progress, bar: None, last: None }
    }

    pub(super) fn show(&mut self, progress: &SweepProgress) {
        match self.kind {
            Kind::Hidden => {}
            Kind::Json => self.json(progress),
            Kind::Bar => self.bar(progress),
        }
    }

    fn json(&mut self, progress: &SweepProgress) {
        let at_end = progress.done == progress.total;
        if !at_end && self.last.is_some_and(|last| last.elapsed() < PACE) {
            return;
        }
        self.last = Some(Instant::now());
        let line = serde_json::json!({
            "runs": progress.done, "of": progress.total, "failed": progress.failed, "seconds": progress.seconds,
            "runs_per_second": progress.rate(), "remaining_s": progress.remaining(),
        });
        let _ = writeln!(std::io::stderr(), "{line}");
    }

    fn bar(&mut self, progress: &SweepProgress) {
        if progress.seconds < PATIENCE_S {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let style = ProgressStyle::with_template("{bar:40} run {pos}/{len}  {msg}")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::with_draw_target(Some(progress.total), ProgressDrawTarget::stderr_with_hz(10))
                .with_style(style)
        });
        let mut message = progress.rate().map_or_else(String::new, |rate| format!("{} a second", significant(rate, 3)));
        if let Some(seconds) = progress.remaining().filter(|s| *s < 1e9) {
            let left = indicatif::HumanDuration(Duration::from_secs_f64(seconds));
            message.push_str(&format!("  {left:#} left"));
        }
        if progress.failed > 0 {
            message.push_str(&format!("  {} failed", progress.failed));
        }
        bar.set_message(message);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of runs, not negative")]
        bar.set_position(progress.done + progress.under_way as u64);
    }
}

impl Drop for SweepReporter {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
