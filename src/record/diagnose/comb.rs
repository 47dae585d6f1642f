//! A sensor that shows an average over N samples: its spectrum is 0 at every multiple of 1/N.

use super::spectrum::{POINTS, power};
use super::{Channel, Finding, View};
use crate::numeric::{count, differences, median, peak, whole};
use std::ops::RangeInclusive;

/// Windows that are looked for \[samples\].
const WINDOWS: RangeInclusive<usize> = 4..=299;
/// Multiples of 1/N that count.
const MULTIPLES: usize = 8;
/// From this score on it is mentioned, and reported: real averages over 32 and 128 samples score 1.19 and more, clean
/// simulated channels 0.74 at most (35,000 of them).
const SCORES: [f64; 2] = [0.7, 1.0];
/// Fewer samples resolve no comb.
const SAMPLES_MIN: usize = 512;
/// A window needs this many of it in a segment, so that notches and humps are apart.
const WINDOWS_IN_SEGMENT: usize = 10;
/// Logarithms below this (the largest is 0) are the window's leakage, in recordings without noise; the humps of real
/// sensors lie above -6.
const LEAKAGE: f64 = -9.0;
/// The score in standard errors from which an effect is reported.
const SURE: f64 = 6.0;

pub(super) fn averaged_sensor(view: &View<'_>, findings: &mut Vec<Finding>) {
    let mut inputs = None;
    for channel in view.channels() {
        let Some(spectrum) = Logs::of(&differences(channel.values), LEAKAGE) else { continue };
        if best(&spectrum, &[]).is_none() {
            continue;
        }
        if is_tone(view) {
            return;
        }
        // What the voltage explains is no averaging: pulses of N samples have the same comb.
        let inputs = inputs.get_or_insert_with(|| spectra_of_input(view));
        if let Some(best) = self::best(&spectrum, inputs) {
            findings.push(finding(view, channel, best));
        }
    }
}

fn finding(view: &View<'_>, channel: &Channel<'_>, best: Best) -> Finding {
    let (quantity, window) = (channel.quantity, count(best.window));
    let seconds = crate::text::engineering(window * view.period(), "s", 3);
    let message =
        format!("the {quantity} looks like an average over {window} samples ({seconds}): it lags by half of that");
    let remedy = "Record it without the average, or let the model average over as many samples.";
    let finding = Finding::new("averaged_sensor", quantity, message, remedy).mention_if(best.score < SCORES[1]);
    finding.figure("window", window).figure("score", best.score)
}

/// The spectra of the voltage's changes and, as noise of a measured voltage fills their notches, of its edges alone.
fn spectra_of_input(view: &View<'_>) -> Vec<Logs> {
    let all = differences(view.input.values);
    let edges: Vec<f64> = all.iter().map(|d| if d.abs() > 6.0 * view.input.noise { *d } else { 0.0 }).collect();
    [all, edges].iter().filter_map(|steps| Logs::of(steps, f64::NEG_INFINITY)).collect()
}

/// The part of a voltage's power that one line of its spectrum has, from which on it is a tone.
const TONE: f64 = 0.9;

/// Returns whether the voltage is a tone. Friction or a deadband makes harmonics of it, with notches between them.
fn is_tone(view: &View<'_>) -> bool {
    let (power, _) = power(&differences(view.input.values));
    let Some(at) = (0..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b])) else { return false };
    let lobe = 2 * POINTS.div_ceil(view.len().min(POINTS));
    let line = &power[at.saturating_sub(lobe)..(at + lobe + 1).min(power.len())];
    line.iter().sum::<f64>() > TONE * power.iter().sum::<f64>()
}

/// The logarithms of a spectrum with their running sum.
struct Logs {
    sums: Vec<f64>,
    /// Independent segments times samples of each over [`POINTS`]: what a bin is worth.
    worth: f64,
    segment: usize,
    /// Humps below this do not count.
    floor: f64,
}

impl Logs {
    fn of(steps: &[f64], floor: f64) -> Option<Self> {
        if steps.len() + 1 < SAMPLES_MIN {
            return None;
        }
        let (power, _) = power(steps);
        let largest = peak(&power);
        if largest <= 0.0 {
            return None;
        }
        let mut sum = 0.0;
        let sums = std::iter::once(0.0)
            .chain(power.iter().map(|p| {
                // What lies 240 dB below the largest is rounding.
                sum += (p / largest).max(1e-24).log10();
                sum
            }))
            .collect();
        let segment = steps.len().min(POINTS);
        let independent = count(steps.len()) / count(segment);
        Some(Self { sums, worth: independent * count(segment) / count(POINTS) / 1.5, segment, floor })
    }

