//! Samples of several motors side by side.

/// Wrapper that aligns numbers to 64 bytes, so that each load of an AVX-512 vector is within one cache line.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub struct Aligned<T>(pub T);

/// Number of samples that the kernel computes at a time.
pub const CHUNK: usize = 64;

/// Number of motors whose samples are interleaved at a time: their addresses fit into registers.
pub const GROUP: usize = 4;

/// Writes sample n of each source to row n of `to`, from the motor `first` on; `value` reads the sample of a motor. The function is
/// not compiled for the SIMD level: AVX-512 would gather and scatter the samples of each source, which takes four times as long.
#[inline(never)]
pub fn interleave<S, const L: usize>(
    sources: [&[S]; GROUP],
    to: &mut [Aligned<[f64; L]>],
    first: usize,
    value: impl Fn(&S, usize) -> f64,
) {
    let [one, two, three, four] = sources.map(|source| &source[..to.len()]);
    for (n, Aligned(to)) in to.iter_mut().enumerate() {
        let values =
            [value(&one[n], first), value(&two[n], first + 1), value(&three[n], first + 2), value(&four[n], first + 3)];
        to[first..][..GROUP].copy_from_slice(&values);
    }
}
