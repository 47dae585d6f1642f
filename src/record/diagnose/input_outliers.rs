//! Outliers of the voltage: pulses of up to three samples that the motor did not get, as what it measurably does shows.

use super::outliers::Outliers;
use super::pulses::{Pulses, level, noise};
use super::regression::{Row, Solution, Sums};
use super::view::{Channel, View};
use crate::numeric::{count, order_statistic, peak};
use std::ops::Range;

/// A pulse is a change by this part of the range of the voltage and so many times its noise…
const PART: f64 = 0.004;
const NOISES: f64 = 8.0;
/// …after which the voltage is the same again within this part of it.
const AGREE: f64 = 0.3;
/// Samples behind a pulse in which its effect is looked for.
const EFFECT: usize = 3;
/// The effect that a pulse would have had, in usual residuals, and the part of its square that is left without the pulse.
const TIMES: f64 = 5.0;
const BETTER: f64 = 25.0;
const LEFT: f64 = 0.4;
/// Up to this part of the samples are few.
const FEW: f64 = 0.005;
/// More than this part of the samples are no single outliers.
const RARE: f64 = 0.02;

/// Returns the outliers of the voltage.
pub(super) fn of_input(view: &View<'_>) -> Option<Outliers> {
    let pulses = pulses(view);
    if pulses.is_empty() || view.by_current() {
        return None;
    }
    // Few pulses are no part of what the motor is known by.
    let mut is_left_out = vec![false; view.len()];
    if count(pulses.len()) <= (FEW * count(view.len())).max(6.0) {
        pulses.iter().for_each(|pulse| is_left_out[pulse.start..pulse.end + EFFECT].fill(true));
    }
    let models: Vec<Model<'_>> =
        view.channels().filter_map(|channel| Model::new(view, channel, &is_left_out)).collect();
    // Before the first response a drive may not be awake yet.
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

/// Runs of one to three samples that differ from the voltage before and behind them.
fn pulses(view: &View<'_>) -> Vec<Range<usize>> {
    let volts = view.input.values;
    // Without the outermost values, so that an outlier does not set the range.
    let outer = (0.01_f64).max(6.0 / count(volts.len()));
    let mut copy = volts.to_vec();
    let [low, high] = [outer, 1.0 - outer].map(|p| order_statistic(&mut copy, p));
    let range = (high - low).max(0.1 * high.abs());
    let least = (PART * range).max((NOISES * noise(volts).min(view.input.noise)).min(0.3 * range));
    Pulses { least, agree: AGREE, slack: 0.0, with_turns: true }.of(volts)
}

/// A regression of a channel on itself and the voltage before.
struct Model<'a> {
    values: &'a [f64],
    solution: Solution,
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

    /// Returns the sum of squared residuals at a pulse and behind it, in usual residuals, with the voltage as it is or repaired.
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
