//! Preparation of recordings: cropping, subtraction of offsets, masks, change of rate, low-pass filters.
//!
//! Voltage, torque, current and speed pass the same filter. A filter commutes with a linear time-invariant motor that starts
//! at rest or in a steady state: the filtered signals satisfy the same equations, and the estimates are not biased (L. Ljung,
//! *System Identification*, 1999, chapter 14).

mod even;
mod filter;
mod mask;
mod resample;
mod spikes;

use filter::Response;
pub use filter::{FilterKind, LowPass};
pub use mask::{Mask, parse_masks};

use super::heading::Quantity;
use super::record::{Excluded, Record};
use super::samples::{SAMPLES_MAX, Samples};
use super::source::Source;
use super::time;
use motorfit_core::limit::{Limit, limit, limit_of};
use motorfit_core::numeric::{count, mean, noise_sigma, peak, rounded, whole};
use motorfit_core::setting::text;
use motorfit_core::text::{engineering, significant};
use motorfit_core::{Error, Result};
use resample::{Resampled, decimated, lines, regular};
use std::ops::Range;

/// Largest ratio of a new rate to the recorded one; interpolated samples carry no information.
const FINER_MAX: u32 = 100;

/// Size limits of preparation.
pub(super) const LIMITS: [Limit; 2] = [
    limit("samples of a new rate for each recorded one", FINER_MAX as u64, "refused, with the highest rate"),
    limit_of("order of a low-pass", filter::ORDER_MAX, "refused"),
];

/// Steps of preparation; they are applied in this order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Preparation {
    /// First and last time that is kept \[s\]; `None` does not limit the recording on that side.
    pub crop: [Option<f64>; 2],
    /// Offsets of sensors that are subtracted.
    pub offset: Offset,
    /// Samples that are excluded from the criterion.
    pub mask: Vec<Mask>,
    /// Sampling rate to which the recording is resampled \[Hz\].
    pub rate_hz: Option<f64>,
    /// Factor of decimation: every Nth sample is kept, after an anti-alias filter. It is ignored if `rate_hz` is given.
    pub decimate: Option<usize>,
    /// Low-pass filter of all signals.
    pub filter: Option<LowPass>,
    /// True for a first-order hold of the input between samples, false for a zero-order hold; `None` selects the zero-order
    /// hold for a voltage and the first-order hold for a current.
    pub sampled_input: Option<bool>,
}

/// Offsets of sensors that are subtracted from their signals.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum Offset {
    /// No offsets are subtracted.
    #[default]
    None,
    /// Means of current and speed while the input is idle at the start of the recording, if that lasts ten samples.
    Auto,
    /// Offset of each listed signal, in SI units.
    Given(Vec<(Quantity, f64)>),
}

impl Preparation {
    /// Returns true if no step changes a recording.
    #[must_use]
    pub fn is_identity(&self) -> bool {
        *self == Self { sampled_input: self.sampled_input, ..Self::default() }
    }

    /// Prepares a recording. Cutting out segments with a disabled drive makes several recordings of one.
    ///
    /// # Errors
    /// Returns `Usage` if a setting does not suit the recording, `Data` if too few samples remain.
    pub fn apply(&self, record: &Record) -> Result<Vec<Record>> {
        let located = |error: Error| record.source().path.iter().fold(error, |error, path| error.in_file(path));
        self.check_clocks(record).map_err(located)?;
        let pieces = mask::apply(&self.mask, self.shifted(self.cropped(record)?)?)?;
        pieces.into_iter().map(|piece| self.filtered(self.resampled(piece)?)).collect::<Result<_>>().map_err(located)
    }

