//! Change of the sampling rate: interpolation to a regular clock, and decimation after an anti-alias filter.
//!
//! Before a decimation all signals, the input included, pass the same filter, so that the filtered signals satisfy the
//! equations of the motor. Interpolation filters nothing. Over each new period the input is the straight line with the same
//! mean and the same first moment: its effect on the motor differs only in the third order of the period.

use super::filter::{FilterKind, LowPass, Response};
use crate::record::Record;
use crate::samples::{NamedSignal, Samples};
use motorfit_core::{Result, numeric};

/// Cut-off of the anti-alias filter relative to half the new rate.
const EDGE: f64 = 0.8;
/// Order of the anti-alias filter.
const ORDER: usize = 8;
/// Passband ripple of the anti-alias filter \[dB\].
const RIPPLE_DB: f64 = 0.05;

/// Result of a change of rate.
pub(super) struct Resampled {
    /// Signals at the new times; the input is the mean over each period.
    pub samples: Samples,
    /// Rise of the input over each period, in V or A.
    pub slope: Vec<f64>,
    /// Index of the old sample at or before each new one.
    pub from: Vec<usize>,
    /// Ratio of the effective sample size to the number of new samples.
    pub independent: f64,
}

/// Returns mean and rise of an input over each step, for a zero-order hold or else a first-order hold.
pub(super) fn lines(voltage: &[f64], held: bool) -> [Vec<f64>; 2] {
    let next = |n: usize| if held { voltage[n] } else { voltage[(n + 1).min(voltage.len().saturating_sub(1))] };
    let all = || (0..voltage.len()).map(|n| (voltage[n], next(n)));
    [all().map(|(a, b)| f64::midpoint(a, b)).collect(), all().map(|(a, b)| b - a).collect()]
}

/// Decimates a recording with a regular clock by the factor `every`, after an anti-alias filter. The second result is the
/// length of the filter's impulse response \[new samples\].
pub(super) fn decimated(record: &Record, every: usize, at_rest: bool) -> Result<(Resampled, usize)> {
    let (samples, factor) = (record.samples(), numeric::count(every));
    let kind = FilterKind::Chebyshev { ripple_db: RIPPLE_DB };
    let cutoff_hz = EDGE * 0.5 / (record.period_s() * factor);
    let filter = LowPass { kind, order: ORDER, cutoff_hz }.design(record.period_s())?;
    let from: Vec<usize> = (0..record.len()).step_by(every).collect();
    let pass =
        |signal: &[f64]| filter.apply(signal, if at_rest { 0.0 } else { signal.first().copied().unwrap_or(0.0) });
    let picked = |signal: &[f64]| {
        let filtered = pass(signal);
        from.iter().map(|&n| filtered[n]).collect::<Vec<f64>>()
    };
    let [input, slope] = joined(&pass(samples.input()), &pass(record.slope()), every);
    let torque = |signal: &[f64]| {
        let [mean, _] = joined(&pass(signal), &vec![0.0; signal.len()], every);
        mean
    };
    let made = Samples {
        time_s: from.iter().map(|&n| samples.time_s[n]).collect(),
        voltage: samples.voltage.clone(),
        torque: samples.torque.as_deref().map(torque),
        current: samples.current.as_deref().map(picked),
        speed: samples.speed.as_deref().map(picked),
        named: named(samples, &torque, &picked),
    };
    let Response { noise_power, memory } = filter.response();
    let independent = (noise_power * factor).min(1.0);
    Ok((Resampled { samples: made.with_input(input), slope, from, independent }, memory.div_ceil(every)))
}

/// Returns the signals of a model: inputs by their means over each new period, outputs at the new times.
fn named(
    samples: &Samples,
    mean: &impl Fn(&[f64]) -> Vec<f64>,
    at_times: &impl Fn(&[f64]) -> Vec<f64>,
) -> Vec<NamedSignal> {
    let one = |signal: &NamedSignal| {
        let values = if signal.is_input { mean(&signal.values) } else { at_times(&signal.values) };
        signal.with(values)
    };
    samples.named.iter().map(one).collect()
}

