//! What the processor can do: its feature levels and its name.

use std::sync::LazyLock;

/// A feature level that the kernels are compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// What every processor of the target has.
    Portable,
    /// AVX2 with FMA.
    Avx2,
    /// AVX-512 as since Ice Lake and Zen 4; earlier processors lower their clock for it and take AVX2.
    Avx512,
}

impl Level {
    /// All levels, the slowest first.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// Whether this machine has it.
    #[must_use]
    pub fn is_available(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::is_x86_feature_detected as has;
            let avx2 = || has!("avx2") && has!("fma");
            match self {
                Self::Portable => true,
                Self::Avx2 => avx2(),
                // What `multiversion` asks for whenever a target names AVX-512.
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

    /// The levels of this machine, the slowest first.
    pub fn available() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|level| level.is_available())
    }

    /// The fastest level of this machine.
    #[must_use]
    pub fn best() -> Self {
        Self::available().last().unwrap_or(Self::Portable)
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        }
    }
}

/// The processor's name as it gives it, or its architecture.
#[must_use]
pub fn cpu_name() -> String {
    // Virtual machines take tens of microseconds to give it.
    static NAME: LazyLock<String> = LazyLock::new(brand);
    NAME.clone()
}

fn brand() -> String {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(brand) = raw_cpuid::CpuId::new().get_processor_brand_string() {
        return crate::text::printable(brand.as_str().trim());
    }
    format!("{} CPU", std::env::consts::ARCH)
}
