//! Measures sweeps end to end: a thousand searches against the rate of their evaluator alone, in the same process, by SIMD and
//! on the best adapter; and a production line, one fit per recording, against parsing and estimating alone.
//!
//! The production line would reach 100 % if reading files, writing results and scheduling cost nothing.
//! `MOTORFIT_BENCH_RECORDINGS=N` sets the number of recordings (1000); the argument `line` or `searches` runs only one part.
#![allow(missing_docs, reason = "a bench has no public interface")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a bench prints and may stop")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

mod support;

use motorfit::analysis::warnings_of_records;
use motorfit::candidates::Candidates;
use motorfit::device::with_threads;
use motorfit::estimate::fit_problem;
use motorfit::evaluate::Problem;
use motorfit::evaluate::{Batch, Evaluator, Group, Simd};
use motorfit::experiment::{Excitation, noise_of, simulated, with_noise};
use motorfit::identify::{IdentifySpec, Method, Polish, fit_on};
use motorfit::motor::{Discretization, Parameters, Space};
use motorfit::optimize::{Sample, Sampling};
use motorfit::record::{Reading, write_csv};
use motorfit::study::sweep::{Shard, Sweep};
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::path::Path;
use support::{m2_problem, m2_record, median, seconds};

fn noisy(parameters: &Parameters, seed: u64) -> String {
    let step = Excitation::step(10.5, 1.0, 3.0, 0.001).unwrap();
    let clean = simulated(parameters, &step, Discretization::Zoh).unwrap();
    let sigma = noise_of(&clean, motorfit::criterion::Noise::Decibels(40.0));
    write_csv(&with_noise(&clean, sigma, seed).unwrap())
}

/// Returns the recording with the number of digits of a typical logger.
fn logged(text: &str) -> String {
    let mut lines = text.lines();
    let mut short = lines.next().unwrap().to_owned() + "\n";
    for line in lines {
        let v: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        short.push_str(&format!("{:.3},{},{:.5},{:.4}\n", v[0], v[1], v[2], v[3]));
    }
    short
}

/// Runs a study in a new folder and returns the times of planning and running \[s\].
fn sweep(folder: &Path, study: &str) -> [f64; 2] {
    let path = folder.join("study.toml");
    std::fs::write(&path, study).unwrap();
    let out = folder.join("out");
    let _ = std::fs::remove_dir_all(&out);
    let mut planned = None;
    let plan = seconds(|| planned = Some(Sweep::plan(&path, &out, None).unwrap().0));
    let sweep = planned.unwrap();
    let run = seconds(|| {
        // On the thread pool, as in the program.
        let tally = with_threads(None, || sweep.run(Shard::ALL, &mut |_| ControlFlow::Continue(()))).unwrap();
        assert_eq!((tally.failed, tally.finished), (0, sweep.manifest().runs));
    });
    [plan, run]
}

/// Measures `runs` searches of 100 candidates × 100 generations on the M2 recording.
fn searches(name: &str, device: &str, runs: u64, mut evaluator: Box<dyn Evaluator>) {
    let problem = m2_problem();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m2.csv"), write_csv(&m2_record())).unwrap();
    let study = format!(
        "recordings = [\"m2.csv\"]\nmethods = [\"gwo\"]\nseeds = \"1..{runs}\"\nbounds = \"table2\"\ndevice = \"{device}\"\n\
         precision = \"f64\"\n"
    );
    let mut values = vec![0.0; 5 * 100_000];
    Sample::new(Sampling::Uniform, 100_000, Space::table2().bounds(), 1).unwrap().fill(0, &mut values);
    let groups: Vec<Group<'_>> = values
        .chunks(500)
        .map(|own| Group { problem: &problem, candidates: Candidates::new(own, 5), reference: None })
        .collect();
    let mut costs = vec![0.0; 100_000];
    let mut raw = || {
        let once = || evaluator.evaluate(&Batch { groups: &groups }, &mut costs).unwrap();
        rayon::scope(|_| seconds(once)) / 100_000.0
    };
    raw();
    let mut shares = Vec::new();
    for _ in 0..3 {
        let before = median((0..3).map(|_| raw()).collect());
        let [_, run] = sweep(folder.path(), &study);
        let after = median((0..3).map(|_| raw()).collect());
        shares.push(100.0 * f64::midpoint(before, after) * (runs * 10_000) as f64 / run);
    }
    println!(
        "{name}: sweep of {runs} GWO runs of 100 × 100: {:.0} % of the rate of the evaluator alone",
        median(shares)
    );
}

