//! Rule on sensors that average over N samples: their spectrum has notches at the multiples of 1/N per sample.
//!
//! The score of a window length N is the median depth of the notches in decades of power, less their depth in the spectrum of
//! the input.

use super::finding::Finding;
use super::spectrum::{POINTS, power};
use super::view::{Channel, View};
use motorfit_core::numeric::{count, differences, median, peak, whole};
use std::ops::RangeInclusive;

/// Lengths of windows that are examined \[samples\].
const WINDOWS: RangeInclusive<usize> = 4..=299;
/// Largest number of multiples of 1/N that are examined.
const MULTIPLES: usize = 8;
/// Smallest scores at which the finding is mentioned, and at which it is reported. Real averages over 32 and 128 samples score
/// at least 1.19, 35,000 simulated channels without averages at most 0.74.
const SCORES: [f64; 2] = [0.7, 1.0];
/// Fewest samples for an estimate.
const SAMPLES_MIN: usize = 512;
/// Smallest ratio of a segment to the window length at which notches and the lobes between them are resolved.
const WINDOWS_IN_SEGMENT: usize = 10;
/// Smallest logarithm (base 10) of a lobe relative to the largest power. Lower ones are leakage of the window in noise-free
/// recordings; the lobes of real sensors are above -6.
const LEAKAGE: f64 = -9.0;
/// Smallest score in standard errors.
const SURE: f64 = 6.0;

pub(super) fn averaged_sensor(view: &View<'_>, findings: &mut Vec<Finding>) {
    let mut inputs = None;
    for channel in view.channels() {
        let Some(spectrum) = LogSpectrum::of(&differences(channel.values), LEAKAGE) else { continue };
        if best(&spectrum, &[]).is_none() {
            continue;
        }
        if is_tone(view) {
            return;
        }
        // Notches in the spectrum of the voltage are no evidence of averaging: pulses of N samples have the same.
        let inputs = inputs.get_or_insert_with(|| spectra_of_input(view));
        if let Some(best) = self::best(&spectrum, inputs) {
            findings.push(finding(view, channel, best));
        }
    }
}

/// Creates the finding of an average over a window.
fn finding(view: &View<'_>, channel: &Channel<'_>, best: Best) -> Finding {
    let (quantity, window) = (channel.quantity, count(best.window));
    let seconds = motorfit_core::text::engineering(window * view.period(), "s", 3);
    let message =
        format!("the {quantity} looks like an average over {window} samples ({seconds}): it lags by half of that");
    let remedy = "Record it without the average, or include an average over as many samples in the model.";
    let finding = Finding::new("averaged_sensor", quantity, message, remedy).mention_if(best.score < SCORES[1]);
    finding.figure("window", window).figure("score", best.score)
}

/// Returns the spectra of the changes of the voltage and of its edges alone, whose notches noise of the voltage does not fill.
fn spectra_of_input(view: &View<'_>) -> Vec<LogSpectrum> {
    let all = differences(view.input.values);
    let edges: Vec<f64> = all.iter().map(|d| if d.abs() > 6.0 * view.input.noise { *d } else { 0.0 }).collect();
    [all, edges].iter().filter_map(|steps| LogSpectrum::of(steps, f64::NEG_INFINITY)).collect()
}

/// Smallest fraction of the power in one line of the spectrum for a voltage to count as a tone.
const TONE: f64 = 0.9;

/// Returns true if the voltage is a tone. Friction or a deadband then causes harmonics, with notches between them.
fn is_tone(view: &View<'_>) -> bool {
    let (power, _) = power(&differences(view.input.values));
    let Some(at) = (0..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b])) else { return false };
    let lobe = 2 * POINTS.div_ceil(view.len().min(POINTS));
    let line = &power[at.saturating_sub(lobe)..(at + lobe + 1).min(power.len())];
    line.iter().sum::<f64>() > TONE * power.iter().sum::<f64>()
}

/// Logarithm of a power spectrum, stored as a running sum.
struct LogSpectrum {
    /// Running sum of the logarithms (base 10) of the power relative to its maximum.
    sums: Vec<f64>,
    /// Effective number of independent values that are averaged in a bin: the number of differences over [`POINTS`], divided
    /// by 1.5.
    averages: f64,
    /// Length of a segment \[samples\].
    segment: usize,
    /// Smallest logarithm of a lobe that counts.
    floor: f64,
}

