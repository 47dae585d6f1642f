//! A recording at another rate: onto a regular clock, then every so-manieth sample behind an anti-alias filter.
//!
//! Every signal, the voltage too, passes the same filter, so that the motor relates the filtered signals as it relates
//! the others. A held voltage becomes its mean over each new period, which keeps its centre where it was: the error is of
//! second order in the period.

use super::filter::{Cascade, FilterKind, LowPass};
use crate::Result;
use crate::record::Samples;

/// The edge of the anti-alias filter as a part of half the new rate.
const EDGE: f64 = 0.8;
const ORDER: usize = 8;
const RIPPLE_DB: f64 = 0.05;

/// What a change of rate made.
pub(super) struct Resampled {
    pub samples: Samples,
    /// For each sample, the place in time of the old one that it stands for.
    pub from: Vec<usize>,
    /// The part of the new samples that count as independent.
    pub independent: f64,
}

/// Every `every`th sample of regular signals.
pub(super) fn decimated(samples: &Samples, period_s: f64, every: usize, held: bool) -> Result<Resampled> {
    #[expect(clippy::cast_precision_loss, reason = "a small factor")]
    let factor = every as f64;
    let kind = FilterKind::Chebyshev { ripple_db: RIPPLE_DB };
    let filter = LowPass { kind, order: ORDER, cutoff_hz: EDGE * 0.5 / (period_s * factor) }.design(period_s)?;
    let from: Vec<usize> = (0..samples.time_s.len()).step_by(every).collect();
    let picked = |signal: &[f64]| {
        let filtered = filter.apply(signal);
        from.iter().map(|&n| filtered[n]).collect::<Vec<f64>>()
    };
    let input = |signal: &[f64]| if held { means(&filter, signal, every) } else { picked(signal) };
    let samples = Samples {
        time_s: from.iter().map(|&n| samples.time_s[n]).collect(),
        voltage: input(&samples.voltage),
        torque: samples.torque.as_deref().map(input),
        current: samples.current.as_deref().map(picked),
        speed: samples.speed.as_deref().map(picked),
    };
    Ok(Resampled { samples, from, independent: (filter.noise_power() * factor).min(1.0) })
}

/// The means of a filtered signal over each new period.
fn means(filter: &Cascade, signal: &[f64], every: usize) -> Vec<f64> {
    let filtered = filter.apply(signal);
    #[expect(clippy::cast_precision_loss, reason = "a small factor")]
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    filtered.chunks(every).map(mean).collect()
}

/// Signals at times every `period_s`, from the first to the last.
pub(super) fn regular(samples: &Samples, period_s: f64, held: bool) -> Resampled {
    let time_s = &samples.time_s;
    let (first, last) = (time_s[0], time_s[time_s.len() - 1]);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a duration over a period, checked before"
    )]
    let count = ((last - first) / period_s * (1.0 + 1e-12)).floor() as usize + 1;
    #[expect(clippy::cast_precision_loss, reason = "a count of samples is far below 2^53")]
    let grid: Vec<f64> = (0..count).map(|n| first + n as f64 * period_s).collect();
    let mut at = 0;
    let from: Vec<usize> = grid
        .iter()
        .map(|t| {
            while at + 2 < time_s.len() && time_s[at + 1] <= *t + 1e-9 * period_s {
                at += 1;
            }
            at
        })
        .collect();
    let smooth =
        |signal: &[f64]| -> Vec<f64> { grid.iter().zip(&from).map(|(t, &n)| cubic(time_s, signal, n, *t)).collect() };
    let input = |signal: &[f64]| {
        if held { held_means(time_s, signal, &grid, period_s) } else { linear(time_s, signal, &grid, &from) }
    };
    #[expect(clippy::cast_precision_loss, reason = "counts of samples are far below 2^53")]
    let independent = (time_s.len() as f64 / count as f64).min(1.0);
    Resampled {
        samples: Samples {
            voltage: input(&samples.voltage),
            torque: samples.torque.as_deref().map(input),
            current: samples.current.as_deref().map(smooth),
            speed: samples.speed.as_deref().map(smooth),
            time_s: grid.clone(),
        },
        from: from.clone(),
        independent,
    }
}

/// The cubic through the four samples around `t`, which lies in the step after sample `n`; at the ends the nearest four.
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

fn linear(time_s: &[f64], signal: &[f64], grid: &[f64], from: &[usize]) -> Vec<f64> {
    let at = |(t, &n): (&f64, &usize)| {
        let part = (t - time_s[n]) / (time_s[n + 1] - time_s[n]);
        signal[n] + part * (signal[n + 1] - signal[n])
    };
    grid.iter().zip(from).map(at).collect()
}

/// The means of a held signal over each period of a grid.
fn held_means(time_s: &[f64], signal: &[f64], grid: &[f64], period_s: f64) -> Vec<f64> {
    let mut n = 0;
    grid.iter()
        .map(|&start| {
            let end = start + period_s;
            let mut sum = 0.0;
            let mut from = start;
            loop {
                let next = time_s.get(n + 1).copied().unwrap_or(f64::INFINITY);
                sum += signal[n] * (next.min(end) - from).max(0.0);
                if next >= end {
                    return sum / period_s;
                }
                from = next.max(from);
                n += 1;
            }
        })
        .collect()
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
        let made = regular(&samples, 0.007, true);
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
    fn decimation_keeps_what_is_slow_and_drops_what_would_fold() {
        let wave =
            |f: f64| (0..4000).map(|n| (std::f64::consts::TAU * f * f64::from(n) * 1e-3).sin()).collect::<Vec<f64>>();
        let of = |f: f64| {
            let time_s = (0..4000).map(|n| 1e-3 * f64::from(n)).collect();
            let samples = Samples { time_s, voltage: wave(f), speed: Some(wave(f)), ..Samples::default() };
            let made = decimated(&samples, 1e-3, 10, false).unwrap().samples;
            assert_eq!(made.speed.as_ref(), Some(&made.voltage), "alike");
            made.voltage[100..].iter().fold(0.0, |peak: f64, v| peak.max(v.abs()))
        };
        assert!((of(5.0) - 1.0).abs() < 0.02, "{}", of(5.0));
        assert!(of(90.0) < 1e-3, "90 Hz would look like 10 Hz: {}", of(90.0));
    }
}