/// Measures a production line: parameters with standard errors from each recording.
fn line(name: &str, digits: impl Fn(&str) -> String + Sync, count: u64) {
    let folder = tempfile::tempdir().unwrap();
    let spread = |n: u64| {
        let part = |k: u64| 1.0 + 0.1 * ((n * 7919 + k * 104_729) % 1000) as f64 / 1000.0;
        let p = Parameters::M2.to_array();
        Parameters::from_array(std::array::from_fn(|k| p[k] * part(k as u64)))
    };
    let bytes: usize = (0..count)
        .into_par_iter()
        .map(|n| {
            let text = digits(&noisy(&spread(n), n));
            std::fs::write(folder.path().join(format!("motor{n:05}.csv")), &text).unwrap();
            text.len()
        })
        .sum();
    let study = "recordings = [\"motor*.csv\"]\nmethods = [\"sm\"]\npolish = [\"lm\"]\ndevice = \"cpu\"\n";
    let path = folder.path().join("motor00000.csv");
    let reading = Reading::default();
    let spec = IdentifySpec {
        method: Method::SteiglitzMcBride,
        polish: Polish::LevenbergMarquardt,
        ..IdentifySpec::default()
    };
    let threads = rayon::current_num_threads();
    // Parsing or estimating alone: the same file repeatedly, on every core.
    let alone = |work: &(dyn Fn() + Sync)| {
        let once = || (0..200 * threads).into_par_iter().for_each(|_| work());
        once();
        median((0..3).map(|_| seconds(once)).collect()) / 200.0
    };
    let records = reading.records(&path).unwrap();
    let (mut shares, mut rates) = (Vec::new(), Vec::new());
    let (mut parse, mut estimate, mut planning) = (0.0, 0.0, 0.0);
    for _ in 0..3 {
        parse = alone(&|| drop(reading.records(&path).unwrap()));
        estimate = alone(&|| {
            let problem = Problem::new(&records, spec.model, spec.space.clone(), spec.criterion).unwrap();
            let plain = fit_problem(&records, &spec.space, spec.model).unwrap();
            drop(fit_on((&problem, &plain), (&records, &warnings_of_records(&records)), &spec).unwrap());
        });
        let [plan, run] = sweep(folder.path(), study);
        planning = plan;
        shares.push(100.0 * (parse + estimate) * count as f64 / threads as f64 / run);
        rates.push(count as f64 / run);
    }
    let rate = median(rates);
    println!(
        "{name}: {count} recordings of 3001 samples ({:.0} MB): {rate:.0} a second on {threads} threads, {:.0} a core; parsing \
         {:.0} µs and estimating {:.0} µs alone are {:.0} % of it; 10,000 take {:.1} s and their planning {:.2} s",
        bytes as f64 / 1e6,
        rate / threads as f64,
        1e6 * parse,
        1e6 * estimate,
        median(shares),
        1e4 / rate,
        planning * 1e4 / count as f64,
    );
}

fn main() {
    let count = std::env::var("MOTORFIT_BENCH_RECORDINGS").ok().and_then(|n| n.parse().ok()).unwrap_or(1000);
    let only = std::env::args().nth(1).filter(|a| !a.starts_with("--"));
    if only.as_deref() != Some("searches") {
        line("17 digits", str::to_owned, count);
        line("as a logger writes", logged, count);
    }
    if only.as_deref() == Some("line") {
        return;
    }
    searches("SIMD", "cpu", 1000, Box::new(Simd::default()));
    #[cfg(feature = "gpu")]
    {
        use motorfit::evaluate::gpu::{Gpu, Precision, Selector};
        match Gpu::open(&Selector::Best, Some(Precision::F64)) {
            Ok(gpu) => searches(&gpu.facts().name.clone(), "gpu", 300, Box::new(gpu)),
            Err(error) => println!("no adapter: {error}"),
        }
    }
}