    /// Checks that no filter and no change of the rate mixes the samples of outputs with values between them.
    fn check_clocks(&self, record: &Record) -> Result<()> {
        let is_mixed = self.filter.is_some() || self.rate_hz.is_some() || self.decimate.is_some_and(|every| every > 1);
        let Some(of) = record.measured_at().first().filter(|_| is_mixed) else { return Ok(()) };
        let message = format!(
            "the {} was not measured at every sample: a filter or another rate would take interpolated values for measured ones",
            of.quantity
        );
        let hint = text!("Leave out " [Filter] ", " [Rate] " and " [Decimate] ": an output counts at its own samples.");
        Err(Error::usage(message, hint))
    }

    fn cropped(&self, record: &Record) -> Result<Record> {
        let [from, to] = self.crop;
        if from.is_none() && to.is_none() {
            return Ok(record.clone());
        }
        let range = record.between(from.unwrap_or(f64::NEG_INFINITY), to.unwrap_or(f64::INFINITY));
        if range.len() < 2 {
            let time = &record.samples().time_s;
            let (count, first, last) = (range.len(), time[0], time[time.len() - 1]);
            let message = text!([Crop] " leaves {count} samples of a recording from {first} s to {last} s");
            return Err(Error::usage(message, "Give FROM:TO in the time of the recording, in seconds."));
        }
        record.cut_to(range, "cropped")
    }

    fn shifted(&self, record: Record) -> Result<Record> {
        let offsets = match &self.offset {
            Offset::None => return Ok(record),
            Offset::Given(list) => list.clone(),
            Offset::Auto => rest_means(&record),
        };
        if offsets.is_empty() {
            return record.changed(|_| {}, "no rest at the start: no offset subtracted".to_owned());
        }
        let shown =
            |(quantity, value): &(Quantity, f64)| format!("{quantity} {} {}", significant(*value, 3), quantity.unit());
        let note = format!("offsets subtracted: {}", offsets.iter().map(shown).collect::<Vec<_>>().join(", "));
        let shift = |quantity, signal: &mut Vec<f64>| {
            for (_, value) in offsets.iter().filter(|(shifted, _)| *shifted == quantity) {
                signal.iter_mut().for_each(|v| *v -= value);
            }
        };
        record.changed(|samples| samples.change(shift), note)
    }

    fn resampled(&self, record: Record) -> Result<Record> {
        let Some(rate) = self.rate_hz else { return every_nth(record.with_slopes(self), self.decimate.unwrap_or(1)) };
        check_rate(rate)?;
        let time = &record.samples().time_s;
        if (time[time.len() - 1] - time[0]) * rate > count(SAMPLES_MAX) {
            let message = text!([Rate = "{rate}"] " makes more than {SAMPLES_MAX} samples");
            return Err(Error::usage(message, "Give a lower rate."));
        }
        let ratio = 1.0 / (record.period_s() * rate);
        let every = whole((ratio - 0.01).ceil().clamp(1.0, 1e9));
        let fine = 1.0 / (rate * count(every));
        // The tolerance lets the hint round the highest rate to four digits.
        if record.period_s() / fine > f64::from(FINER_MAX) * (1.0 + 1e-3) {
            let period = engineering(record.period_s(), "s", 4);
            let message =
                text!([Rate = "{rate}"] " makes more than {FINER_MAX} samples of each recorded one (period {period})");
            let highest = rounded(f64::from(FINER_MAX) / record.period_s(), 4);
            return Err(Error::usage(message, format!("Give at most {highest} Hz.")));
        }
        if record.steps().step_index.is_empty() && (fine / record.period_s() - 1.0).abs() < 1e-6 {
            return every_nth(record.with_slopes(self), every);
        }
        if !time::gaps(&record.samples().time_s).is_empty() {
            let hint = text!("Add " [Gaps = "split"] ", or use " [Gaps = "keep"] " without " [Rate] ".");
            return Err(Error::usage(text!([Rate] " would interpolate over a gap in time"), hint));
        }
        let record = record.with_slopes(self);
        let note = format!("resampled to a regular clock of {}", engineering(1.0 / fine, "Hz", 5));
        let made = regular(record.samples(), &record.slope, fine);
        let record = Record { interpolated: true, ..record.resampled(made, note)? };
        every_nth(record, every)
    }

