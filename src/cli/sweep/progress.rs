//! Progress of a sweep: runs, rate, remaining time.

use crate::cli::output::Style;
use crate::cli::progress::{Meter, State};
use motorfit::numeric::whole_u64;
use motorfit::study::sweep::SweepProgress;
use motorfit::text::significant;
use serde_json::json;
use std::time::Duration;

/// Shows the progress of a sweep.
pub(super) struct SweepReporter(Meter);

impl SweepReporter {
    pub(super) fn new(style: &Style) -> Self {
        Self(Meter::new(style, "{bar:40} run {pos}/{len}  {msg}".to_owned()))
    }

    pub(super) fn show(&mut self, progress: &SweepProgress) {
        self.0.show(progress.done == progress.total, || {
            let line = json!({
                "runs": progress.done, "of": progress.total, "failed": progress.failed, "seconds": progress.seconds,
                "runs_per_second": progress.rate(), "remaining_s": progress.remaining(),
            });
            let done = progress.done + whole_u64(progress.under_way);
            State { done, of: progress.total, message: message(progress), line }
        });
    }
}

/// Rate, time left, failures.
fn message(progress: &SweepProgress) -> String {
    let mut text = progress.rate().map_or_else(String::new, |rate| format!("{} a second", significant(rate, 3)));
    if let Some(seconds) = progress.remaining().filter(|s| *s < 1e9) {
        let left = indicatif::HumanDuration(Duration::from_secs_f64(seconds));
        text.push_str(&format!("  {left:#} left"));
    }
    if progress.failed > 0 {
        text.push_str(&format!("  {} failed", progress.failed));
    }
    text
}
