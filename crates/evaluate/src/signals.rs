//! A recording prepared for evaluation: everything that does not depend on the candidate is computed once.

use super::filled::filled;
use super::initial::{Initial, initial_state};
use super::scales::{divisor, power};
use super::segment::{Run, Segment};
use crate::criterion::Criterion;
use motorfit_core::Result;
use motorfit_core::numeric::{count, noise_sigma, rms, standard_deviation};
use motorfit_motor::{Discretization, InputHistory, SimulationInput, SplitSteps, sample_times};
use motorfit_record::{Quantity, Record};
use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

/// Ratio of residuals to the standard deviation of a channel's noise up to which residuals count as noise.
const NOISY: f64 = 2.0;

/// Returns the fraction of the variance of residuals of standard deviation `sigma` that noise can account for: 1 up to [`NOISY`]
/// standard deviations of the noise, less above.
#[must_use]
#[doc(hidden)]
pub fn noise_share(noise: f64, sigma: f64) -> f64 {
    (NOISY * noise / sigma).powi(2).min(1.0)
}

/// A recording prepared for a criterion and a discretization.
#[derive(Debug, Clone)]
pub struct Signals {
    /// Distinct step lengths \[s\].
    #[doc(hidden)]
    pub step_s: Vec<f64>,
    /// Index in `step_s` of the step after each sample; empty if all steps are equal.
    #[doc(hidden)]
    pub step_index: Vec<u16>,
    /// Decomposition of the steps of an irregular clock, if they are many and the discretization is exact.
    #[doc(hidden)]
    pub split: Option<SplitSteps>,
    /// Median step \[s\].
    pub(super) period_s: f64,
    /// Times of the samples from the first \[s\], computed on first use.
    pub(super) times: OnceLock<Arc<[f64]>>,
    /// Ends of the runs of equal voltages, computed on first use.
    voltage_ends: OnceLock<Vec<usize>>,
    /// The input: the voltage \[V\], or the current \[A\] if no voltage was recorded.
    #[doc(hidden)]
    pub voltage: Vec<f64>,
    /// Voltage at the start and at the end of each step of a resampled recording, which is linear over a step and may jump
    /// between steps; empty for other recordings.
    lines: [Vec<f64>; 2],
    /// Load torque \[N·m\]; empty if none was recorded.
    #[doc(hidden)]
    pub torque: Vec<f64>,
    /// Measured current and speed; zeros for a channel that was not measured.
    #[doc(hidden)]
    pub measured: Vec<[f64; 2]>,
    /// Sum of squares of each channel.
    power: [f64; 2],
    /// Standard deviation of the noise of each channel, estimated on first use.
    noise: OnceLock<[f64; 2]>,
    /// Standard deviation of each channel, computed on first use.
    deviation: OnceLock<[f64; 2]>,
    /// Weights of the errors, 0 for masked samples; empty if all are 1.
    #[doc(hidden)]
    pub weight: Vec<[f64; 2]>,
    /// True for each channel of a sample that is not masked; empty if no sample is masked.
    counting: Vec<[bool; 2]>,
    /// For each channel true for the samples at which it was measured; empty if it was at all.
    own: [Vec<bool>; 2],
    /// Effective sample ratio: the fraction of the samples that count as independent.
    #[doc(hidden)]
    pub effective_sample_ratio: f64,
    /// Factor of each channel's sum: its scale and, if weights are empty, the step; 0 for a channel that was not measured.
    #[doc(hidden)]
    pub factor: [f64; 2],
    /// The state `[i, ω]` at the first sample.
    pub initial: [f64; 2],
    /// True if the refinement estimates the initial state.
    pub initial_is_free: bool,
    /// Index of the first sample with a voltage or torque. Before it the motor is at rest in the state zero.
    #[doc(hidden)]
    pub first_active: usize,
    /// Weighted sums of errors before `first_active`, per channel.
    pub(crate) idle_sums: [f64; 2],
    /// Runs of constant inputs.
    pub(super) runs: Vec<Run>,
    /// Number of runs before `first_active`.
    idle_runs: usize,
    /// Segments, each with one step length.
    pub(super) segments: Vec<Segment>,
    /// Number of segments before `first_active`.
    idle_segments: usize,
    /// The voltage before the recording, and its first change.
    #[doc(hidden)]
    pub history: InputHistory,
}

