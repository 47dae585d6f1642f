//! Rule on a first response that is delayed more than the later ones, as by a drive that wakes up.

use super::finding::Finding;
use super::view::{Channel, View};
use motorfit_core::numeric::{count, mean, upper_median, whole};
use motorfit_core::text::engineering;

/// Smallest ratio of the first delay to the later ones.
const TIMES: f64 = 3.0;
/// Smallest difference of the first delay from the later ones \[s\].
const MORE_S: f64 = 0.02;
/// Fewest samples of constant voltage after an edge.
const SAMPLES_MIN: usize = 10;
/// Fraction of a response at which it counts as begun.
const BEGUN: f64 = 0.1;

pub(super) fn start_latency(view: &View<'_>, findings: &mut Vec<Finding>) {
    // The current comes first among the channels: its delay is that of the drive alone.
    findings.extend(view.channels().find_map(|channel| late(view, channel)));
}

/// An edge between two constant voltages: its sample, the level of the channel before it and the change after it.
struct Edge {
    at: usize,
    before: f64,
    change: f64,
}

/// Compares the delay of the first response of a channel with those of the later ones.
fn late(view: &View<'_>, channel: &Channel<'_>) -> Option<Finding> {
    let long: Vec<usize> = (1..view.constant_inputs.len())
        .filter(|&k| {
            let [before, after] = [&view.constant_inputs[k - 1], &view.constant_inputs[k]];
            view.part(after.volts - before.volts) >= 0.2
                && before.samples.len() >= SAMPLES_MIN.min(before.samples.end)
                && after.samples.len() >= SAMPLES_MIN
        })
        .collect();
    // Responses are compared over a common length, over which those of a linear motor are proportional.
    let mut lengths: Vec<f64> = long.iter().map(|&k| count(view.constant_inputs[k].samples.len())).collect();
    let length = whole(upper_median(&mut lengths));
    let edges: Vec<Edge> = long.into_iter().filter_map(|k| edge(view, channel, k, length)).collect();
    if edges.len() < 3 || edges[0].at != view.constant_inputs[0].samples.end {
        return None;
    }
    let least = edges.iter().fold(f64::INFINITY, |least: f64, edge| least.min(edge.change.abs()));
    let begun = BEGUN.max(channel.floor() / least);
    if begun > 0.5 {
        return None;
    }
    let delays: Vec<f64> = edges.iter().filter_map(|edge| delay(view, channel, edge, begun)).collect();
    if delays.len() < edges.len() {
        return None;
    }
    let later = upper_median(&mut delays[1..].to_vec());
    let first = delays[0];
    if first <= TIMES * later || first <= later + MORE_S {
        return None;
    }
    let [after, later_after] = [first, later].map(|delay| engineering(delay, "s", 3));
    let message =
        format!("the motor responds to the first change of voltage after {after}, to later ones after {later_after}");
    let remedy = "Leave out the first change: the drive was waking up.";
    let finding = Finding::new("start_latency", channel.quantity, message, remedy);
    Some(finding.at(Some(edges[0].at..edges[0].at + 1)).figure("first_s", first).figure("later_s", later))
}

/// Returns the edge at the start of segment `k` if the channel was steady before it and has changed `length` samples after it.
fn edge(view: &View<'_>, channel: &Channel<'_>, k: usize, length: usize) -> Option<Edge> {
    let (before, after) = (&view.constant_inputs[k - 1].samples, &view.constant_inputs[k].samples);
    let at = after.start;
    let end = at + length;
    if end > after.end + length / 10 || end > channel.values.len() {
        return None;
    }
    let tail = |end: usize, size: usize| if end == 0 { 0.0 } else { mean(&channel.values[end - size.min(end)..end]) };
    let few = (length / 10).clamp(2, before.len().max(2));
    let level = tail(at, few);
    let change = tail(end, few) - level;
    let earlier = tail(at - few.min(at - before.start), few.min(at - before.start).max(1));
    let was_steady = k == 1 && before.len() >= 3 || (level - earlier).abs() < 0.05 * change.abs() + channel.noise;
    (was_steady && change.abs() > channel.floor() && change.abs() > 0.05 * channel.range).then_some(Edge {
        at,
        before: level,
        change,
    })
}

/// Returns the time \[s\] after an edge at which two consecutive samples exceed the fraction `begun` of the response.
fn delay(view: &View<'_>, channel: &Channel<'_>, edge: &Edge, begun: f64) -> Option<f64> {
    let done = |n: usize| (channel.values[n] - edge.before) / edge.change > begun;
    let at = (edge.at..view.len() - 1).find(|&n| done(n) && done(n + 1))?;
    Some(view.time[at] - view.time[edge.at])
}
