//! The clock: jitter and gaps.

use super::Finding;
use super::view::View;
use crate::numeric::{runs, standard_deviation};
use crate::record::Quantity;
use crate::setting::text;
use crate::text::significant;

/// Standard deviation of the steps over the period from which on it is jitter.
const SPREAD: f64 = 0.03;
/// A step of so many periods is a gap.
const GAP: f64 = 1.4;

pub(super) fn jitter(view: &View<'_>, findings: &mut Vec<Finding>) {
    let (time, period) = (view.time, view.period());
    let steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    let spread = standard_deviation(&steps) / period;
    let longest = steps.iter().fold(0.0, |longest: f64, step| longest.max(*step)) / period;
    if spread <= SPREAD && longest <= GAP {
        return;
    }
    let gaps = runs(steps.len(), |n| steps[n] > GAP * period);
    let percent = significant(100.0 * spread, 2);
    let mut message = format!("steps between samples vary by {percent} % of the period (standard deviation)");
    if !gaps.is_empty() {
        message += &format!(", {} of them are gaps, the longest of {} periods", gaps.len(), significant(longest, 3));
    }
    let distinct = distinct(&steps, period);
    let remedy = if distinct == Some(2) {
        message += "; they take two values, as times rounded too coarsely do";
        text!(
            "If samples were taken by a timer, leave the time out and give " [Rate = "HZ"] "; else record times with \
             more digits."
        )
    } else {
        "Each step is simulated as it is, so that parameters stay right; better, sample by a timer.".into()
    };
    let places = gaps.into_iter().map(|gap| gap.start..gap.end + 1);
    findings.push(
        Finding::new("jitter", message, remedy)
            .of(Quantity::Time)
            .mention_if(spread <= SPREAD)
            .at(places)
            .figure("spread", spread)
            .figure("longest", longest),
    );
}

/// How many values the steps take, up to a millionth of the period; `None` for more than two.
fn distinct(steps: &[f64], period: f64) -> Option<usize> {
    let mut values: Vec<f64> = Vec::new();
    for step in steps {
        if values.iter().all(|value| (value - step).abs() > 1e-6 * period) {
            values.push(*step);
        }
        if values.len() > 2 {
            return None;
        }
    }
    Some(values.len())
}
