//! Power spectra by Welch's method.

use crate::numeric::count;
use realfft::num_complex::Complex;
use realfft::{RealFftPlanner, RealToComplex};
use std::cell::RefCell;
use std::sync::Arc;

/// Points of every transform; shorter segments are padded with zeros.
pub(super) const POINTS: usize = 4096;

/// Lengths whose windows are kept.
const WINDOWS: usize = 4;

/// A plan with its buffers, made once a thread.
struct Plan {
    transform: Arc<dyn RealToComplex<f64>>,
    input: Vec<f64>,
    output: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
    /// The Hann windows of the last lengths: a signal and its differences take turns.
    windows: Vec<Vec<f64>>,
}

thread_local! {
    static PLAN: RefCell<Plan> = RefCell::new(Plan::new());
}

impl Plan {
    fn new() -> Self {
        let transform = RealFftPlanner::new().plan_fft_forward(POINTS);
        let (input, output) = (transform.make_input_vec(), transform.make_output_vec());
        let scratch = transform.make_scratch_vec();
        Self { transform, input, output, scratch, windows: Vec::new() }
    }

    /// Adds |transform|² of one windowed segment to `power`.
    fn add(&mut self, segment: &[f64], power: &mut [f64]) {
        let place = self.windows.iter().position(|window| window.len() == segment.len()).unwrap_or_else(|| {
            let turn = std::f64::consts::TAU / count(segment.len());
            self.windows.truncate(WINDOWS - 1);
            self.windows.insert(0, (0..segment.len()).map(|n| 0.5 - 0.5 * ((count(n) + 0.5) * turn).cos()).collect());
            0
        });
        for ((place, value), weight) in self.input.iter_mut().zip(segment).zip(&self.windows[place]) {
            *place = value * weight;
        }
        self.input[segment.len()..].fill(0.0);
        // Cannot fail: all three buffers are the plan's own.
        let done = self.transform.process_with_scratch(&mut self.input, &mut self.output, &mut self.scratch);
        if done.is_ok() {
            power.iter_mut().zip(&self.output).for_each(|(sum, x)| *sum += x.norm_sqr());
        }
    }
}

/// The power spectrum of a signal with the number of segments that it is the sum of: segments of up to [`POINTS`]
/// samples that overlap by half or more, Hann windows. Bin k is the frequency k/[`POINTS`] per sample.
pub(super) fn power(signal: &[f64]) -> (Vec<f64>, usize) {
    let length = signal.len().min(POINTS);
    let spare = signal.len() - length;
    let segments = 1 + spare.div_ceil(POINTS / 2);
    let mut power = vec![0.0; POINTS / 2 + 1];
    PLAN.with_borrow_mut(|plan| {
        for segment in 0..segments {
            let start = if segments > 1 { spare * segment / (segments - 1) } else { 0 };
            plan.add(&signal[start..start + length], &mut power);
        }
    });
    (power, segments)
}