impl Signals {
    /// Prepares a recording for a criterion and a discretization.
    ///
    /// # Errors
    /// Returns a not-identified error if the scale divides by the variation of a constant channel, or by the noise of a channel
    /// without any.
    pub fn new(record: &Record, criterion: &Criterion, initial: Initial, method: Discretization) -> Result<Self> {
        let (samples, steps) = (record.samples(), record.steps());
        let counting = record.counting();
        let filled = filled(record, &counting);
        let measured = [0, 1].map(|channel| filled[channel].as_deref().or(record.measured()[channel]));
        let (initial, initial_is_free) = initial_state(measured, initial);
        let mut signals = Self {
            step_s: steps.step_s.clone(),
            step_index: steps.step_index.clone(),
            split: method.is_exact().then(|| SplitSteps::new(&steps.step_s, steps.unit_s())).flatten(),
            period_s: steps.period_s,
            times: OnceLock::new(),
            voltage_ends: OnceLock::new(),
            voltage: record.input().to_vec(),
            lines: lines(record, method),
            torque: samples.torque.clone().unwrap_or_default(),
            measured: match measured {
                [Some(current), Some(speed)] => current.iter().zip(speed).map(|(i, w)| [*i, *w]).collect(),
                _ => (0..record.len()).map(|n| measured.map(|m| m.map_or(0.0, |m| m[n]))).collect(),
            },
            power: [0.0; 2],
            noise: OnceLock::new(),
            deviation: OnceLock::new(),
            weight: Vec::new(),
            counting,
            own: [Quantity::Current, Quantity::Speed].map(|quantity| {
                let of = record.measured_at().iter().find(|of| of.quantity == quantity);
                of.map(|of| of.samples.clone()).unwrap_or_default()
            }),
            effective_sample_ratio: record.effective_sample_ratio(),
            factor: [0.0; 2],
            initial,
            initial_is_free,
            first_active: 0,
            idle_sums: [0.0; 2],
            runs: Vec::new(),
            idle_runs: 0,
            segments: Vec::new(),
            idle_segments: 0,
            history: InputHistory::default(),
        };
        signals.history = InputHistory::of(&signals.voltage, signals.starts_at_rest());
        for (channel, signal) in measured.into_iter().enumerate() {
            if let Some(signal) = signal {
                let divisor = divisor(criterion, channel, &signals.at_own(channel, signal))
                    .map_err(|e| record.source().path.iter().fold(e, |e, path| e.in_file(path)))?;
                signals.factor[channel] = criterion.factor(divisor);
            }
        }
        signals.power = power(&signals.measured);
        signals.set_weights(record, criterion);
        signals.set_runs(method);
        signals.set_idle_sums(criterion);
        Ok(signals)
    }

