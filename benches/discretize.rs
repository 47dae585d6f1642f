//! Measures the time per candidate to compute step maps, in vectors of 8 as in the kernel and one by one.
#![allow(missing_docs, reason = "a bench has no public interface")]

mod support;

use criterion::{Criterion, Throughput};
use motorfit::motor::{Discretization, Parameters, StepMap, step_maps};
use multiversion::multiversion;
use std::hint::black_box;
use support::candidates;

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
fn side_by_side(blocks: &[[[f64; 8]; 5]], method: Discretization) -> f64 {
    blocks.iter().map(|block| step_maps(block, 0.001, method).d[0][0]).sum()
}

fn main() {
    let values = candidates(800);
    let rows: Vec<[f64; 5]> = values.chunks(5).map(|r| [r[0], r[1], r[2], r[3], r[4]]).collect();
    let blocks: Vec<[[f64; 8]; 5]> =
        rows.chunks(8).map(|lanes| [0, 1, 2, 3, 4].map(|p| [0, 1, 2, 3, 4, 5, 6, 7].map(|l| lanes[l][p]))).collect();
    let mut criterion = Criterion::default().sample_size(20).configure_from_args();
    let mut group = criterion.benchmark_group("discretize");
    group.throughput(Throughput::Elements(800));
    for method in [Discretization::Zoh, Discretization::Foh, Discretization::Rk4, Discretization::Euler] {
        group.bench_function(format!("{method:?}, 8 side by side"), |b| {
            b.iter(|| side_by_side(black_box(&blocks), method));
        });
        group.bench_function(format!("{method:?}, one by one"), |b| {
            let one = |r: &[f64; 5]| StepMap::new(&Parameters::from_array(*r), 0.001, method).d[0];
            b.iter(|| black_box(&rows).iter().map(one).sum::<f64>());
        });
    }
    group.finish();
    criterion.final_summary();
}