impl LogSpectrum {
    /// Computes the spectrum of differences; `None` for too few samples or a constant signal.
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
                // Power 240 dB below the largest is rounding.
                sum += (p / largest).max(1e-24).log10();
                sum
            }))
            .collect();
        let segment = steps.len().min(POINTS);
        let independent = count(steps.len()) / count(segment);
        Some(Self { sums, averages: independent * count(segment) / count(POINTS) / 1.5, segment, floor })
    }

    /// Returns the mean logarithm between two frequencies \[1/sample\], over at least one bin, and the number of bins.
    fn mean(&self, from: f64, to: f64) -> (f64, f64) {
        let bin = |f: f64| whole(f * count(POINTS) + 0.5);
        let last = self.sums.len() - 2;
        let (from, to) = (bin(from).min(last), bin(to).min(last));
        let count = count(to + 1 - from);
        ((self.sums[to + 1] - self.sums[from]) / count, count)
    }

    /// Returns the mean logarithm of the lobe between k/N and (k + 1)/N, without its middle, where the odd harmonics of a
    /// period of 2N samples are.
    fn lobe(&self, k: usize, window: f64) -> f64 {
        let [a, b, c, d] = [0.2, 0.4, 0.6, 0.8].map(|part| (count(k) + part) / window);
        0.5 * (self.mean(a, b).0 + self.mean(c, d).0)
    }

    /// Returns the depth of the notch at k/N below the lobes on both sides; 0 if a lobe is below the floor.
    fn depth(&self, k: usize, window: f64, [before, after]: [f64; 2]) -> f64 {
        let notch = || self.mean((count(k) - 0.05) / window, (count(k) + 0.05) / window).0;
        if before.min(after) < self.floor { 0.0 } else { 0.5 * (before + after) - notch() }
    }

    /// Returns the depths of the notches at every multiple of 1/N, or every second one, and their number below half the
    /// sampling rate; `None` if more than half of them are below `least`.
    fn depths(&self, window: f64, every: usize, least: f64) -> Option<([f64; MULTIPLES], usize)> {
        let mut depths = [0.0; MULTIPLES];
        let mut lobes = [f64::NAN, self.lobe(0, window)];
        let below_half = |k: &usize| (count(*k) + 0.8) / window <= 0.5;
        let multiples = (1..).step_by(every).take(MULTIPLES).take_while(below_half).count();
        let mut low = 0;
        for (k, depth) in (1..).step_by(every).zip(&mut depths[..multiples]) {
            let before = if every == 1 { lobes[1] } else { self.lobe(k - 1, window) };
            lobes = [before, self.lobe(k, window)];
            *depth = self.depth(k, window, lobes);
            low += usize::from(*depth < least);
            if 2 * low > multiples {
                return None;
            }
        }
        Some((depths, multiples))
    }
}

/// A window length \[samples\] and its score.
#[derive(Debug, Clone, Copy)]
struct Best {
    window: usize,
    score: f64,
}

/// Returns the window length with the highest significant score.
fn best(spectrum: &LogSpectrum, inputs: &[LogSpectrum]) -> Option<Best> {
    let longest = (spectrum.segment / WINDOWS_IN_SEGMENT).min(*WINDOWS.end());
    let mut best: Option<Best> = None;
    for window in *WINDOWS.start()..=longest {
        let is_better = |found: &Best| best.is_none_or(|best| found.score > best.score);
        // The spectrum of the voltage is evaluated only for windows that are significant without it.
        let plain = scored(spectrum, &[], window, (1, SCORES[0])).filter(is_better);
        if let Some(found) = plain.and_then(|_| scored(spectrum, inputs, window, (1, SCORES[0]))).filter(is_better) {
            best = Some(found);
        }
    }
    // A window of N samples has the notches of one of N/2 samples, and one more between each two. If these are present, the
    // window is the longer one.
    while let Some(found) = best {
        let twice = (2 * found.window - 1..=2 * found.window + 1).filter(|window| *window <= longest);
        let longer = twice.filter_map(|window| scored(spectrum, inputs, window, (2, 0.5 * found.score)));
        let Some(longer) = longer.max_by(|a, b| a.score.total_cmp(&b.score)) else { break };
        best = Some(Best { score: found.score, ..longer });
    }
    best
}

/// Returns the score of a window from every multiple of 1/N, or every second one, if it is significant and at least `least`.
fn scored(spectrum: &LogSpectrum, inputs: &[LogSpectrum], window: usize, (every, least): (usize, f64)) -> Option<Best> {
    let length = count(window);
    let (mut depths, multiples) = spectrum.depths(length, every, least)?;
    if multiples == 0 {
        return None;
    }
    let mut of_input = [0.0_f64; MULTIPLES];
    for input in inputs {
        let (depths, _) = input.depths(length, every, f64::NEG_INFINITY)?;
        of_input.iter_mut().zip(depths).for_each(|(most, depth)| *most = most.max(depth));
    }
    let depths = &mut depths[..multiples];
    depths.iter_mut().zip(of_input).for_each(|(depth, of_input)| *depth -= of_input);
    depths.sort_unstable_by(f64::total_cmp);
    let score = median(depths);
    // The logarithm (base 10) of one bin of noise has a standard deviation of 0.56. A depth is a mean over the bins of a
    // notch, and the lobes add a quarter to its variance. The median of n depths has the variance of a mean of n/1.57.
    let bins = spectrum.mean(0.95 / length, 1.05 / length).1 * spectrum.averages;
    let error = 0.56 * 1.25_f64.sqrt() / bins.max(0.7).sqrt() / (count(multiples) / 1.57).max(1.0).sqrt();
    (score >= least && score >= SURE * error).then_some(Best { window, score })
}
