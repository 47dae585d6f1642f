//! Rule on the clock: jitter and gaps.

use super::finding::Finding;
use super::view::View;
use crate::heading::Quantity;
use motorfit_core::numeric::{differences, peak, runs, standard_deviation};
use motorfit_core::setting::text;
use motorfit_core::text::significant;

/// Largest standard deviation of the steps, relative to the period, of a regular clock.
const SPREAD: f64 = 0.03;
/// Longest step that is not a gap \[periods\].
const GAP: f64 = 1.4;

pub(super) fn jitter(view: &View<'_>, findings: &mut Vec<Finding>) {
    let (time, period) = (view.time, view.period());
    let steps = differences(time);
    let spread = standard_deviation(&steps) / period;
    let longest = peak(&steps) / period;
    if spread <= SPREAD && longest <= GAP {
        return;
    }
    let gaps = runs(steps.len(), |n| steps[n] > GAP * period);
    let percent = significant(100.0 * spread, 2);
    let mut message = format!("steps between samples vary by {percent} % of the period (standard deviation)");
    if !gaps.is_empty() {
        message += &format!(", {} of them are gaps, the longest of {} periods", gaps.len(), significant(longest, 3));
    }
    let remedy = if are_two_values(&steps, period) {
        message += "; they take two values, as if the times were rounded too coarsely";
        text!(
            "If a timer took the samples, leave out the time column and give " [Rate = "HZ"] "; otherwise record times \
             with more digits."
        )
    } else {
        "Each step is simulated with its length, so that parameters stay unbiased; a timer is better.".into()
    };
    let places = gaps.into_iter().map(|gap| gap.start..gap.end + 1);
    let finding = Finding::new("jitter", Quantity::Time, message, remedy).mention_if(spread <= SPREAD).at(places);
    findings.push(finding.figure("spread", spread).figure("longest", longest));
}

/// Returns true if the steps take exactly two values, within a millionth of the period.
fn are_two_values(steps: &[f64], period: f64) -> bool {
    let is = |value: f64, step: &&f64| (value - **step).abs() <= 1e-6 * period;
    let second = steps.iter().find(|step| !is(steps[0], step));
    second.is_some_and(|second| steps.iter().all(|step| is(steps[0], &step) || is(*second, &step)))
}