    /// Returns the number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.voltage.len()
    }

    /// Returns false, since every recording has samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.voltage.is_empty()
    }

    /// Returns true if the initial state is fixed at zero.
    #[must_use]
    pub fn starts_at_rest(&self) -> bool {
        !self.initial_is_free && self.initial.iter().all(|v| *v == 0.0)
    }

    /// Returns true if an input or the initial state is not zero.
    #[must_use]
    pub fn is_driven(&self) -> bool {
        let drives = |values: &[f64]| values.iter().any(|v| *v != 0.0);
        drives(&self.voltage) || drives(&self.torque) || drives(&self.initial)
    }

    /// Returns true if a channel (0 current, 1 speed) was measured.
    #[must_use]
    pub fn has(&self, channel: usize) -> bool {
        self.factor.get(channel).is_some_and(|factor| *factor > 0.0)
    }

    /// Returns the root mean square of a channel.
    #[must_use]
    #[doc(hidden)]
    pub fn rms(&self, channel: usize) -> f64 {
        (self.power[channel] / count(self.len())).sqrt()
    }

    /// Returns the standard deviation of a channel's noise, estimated from the channel alone.
    #[must_use]
    #[doc(hidden)]
    pub fn noise(&self, channel: usize) -> f64 {
        let of = |channel: usize| {
            let counting = (0..self.len()).filter(|n| self.counts(channel, *n));
            noise_sigma(&counting.map(|n| self.measured[n][channel]).collect::<Vec<_>>())
        };
        self.noise.get_or_init(|| [0, 1].map(of))[channel]
    }

    /// Returns the fraction of the variance of residuals of standard deviation `sigma` that noise can account for: 1 up to
    /// [`NOISY`] standard deviations of the channel's noise, less above.
    #[must_use]
    #[doc(hidden)]
    pub fn noise_share(&self, channel: usize, sigma: f64) -> f64 {
        noise_share(self.noise(channel), sigma)
    }

    /// Returns true if a channel was measured and residuals of standard deviation `sigma` exceed its noise.
    #[must_use]
    #[doc(hidden)]
    pub fn is_above_noise(&self, channel: usize, sigma: f64) -> bool {
        self.has(channel) && self.noise_share(channel, sigma) < 1.0
    }

    /// Returns the standard deviation of a channel over the samples that are not masked; the root mean square for a constant
    /// channel, and 1 for a channel that is zero.
    #[must_use]
    #[doc(hidden)]
    pub fn deviation(&self, channel: usize) -> f64 {
        let of = |channel: usize| {
            let counting = (0..self.len()).filter(|n| self.counts(channel, *n));
            let values: Vec<f64> = counting.map(|n| self.measured[n][channel]).collect();
            [standard_deviation(&values), rms(&values), 1.0].into_iter().find(|v| *v > 0.0).unwrap_or(1.0)
        };
        self.deviation.get_or_init(|| [0, 1].map(of))[channel]
    }

    /// Returns the measured values of a channel; zeros for one that was not measured.
    pub fn measured(&self, channel: usize) -> impl Iterator<Item = f64> {
        self.measured.iter().map(move |y| y.get(channel).copied().unwrap_or_default())
    }

    /// Returns true if a channel of a sample is not masked.
    #[must_use]
    pub fn counts(&self, channel: usize, sample: usize) -> bool {
        self.counting.get(sample).is_none_or(|counts| counts.get(channel) == Some(&true))
    }

    /// Returns the values of a channel at the samples at which it was measured.
    fn at_own<'a>(&self, channel: usize, values: &'a [f64]) -> Cow<'a, [f64]> {
        match self.own[channel].is_empty() {
            true => Cow::Borrowed(values),
            false => (0..values.len()).filter(|n| self.own[channel][*n]).map(|n| values[n]).collect(),
        }
    }

    /// Returns true if a channel was measured at a sample, and not interpolated between others.
    #[doc(hidden)]
    #[inline]
    pub fn is_measured(&self, channel: usize, sample: usize) -> bool {
        self.own[channel].get(sample).copied().unwrap_or(true)
    }

    /// Returns the number of samples of a channel that are not masked.
    #[must_use]
    pub fn count(&self, channel: usize) -> usize {
        let counting = self.counting.iter().filter(|counts| counts.get(channel) == Some(&true));
        if self.counting.is_empty() { self.len() } else { counting.count() }
    }

    /// Returns the number of samples that are not masked in at least one measured channel.
    pub(super) fn samples(&self) -> usize {
        let any = |counts: &&[bool; 2]| (0..2).any(|channel| counts[channel] && self.has(channel));
        if self.counting.is_empty() { self.len() } else { self.counting.iter().filter(any).count() }
    }

    /// Returns the inputs in the form of the reference simulation.
    #[must_use]
    pub fn drive(&self) -> SimulationInput<'_> {
        let Self { step_s, step_index, torque, lines: [start, end], .. } = self;
        let voltage = if start.is_empty() { &self.voltage } else { start };
        SimulationInput { step_s, step_index, voltage, voltage_end: end, torque }
    }

    /// Returns the times of the samples relative to the first \[s\].
    #[doc(hidden)]
    pub fn times(&self) -> Arc<[f64]> {
        self.times.get_or_init(|| sample_times(&self.drive())).clone()
    }

    /// Returns the ends of the runs of equal voltages.
    pub(super) fn voltage_ends(&self) -> &[usize] {
        self.voltage_ends.get_or_init(|| {
            let changes = (1..self.len()).filter(|&n| self.voltage[n].to_bits() != self.voltage[n - 1].to_bits());
            changes.chain([self.len()]).collect()
        })
    }

    /// Returns true if the voltage is linear over each step and may jump between steps, as in a resampled recording.
    #[doc(hidden)]
    pub fn has_slopes(&self) -> bool {
        !self.lines[0].is_empty()
    }

    /// Returns the voltage at the start and at the end of the step after a sample \[V\], and the torque \[N·m\].
    #[inline(always)]
    #[doc(hidden)]
    pub fn inputs(&self, n: usize) -> [f64; 3] {
        let drive = self.drive();
        [drive.voltage[n], drive.end(n), drive.torque.get(n).copied().unwrap_or(0.0)]
    }

    /// Returns the voltage at the start and at the end of the step after a sample \[V\].
    #[inline(always)]
    pub(super) fn voltages_at(&self, n: usize) -> [f64; 2] {
        let [start, end, _] = self.inputs(n);
        [start, end]
    }

    /// Returns the runs from `first_active` on.
    #[doc(hidden)]
    pub fn active_runs(&self) -> &[Run] {
        &self.runs[self.idle_runs..]
    }

    /// Returns the segments from `first_active` on.
    pub(super) fn active_segments(&self) -> &[Segment] {
        &self.segments[self.idle_segments..]
    }

    fn set_weights(&mut self, record: &Record, criterion: &Criterion) {
        let regular = self.step_index.is_empty();
        if criterion.norm.is_time_weighted() || (criterion.is_integral() && !regular) {
            let time_s = &record.samples().time_s;
            let weight = |n: usize| criterion.weight(time_s[n] - time_s[0], record.steps().step(n));
            self.weight = (0..self.len()).map(|n| [weight(n); 2]).collect();
        } else if criterion.is_integral() {
            self.factor = self.factor.map(|factor| factor * self.step_s[0]);
        }
        if !self.counting.is_empty() {
            self.weight.resize(self.len(), [1.0; 2]);
            for (weight, counts) in self.weight.iter_mut().zip(&self.counting) {
                *weight = [0, 1].map(|channel| if counts[channel] { weight[channel] } else { 0.0 });
            }
        }
    }

    pub(super) fn set_runs(&mut self, method: Discretization) {
        let run = |n: usize| {
            let [start, end, torque] = self.inputs(n);
            let voltage = [start, if method.uses_next_input() { end } else { 0.0 }];
            Run { start: n, end: n + 1, step: self.step_of(n), voltage, torque }
        };
        self.runs = Run::joined((0..self.len()).map(run));
        let zero = |values: &[f64]| values.iter().all(|v| *v == 0.0);
        if self.starts_at_rest() {
            let idle = |run: &&Run| zero(&run.voltage) && run.torque == 0.0;
            self.idle_runs = self.runs.iter().take_while(idle).count();
            self.first_active = self.runs.get(self.idle_runs).map_or(self.len(), |run| run.start);
        }
        let (idle, active) = self.runs.split_at(self.idle_runs);
        self.segments = Segment::of(idle);
        self.idle_segments = self.segments.len();
        self.segments.extend(Segment::of(active));
    }

    fn set_idle_sums(&mut self, criterion: &Criterion) {
        for (n, measured) in self.measured[..self.first_active].iter().enumerate() {
            for channel in 0..2 {
                let e = measured[channel];
                let loss = if criterion.is_absolute() { e.abs() } else { e * e };
                self.idle_sums[channel] += loss * self.weight.get(n).map_or(1.0, |w| w[channel]);
            }
        }
    }
}

/// Returns the voltage at the start and at the end of each step of a resampled recording, whose voltage is linear over each
/// step and may jump between steps. It is empty for other recordings, and for discretizations that use only the start.
fn lines(record: &Record, method: Discretization) -> [Vec<f64>; 2] {
    if record.slope().is_empty() || !method.uses_next_input() {
        return Default::default();
    }
    let at = |fraction: f64| {
        let line = |(mean, slope): (&f64, &f64)| mean + fraction * slope;
        record.input().iter().zip(record.slope()).map(line).collect()
    };
    [at(-0.5), at(0.5)]
}
