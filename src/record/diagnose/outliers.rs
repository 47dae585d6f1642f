//! Outliers: single samples, or runs of up to three, that fit neither the samples before them nor those behind them.

use super::predictor::{Predictor, REACH, RUN_MAX, Scaled};
use super::view::{Channel, View};
use super::{Finding, Quantity, text};
use crate::numeric::{count, order_statistic, peak};
use crate::text::{counted, significant};
use std::cell::OnceCell;
use std::ops::Range;

/// A sample is an outlier from so many times the usual residual of its prediction on.
const TIMES: f64 = 8.0;
/// Residuals below this part of the range are none, nor those below so many steps of a coarse sensor.
const PART: f64 = 0.02;
const STEPS: f64 = 2.5;
/// The predictions from both sides agree within this part of the deviation: behind a step, or a peak that decays, the signal
/// is another than before it.
const AGREE: f64 = 0.35;
/// Samples on each side whose residuals give the local scale.
const AROUND: usize = 24;
/// More than this part of the samples are no single outliers but how the sensor is.
const RARE: f64 = 0.03;
/// A response comes up to so many samples after the change of the input.
const RESPONSE: usize = 100;

/// The samples of a signal that are outliers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Outliers {
    pub quantity: Quantity,
    pub places: Vec<Range<usize>>,
    /// For each sample of the places its index and what the samples around it predict.
    pub repaired: Vec<(usize, f64)>,
}

/// Returns the outliers of the measured outputs.
pub(super) fn of_outputs(view: &View<'_>) -> Vec<Outliers> {
    let outputs = view.channels().filter(|channel| !(view.by_current() && channel.quantity == Quantity::Current));
    outputs.filter_map(|channel| of_channel(view, channel)).collect()
}

/// Adds the finding for the outliers of each signal.
pub(super) fn report(view: &View<'_>, outliers: &[Outliers], findings: &mut Vec<Finding>) {
    findings.extend(outliers.iter().map(|outliers| finding(view, outliers)));
}

fn finding(view: &View<'_>, outliers: &Outliers) -> Finding {
    let (quantity, repaired) = (outliers.quantity, &outliers.repaired);
    let values = view.record.samples().signals().find(|(of, _)| *of == quantity).map_or(&[][..], |(_, values)| values);
    let shown = |value: f64| significant(value, 4);
    let pairs = repaired.iter().take(3).map(|(n, value)| format!("{} instead of {}", shown(values[*n]), shown(*value)));
    let more = if repaired.len() > 3 { ", …" } else { "" };
    let list = pairs.collect::<Vec<_>>().join(", ");
    let (samples, unit) = (repaired.len(), quantity.unit());
    let verb = if samples == 1 { "is" } else { "are" };
    let message = format!(
        "{} of the {quantity} {verb} far off the samples around: {list}{more} {unit}",
        counted(samples, "single sample")
    );
    let what = if quantity == Quantity::Voltage { "Have them replaced by" } else { "Leave them out with" };
    let remedy = text!("{what} " [Mask = "auto"] ".");
    let deviations: Vec<f64> = repaired.iter().map(|(n, value)| values[*n] - value).collect();
    let finding = Finding::new("outliers", quantity, message, remedy).at(outliers.places.iter().cloned());
    finding.figure("samples", count(samples)).figure("largest", peak(&deviations))
}

/// A signal with the predictors of it from both sides.
struct Search<'a> {
    of: Scaled<'a>,
    /// From the samples before, and from those behind, over one to three samples; made where a sample is suspected.
    sides: [[OnceCell<Predictor>; RUN_MAX]; 2],
    /// The |residual| of each sample predicted from those before it, nothing repaired.
    first: Vec<f64>,
    /// The least deviation that counts.
    least: f64,
}

fn of_channel(view: &View<'_>, channel: &Channel<'_>) -> Option<Outliers> {
    let of = Scaled::new(view, channel.values)?;
    let within = REACH..of.values.len() - REACH;
    let mut first = vec![0.0; of.values.len()];
    let before = Predictor::new(&of, 1, true);
    within.clone().for_each(|m| first[m] = before.residual(&of, m).abs());
    let coarse = if is_quantized(channel) { channel.quantum / of.range } else { 0.0 };
    let sides = [[before.into(), OnceCell::new(), OnceCell::new()], Default::default()];
    let mut search = Search { of, sides, first, least: PART.max(STEPS * coarse.min(1.0)) };
    let mut places = Vec::new();
    let mut repaired = Vec::new();
    let mut n = within.start;
    while n + RUN_MAX < within.end {
        let Some(values) = search.run_at(n) else {
            n += 1;
            continue;
        };
        let end = n + values.len();
        if !search.is_response(n) {
            places.push(n..end);
            repaired.extend((n..end).zip(values.iter().map(|x| search.of.middle + search.of.range * x)));
        }
        search.of.values[n..end].copy_from_slice(&values);
        n = end;
    }
    // What goes on for longer is no outlier.
    let runs: Vec<Range<usize>> = places
        .chunk_by(|a: &Range<usize>, b| a.end == b.start)
        .map(|run| run[0].start..run[run.len() - 1].end)
        .filter(|run| run.len() <= RUN_MAX)
        .collect();
    let places = runs;
    repaired.retain(|(n, _)| places.iter().any(|place| place.contains(n)));
    let is_rare = count(repaired.len()) <= (RARE * count(view.len())).max(3.0);
    (is_rare && !repaired.is_empty()).then_some(Outliers { quantity: channel.quantity, places, repaired })
}