/// Joins the lines over `every` periods each into one: its mean, and the rise that gives the same first moment.
fn joined(mean: &[f64], slope: &[f64], every: usize) -> [Vec<f64>; 2] {
    let one = |(mean, slope): (&[f64], &[f64])| {
        let count = numeric::count(mean.len());
        let (mut total, mut moment, mut place) = (0.0, 0.0, 0.5);
        for (m, s) in mean.iter().zip(slope) {
            total += m;
            moment += m * (place / count - 0.5) + s / (12.0 * count);
            place += 1.0;
        }
        (total / count, 12.0 * moment / count)
    };
    let pairs: Vec<(f64, f64)> = mean.chunks(every).zip(slope.chunks(every)).map(one).collect();
    [pairs.iter().map(|p| p.0).collect(), pairs.iter().map(|p| p.1).collect()]
}

/// Resamples signals to a regular clock of `period_s` \[s\], from the first time to the last.
pub(super) fn regular(samples: &Samples, slope: &[f64], period_s: f64) -> Resampled {
    let time_s = &samples.time_s;
    let (first, last) = (time_s[0], time_s[time_s.len() - 1]);
    let count = numeric::whole((last - first) / period_s * (1.0 + 1e-12)) + 1;
    let grid: Vec<f64> = (0..count).map(|n| first + numeric::count(n) * period_s).collect();
    let mut at = 0;
    let mut step_of = |t: &f64| {
        while at + 2 < time_s.len() && time_s[at + 1] <= *t + 1e-9 * period_s {
            at += 1;
        }
        at
    };
    let from: Vec<usize> = grid.iter().map(&mut step_of).collect();
    let smooth =
        |signal: &[f64]| -> Vec<f64> { grid.iter().zip(&from).map(|(t, &n)| cubic(time_s, signal, n, *t)).collect() };
    let [input, slope] = on_grid(time_s, [samples.input(), slope], &grid, period_s);
    let torque = |signal: &[f64]| {
        let [mean, _] = on_grid(time_s, [signal, &vec![0.0; signal.len()]], &grid, period_s);
        mean
    };
    let independent = (numeric::count(time_s.len()) / numeric::count(count)).min(1.0);
    let made = Samples {
        voltage: samples.voltage.clone(),
        torque: samples.torque.as_deref().map(torque),
        current: samples.current.as_deref().map(smooth),
        speed: samples.speed.as_deref().map(smooth),
        named: named(samples, &torque, &smooth),
        time_s: grid.clone(),
    };
    Resampled { samples: made.with_input(input), slope, from, independent }
}

/// Evaluates at `t`, in the step after sample `n`, the cubic through the four nearest samples (Lagrange's form).
fn cubic(time_s: &[f64], signal: &[f64], n: usize, t: f64) -> f64 {
    let count = time_s.len().min(4);
    let start = n.saturating_sub(1).min(time_s.len() - count);
    let (times, values) = (&time_s[start..start + count], &signal[start..start + count]);
    let weight = |k: usize| {
        let others = times.iter().enumerate().filter(|(other, _)| *other != k);
        others.map(|(_, other)| (t - other) / (times[k] - other)).product::<f64>()
    };
    values.iter().enumerate().map(|(k, value)| weight(k) * value).sum()
}

