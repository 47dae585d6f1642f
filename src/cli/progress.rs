//! Progress on stderr: a bar on a terminal, JSON lines on request.

use super::output::{Progress as Kind, Style};
use super::terminal::{Stream, width};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use motorfit::numeric::whole_u64;
use motorfit::optimize::Progress;
use motorfit::study::sweep::SweepProgress;
use motorfit::text::significant;
use serde_json::{Value, json};
use std::io::Write as _;
use std::time::{Duration, Instant};

/// Time before a bar is shown.
const BAR_DELAY: Duration = Duration::from_millis(300);
/// Width of a terminal from which on the bar is long \[characters\].
const WIDE: usize = 100;
/// Shortest time between JSON lines.
const JSON_INTERVAL: Duration = Duration::from_millis(100);

struct State {
    done: u64,
    of: u64,
    /// Text after the bar.
    message: String,
    /// The state as a line of JSON.
    line: Value,
}

struct Meter {
    kind: Kind,
    template: String,
    bar: Option<ProgressBar>,
    started: Instant,
    last: Option<Instant>,
}

impl Meter {
    fn new(style: &Style, template: String) -> Self {
        // The message is cut at the end of the line, so that the bar keeps to one line.
        let bar = match width(Stream::Stderr) {
            Some(columns) if columns < WIDE => 10,
            _ => 40,
        };
        let template = format!("{{bar:{bar}}} {template}");
        Self { kind: style.progress, template, bar: None, started: Instant::now(), last: None }
    }

    /// Shows a state. The closure is called only if an update is due.
    fn show(&mut self, at_end: bool, state: impl FnOnce() -> State) {
        match self.kind {
            Kind::Json if at_end || self.last.is_none_or(|last| last.elapsed() >= JSON_INTERVAL) => {
                self.last = Some(Instant::now());
                let _ = writeln!(std::io::stderr(), "{}", state().line);
            }
            Kind::Bar if self.started.elapsed() >= BAR_DELAY => {
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

/// Returns an observer that shows the progress of a search; `what` is the unit that is counted.
pub(crate) fn reporter(style: &Style, what: &'static str) -> impl FnMut(&Progress) {
    let mut meter = Meter::new(style, format!("{what} {{pos}}/{{len}}  {{eta}} left  {{wide_msg}}"));
    let many = format!("{what}{}", if what == "batch" { "es" } else { "s" });
    move |progress| {
        let &Progress { generation, generations, evaluations, cost } = progress;
        meter.show(generation == generations, || State {
            done: generation as u64,
            of: generations as u64,
            message: if cost.is_nan() { String::new() } else { format!("cost {}", significant(cost, 4)) },
            line: json!({what: generation, many.as_str(): generations, "evaluations": evaluations, "cost": cost}),
        });
    }
}

pub(crate) fn sweep_reporter(style: &Style) -> impl FnMut(&SweepProgress) {
    let mut meter = Meter::new(style, "run {pos}/{len}  {wide_msg}".to_owned());
    move |progress| {
        meter.show(progress.done == progress.total, || State {
            done: progress.done + whole_u64(progress.under_way),
            of: progress.total,
            message: rate_text(progress),
            line: json!({
                "runs": progress.done, "of": progress.total, "failed": progress.failed, "seconds": progress.seconds,
                "runs_per_second": progress.rate(), "remaining_s": progress.remaining(),
            }),
        });
    }
}

fn rate_text(progress: &SweepProgress) -> String {
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
