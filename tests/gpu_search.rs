//! Proves: searches find on the GPU, in f32 and f64, what they find on the CPU: as distributions over 30 seeds.
//! Does not prove: what a search does on a recording with noise.
#![cfg(feature = "gpu")]
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

mod support;

use motorfit::device::{DeviceSpec, PrecisionSpec};
use motorfit::evaluate::gpu::list;
use motorfit::identify::{IdentifySpec, Method, Polish, identify};
use motorfit::optimize::{GeneticOptions, GwoOptions, JayaOptions};
use motorfit::record::Record;
use support::m2_record;

/// Final costs over seeds 1 to 30, lowest first.
fn costs(records: &[Record], method: Method, device: &DeviceSpec, precision: PrecisionSpec) -> Vec<f64> {
    let run = |seed| {
        let spec = IdentifySpec {
            method,
            polish: Polish::None,
            seed,
            auto_bounds: Vec::new(),
            device: device.clone(),
            precision,
            ..IdentifySpec::default()
        };
        let found = identify(records, &spec).unwrap();
        if *device == DeviceSpec::Gpu {
            assert_eq!(found.device_kind, "gpu");
            // The reported cost is the oracle's, and so was the leader's in the search.
            let last = found.history[found.history.len() - 1];
            assert!((found.cost / last - 1.0).abs() < 1e-9, "{} {last}", found.cost);
            assert!(found.cost_difference.unwrap().abs() <= 1e-3 * found.cost);
        }
        found.cost
    };
    let mut found: Vec<f64> = (1..=30).map(run).collect();
    found.sort_by(f64::total_cmp);
    found
}

/// The largest distance of two empirical distributions (Kolmogorov and Smirnov).
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let share = |of: &[f64], x: f64| of.iter().filter(|v| **v <= x).count() as f64 / of.len() as f64;
    a.iter().chain(b).map(|&x| (share(a, x) - share(b, x)).abs()).fold(0.0, f64::max)
}

#[test]
fn searches_find_what_they_find_on_the_cpu() {
    let adapters = list();
    let skips = std::env::var_os("MOTORFIT_NO_SKIP").is_none();
    let records = [m2_record()];
    let jaya = Method::from(JayaOptions::default());
    let ga = Method::from(GeneticOptions::default());
    // The medians that the methods have on the CPU (tests/optimizers.rs).
    for (method, median) in [(Method::from(GwoOptions::default()), 0.005), (jaya, 3e-4), (ga, 0.03)] {
        let cpu = costs(&records, method, &DeviceSpec::Cpu, PrecisionSpec::Auto);
        for precision in [PrecisionSpec::F64, PrecisionSpec::F32] {
            if !adapters.iter().any(|a| precision == PrecisionSpec::F32 || a.f64) {
                assert!(skips, "no adapter for {precision:?}: {adapters:?}");
                println!("SKIPPED: no adapter for {precision:?}");
                continue;
            }
            let gpu = costs(&records, method, &DeviceSpec::Gpu, precision);
            let apart = distance(&cpu, &gpu);
            println!("{} {precision:?}: median of thirty {:.6}, {apart:.2} from the CPU's", method.name(), gpu[15]);
            assert!(gpu[15] <= median, "{gpu:?}");
            // Two samples of 30 of one distribution are further apart than this once in a hundred times.
            assert!(apart <= 0.42, "{} {precision:?}: {apart}", method.name());
        }
    }
}
