//! Measures Steiglitz–McBride and the refinement with covariance: time for a recording of 3001 samples, and per sample from
//! 1e3 to 1e6 samples. `benches/baseline/estimate.py` does the same in numpy and scipy; alternate both for a ratio:
//! `cargo bench --bench estimate && python benches/baseline/estimate.py examples/m2-step.csv`.
#![allow(missing_docs, reason = "a bench has no public interface")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a bench prints and may stop")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

mod support;

use motorfit::criterion::Noise;
use motorfit::estimate::{RefineOptions, fit_problem, global_reference, refine, steiglitz_mcbride};
use motorfit::evaluate::Model;
use motorfit::experiment::{Excitation, noise_of, simulated, with_noise};
use motorfit::motor::{Discretization, Parameters, Space};
use motorfit::record::Record;
use support::{median, seconds};

/// Returns a recording of the M2 motor under a square-wave voltage, with 40 dB of noise.
fn record(samples: u32) -> Record {
    let time_s: Vec<f64> = (0..samples).map(|n| f64::from(n) * 1e-3).collect();
    let voltage = (0..samples).map(|n| if n >= 100 && (n / 400) % 2 == 0 { 10.5 } else { 0.0 }).collect();
    let clean = simulated(&Parameters::M2, &Excitation { time_s, voltage, torque: None }, Discretization::Zoh).unwrap();
    with_noise(&clean, noise_of(&clean, Noise::Decibels(40.0)), 1).unwrap()
}

fn main() {
    let (space, options) = (Space::table2(), RefineOptions::default());
    let m2 = with_noise(&support::m2_record(), [0.012_015_7, 1.038_37], 1).unwrap();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let both = |record: &Record| {
        let sm = steiglitz_mcbride(record, Model::default()).unwrap().unwrap();
        refine(std::slice::from_ref(record), &space, &sm.parameters.to_array(), &options).unwrap()
    };
    one.install(|| {
        let sm = median((0..101).map(|_| seconds(|| drop(steiglitz_mcbride(&m2, Model::default())))).collect());
        let all = median((0..101).map(|_| seconds(|| drop(both(&m2)))).collect());
        println!("M2, 3001 samples, one core: SM {:.0} µs, with the refinement {:.0} µs", 1e6 * sm, 1e6 * all);
        let sigma = both(&m2).sigmas;
        let problem = || fit_problem(std::slice::from_ref(&m2), &space, Model::default()).unwrap();
        let reference = || drop(global_reference(&problem(), &sigma));
        println!("  global reference {:.2} ms", 1e3 * median((0..21).map(|_| seconds(reference)).collect()));
        for samples in [1_000, 10_000, 100_000, 1_000_000] {
            let record = record(samples);
            let fit = both(&record);
            let time = median((0..5).map(|_| seconds(|| drop(both(&record)))).collect());
            println!(
                "  {samples:>9} samples: {:>8.2} ms, {:.0} ns a sample ({} simulations with derivatives)",
                1e3 * time,
                1e9 * time / f64::from(samples),
                fit.evaluations
            );
        }
    });
}
