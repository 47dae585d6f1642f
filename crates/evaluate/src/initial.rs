//! Initial state of a simulation.

use motorfit_core::named::named;
use motorfit_core::numeric::{noise_sigma, peak};

named! {
    /// The state `[i, ω]` at which the simulation starts.
    #[non_exhaustive]
    pub enum Initial (default Auto) {
        /// Zero if the recording starts at rest, else free.
        Auto = "auto",
        /// Zero: the motor starts at rest.
        Zero = "zero",
        /// The first measured sample; zero for a channel that was not measured.
        Measured = "measured",
        /// Estimated by the refinement; a population search uses the first measured sample.
        Free = "free",
    }
}

/// Returns the state at the first sample, and true if the refinement estimates it.
pub(super) fn initial_state(measured: [Option<&[f64]>; 2], initial: Initial) -> ([f64; 2], bool) {
    let first = measured.map(|m| m.map_or(0.0, |m| m[0]));
    let at_rest = || {
        measured.into_iter().flatten().all(|signal| {
            // At rest means below one percent of the peak, or below five standard deviations of the noise.
            let first = signal[0].abs();
            first <= 0.01 * peak(signal) || first <= 5.0 * noise_sigma(signal)
        })
    };
    match initial {
        Initial::Zero => ([0.0; 2], false),
        Initial::Measured => (first, false),
        Initial::Free => (first, true),
        Initial::Auto if at_rest() => ([0.0; 2], false),
        Initial::Auto => (first, true),
    }
}
