//! The processor's peak of multiply–adds, measured: what the rate of an evaluator is held against.

use super::cpu::Level;
use crate::numeric::count;
use multiversion::multiversion;
use std::hint::black_box;

const CHAINS: usize = 10;

/// Independent chains of multiply–adds, `N` lanes each, enough to hide their latency.
#[inline(always)]
fn chains<const N: usize>(rounds: usize) -> f64 {
    let mut x = [[1.0_f64; N]; CHAINS];
    let (a, b) = ([black_box(0.999); N], [black_box(1e-3); N]);
    for _ in 0..rounds {
        for chain in &mut x {
            for (n, value) in chain.iter_mut().enumerate() {
                *value = value.mul_add(a[n], b[n]);
            }
        }
    }
    black_box(x)[0][0]
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma"))]
fn chains_avx512(rounds: usize) -> f64 {
    chains::<8>(rounds)
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn chains_avx2(rounds: usize) -> f64 {
    chains::<4>(rounds)
}

/// Runs `rounds` of a loop of fused multiply–adds in f64 at a level and returns how many that were, counted by lane.
/// `None` where the level has none.
#[must_use]
pub fn fma_loop(level: Level, rounds: usize) -> Option<f64> {
    let lanes = match level {
        Level::Portable => return None,
        Level::Avx2 => {
            black_box(chains_avx2(rounds));
            4
        }
        Level::Avx512 => {
            black_box(chains_avx512(rounds));
            8
        }
    };
    Some(count(rounds * CHAINS * lanes))
}
