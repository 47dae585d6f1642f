//! Power spectra by averaged modified periodograms (P. D. Welch 1967).

use motorfit_core::numeric::count;
use nalgebra::Complex;
use std::f64::consts::TAU;
use std::sync::LazyLock;

/// Length of every transform; shorter segments are padded with zeros.
pub(super) const POINTS: usize = 4096;

/// Number of complex values that are transformed: pairs of real samples.
const HALF: usize = POINTS / 2;

/// Roots of unity `exp(−2πi k/N)` of order N = [`POINTS`], for k below [`HALF`].
static ROOTS: LazyLock<Vec<Complex<f64>>> = LazyLock::new(|| {
    let turn = TAU / count(POINTS);
    (0..HALF).map(|k| polar(-turn * count(k))).collect()
});

/// Returns the complex number of magnitude 1 with the given angle \[rad\].
fn polar(angle: f64) -> Complex<f64> {
    Complex::new(angle.cos(), angle.sin())
}

/// Transforms [`HALF`] complex values in place (J. W. Cooley, J. W. Tukey 1965; decimation in frequency). The result is in
/// bit-reversed order. Compiling a general library for this one length took 11 % of the build time of this crate.
fn transform(x: &mut [Complex<f64>], roots: &[Complex<f64>]) {
    let mut span = HALF / 2;
    while span > 0 {
        let stride = HALF / span;
        for block in x.chunks_exact_mut(2 * span) {
            let (low, high) = block.split_at_mut(span);
            for ((a, b), root) in low.iter_mut().zip(high).zip(roots.iter().step_by(stride)) {
                let difference = *a - *b;
                *a += *b;
                *b = difference * root;
            }
        }
        span /= 2;
    }
}

/// Returns the Hann window `(1 − cos(2π (n + 1/2)/length))/2`. Its cosines are computed by rotations, with errors below 1e-12.
fn hann(length: usize) -> Vec<f64> {
    let turn = TAU / count(length);
    let rotation = polar(turn);
    let rotated = std::iter::successors(Some(polar(0.5 * turn)), |last| Some(last * rotation));
    rotated.take(length).map(|point| 0.5 - 0.5 * point.re).collect()
}

/// Returns the power spectrum of a signal, summed over segments, and the number of segments.
///
/// Segments have up to [`POINTS`] samples, overlap by at least half and have Hann windows. Bin k is the frequency k/[`POINTS`]
/// per sample.
pub(super) fn power(signal: &[f64]) -> (Vec<f64>, usize) {
    let length = signal.len().min(POINTS);
    let spare = signal.len() - length;
    let segments = 1 + spare.div_ceil(POINTS / 2);
    let (window, roots) = (hann(length), &*ROOTS);
    let mut packed = vec![Complex::new(0.0, 0.0); HALF];
    let mut power = vec![0.0; HALF + 1];
    for segment in 0..segments {
        let start = if segments > 1 { spare * segment / (segments - 1) } else { 0 };
        packed.fill(Complex::new(0.0, 0.0));
        for (pair, (values, weights)) in
            packed.iter_mut().zip(signal[start..][..length].chunks(2).zip(window.chunks(2)))
        {
            let at = |n: usize| values.get(n).map_or(0.0, |value| value * weights[n]);
            *pair = Complex::new(at(0), at(1));
        }
        transform(&mut packed, roots);
        let at = |k: usize| packed[(k % HALF).reverse_bits() >> (usize::BITS - HALF.trailing_zeros())];
        for (k, sum) in power.iter_mut().enumerate() {
            // The transforms of the samples with even and with odd index.
            let (a, b) = (at(k), at(HALF - k).conj());
            let (even, odd) = ((a + b) * 0.5, (a - b) * Complex::new(0.0, -0.5));
            let root = if k < HALF { roots[k] } else { Complex::new(-1.0, 0.0) };
            *sum += (even + root * odd).norm_sqr();
        }
    }
    (power, segments)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Deterministic values without symmetry.
    fn signal(length: usize) -> Vec<f64> {
        (0..length).map(|n| (0.37 * count(n)).sin() + 0.2 * (1.9 * count(n * n % 101)).cos()).collect()
    }

    #[test]
    fn a_spectrum_is_the_sum_of_squared_fourier_sums() {
        // The oracle is the definition. Rounding of 4096 terms is 1e-13 of their sum of magnitudes.
        for length in [1, 2, 37, 2049, POINTS] {
            let values = signal(length);
            let (found, segments) = power(&values);
            assert_eq!((segments, found.len()), (1, HALF + 1));
            let window = |n: usize| 0.5 - 0.5 * (TAU * (count(n) + 0.5) / count(length)).cos();
            for k in [0, 1, 2, 511, 1023, HALF - 1, HALF] {
                let term = |n: usize| polar(-TAU * count(n * k % POINTS) / count(POINTS)) * (values[n] * window(n));
                let expected = (0..length).map(term).sum::<Complex<f64>>().norm_sqr();
                assert!(
                    (found[k] - expected).abs() < 1e-9 * (1.0 + expected),
                    "{length}, {k}: {} {expected}",
                    found[k]
                );
            }
        }
    }

    #[test]
    fn segments_cover_a_long_signal() {
        let values = signal(3 * POINTS + 5);
        let (found, segments) = power(&values);
        let spare = values.len() - POINTS;
        assert_eq!(segments, 1 + spare.div_ceil(HALF));
        let of = |n: usize| power(&values[spare * n / (segments - 1)..][..POINTS]).0[7];
        let expected: f64 = (0..segments).map(of).sum();
        assert!((found[7] / expected - 1.0).abs() < 1e-12);
    }
}