/// Returns whether nine of ten differences are whole multiples of the smallest ones.
fn is_quantized(channel: &Channel<'_>) -> bool {
    let steps = channel.values.windows(2).map(|w| (w[1] - w[0]).abs() / channel.quantum);
    let (whole, all) = steps
        .filter(|step| *step > 0.5)
        .fold((0, 0), |(whole, all), step| (whole + usize::from((step - step.round()).abs() < 0.05), all + 1));
    !channel.is_fine() && 10 * whole >= 9 * all
}

impl Search<'_> {
    /// Returns the predictor from one side over `k` samples.
    fn side(&self, is_before: bool, k: usize) -> &Predictor {
        self.sides[usize::from(!is_before)][k - 1].get_or_init(|| Predictor::new(&self.of, k, is_before))
    }

    /// Returns what would fit in place of a run of outliers that begins at `n`, `None` where there is none.
    fn run_at(&self, n: usize) -> Option<Vec<f64>> {
        let (of, before) = (&self.of, self.side(true, 1));
        if before.residual(of, n).abs() <= self.least.max(TIMES * before.scale(of, n)) || !of.is_regular(n) {
            return None;
        }
        let local = self.local_scale(n);
        (1..=RUN_MAX).find_map(|length| {
            let sides = |m: usize| [self.side(true, m - n + 1), self.side(false, n + length - m)];
            let is_off = |m: usize| {
                let [early, late] = sides(m).map(|side| side.residual(of, m));
                let limit = sides(m).map(|side| side.scale(of, m)).into_iter().fold(local, f64::max);
                let smaller = early.abs().min(late.abs());
                smaller > self.least.max(TIMES * limit)
                    && early * late > 0.0
                    && (early - late).abs() < AGREE * smaller
                    && sides(m).iter().all(|side| side.has_seen(of, m))
            };
            let between = |m: usize| sides(m).map(|side| 0.5 * side.predicted(of, m)).iter().sum();
            (is_off(n) && is_off(n + length - 1)).then(|| (n..n + length).map(between).collect())
        })
    }

    /// The usual size of the residuals around a sample, itself and its followers left out.
    fn local_scale(&self, n: usize) -> f64 {
        let before = n.saturating_sub(AROUND)..n.saturating_sub(1);
        let behind = n + RUN_MAX + 2..(n + AROUND).min(self.first.len());
        let mut sizes: Vec<f64> = before.chain(behind).map(|m| self.first[m]).collect();
        order_statistic(&mut sizes, 0.85) / 1.44
    }

    /// Returns whether a run at `start` is the response to a change of the input: others are followed by the same after the same
    /// time, or it follows a pulse as short as itself and there is none to compare it with.
    fn is_response(&self, start: usize) -> bool {
        let input = &self.of.view.input;
        let size = input.values.len();
        let limit = 0.1 * input.range;
        let changes: Vec<usize> =
            (1..size).filter(|n| (input.values[*n] - input.values[n - 1]).abs() > limit).collect();
        let Some(last) = changes.iter().copied().rfind(|n| *n <= start + 1) else { return false };
        let delay = start + 1 - last;
        if delay > RESPONSE {
            return false;
        }
        let others: Vec<usize> = changes.iter().copied().filter(|n| n.abs_diff(last) > RUN_MAX + 1).collect();
        let answers = |n: &&usize| {
            let from = (**n + delay).saturating_sub(3);
            let until = (**n + delay + 2).min(size);
            (from..until).any(|m| m.abs_diff(start) > RUN_MAX && self.first[m] > 0.3 * self.first[start])
        };
        let same = others.iter().filter(answers).count();
        let is_pulse = changes.iter().any(|n| *n < last && last - n <= 2 * RUN_MAX);
        if others.is_empty() { is_pulse } else { 2 * same >= others.len() }
    }
}
