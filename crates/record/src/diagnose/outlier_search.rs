//! Search for outliers: runs of samples that disagree with predictions from the samples before and after them.

use super::predictor::{Predictor, REACH, Scaled};
use super::pulses::RUN_MAX;
use motorfit_core::numeric::order_statistic;
use std::cell::OnceCell;
use std::ops::Range;

/// Smallest combined residual at the ends of an outlier of one, two and three samples, in scales of the residuals.
const TIMES: [f64; RUN_MAX] = [7.5, 5.0, 4.5];
/// Smallest residual of the first sample at which a run is examined, in scales.
const SUSPECTED: f64 = 4.0;
/// Largest residual of the samples around a replaced run, in scales.
const AROUND_TIMES: f64 = 4.5;
/// Largest difference of the residuals from both sides, as a fraction of the deviation. It excludes steps and decaying peaks,
/// after which the signal differs from before.
const AGREE: f64 = 0.35;
/// Additional difference that is allowed, in scales of both residuals, away from edges of the input and near them.
const DIFFER: [f64; 2] = [2.5, 1.5];
/// Scale of the combined residual near edges of the input, relative to the smaller one of both sides.
const NEAR_EDGES: f64 = 1.3;
/// Number of samples on each side whose residuals give the local scale.
const AROUND: usize = 24;
/// Largest delay of a response to a change of the input \[samples\].
const RESPONSE: usize = 100;

/// A signal with its predictors from both sides.
pub(super) struct Search<'a> {
    of: Scaled<'a>,
    /// Predictors from the samples before and after, over distances of one to three samples; fitted when first used.
    sides: [[OnceCell<Predictor>; RUN_MAX]; 2],
    /// |Residual| of each sample, predicted one step ahead from the recorded signal; computed when first used, which is before
    /// the first replacement.
    first: OnceCell<Vec<f64>>,
    /// Smallest deviation of an outlier, relative to the range of the signal.
    least: f64,
}

/// Residual of a sample, combined from both sides.
struct Joint {
    /// Mean of the residuals of both sides, weighted by their inverse variances.
    residual: f64,
    /// Scale of the combined residual.
    scale: f64,
    /// True if both sides agree and neither extrapolates.
    agrees: bool,
}

impl Joint {
    /// Combines the residuals of sample `m`.
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
        // The scale is not reduced by the combination, because both residuals contain the noise of the sample itself.
        Self { residual, scale, agrees }
    }
}

impl<'a> Search<'a> {
    /// Creates a search for deviations above `least`, relative to the range of the signal.
    pub(super) fn new(of: Scaled<'a>, least: f64) -> Self {
        Self { of, sides: Default::default(), first: OnceCell::new(), least }
    }

    /// Returns |residual| of each sample; 0 at both ends.
    fn first(&self) -> &[f64] {
        self.first.get_or_init(|| {
            let (before, size) = (self.side(true, 1), self.of.values.len());
            let residual =
                |m: usize| if (REACH..size - REACH).contains(&m) { before.residual(&self.of, m).abs() } else { 0.0 };
            (0..size).map(residual).collect()
        })
    }

    /// Returns the runs of outliers at pulses, and index and replacement of each of their samples.
    pub(super) fn found(mut self, pulses: &[Range<usize>]) -> (Vec<Range<usize>>, Vec<(usize, f64)>) {
        let mut places: Vec<Range<usize>> = Vec::new();
        let mut repaired = Vec::new();
        let last = self.of.values.len().saturating_sub(RUN_MAX + REACH);
        // Noise may hide the first sample of a run, or appear as one.
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

    /// Replaces the run of outliers that begins at `n`, if the samples around it agree with the replacement.
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

    /// Returns the predictor from one side over a distance of `k` samples.
    fn side(&self, is_before: bool, k: usize) -> &Predictor {
        self.sides[usize::from(!is_before)][k - 1].get_or_init(|| Predictor::new(&self.of, k, is_before))
    }

    /// Returns replacements for a run of outliers that begins at `n`; `None` if there is none.
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

    /// Returns true if the samples around a replaced run agree with it, which excludes a step of the signal.
    fn fits_around(&self, run: Range<usize>) -> bool {
        let fits = |is_before: bool, m: usize| {
            let side = self.side(is_before, 1);
            side.residual(&self.of, m).abs() <= self.least.max(AROUND_TIMES * side.scale(&self.of, m))
        };
        (run.end..run.end + 2).all(|m| fits(true, m)) && (run.start - 2..run.start).all(|m| fits(false, m))
    }

    /// Returns the scale of the residuals around a sample, without the sample and its successors.
    fn local_scale(&self, n: usize) -> f64 {
        let before = n.saturating_sub(AROUND)..n.saturating_sub(1);
        let behind = n + RUN_MAX + 2..(n + AROUND).min(self.of.values.len());
        let first = self.first();
        let mut sizes: Vec<f64> = before.chain(behind).map(|m| first[m]).collect();
        order_statistic(&mut sizes, 0.85) / 1.44
    }

    /// Returns true if a run at `start` is the response to a change of the input: half of the other changes are followed by a
    /// similar residual after the same delay or, if there are no others, the change is a short pulse.
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
        let first = self.first();
        let answers = |n: &&usize| {
            let from = (**n + delay).saturating_sub(3);
            let until = (**n + delay + 2).min(size);
            (from..until).any(|m| m.abs_diff(start) > RUN_MAX && first[m] > 0.3 * first[start])
        };
        let same = others.iter().filter(answers).count();
        let is_pulse = changes.iter().any(|n| *n < last && last - n <= 2 * RUN_MAX);
        if others.is_empty() { is_pulse } else { 2 * same >= others.len() }
    }
}
