//! The search for outliers: samples that are predicted otherwise from those before them and from those behind them.

use super::predictor::{Predictor, REACH, Scaled};
use super::pulses::RUN_MAX;
use crate::numeric::order_statistic;
use std::cell::OnceCell;
use std::ops::Range;

/// A run of one, two or three samples is off from so many usual residuals at its ends on…
const TIMES: [f64; RUN_MAX] = [7.5, 5.0, 4.5];
/// …and looked at from so many at its first sample on.
const SUSPECTED: f64 = 4.0;
/// With a run replaced, the samples around it are within so many.
const AROUND_TIMES: f64 = 4.5;
/// The predictions from both sides agree within this part of the deviation: behind a step, or a peak that decays, the signal
/// is another than before it.
const AGREE: f64 = 0.35;
/// They differ by so many of their usual residuals more, away from changes of the input and near them.
const DIFFER: [f64; 2] = [2.5, 1.5];
/// The usual residual of both near changes of the input, in terms of the smaller one.
const NEAR_EDGES: f64 = 1.3;
/// Samples on each side whose residuals give the local scale.
const AROUND: usize = 24;
/// A response comes up to so many samples after the change of the input.
const RESPONSE: usize = 100;

/// A signal with the predictors of it from both sides.
pub(super) struct Search<'a> {
    of: Scaled<'a>,
    /// From the samples before, and from those behind, over one to three samples; made where a sample is suspected.
    sides: [[OnceCell<Predictor>; RUN_MAX]; 2],
    /// The |residual| of each sample predicted from those before it, nothing repaired.
    first: Vec<f64>,
    /// The least deviation that counts.
    least: f64,
}

/// The combined prediction of a sample from both sides.
struct Joint {
    residual: f64,
    scale: f64,
    agrees: bool,
}

impl Joint {
    fn new(of: &Scaled<'_>, sides: [&Predictor; 2], m: usize) -> Self {
        let [early, late] = sides.map(|side| side.residual(of, m));
        let [a, b] = sides.map(|side| side.scale(of, m));
        if !(a.is_finite() && b.is_finite()) {
            return Self { residual: 0.0, scale: 1.0, agrees: false };
        }
        let [u, v] = [a, b].map(|scale| scale.powi(-2));
        let residual = (u * early + v * late) / (u + v);
        let smaller = early.abs().min(late.abs());
        let (limit, scale) = if of.is_edge[m] {
            (AGREE * smaller + DIFFER[1] * a.hypot(b), NEAR_EDGES * a.min(b))
        } else {
            (AGREE * residual.abs() + DIFFER[0] * a.hypot(b), a.min(b))
        };
        let agrees =
            (early - late).abs() < limit && early * late > 0.0 && sides.iter().all(|side| side.has_seen(of, m));
        // Both contain the noise of the sample itself.
        Self { residual, scale, agrees }
    }
}

impl<'a> Search<'a> {
    /// A search for deviations above `least`, in parts of the signal's range.
    pub(super) fn new(of: Scaled<'a>, least: f64) -> Self {
        let mut first = vec![0.0; of.values.len()];
        let before = Predictor::new(&of, 1, true);
        (REACH..of.values.len() - REACH).for_each(|m| first[m] = before.residual(&of, m).abs());
        let sides = [[before.into(), OnceCell::new(), OnceCell::new()], Default::default()];
        Self { of, sides, first, least }
    }

    /// Returns the runs of outliers at pulses, and for each of their samples its index and what would fit.
    pub(super) fn found(mut self, pulses: &[Range<usize>]) -> (Vec<Range<usize>>, Vec<(usize, f64)>) {
        let mut places: Vec<Range<usize>> = Vec::new();
        let mut repaired = Vec::new();
        let last = self.of.values.len().saturating_sub(RUN_MAX + REACH);
        // Noise may hide the first sample of a run, or seem one.
        let starts = |pulse: &Range<usize>| (pulse.start + 1).saturating_sub(RUN_MAX).max(REACH)..pulse.end.min(last);
        let mut next = 0;
        for n in pulses.iter().flat_map(starts) {
            let Some(run) = (n >= next).then(|| self.replaced_at(n)).flatten() else { continue };
            next = run.end;
            if !self.is_response(run.start) {
                let value = |n: usize| (n, self.of.middle + self.of.range * self.of.values[n]);
                repaired.extend(run.clone().map(value));
                places.push(run);
            }
        }
        (places, repaired)
    }

    /// Replaces the run of outliers that begins at `n` if the samples around fit what is put in its place.
    fn replaced_at(&mut self, n: usize) -> Option<Range<usize>> {
        let fitting = self.run_at(n)?;
        let run = n..n + fitting.len();
        let logged = self.of.values[run.clone()].to_vec();
        self.of.values[run.clone()].copy_from_slice(&fitting);
        if self.fits_around(run.clone()) {
            return Some(run);
        }
        self.of.values[run].copy_from_slice(&logged);
        None
    }

    /// Returns the predictor from one side over `k` samples.
    fn side(&self, is_before: bool, k: usize) -> &Predictor {
        self.sides[usize::from(!is_before)][k - 1].get_or_init(|| Predictor::new(&self.of, k, is_before))
    }

    /// Returns what would fit in place of a run of outliers that begins at `n`, `None` where there is none.
    fn run_at(&self, n: usize) -> Option<Vec<f64>> {
        let (of, before) = (&self.of, self.side(true, 1));
        if before.residual(of, n).abs() <= self.least.max(SUSPECTED * before.scale(of, n)) || !of.is_regular(n) {
            return None;
        }
        let local = self.local_scale(n) / before.scale(of, n);
        (1..=RUN_MAX).find_map(|length| {
            let joint = |m: usize| {
                let sides = [self.side(true, m - n + 1), self.side(false, n + length - m)];
                Joint::new(of, sides, m)
            };
            let [first, last] = [n, n + length - 1].map(joint);
            let sign = first.residual.signum();
            let is_off = |joint: &Joint| {
                sign * joint.residual > self.least.max(TIMES[length - 1] * joint.scale * local.max(1.0)) && joint.agrees
            };
            (is_off(&first) && is_off(&last))
                .then(|| (n..n + length).map(|m| of.values[m] - joint(m).residual).collect())
        })
    }

    /// Returns whether the samples around a run that was replaced fit it: a signal that goes on elsewhere does not.
    fn fits_around(&self, run: Range<usize>) -> bool {
        let fits = |is_before: bool, m: usize| {
            let side = self.side(is_before, 1);
            side.residual(&self.of, m).abs() <= self.least.max(AROUND_TIMES * side.scale(&self.of, m))
        };
        (run.end..run.end + 2).all(|m| fits(true, m)) && (run.start - 2..run.start).all(|m| fits(false, m))
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
