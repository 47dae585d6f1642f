//! Single wrong samples of the outputs of a user's model: glitches of a sensor or a bus, found without the model.
//!
//! One or two samples that are far from those before and after them on the same side, while these agree with each other. After a jump of
//! an input a signal may move so itself, as the current of a winding does; samples there are left.

use crate::record::Record;
use motorfit_core::numeric::{count, noise_sigma, peak};
use std::ops::Range;

/// Smallest departure from the surrounding samples, in units of their noise, and as a multiple of the largest usual change within two
/// samples.
const NOISE: f64 = 15.0;
const CHANGES: f64 = 3.0;
/// Part of the changes within two samples that are usual: as many faults as [`RARE`] admits are in 2 % of them.
const USUAL: f64 = 0.97;
/// Largest difference of the samples before and after, as a part of the departure.
const AGREE: f64 = 0.25;
/// Largest part of the samples that are single faults.
const RARE: f64 = 0.01;
/// Change of an input, as a part of its peak, that is a jump, and the number of samples after one that are left.
const JUMP: f64 = 0.05;
const AFTER: usize = 3;

/// Returns the runs of wrong samples of the outputs.
pub(super) fn spikes(record: &Record) -> Vec<Range<usize>> {
    let named = &record.samples().named;
    let mut is_after_jump = vec![false; record.len()];
    for input in named.iter().filter(|signal| signal.is_input) {
        let jump = JUMP * peak(&input.values);
        for n in 1..input.values.len() {
            if (input.values[n] - input.values[n - 1]).abs() > jump {
                let end = (n + AFTER).min(is_after_jump.len());
                is_after_jump[n - 1..end].fill(true);
            }
        }
    }
    let of = |values: &[f64]| {
        let found = of_signal(values);
        let samples: usize = found.iter().map(ExactSizeIterator::len).sum();
        let is_rare = count(samples) <= RARE * count(values.len());
        let kept = found.into_iter().filter(|run| !run.clone().any(|n| is_after_jump[n]));
        if is_rare { kept.collect() } else { Vec::new() }
    };
    named.iter().filter(|signal| !signal.is_input).flat_map(|signal| of(&signal.values)).collect::<Vec<_>>()
}

/// Returns the runs of one or two samples far from the others around them.
fn of_signal(values: &[f64]) -> Vec<Range<usize>> {
    let mut changes: Vec<f64> = values.windows(3).map(|of| (of[2] - of[0]).abs()).collect();
    let usual = motorfit_core::numeric::order_statistic(&mut changes, USUAL);
    let least = (NOISE * noise_sigma(values)).max(CHANGES * usual);
    let mut found: Vec<Range<usize>> = Vec::new();
    let mut n = 1;
    while n + 1 < values.len() {
        let run = (1..=2).map(|length| n..n + length).find(|run| is_apart(values, run, least));
        n = run.as_ref().map_or(n, |run| run.end) + 1;
        found.extend(run);
    }
    found
}

fn is_apart(values: &[f64], run: &Range<usize>, least: f64) -> bool {
    let Some(after) = values.get(run.end) else { return false };
    let before = values[run.start - 1];
    let departure = |n: usize| {
        let [a, b] = [values[n] - before, values[n] - after];
        if a * b > 0.0 { a.signum() * a.abs().min(b.abs()) } else { 0.0 }
    };
    let all: Vec<f64> = run.clone().map(departure).collect();
    let is_far = |by: &f64| by.abs() > least && by * all[0] > 0.0 && (after - before).abs() < AGREE * by.abs();
    least > 0.0 && all.iter().all(is_far)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_samples_are_found_and_peaks_of_several_are_not() {
        let mut values: Vec<f64> = (0..400).map(|n| (0.05 * count(n)).sin() + 1e-3 * (7.1 * count(n)).sin()).collect();
        assert!(of_signal(&values).is_empty());
        values[100] += 3.0;
        values[201..203].iter_mut().for_each(|value| *value -= 4.0);
        values[300..304].iter_mut().for_each(|value| *value += 4.0);
        assert_eq!(of_signal(&values), [100..101, 201..203]);
    }
}
