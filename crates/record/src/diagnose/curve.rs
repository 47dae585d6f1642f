//! Rules on the static characteristic of the motor: the steady-state speed for each voltage.

use super::finding::Finding;
use super::view::{Channel, View};
use crate::heading::Quantity;
use motorfit_core::numeric::{count, mean, slope, whole};
use motorfit_core::text::significant;

/// Largest rate of change of the voltage (standard deviation of its differences over its own) for a static characteristic.
const ROUGHNESS: f64 = 0.3;
/// Number of bins of |voltage|.
const BINS: usize = 12;
/// Largest number of blocks over which samples are averaged.
const BLOCKS: usize = 400;
/// Fewest samples for an estimate.
const SAMPLES_MIN: usize = 100;

pub(super) fn curve(view: &View<'_>, findings: &mut Vec<Finding>) {
    let Some(speed) = view.speed.as_ref().filter(|speed| speed.range > 0.0 && !view.loaded) else { return };
    if view.roughness >= ROUGHNESS || view.input.range == 0.0 || view.len() < SAMPLES_MIN {
        return;
    }
    let Some(points) = static_curve(view, speed) else { return };
    findings.extend(falls(&points).or_else(|| saturates(&points)));
}

/// A point of the static characteristic: |voltage| \[V\], steady-state speed \[rad/s\] and its standard error \[rad/s\].
#[derive(Debug, Clone, Copy)]
struct Point {
    volts: f64,
    speed: f64,
    error: f64,
}

/// Sums over the blocks of one bin, for the voltage v, the speeds x of a block and y of the next one, and the instrument z.
#[derive(Debug, Clone, Copy, Default)]
struct Bin {
    count: f64,
    v: f64,
    vv: f64,
    xyz: [f64; 3],
    xyz_v: [f64; 3],
    /// Sums of yz, xz, xx and zz.
    products: [f64; 4],
}

impl Bin {
    fn add(&mut self, v: f64, [x, y, z]: [f64; 3]) {
        self.count += 1.0;
        self.v += v;
        self.vv += v * v;
        for (k, value) in [x, y, z].into_iter().enumerate() {
            self.xyz[k] += value;
            self.xyz_v[k] += value * v;
        }
        for (sum, product) in self.products.iter_mut().zip([y * z, x * z, x * x, z * z]) {
            *sum += product;
        }
    }

    /// Returns the sums of products after mean and slope over v are removed from both factors.
    fn partial(&self) -> [f64; 4] {
        let vv = self.vv - self.v * self.v / self.count;
        let with_v = |k: usize| self.xyz_v[k] - self.xyz[k] * self.v / self.count;
        let [x, y, z] = [0, 1, 2];
        let mut partial = self.products;
        for (sum, (a, b)) in partial.iter_mut().zip([(y, z), (x, z), (x, x), (z, z)]) {
            *sum -= self.xyz[a] * self.xyz[b] / self.count;
            if vv > 1e-9 * self.vv {
                *sum -= with_v(a) * with_v(b) / vv;
            }
        }
        partial
    }
}

/// Estimates the static characteristic by instrumental variables (T. Söderström, P. Stoica 1983).
///
/// The speed of a block is `a` times that of the block before plus a function of the voltage; the speed two blocks before,
/// whose noise is independent, is the instrument. This extrapolates a slow motor under short steps to its steady-state speeds.
fn static_curve(view: &View<'_>, speed: &Channel<'_>) -> Option<Vec<Point>> {
    let rows = rows(view, speed);
    let mut bins = [Bin::default(); BINS];
    for (bin, v, xyz) in &rows {
        bins[*bin].add(*v, *xyz);
    }
    let mut sums = [0.0; 4];
    let mut used = 0.0;
    for bin in bins.iter().filter(|bin| bin.count >= 4.0) {
        sums.iter_mut().zip(bin.partial()).for_each(|(sum, part)| *sum += part);
        used += bin.count;
    }
    let [yz, xz, xx, zz] = sums;
    // If the motor settles within each block, the instrument is uncorrelated and a is 0.
    let a = if xz > 4.0 * (xx * zz / f64::max(used, 1.0)).sqrt() { yz / xz } else { 0.0 };
    if !(-0.3..0.9).contains(&a) {
        return None;
    }
    let gain = 1.0 - a;
    let mut squares = [0.0; BINS];
    for (bin, _, [x, y, _]) in &rows {
        let all = &bins[*bin];
        let rest = (y - a * x) - (all.xyz[1] - a * all.xyz[0]) / all.count;
        squares[*bin] += rest * rest;
    }
    let points = bins.iter().zip(squares).filter(|(bin, _)| bin.count >= 4.0).map(|(bin, squares)| Point {
        volts: bin.v / bin.count,
        speed: (bin.xyz[1] - a * bin.xyz[0]) / bin.count / gain,
        error: (squares / (bin.count - 2.0) / bin.count).sqrt() / gain,
    });
    Some(points.collect())
}

