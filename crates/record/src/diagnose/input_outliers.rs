//! Outliers of the voltage: pulses of up to three samples to which the measured outputs do not respond.
//!
//! Each output is predicted by a regression on its own past and the voltage; a pulse is an outlier if the predictions are
//! clearly better without it.

use super::outliers::Outliers;
use super::pulses::{Pulses, level, noise};
use super::regression::{Row, Solution, Sums};
use super::view::{Channel, View};
use motorfit_core::numeric::{count, order_statistic, peak};
use std::ops::Range;

/// Smallest size of a pulse, as a fraction of the range of the voltage.
const PART: f64 = 0.004;
/// Smallest size of a pulse, in standard deviations of the noise of the voltage.
const NOISES: f64 = 8.0;
/// Largest change of the voltage from before to after a pulse, as a fraction of its size.
const AGREE: f64 = 0.3;
/// Number of samples after a pulse in which its effect is examined.
const EFFECT: usize = 3;
/// Largest norm of the scaled residuals of a channel without the pulse that is accepted if it is larger than with the pulse.
const TIMES: f64 = 5.0;
/// Smallest decrease of the sum of squared scaled residuals without the pulse.
const BETTER: f64 = 25.0;
/// Largest ratio of the sums of squared residuals without and with the pulse.
const LEFT: f64 = 0.4;
/// Largest ratio of pulses to samples at which pulses are left out of the regressions.
const FEW: f64 = 0.005;
/// Largest fraction of the samples that can be outliers; more are a property of the signal.
const RARE: f64 = 0.02;

/// Returns the outliers of the voltage; `None` if there are none, or if they are too many.
pub(super) fn of_input(view: &View<'_>) -> Option<Outliers> {
    let pulses = pulses(view);
    if pulses.is_empty() || view.by_current() {
        return None;
    }
    // Few pulses are left out, so that they do not bias the regressions.
    let mut is_left_out = vec![false; view.len()];
    if count(pulses.len()) <= (FEW * count(view.len())).max(6.0) {
        pulses.iter().for_each(|pulse| is_left_out[pulse.start..pulse.end + EFFECT].fill(true));
    }
    let models: Vec<Model<'_>> =
        view.channels().filter_map(|channel| Model::new(view, channel, &is_left_out)).collect();
    // Before the first response the drive may still be disabled.
    let awake = models
        .iter()
        .filter_map(|model| model.values.windows(3).position(|w| w.iter().all(|x| x.abs() > 0.1 * peak(model.values))))
        .min()?;
    let is_wrong = |pulse: &&Range<usize>| {
        let [logged, repaired] = [false, true].map(|is_repaired| {
            models.iter().map(|model| model.residual(view, pulse, is_repaired)).collect::<Vec<f64>>()
        });
        let [with, without] = [logged.iter().sum::<f64>(), repaired.iter().sum::<f64>()];
        with - without > BETTER
            && without < LEFT * with
            && logged.iter().zip(&repaired).all(|(with, without)| *without <= with.max(TIMES * TIMES))
    };
    let places: Vec<Range<usize>> =
        pulses.iter().filter(|pulse| pulse.start > awake).filter(is_wrong).cloned().collect();
    let repaired: Vec<(usize, f64)> =
        places.iter().flat_map(|place| place.clone().map(|n| (n, level(view.input.values, place, n)))).collect();
    let is_rare = count(repaired.len()) <= (RARE * count(view.len())).max(3.0);
    (is_rare && !places.is_empty()).then_some(Outliers { quantity: view.input.quantity, places, repaired })
}

/// Returns runs of one to three samples that differ from the voltage before and after them.
fn pulses(view: &View<'_>) -> Vec<Range<usize>> {
    let volts = view.input.values;
    // The extreme values are left out, so that an outlier does not determine the range.
    let outer = (0.01_f64).max(6.0 / count(volts.len()));
    let mut copy = volts.to_vec();
    let [low, high] = [outer, 1.0 - outer].map(|p| order_statistic(&mut copy, p));
    let range = (high - low).max(0.1 * high.abs());
    let least = (PART * range).max((NOISES * noise(volts).min(view.input.noise)).min(0.3 * range));
    Pulses { least, agree: AGREE, slack: 0.0, with_turns: true }.of(volts)
}

/// Regression of a channel on its last two values and the voltage.
struct Model<'a> {
    values: &'a [f64],
    solution: Solution,
    /// Standard deviation of the residuals, estimated from a quantile.
    scale: f64,
}

impl<'a> Model<'a> {
    fn new(view: &View<'_>, channel: &Channel<'a>, is_left_out: &[bool]) -> Option<Self> {
        let mut model = Self { values: channel.values, solution: Solution::default(), scale: f64::INFINITY };
        if channel.range == 0.0 || view.len() < 40 {
            return None;
        }
        for _ in 0..3 {
            let mut sums = Sums::default();
            for m in (2..view.len()).filter(|m| !is_left_out[*m]) {
                let row = model.row(view.input.values, m);
                if (model.values[m] - model.solution.predicted(&row)).abs() < 6.0 * model.scale {
                    sums.add(&row, model.values[m]);
                }
            }
            model.solution = sums.solve();
            let residual =
                |m: usize| (model.values[m] - model.solution.predicted(&model.row(view.input.values, m))).abs();
            let mut sizes: Vec<f64> = (2..view.len()).map(residual).collect();
            model.scale = (order_statistic(&mut sizes, 0.9) / 1.645).max(1e-6 * channel.range);
        }
        Some(model)
    }

    fn row(&self, volts: &[f64], m: usize) -> Row {
        let x = self.values;
        [1.0, x[m - 1], x[m - 2], volts[m], volts[m - 1], volts[m - 2], 0.0, 0.0]
    }

    /// Returns the sum of squared scaled residuals at a pulse and after it, with the recorded or the repaired voltage.
    fn residual(&self, view: &View<'_>, pulse: &Range<usize>, is_repaired: bool) -> f64 {
        let mut volts = view.input.values[pulse.start - 2..pulse.end + EFFECT].to_vec();
        if is_repaired {
            pulse.clone().for_each(|n| volts[n + 2 - pulse.start] = level(view.input.values, pulse, n));
        }
        let square = |m: usize| {
            let v = |lag: usize| volts[m - lag + 2 - pulse.start];
            let x = self.values;
            let row = [1.0, x[m - 1], x[m - 2], v(0), v(1), v(2), 0.0, 0.0];
            ((x[m] - self.solution.predicted(&row)) / self.scale).powi(2)
        };
        (pulse.start..pulse.end + EFFECT).map(square).sum()
    }
}
