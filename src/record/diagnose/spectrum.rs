//! Power spectra by averaged modified periodograms (P. D. Welch 1967).

use crate::numeric::count;
use realfft::{RealFftPlanner, RealToComplex};
use std::sync::{Arc, LazyLock};

/// Length of every transform; shorter segments are padded with zeros.
pub(super) const POINTS: usize = 4096;

static TRANSFORM: LazyLock<Arc<dyn RealToComplex<f64>>> =
    LazyLock::new(|| RealFftPlanner::new().plan_fft_forward(POINTS));

/// Returns the power spectrum of a signal, summed over segments, and the number of segments.
///
/// Segments have up to [`POINTS`] samples, overlap by at least half and have Hann windows. Bin k is the frequency k/[`POINTS`]
/// per sample.
pub(super) fn power(signal: &[f64]) -> (Vec<f64>, usize) {
    let length = signal.len().min(POINTS);
    let spare = signal.len() - length;
    let segments = 1 + spare.div_ceil(POINTS / 2);
    let turn = std::f64::consts::TAU / count(length);
    let window: Vec<f64> = (0..length).map(|n| 0.5 - 0.5 * ((count(n) + 0.5) * turn).cos()).collect();
    let (mut input, mut output) = (TRANSFORM.make_input_vec(), TRANSFORM.make_output_vec());
    let mut scratch = TRANSFORM.make_scratch_vec();
    let mut power = vec![0.0; POINTS / 2 + 1];
    for segment in 0..segments {
        let start = if segments > 1 { spare * segment / (segments - 1) } else { 0 };
        for ((place, value), weight) in input.iter_mut().zip(&signal[start..]).zip(&window) {
            *place = value * weight;
        }
        input[length..].fill(0.0);
        // This cannot fail: the transform made all three buffers.
        if TRANSFORM.process_with_scratch(&mut input, &mut output, &mut scratch).is_ok() {
            power.iter_mut().zip(&output).for_each(|(sum, x)| *sum += x.norm_sqr());
        }
    }
    (power, segments)
}
