//! The noise floor: the differences between recordings with the same input, which no deterministic model can reproduce.
//!
//! From m recordings with the same input and N samples each, the variance of the noise is estimated by
//! `σ² = Σ_n Σ_r (y_rn − ȳ_n)²/(N(m − 1))`, for two recordings `mean((y_a − y_b)²)/2`. The residuals of an ideal model have the
//! variance σ², so that the best achievable fit is `100 (1 − √(Σ σ²)/‖y − mean y‖)`.

use super::outputs::by_output_of_motor;
use motorfit_core::Result;
use motorfit_core::numeric::{count, mean, peak, squares_about};
use motorfit_estimate::fit_problem;
use motorfit_evaluate::{Model, Problem};
use motorfit_motor::Space;
use motorfit_record::Record;
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

/// The noise floor of recordings with the same input.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseFloor {
    /// Groups of recordings with the same input, as indices from 0.
    pub groups: Vec<Vec<usize>>,
    /// Number of compared samples of each group.
    pub samples: Vec<usize>,
    /// Best achievable fit of current and speed on these recordings \[%\]; `None` for a constant or missing channel.
    pub best_achievable_percent: [Option<f64>; 2],
    /// Standard deviation of the noise of current \[A\] and speed \[rad/s\].
    pub sigma: [Option<f64>; 2],
}

impl Serialize for NoiseFloor {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let groups = self.groups.iter().zip(&self.samples);
        let record = json!({
            "ceiling_percent": by_output_of_motor(&self.best_achievable_percent),
            "sigma": by_output_of_motor(&self.sigma),
            "groups": groups.map(|(records, samples)| json!({"records": records, "samples": samples})).collect::<Value>(),
        });
        record.serialize(serializer)
    }
}

/// Largest difference of equal inputs relative to their peak.
const SAME: f64 = 1e-3;
/// Largest relative difference of equal sampling periods.
const SAME_PERIOD: f64 = 1e-4;
/// Smallest number of common samples.
const SAMPLES_MIN: usize = 20;
/// Largest number of recordings that are compared.
const RECORDINGS_MAX: usize = 200;

/// Returns the noise floor of recordings that begin at rest and have the same input, aligned at its first change; `None` if no
/// two recordings do. Recordings with an irregular clock or a changed sampling rate are left out; identical recordings count
/// once.
///
/// # Errors
/// Propagates the errors of [`fit_problem`].
pub fn noise_floor(records: &[&Record], model: Model) -> Result<Option<NoiseFloor>> {
    if records.len() < 2 {
        return Ok(None);
    }
    let mut groups: Vec<Vec<Aligned<'_>>> = Vec::new();
    for (number, record) in records.iter().take(RECORDINGS_MAX).enumerate() {
        let problem = fit_problem(std::slice::from_ref(*record), &Space::table2(), model)?;
        let Some(aligned) = Aligned::of(number, record, &problem) else { continue };
        match groups.iter_mut().find(|group| group[0].is_same_input(&aligned)) {
            Some(group) if group.iter().any(|other| other.record.samples() == record.samples()) => {}
            Some(group) => group.push(aligned),
            None => groups.push(vec![aligned]),
        }
    }
    groups.retain(|group| group.len() > 1);
    Ok((!groups.is_empty()).then(|| noise_floor_of(&groups)))
}

/// A recording that begins at rest, aligned at the first change of its input.
struct Aligned<'a> {
    number: usize,
    record: &'a Record,
    /// Index of the sample at which the input first changes.
    onset: usize,
    counting: Vec<[bool; 2]>,
}

impl<'a> Aligned<'a> {
    fn of(number: usize, record: &'a Record, problem: &Problem) -> Option<Self> {
        let voltage = record.input();
        let change = SAME * peak(voltage);
        let onset = voltage.iter().position(|v| (v - voltage[0]).abs() > change).unwrap_or(0);
        let evenly = record.steps().step_index.is_empty();
        let usable = problem.signals()[0].starts_at_rest() && evenly && record.slope().is_empty();
        usable.then(|| Self { number, record, onset, counting: record.counting() })
    }

    /// Returns the numbers of samples before and after the onset that two recordings have in common.
    fn common(&self, other: &Self) -> [usize; 2] {
        let after = |of: &Self| of.record.len() - of.onset;
        [self.onset.min(other.onset), after(self).min(after(other))]
    }

    fn is_same_input(&self, other: &Self) -> bool {
        let (a, b) = (self.record, other.record);
        let [before, after] = self.common(other);
        let alike = |a: &[f64], b: &[f64]| {
            let differs = SAME * peak(a).max(peak(b));
            let pairs = a[self.onset - before..self.onset + after].iter().zip(&b[other.onset - before..]);
            pairs.into_iter().all(|(a, b)| (a - b).abs() <= differs)
        };
        let torque = match (&a.samples().torque, &b.samples().torque) {
            (None, None) => true,
            (Some(a), Some(b)) => alike(a, b),
            _ => false,
        };
        let channels = a.measured().map(|m| m.is_some()) == b.measured().map(|m| m.is_some());
        let clock = (a.period_s() / b.period_s() - 1.0).abs() < SAME_PERIOD;
        channels
            && a.driver() == b.driver()
            && clock
            && before + after >= SAMPLES_MIN
            && torque
            && alike(a.input(), b.input())
    }

    /// Returns sample `n` of the common range of a channel, which begins `before` samples before the onset; `None` if excluded.
    fn value(&self, channel: usize, before: usize, n: usize) -> Option<f64> {
        let n = self.onset - before + n;
        let counts = self.counting.get(n).is_none_or(|counts| counts[channel]);
        self.record.measured()[channel].filter(|_| counts).map(|signal| signal[n])
    }
}

/// Computes the noise floor over groups of recordings with the same input.
fn noise_floor_of(groups: &[Vec<Aligned<'_>>]) -> NoiseFloor {
    let mut sums = [Sums::default(); 2];
    let mut samples = Vec::new();
    for group in groups {
        let common = group.iter().map(|of| group[0].common(of));
        let [before, after] = common.fold([usize::MAX; 2], |a, b| [a[0].min(b[0]), a[1].min(b[1])]);
        samples.push(before + after);
        for (channel, sums) in sums.iter_mut().enumerate() {
            sums.add(group, channel, [before, after]);
        }
    }
    NoiseFloor {
        groups: groups.iter().map(|group| group.iter().map(|of| of.number).collect()).collect(),
        samples,
        best_achievable_percent: sums.map(|of| finite(100.0 * (1.0 - (of.noise / of.about).sqrt()))),
        sigma: sums.map(|of| finite((of.noise / of.count).sqrt())),
    }
}

/// Sums over all groups.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Sum of the estimates of σ² over all values.
    noise: f64,
    /// Sum of squares about the mean of each recording.
    about: f64,
    /// Number of values.
    count: f64,
}

impl Sums {
    fn add(&mut self, group: &[Aligned<'_>], channel: usize, [before, after]: [usize; 2]) {
        let size = count(group.len());
        let mut kept = vec![Vec::with_capacity(before + after); group.len()];
        for n in 0..before + after {
            // Samples that are excluded in one recording are excluded in all.
            let values: Option<Vec<f64>> = group.iter().map(|of| of.value(channel, before, n)).collect();
            let Some(values) = values else { continue };
            self.noise += size * squares_about(mean(&values), &values) / (size - 1.0);
            self.count += size;
            kept.iter_mut().zip(values).for_each(|(kept, y)| kept.push(y));
        }
        for signal in kept {
            self.about += squares_about(mean(&signal), &signal);
        }
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
