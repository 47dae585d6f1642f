//! Proves: searches on the GPU, in f32 and f64, have the distribution of final costs of the CPU over 30 seeds (two-sample
//! Kolmogorov–Smirnov test at 1 %).
//! Does not prove: the same for recordings with noise.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

use crate::support::m2_record;
use motorfit::device::{DeviceSpec, PrecisionSpec};
use motorfit::evaluate::gpu::list;
use motorfit::identify::{IdentifySpec, Method, Polish, identify};
use motorfit::optimize::{GeneticOptions, GwoOptions, JayaOptions};
use motorfit::record::Record;

/// Returns the final costs over seeds 1 to 30, in increasing order.
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
            assert_eq!(found.device.kind, "gpu");
            // The reported cost is computed by the oracle, as that of the leaders in the search.
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

/// Returns the Kolmogorov–Smirnov distance of two samples.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let share = |of: &[f64], x: f64| of.iter().filter(|v| **v <= x).count() as f64 / of.len() as f64;
    a.iter().chain(b).map(|&x| (share(a, x) - share(b, x)).abs()).fold(0.0, f64::max)
}

#[test]
fn searches_have_the_distribution_of_the_cpu() {
    let adapters = list();
    let skips = std::env::var_os("MOTORFIT_NO_SKIP").is_none();
    let records = [m2_record()];
    let jaya = Method::from(JayaOptions::default());
    let ga = Method::from(GeneticOptions::default());
    // Medians of the methods on the CPU (tests/studies/optimizers).
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
            // Two samples of 30 from the same distribution exceed this distance with probability 0.01.
            assert!(apart <= 0.42, "{} {precision:?}: {apart}", method.name());
        }
    }
}