    fn filtered(&self, record: Record) -> Result<Record> {
        let Some(filter) = self.filter else { return Ok(record) };
        if !record.steps().step_index.is_empty() {
            return Err(Error::usage(text!([Filter] " needs evenly spaced samples"), time::regular_clock()));
        }
        let cascade = filter.design(record.period_s())?;
        let name = match filter.kind {
            FilterKind::Butterworth => "Butterworth".to_owned(),
            FilterKind::Chebyshev { ripple_db } => format!("Chebyshev ({ripple_db} dB)"),
        };
        let (order, cutoff) = (filter.order, engineering(filter.cutoff_hz, "Hz", 4));
        let note = format!("all signals through the same low-pass: {name}, order {order}, {cutoff}");
        // The filter spreads an excluded sample over later ones.
        let tail = whole((2.0 / (filter.cutoff_hz * record.period_s())).ceil());
        let widened = |e: &Excluded| Excluded { end: e.end.saturating_add(tail).min(record.len()), ..*e };
        let excluded = record.excluded().iter().map(widened).collect();
        let Response { noise_power, memory } = cascade.response();
        let independent = record.effective_sample_ratio() * noise_power;
        let at_rest = record.starts_at_rest();
        let filtered = |signal: &[f64]| cascade.apply(signal, if at_rest { 0.0 } else { first(signal) });
        let slope = if record.slope.is_empty() { Vec::new() } else { filtered(&record.slope) };
        let pass = |samples: &mut Samples| samples.change(|_, signal| *signal = filtered(signal));
        let record = Record { excluded, independent, slope, ..record.changed(pass, note)? };
        Ok(record.without_first(if at_rest { 0 } else { memory }))
    }
}

/// Returns the first value of a signal; 0 for one that was not recorded.
fn first(signal: &[f64]) -> f64 {
    signal.first().copied().unwrap_or(0.0)
}

/// Lowest rate \[Hz\], that of the longest period of a recording.
const RATE_MIN: f64 = 1e-6;

/// Checks that a rate \[Hz\] is finite and at least [`RATE_MIN`].
pub(super) fn check_rate(rate_hz: f64) -> Result<()> {
    if rate_hz.is_finite() && rate_hz >= RATE_MIN {
        return Ok(());
    }
    Err(Error::usage(text!([Rate] " is {rate_hz}"), format!("Give samples per second, at least {RATE_MIN}.")))
}

/// Decimates a recording by an integer factor.
fn every_nth(record: Record, every: usize) -> Result<Record> {
    if every <= 1 {
        return Ok(record);
    }
    if !record.steps().step_index.is_empty() {
        return Err(Error::usage(text!([Decimate] " needs evenly spaced samples"), time::regular_clock()));
    }
    if record.len() / 2 < every {
        let message = format!("decimation by {every} leaves too little of {} samples", record.len());
        return Err(Error::usage(message, text!("Decimate less, or give a higher " [Rate] ".")));
    }
    let note = format!("one of {every} samples kept after an anti-alias filter of all signals");
    let at_rest = record.starts_at_rest();
    let (made, memory) = decimated(&record, every, at_rest)?;
    Ok(record.resampled(made, note)?.without_first(if at_rest { 0 } else { memory }))
}

/// Fewest idle samples at the start whose means are taken as offsets.
const REST_MIN: usize = 10;

/// Returns the means of current and speed while the input is within 1 % of its peak from zero at the start of the recording;
/// none if that is shorter than [`REST_MIN`] samples.
fn rest_means(record: &Record) -> Vec<(Quantity, f64)> {
    let input = record.input();
    let peak = peak(input);
    let rest = input.iter().take_while(|v| v.abs() <= 0.01 * peak).count();
    if rest < REST_MIN {
        return Vec::new();
    }
    let samples = record.samples();
    let channels = [(Quantity::Current, &samples.current), (Quantity::Speed, &samples.speed)];
    channels.into_iter().filter_map(|(quantity, signal)| Some((quantity, mean(&signal.as_ref()?[..rest])))).collect()
}