/// Returns the blocks with a steady voltage: the bin of |v|, |v|, and the speeds of this block, the next and the previous one,
/// times the sign of v.
fn rows(view: &View<'_>, speed: &Channel<'_>) -> Vec<(usize, f64, [f64; 3])> {
    let length = view.len().div_ceil(BLOCKS);
    let blocks = |values: &[f64]| values.chunks_exact(length).map(mean).collect::<Vec<f64>>();
    let (volts, speeds) = (blocks(view.input.values), blocks(speed.values));
    let width = view.input.peak / count(BINS);
    let mut rows = Vec::new();
    for n in 1..volts.len().saturating_sub(1) {
        let v = 0.5 * (volts[n] + volts[n + 1]);
        if v.abs() < 0.5 * width || (volts[n + 1] - volts[n]).abs() > 0.5 * width {
            continue;
        }
        let bin = whole(v.abs() / width).min(BINS - 1);
        let sign = v.signum();
        rows.push((bin, v.abs(), [speeds[n], speeds[n + 1], speeds[n - 1]].map(|w| sign * w)));
    }
    rows
}

/// Detects a speed that decreases as the voltage increases, as under a drive that folds back or whose command overflows.
fn falls(points: &[Point]) -> Option<Finding> {
    let top = points.last().filter(|_| points.len() >= 3)?;
    let best = points.iter().max_by(|a, b| a.speed.total_cmp(&b.speed))?;
    let drop = best.speed - top.speed;
    let error = (best.error.powi(2) + top.error.powi(2)).sqrt();
    if best.speed <= 0.0 || top.speed < 0.0 || drop < 0.1 * best.speed || drop < 5.0 * error {
        return None;
    }
    let [at, peak, end, last] = [best.volts, best.speed, top.volts, top.speed].map(|x| significant(x, 3));
    let message = format!("the speed decreases with more voltage: {peak} rad/s at {at} V but {last} rad/s at {end} V");
    let remedy = format!("Leave out voltages above {at} V, and check the drive and the range of its command there.");
    let finding = Finding::new("speed_falls", Quantity::Speed, message, remedy);
    Some(finding.figure("volts", best.volts).figure("drop", drop / best.speed))
}

/// Detects saturation: the gain in the top third of the voltages is below a quarter of that in the bottom third.
fn saturates(points: &[Point]) -> Option<Finding> {
    let (low, high) = (points.first()?.volts, points.last()?.volts);
    let third = (high - low) / 3.0;
    let gain = |from: f64, to: f64| {
        let within: Vec<&Point> = points.iter().filter(|p| (from..=to).contains(&p.volts)).collect();
        let line: Vec<(f64, f64)> = within.iter().map(|p| (p.volts, p.speed)).collect();
        let error = within.iter().fold(0.0, |worst: f64, p| worst.max(p.error)) / third;
        (line.len() >= 2).then(|| (slope(&line), 2.0 * error))
    };
    let ((bottom, error_bottom), (top, error_top)) = (gain(low, low + third)?, gain(high - third, high)?);
    let sure = bottom > 5.0 * error_bottom && 0.25 * bottom - top > 2.0 * (error_top + 0.25 * error_bottom);
    if points.len() < 6 || top >= 0.25 * bottom || !sure {
        return None;
    }
    let [bottom_shown, top_shown] = [bottom, top].map(|gain| significant(gain, 3));
    let from = significant(high - third, 3);
    let message = format!(
        "the speed saturates: it rises by {bottom_shown} rad/s per V at low voltages, by {top_shown} above {from} V"
    );
    let remedy = "Leave out the highest voltages, and check the range of the drive and its supply.";
    let finding = Finding::new("speed_saturates", Quantity::Speed, message, remedy);
    Some(finding.figure("gain_first", bottom).figure("gain_last", top))
}
