//! Measured evaluation times of this machine, from which `auto` predicts the faster device.

use motorfit_core::numeric::{count, count_u64};
use motorfit_evaluate::{Level, cpu_name};
use serde::{Deserialize, Serialize};

/// Ratio of the CPU's rate in a search, whose cutoffs end most evaluations early, to the measured one of complete evaluations: 1.7 to 2.3
/// with GWO on 16 threads. Adapters gain little, because their candidates end together. Methods without cutoffs, such as the genetic
/// algorithm, are slower than this expects.
const CUTOFFS: f64 = 2.0;

/// Measured evaluation times of one evaluator against recording length and batch size.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ThroughputCurve {
    /// Measurements: samples of the recordings, candidates in the batch, time of the batch \[s\].
    pub points: Vec<(u64, u64, f64)>,
}

impl ThroughputCurve {
    /// Returns the predicted time of a batch of `population` candidates \[s\], or `None` without measurements. Between
    /// measurements the logarithms are interpolated linearly, above the largest the time is proportional to the size, and below
    /// the smallest it is constant.
    #[must_use]
    pub fn seconds(&self, samples: u64, population: u64) -> Option<f64> {
        let mut lengths: Vec<u64> = self.points.iter().map(|point| point.0).collect();
        lengths.sort_unstable();
        lengths.dedup();
        let at = |length: u64| {
            let of = self.points.iter().filter(|point| point.0 == length);
            interpolated(of.map(|point| (point.1, point.2)).collect(), population)
        };
        let known = lengths.iter().filter_map(|&length| Some((length, at(length)?))).collect();
        interpolated(known, samples)
    }
}

/// Returns the value at `x` of a function given by the points `known`, interpolated linearly in logarithms.
fn interpolated(mut known: Vec<(u64, f64)>, x: u64) -> Option<f64> {
    known.retain(|(at, value)| *at > 0 && value.is_finite() && *value > 0.0);
    known.sort_by_key(|(at, _)| *at);
    let (&first, &last) = (known.first()?, known.last()?);
    if x <= first.0 {
        return Some(first.1);
    }
    if x >= last.0 {
        return Some(last.1 * count_u64(x) / count_u64(last.0));
    }
    let above = known.iter().position(|(at, _)| *at >= x)?;
    let ((x0, y0), (x1, y1)) = (known[above - 1], known[above]);
    let share = (count_u64(x) / count_u64(x0)).ln() / (count_u64(x1) / count_u64(x0)).ln();
    Some(y0 * (y1 / y0).powf(share))
}

/// Measured throughput of a GPU adapter, which is recognized by its name, interface and driver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AdapterThroughput {
    /// Name of the adapter.
    pub name: String,
    /// Kind of the adapter: discrete, integrated, virtual, software or other.
    pub kind: String,
    /// Graphics interface, such as Vulkan.
    pub backend: String,
    /// Driver and its version.
    pub driver: String,
    /// Precision of the evaluation: f32 or f64.
    pub precision: String,
    /// Time to open and check the adapter \[s\].
    pub opening_s: f64,
    /// Evaluation times.
    #[serde(rename = "pace")]
    pub curve: ThroughputCurve,
}

/// Throughput measured on a machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ThroughputProfile {
    /// Version of the program that measured. Other versions may be faster or slower.
    pub motorfit: String,
    /// The processor and its SIMD level.
    pub cpu: String,
    /// Number of CPU threads in the measurement.
    pub threads: usize,
    /// Evaluation times of the CPU with this number of threads.
    #[serde(rename = "pace")]
    pub curve: ThroughputCurve,
    /// The measured adapters.
    pub adapters: Vec<AdapterThroughput>,
}

/// The size of a search, from which its time on each device is predicted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Work {
    /// Number of samples of all recordings.
    pub samples: u64,
    /// Number of candidates in a generation.
    pub population: u64,
    /// Number of generations.
    pub generations: u64,
    /// Number of CPU threads.
    pub threads: usize,
    /// Number of samples whose complete simulation takes the CPU as long as a candidate with tables of poles; `None` if it simulates.
    pub equivalent_samples: Option<u64>,
}

impl ThroughputProfile {
    /// Returns the name of this machine's processor and its SIMD level.
    #[must_use]
    pub fn this_cpu() -> String {
        format!("{}, {}", cpu_name(), Level::best().name())
    }

    /// Returns true if the profile was measured with this processor and this version of the program.
    #[must_use]
    pub fn is_current(&self) -> bool {
        self.motorfit == env!("CARGO_PKG_VERSION") && self.cpu == Self::this_cpu()
    }