impl Record {
    /// Returns true if all outputs are zero at the first sample, within their noise or 1 % of their peaks.
    fn starts_at_rest(&self) -> bool {
        let named = self.samples.named.iter().filter(|signal| !signal.is_input).map(|signal| signal.values.as_slice());
        self.measured()
            .into_iter()
            .flatten()
            .chain(named)
            .all(|signal| signal[0].abs() <= (0.01 * peak(signal)).max(5.0 * noise_sigma(signal)))
    }

    /// Excludes the first samples, in which the transient of a filter that started in motion has not decayed.
    ///
    /// The samples are not cut off, because the input drives the motor there too; its initial state is estimated.
    fn without_first(self, count: usize) -> Self {
        let end = count.min(self.len().saturating_sub(2));
        let first = (end > 0).then_some(Excluded { start: 0, end, channels: [true; 2] });
        Self { excluded: self.excluded.into_iter().chain(first).collect(), ..self }
    }

    /// Returns the samples between two times \[s\], both included.
    fn between(&self, from: f64, to: f64) -> Range<usize> {
        // A tolerance of a millionth of a period: at 1 ms the time 0.3 s is sample 300 in spite of rounding.
        let near = 1e-6 * self.period_s();
        let start = self.samples.time_s.partition_point(|t| *t < from - near);
        start..self.samples.time_s.partition_point(|t| *t <= to + near)
    }

    /// Returns the samples of a range, with a note on the times.
    fn cut_to(&self, range: Range<usize>, how: &str) -> Result<Self> {
        let [from, to] = [range.start, range.end - 1].map(|n| significant(self.samples.time_s[n], 6));
        self.part(range, format!("{how} to {from} s … {to} s"))
    }

    /// Returns the recording with changed values, which are checked, and a note.
    #[doc(hidden)]
    pub fn changed(self, change: impl FnOnce(&mut Samples), note: String) -> Result<Self> {
        let Self { mut samples, mut source, .. } = self;
        change(&mut samples);
        source.notes.push(note);
        for (quantity, signal) in samples.signals() {
            super::record::check_values(quantity, signal, &source)?;
        }
        Ok(Self { samples, source, ..self })
    }

    /// Represents the input by its mean and slope over each step if the recording will be resampled.
    fn with_slopes(self, preparation: &Preparation) -> Self {
        if !self.slope.is_empty() || (preparation.rate_hz.is_none() && preparation.decimate.is_none_or(|n| n <= 1)) {
            return self;
        }
        let sampled = preparation.sampled_input.unwrap_or(self.driver() == Quantity::Current);
        let [mean, slope] = lines(self.input(), !sampled);
        Self { samples: self.samples.with_input(mean), slope, ..self }
    }

    /// Replaces the signals by resampled ones and maps lines and excluded ranges to the new samples.
    fn resampled(self, made: Resampled, note: String) -> Result<Self> {
        let this = self.with_mixed_samples();
        let mut source = Source { lines: this.source.lines.of(made.from.iter().copied()), ..this.source };
        source.notes.push(note);
        let place = |n: usize| made.from.partition_point(|from| *from < n);
        let moved = |e: &Excluded| Excluded { start: place(e.start), end: place(e.end).max(place(e.start) + 1), ..*e };
        let excluded = this.excluded.iter().map(moved).filter(|e| e.start < made.from.len()).collect();
        let independent = this.independent * made.independent;
        let (slope, interpolated) = (made.slope, this.interpolated);
        Ok(Self { excluded, independent, slope, interpolated, ..Self::from_file(made.samples, source, false)? })
    }
}