/// Converts lines over irregular steps (means and rises) to lines over the periods of a grid.
fn on_grid(time_s: &[f64], [mean, slope]: [&[f64]; 2], grid: &[f64], period_s: f64) -> [Vec<f64>; 2] {
    // A recording of a model has its inputs among the named signals.
    if mean.is_empty() {
        return [Vec::new(), Vec::new()];
    }
    let mut n = 0;
    let mut lines = [Vec::with_capacity(grid.len()), Vec::with_capacity(grid.len())];
    for &start in grid {
        let (end, middle) = (start + period_s, start + 0.5 * period_s);
        let (mut total, mut moment, mut from) = (0.0, 0.0, start);
        loop {
            let next = time_s.get(n + 1).copied().unwrap_or(f64::INFINITY);
            let to = next.min(end);
            let (length, center) = ((to - from).max(0.0), f64::midpoint(from, to));
            // Slope of the piece, and its value at the centre.
            let rate = if next.is_finite() { slope[n] / (next - time_s[n]) } else { 0.0 };
            let value =
                if next.is_finite() { mean[n] + rate * (center - f64::midpoint(time_s[n], next)) } else { mean[n] };
            total += value * length;
            moment += value * length * (center - middle) + rate * length.powi(3) / 12.0;
            if next >= end {
                break;
            }
            from = next.max(from);
            n += 1;
        }
        lines[0].push(total / period_s);
        lines[1].push(12.0 * moment / (period_s * period_s));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_regular_clock_keeps_cubics_and_the_area_of_a_held_voltage() {
        let time_s: Vec<f64> = (0..60).map(|n| 0.01 * f64::from(n) + 0.002 * f64::from(n * n % 5)).collect();
        let cube = |t: &f64| 1.0 + t - 3.0 * t * t + 2.0 * t.powi(3);
        let voltage: Vec<f64> = (0..60).map(|n| f64::from(n / 7 % 2)).collect();
        let samples = Samples { speed: Some(time_s.iter().map(cube).collect()), voltage, time_s, ..Samples::default() };
        let [_, slope] = lines(&samples.voltage, true);
        let made = regular(&samples, &slope, 0.007);
        let exact = made.samples.time_s.iter().zip(made.samples.speed.as_ref().unwrap());
        assert!(exact.into_iter().all(|(t, y)| (y - cube(t)).abs() < 1e-12));
        let end = made.samples.time_s.last().unwrap() + 0.007;
        let area: f64 =
            samples.time_s.windows(2).zip(&samples.voltage).map(|(t, v)| v * (t[1].min(end) - t[0].min(end))).sum();
        let last = samples.voltage.last().unwrap() * (end - samples.time_s.last().unwrap()).max(0.0);
        let ours: f64 = made.samples.voltage.iter().map(|v| v * 0.007).sum();
        assert!((ours - area - last).abs() < 1e-12, "{ours} {area}");
    }

    #[test]
    fn a_line_stays_a_line() {
        // A linear voltage is reproduced exactly on any grid.
        let time_s: Vec<f64> = (0..40).map(|n| 0.01 * f64::from(n) + 0.003 * f64::from(n % 3)).collect();
        let voltage: Vec<f64> = time_s.iter().map(|t| 2.0 * t - 0.1).collect();
        let [mean, slope] = lines(&voltage, false);
        let made = on_grid(&time_s, [&mean, &slope], &[0.005, 0.012, 0.019], 0.007);
        for (n, start) in [0.005, 0.012, 0.019].into_iter().enumerate() {
            assert!((made[0][n] - (2.0 * (start + 0.0035) - 0.1)).abs() < 1e-12);
            assert!((made[1][n] - 0.014).abs() < 1e-12);
        }
        let [mean, slope] = joined(&[1.0, 2.0, 3.0, 4.0], &[1.0; 4], 4);
        assert!((mean[0] - 2.5).abs() < 1e-12 && (slope[0] - 4.0).abs() < 1e-12, "{slope:?}");
    }

    #[test]
    fn decimation_keeps_the_passband_and_suppresses_aliases() {
        let wave =
            |f: f64| (0..4000).map(|n| (std::f64::consts::TAU * f * f64::from(n) * 1e-3).sin()).collect::<Vec<f64>>();
        let of = |f: f64| {
            let time_s = (0..4000).map(|n| 1e-3 * f64::from(n)).collect();
            let samples = Samples { time_s, voltage: wave(f), speed: Some(wave(f)), ..Samples::default() };
            let record = Record { slope: vec![0.0; 4000], ..Record::new(samples).unwrap() };
            let (made, _) = decimated(&record, 10, true).unwrap();
            numeric::peak(&made.samples.speed.unwrap()[100..])
        };
        assert!((of(5.0) - 1.0).abs() < 0.02, "{}", of(5.0));
        assert!(of(90.0) < 1e-3, "90 Hz would be aliased to 10 Hz: {}", of(90.0));
    }
}
