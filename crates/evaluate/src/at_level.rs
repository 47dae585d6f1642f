//! Functions that are compiled for one SIMD level.

/// Defines a function that is compiled for one SIMD level, AVX-512 or AVX2 with FMA. It names the function of the next lower level,
/// which runs on a processor without the instructions; callers ask [`Level`](crate::Level) first, so that it never does. A list of
/// several levels in `targets` would compile the whole body for each of them, and once more for a processor without any.
#[doc(hidden)]
#[macro_export]
macro_rules! __at_level {
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
#[doc(hidden)]
pub use __at_level as at_level;

/// Defines `avx512`, `avx2` and `portable`, which write the costs of the candidates of a block with `run`, compiled for the level,
/// with so many candidates side by side. The portable one multiplies and adds separately, since `mul_add` is a library call without
/// FMA instructions.
macro_rules! at_each_level {
    ($run:ident $(for $kernel:ident)? with [$avx512:expr, $avx2:expr, $portable:expr] candidates) => {
        $crate::at_level! {
            pub(super) fn avx512(block: &Block<'_>, costs: &mut [f64]) = avx512 { $run::<$($kernel,)? { $avx512 }, true>(block, costs) } else avx2
        }

        $crate::at_level! {
            pub(super) fn avx2(block: &Block<'_>, costs: &mut [f64]) = avx2 { $run::<$($kernel,)? { $avx2 }, true>(block, costs) } else portable
        }

        pub(super) fn portable(block: &Block<'_>, costs: &mut [f64]) {
            $run::<$($kernel,)? { $portable }, false>(block, costs);
        }
    };
}
pub(crate) use at_each_level;