    /// The mean logarithm between two frequencies per sample, of at least one bin; and how many bins.
    fn mean(&self, from: f64, to: f64) -> (f64, f64) {
        let bin = |f: f64| whole(f * count(POINTS) + 0.5);
        let last = self.sums.len() - 2;
        let (from, to) = (bin(from).min(last), bin(to).min(last));
        let count = count(to + 1 - from);
        ((self.sums[to + 1] - self.sums[from]) / count, count)
    }

    /// The mean logarithm between k/N and (k + 1)/N. The middle is left out, where the odd harmonics of a period of 2N
    /// would stand.
    fn hump(&self, k: usize, window: f64) -> f64 {
        let [a, b, c, d] = [0.2, 0.4, 0.6, 0.8].map(|part| (count(k) + part) / window);
        0.5 * (self.mean(a, b).0 + self.mean(c, d).0)
    }

    /// Returns the depth of the spectrum's dip at k/N below the humps on both sides.
    fn dip(&self, k: usize, window: f64, [before, after]: [f64; 2]) -> f64 {
        let notch = || self.mean((count(k) - 0.05) / window, (count(k) + 0.05) / window).0;
        if before.min(after) < self.floor { 0.0 } else { 0.5 * (before + after) - notch() }
    }

    /// The dips at the first multiples of 1/N, or at every second, and how many there are below half the rate; `None`
    /// where more than half of them are below `least`.
    fn dips(&self, window: f64, every: usize, least: f64) -> Option<([f64; MULTIPLES], usize)> {
        let mut dips = [0.0; MULTIPLES];
        let mut humps = [f64::NAN, self.hump(0, window)];
        let below_half = |k: &usize| (count(*k) + 0.8) / window <= 0.5;
        let multiples = (1..).step_by(every).take(MULTIPLES).take_while(below_half).count();
        let mut low = 0;
        for (k, dip) in (1..).step_by(every).zip(&mut dips[..multiples]) {
            let before = if every == 1 { humps[1] } else { self.hump(k - 1, window) };
            humps = [before, self.hump(k, window)];
            *dip = self.dip(k, window, humps);
            low += usize::from(*dip < least);
            if 2 * low > multiples {
                return None;
            }
        }
        Some((dips, multiples))
    }
}

#[derive(Debug, Clone, Copy)]
struct Best {
    window: usize,
    score: f64,
}

/// The window with the highest score among those that are sure.
fn best(spectrum: &Logs, inputs: &[Logs]) -> Option<Best> {
    let longest = (spectrum.segment / WINDOWS_IN_SEGMENT).min(*WINDOWS.end());
    let mut best: Option<Best> = None;
    for window in *WINDOWS.start()..=longest {
        let is_better = |found: &Best| best.is_none_or(|best| found.score > best.score);
        // What the voltage explains is only asked where there is something to explain.
        let plain = scored(spectrum, &[], window, (1, SCORES[0])).filter(is_better);
        if let Some(found) = plain.and_then(|_| scored(spectrum, inputs, window, (1, SCORES[0]))).filter(is_better) {
            best = Some(found);
        }
    }
    // Half of the window has its notches at every other notch: then the odd multiples of the whole are notches too.
    while let Some(found) = best {
        let twice = (2 * found.window - 1..=2 * found.window + 1).filter(|window| *window <= longest);
        let longer = twice.filter_map(|window| scored(spectrum, inputs, window, (2, 0.5 * found.score)));
        let Some(longer) = longer.max_by(|a, b| a.score.total_cmp(&b.score)) else { break };
        best = Some(Best { score: found.score, ..longer });
    }
    best
}

/// The score of a window, if it is sure and at least `least`, by every multiple of 1/N or every second.
fn scored(spectrum: &Logs, inputs: &[Logs], window: usize, (every, least): (usize, f64)) -> Option<Best> {
    let length = count(window);
    let (mut dips, multiples) = spectrum.dips(length, every, least)?;
    if multiples == 0 {
        return None;
    }
    let mut explained = [0.0_f64; MULTIPLES];
    for input in inputs {
        let (dips, _) = input.dips(length, every, f64::NEG_INFINITY)?;
        explained.iter_mut().zip(dips).for_each(|(most, dip)| *most = most.max(dip));
    }
    let dips = &mut dips[..multiples];
    dips.iter_mut().zip(explained).for_each(|(dip, explained)| *dip -= explained);
    dips.sort_unstable_by(f64::total_cmp);
    let score = median(dips);
    // The logarithm of one bin of noise has the standard deviation 0.56; a dip is a mean over the bins of a notch, and
    // what it is compared with adds a quarter to its variance. A median of n is worth n/1.57 of them.
    let bins = spectrum.mean(0.95 / length, 1.05 / length).1 * spectrum.worth;
    let error = 0.56 * 1.25_f64.sqrt() / bins.max(0.7).sqrt() / (count(multiples) / 1.57).max(1.0).sqrt();
    (score >= least && score >= SURE * error).then_some(Best { window, score })
}
