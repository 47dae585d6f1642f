//! The processor: its SIMD levels, its name, and a loop of multiply–adds that measures its peak rate.

use motorfit_core::numeric::count;
use multiversion::multiversion;
use std::hint::black_box;
use std::sync::LazyLock;

/// A SIMD level that the kernels are compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Level {
    /// The instructions that every processor of the target has.
    Portable,
    /// AVX2 with FMA.
    Avx2,
    /// AVX-512 of Ice Lake, Zen 4 and later. Earlier processors lower their clock for AVX-512 and use AVX2.
    Avx512,
}

impl Level {
    /// All levels, the slowest first.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// Returns true if this machine has the level.
    #[must_use]
    pub fn is_available(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::is_x86_feature_detected as has;
            let avx2 = || has!("avx2") && has!("fma");
            match self {
                Self::Portable => true,
                Self::Avx2 => avx2(),
                // These are the features that `multiversion` requires for a target with AVX-512.
                Self::Avx512 => {
                    avx2()
                        && (has!("avx512f")
                            && has!("avx512bw")
                            && has!("avx512cd")
                            && has!("avx512dq")
                            && has!("avx512vl"))
                        && (has!("avx512ifma") && has!("avx512vbmi") && has!("avx512vbmi2") && has!("avx512vnni"))
                        && (has!("avx512bitalg") && has!("avx512vpopcntdq"))
                        && (has!("gfni") && has!("vaes") && has!("vpclmulqdq"))
                }
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            self == Self::Portable
        }
    }

    /// Returns the levels of this machine, the slowest first.
    pub fn available() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|level| level.is_available())
    }

    /// Returns the fastest level of this machine.
    #[must_use]
    pub fn best() -> Self {
        Self::available().last().unwrap_or(Self::Portable)
    }

    /// Returns the name of the level.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        }
    }
}

/// Returns the brand name of the processor, or its architecture if it has none.
#[must_use]
pub fn cpu_name() -> String {
    // The name is cached, because reading it takes tens of microseconds on virtual machines.
    static NAME: LazyLock<String> = LazyLock::new(brand);
    NAME.clone()
}

fn brand() -> String {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(brand) = raw_cpuid::CpuId::new().get_processor_brand_string() {
        return motorfit_core::text::printable(brand.as_str().trim());
    }
    format!("{} CPU", std::env::consts::ARCH)
}

/// Number of independent chains of multiply–adds, enough to hide their latency.
const CHAINS: usize = 10;

/// Runs independent chains of multiply–adds, of `N` lanes each.
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

/// Runs `rounds` iterations of a loop of fused multiply–adds in f64 and returns their number, counted per lane. Returns `None`
/// for a level without fused multiply–adds.
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