    /// Returns the adapter that is predicted to be the fastest for the work, opening included, or `None` if the CPU is faster.
    /// Software adapters are ignored. Without a `precision`, f64 is used if it was measured, else f32.
    #[must_use]
    pub fn faster(&self, work: Work, precision: Option<&str>) -> Option<&AdapterThroughput> {
        let Work { samples, population, generations, threads, equivalent_samples } = work;
        let (rounds, cores) = (count_u64(generations), count(threads.max(1)) / count(self.threads.max(1)));
        let gain = match equivalent_samples {
            Some(equivalent) => count_u64(samples.max(1)) / count_u64(equivalent.max(1)),
            None if generations > 1 => CUTOFFS,
            None => 1.0,
        };
        let cpu = rounds * self.curve.seconds(samples, population)? / cores / gain;
        let fits = |adapter: &&AdapterThroughput| {
            let same = |a: &AdapterThroughput| {
                a.name == adapter.name && a.driver == adapter.driver && a.backend == adapter.backend
            };
            let has_f64 = self.adapters.iter().any(|a| same(a) && a.precision == "f64");
            let wanted = precision.unwrap_or(if has_f64 { "f64" } else { "f32" });
            adapter.kind != "software" && adapter.precision == wanted
        };
        let time = |adapter: &AdapterThroughput| {
            Some(adapter.opening_s + rounds * adapter.curve.seconds(samples, population)?).filter(|time| *time < cpu)
        };
        let timed = self.adapters.iter().filter(fits).filter_map(|adapter| Some((adapter, time(adapter)?)));
        timed.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(adapter, _)| adapter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Option<f64>, b: f64) -> bool {
        a.is_some_and(|a| (a / b - 1.0).abs() < 1e-12)
    }

    #[test]
    fn times_are_between_and_beyond_the_measured_ones() {
        let curve = ThroughputCurve {
            points: vec![(300, 1, 1e-4), (300, 100, 1e-3), (3000, 1, 1e-4), (3000, 100, 1e-2), (9, 9, f64::NAN)],
        };
        assert!(close(curve.seconds(300, 1), 1e-4) && close(curve.seconds(300, 100), 1e-3));
        assert!(close(curve.seconds(300, 10), (1e-4_f64 * 1e-3).sqrt()), "between populations");
        assert!(close(curve.seconds(300, 1000), 1e-2), "above: in proportion");
        assert!(close(curve.seconds(10, 0), 1e-4), "below: the least");
        assert!(close(curve.seconds(30_000, 1000), 1.0), "both");
        assert!(close(curve.seconds(949, 100), 1e-3 * 10_f64.powf((949.0 / 300.0_f64).log10())), "between lengths");
        assert_eq!(ThroughputCurve::default().seconds(1, 1), None);
    }

    /// A profile with a CPU of 1e9 candidate-steps per second and an adapter a hundred times faster that takes at least 1 ms
    /// per batch and 0.5 s to open.
    fn throughput_profile() -> ThroughputProfile {
        let points = |rate: f64, least: f64| {
            let at = |population: u64| {
                let seconds = (1000.0 * count_u64(population) / rate).max(least);
                (1000, population, seconds)
            };
            ThroughputCurve { points: [1, 100, 10_000, 1_000_000].map(at).to_vec() }
        };
        let adapter = |kind: &str, precision: &str, rate: f64| AdapterThroughput {
            name: kind.to_owned(),
            kind: kind.to_owned(),
            backend: "Vulkan".to_owned(),
            driver: "1.0".to_owned(),
            precision: precision.to_owned(),
            opening_s: 0.5,
            curve: points(rate, 1e-3),
        };
        ThroughputProfile {
            motorfit: env!("CARGO_PKG_VERSION").to_owned(),
            cpu: ThroughputProfile::this_cpu(),
            threads: 2,
            curve: points(1e9, 1e-5),
            adapters: vec![
                adapter("software", "f64", 1e12),
                adapter("discrete", "f32", 2e11),
                adapter("discrete", "f64", 1e11),
                adapter("integrated", "f32", 2e9),
            ],
        }
    }

    #[test]
    fn an_adapter_is_selected_only_where_it_is_faster() {
        let throughput_profile = throughput_profile();
        let work = |population, generations| Work {
            samples: 1000,
            population,
            generations,
            threads: 2,
            equivalent_samples: None,
        };
        let taken = |work, precision| {
            throughput_profile.faster(work, precision).map(|a| (a.kind.as_str(), a.precision.as_str()))
        };
        // A generation of 100 × 1000 takes 0.1 ms on the CPU and 1 ms on the adapter, which is never faster.
        assert_eq!(taken(work(100, 1_000_000), None), None);
        // A generation of 1e5 × 1000 takes 0.05 s on the CPU, with cutoffs, and 1 ms on the adapter, which is faster from eleven
        // generations on.
        assert_eq!(taken(work(100_000, 10), None), None);
        assert_eq!(taken(work(100_000, 11), None), Some(("discrete", "f64")));
        // With twice the threads the CPU is faster again.
        assert_eq!(throughput_profile.faster(Work { threads: 4, ..work(100_000, 11) }, None), None);
        // A single batch has no cutoffs: 1e6 × 1000 takes 1 s on the CPU and 0.51 s on the adapter.
        assert_eq!(taken(work(1_000_000, 1), None), Some(("discrete", "f64")));
        assert_eq!(taken(work(1_000_000, 100), Some("f32")), Some(("discrete", "f32")));
        // 1e8 candidates of 1e5 samples take the adapter 100.5 s, and the CPU 90 s with tables that cost 900 samples, 110 s with 1100.
        let long = |equivalent_samples| Work { samples: 100_000, equivalent_samples, ..work(1_000_000, 100) };
        assert_eq!(taken(long(None), None), Some(("discrete", "f64")));
        assert_eq!(taken(long(Some(900)), None), None);
        assert_eq!(taken(long(Some(1100)), None), Some(("discrete", "f64")));
        assert!(throughput_profile.is_current());
        assert!(!ThroughputProfile { motorfit: "0.0.0".to_owned(), ..throughput_profile.clone() }.is_current());
        assert!(!ThroughputProfile { cpu: "another".to_owned(), ..throughput_profile }.is_current());
    }
}
