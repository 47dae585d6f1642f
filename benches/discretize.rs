//! Measures the time per candidate to compute step maps, 8 and 24 side by side as in the kernels and one by one. At 10 ms most motors of
//! the box need several halvings of the step.
#![allow(missing_docs, reason = "a bench has no public interface")]

mod support;

use criterion::{Criterion, Throughput};
use motorfit::motor::{Discretization, Parameters, StepMap, step_maps};
use multiversion::multiversion;
use std::hint::black_box;
use support::candidates;

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
fn side_by_side<const N: usize>(blocks: &[[[f64; N]; 5]], h: f64, method: Discretization) -> f64 {
    blocks.iter().map(|block| step_maps(block, h, method).d[0][0]).sum()
}

/// Number of candidates: a multiple of both widths.
const CANDIDATES: usize = 2400;

fn blocks<const N: usize>(rows: &[[f64; 5]]) -> Vec<[[f64; N]; 5]> {
    rows.chunks_exact(N).map(|lanes| std::array::from_fn(|p| std::array::from_fn(|lane| lanes[lane][p]))).collect()
}

fn main() {
    let values = candidates(CANDIDATES);
    let rows: Vec<[f64; 5]> = values.chunks(5).map(|r| [r[0], r[1], r[2], r[3], r[4]]).collect();
    let (narrow, wide) = (blocks::<8>(&rows), blocks::<24>(&rows));
    let mut criterion = Criterion::default().sample_size(20).configure_from_args();
    let mut group = criterion.benchmark_group("discretize");
    group.throughput(Throughput::Elements(CANDIDATES as u64));
    for (method, h) in [Discretization::Zoh, Discretization::Foh, Discretization::Rk4, Discretization::Euler]
        .into_iter()
        .flat_map(|method| [0.001, 0.01].map(|h| (method, h)))
    {
        group.bench_function(format!("{method:?}, {h} s, 8 side by side"), |b| {
            b.iter(|| side_by_side(black_box(&narrow), h, method));
        });
        group.bench_function(format!("{method:?}, {h} s, 24 side by side"), |b| {
            b.iter(|| side_by_side(black_box(&wide), h, method));
        });
        group.bench_function(format!("{method:?}, {h} s, one by one"), |b| {
            let one = |r: &[f64; 5]| StepMap::new(&Parameters::from_array(*r), h, method).d[0];
            b.iter(|| black_box(&rows).iter().map(one).sum::<f64>());
        });
    }
    group.finish();
    criterion.final_summary();
}
