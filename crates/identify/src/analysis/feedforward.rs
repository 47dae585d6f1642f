//! Feedforward characteristics by regression, for comparison with those of the output-error fit.
//!
//! Ordinary least squares of `dω/dt = α ω + β v + γ sgn(ω)`, as in FRC's `SysId` (allwpilib, `ols-derivations.md`):
//! `kS = −γ/β`, `kV = −α/β`, `kA = 1/β`, where `dω/dt` \[rad/s²\] is the central difference of the measured speed over a
//! window. A wide window has a bias: on an exponential of time constant τ a window `2d` scales the difference by
//! `sinh(d/τ)/(d/τ)`. A narrow window amplifies the noise, and noise of the speed biases α towards zero. Since the windows
//! overlap, their errors are correlated and the ordinary standard errors only approximate.

use super::characteristics::Characteristic;
use motorfit_core::numeric::{count, peak, whole};
use motorfit_record::Record;
use nalgebra::{Matrix3, Vector3};

/// The characteristics by regression over all recordings with a speed and without a load torque.
///
/// If the current is the input, A replaces V in all units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regression {
    /// Window of the central difference \[s\].
    pub window_s: f64,
    /// Window of the central difference in sampling periods of the first recording.
    pub window_samples: usize,
    /// Number of samples in the regression.
    pub samples: usize,
    /// Input that overcomes Coulomb friction, kS \[V\].
    pub ks: Characteristic,
    /// Input per speed, kV \[V·s/rad\].
    pub kv: Characteristic,
    /// Input per acceleration, kA \[V·s²/rad\].
    pub ka: Characteristic,
}

/// Smallest speed of a moving motor relative to the peak speed.
const MOVING: f64 = 0.05;
/// Smallest number of samples of a regression.
const SAMPLES_MIN: usize = 20;
/// Ratio of the wider window to the time constant; on an exponential the difference is then 0.26 % too large.
const WINDOW: f64 = 0.25;
/// Smallest pivot of the normal matrix with unit diagonal at which the regressors are not collinear.
const PIVOT_MIN: f64 = 1e-9;

/// Computes the regression over the shortest window, two periods, and, if the time constant \[s\] is known, over a window of a
/// quarter of it.
#[must_use]
pub fn regressions(records: &[Record], time_constant_s: Option<f64>) -> Vec<Regression> {
    let shortest = 2.0 * records.iter().map(Record::period_s).fold(0.0, f64::max);
    let mut found: Vec<Regression> = regression(records, shortest).into_iter().collect();
    let wider = time_constant_s.and_then(|seconds| regression(records, WINDOW * seconds));
    found.extend(wider.filter(|wider| found.iter().all(|short| wider.window_samples > short.window_samples)));
    found
}

/// Computes the regression with central differences over about `window_s` \[s\]. Returns `None` if too few samples move, or if
/// the regressors are collinear.
#[must_use]
pub fn regression(records: &[Record], window_s: f64) -> Option<Regression> {
    let usable: Vec<&Record> =
        records.iter().filter(|r| r.samples().speed.is_some() && r.samples().torque.is_none()).collect();
    let first = usable.first()?;
    let mut sums = Sums::default();
    for record in &usable {
        visit(record, half(record, window_s), &mut |x, y| sums.add(x, y));
    }
    let (solution, inverse) = sums.solve()?;
    let mut squares = 0.0;
    for record in &usable {
        visit(record, half(record, window_s), &mut |x, y| squares += (y - x.dot(&solution)).powi(2));
    }
    let covariance = inverse * (squares / count(sums.samples - 3));
    let window_samples = 2 * half(first, window_s);
    let [speed, volts, sign] = [solution[0], solution[1], solution[2]];
    let entry = |value: f64, slope: [f64; 3]| {
        let slope = Vector3::from(slope);
        let error = slope.dot(&(covariance * slope)).max(0.0).sqrt();
        Characteristic { value, std_error: error.is_finite().then_some(error) }
    };
    let square = volts * volts;
    let found = Regression {
        window_s: count(window_samples) * first.period_s(),
        window_samples,
        samples: sums.samples,
        ks: entry(-sign / volts, [0.0, sign / square, -1.0 / volts]),
        kv: entry(-speed / volts, [-1.0 / volts, speed / square, 0.0]),
        ka: entry(1.0 / volts, [0.0, -1.0 / square, 0.0]),
    };
    [found.ks, found.kv, found.ka].iter().all(|c| c.value.is_finite()).then_some(found)
}

/// Returns half the window in periods of a recording, at least one.
fn half(record: &Record, window_s: f64) -> usize {
    whole((window_s / (2.0 * record.period_s())).round()).max(1)
}

/// Calls `to` with the regressors `[ω, v, sgn ω]` and the central difference of each moving sample.
fn visit(record: &Record, half: usize, to: &mut dyn FnMut(Vector3<f64>, f64)) {
    let samples = record.samples();
    let Some(speed) = &samples.speed else { return };
    let slow = MOVING * peak(speed);
    let counting = record.counting();
    let counts = |n: usize| counting.get(n).is_none_or(|counts| counts[1]);
    for n in half..speed.len().saturating_sub(half) {
        let (before, after) = (n - half, n + half);
        let window_s = samples.time_s[after] - samples.time_s[before];
        let sign = speed[n].signum();
        let moving = [before, n, after].iter().all(|&n| counts(n) && sign * speed[n] > slow);
        // Windows across a gap are left out.
        if moving && window_s < 1.5 * count(2 * half) * record.period_s() {
            let difference = (speed[after] - speed[before]) / window_s;
            to(Vector3::new(speed[n], record.input()[n], sign), difference);
        }
    }
}

#[derive(Default)]
struct Sums {
    matrix: Matrix3<f64>,
    right: Vector3<f64>,
    samples: usize,
}

impl Sums {
    fn add(&mut self, x: Vector3<f64>, y: f64) {
        self.matrix += x * x.transpose();
        self.right += x * y;
        self.samples += 1;
    }

    /// Returns the coefficients and the inverse of the normal matrix; `None` for too few samples or collinear regressors.
    fn solve(&self) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        if self.samples < SAMPLES_MIN {
            return None;
        }
        let scale = self.matrix.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 });
        let scale = Matrix3::from_diagonal(&scale);
        let factor = (scale * self.matrix * scale).cholesky()?;
        let smallest = factor.l_dirty().diagonal().iter().fold(f64::INFINITY, |m, pivot| m.min(pivot * pivot));
        let inverse = scale * factor.inverse() * scale;
        (smallest > PIVOT_MIN).then(|| (inverse * self.right, inverse))
    }
}
