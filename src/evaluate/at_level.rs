//! Functions that are compiled for one SIMD level.

/// Defines a function that is compiled for one SIMD level, AVX-512 or AVX2 with FMA. It names the function of the next lower level,
/// which runs on a processor without the instructions; callers ask [`Level`](super::Level) first, so that it never does. A list of
/// several levels in `targets` would compile the whole body for each of them, and once more for a processor without any.
macro_rules! at_level {
    ($vis:vis fn $name:ident($($argument:ident: $of:ty),+) $(-> $result:ty)? = avx512 $body:block else $lower:ident) => {
        #[multiversion::multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma"))]
        $vis fn $name($($argument: $of),+) $(-> $result)? {
            if multiversion::target::target_cfg_f!(target_feature = "avx512f") $body else { $lower($($argument),+) }
        }
    };
    ($vis:vis fn $name:ident($($argument:ident: $of:ty),+) $(-> $result:ty)? = avx2 $body:block else $lower:ident) => {
        #[multiversion::multiversion(targets("x86_64+avx2+fma"))]
        $vis fn $name($($argument: $of),+) $(-> $result)? {
            if multiversion::target::target_cfg_f!(target_feature = "avx2") $body else { $lower($($argument),+) }
        }
    };
}
pub(crate) use at_level;
