//! Estimation in f64 on the CPU. The model of the measurements is an output error: the simulated current and speed plus white
//! Gaussian noise with one unknown σ for each recording and channel.
//!
//! [`steiglitz_mcbride()`] estimates the linear motor without a start. [`refine()`] computes the maximum-likelihood estimate
//! from a start by Levenberg–Marquardt, with its [`Uncertainty`]; [`robust_uncertainty`] widens the standard errors for
//! correlated residuals. [`global_reference`] searches the complete box for the lowest weighted sum of squares. Many
//! refinements of the same recordings share a problem made by [`fit_problem`].

#![forbid(unsafe_code)]
// Counts are converted by the functions of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

mod damped_step;
mod descent;
mod ended;
mod failure;
mod fit;
mod fitted;
mod flat;
mod gram;
mod initial;
mod linear_steps;
mod local_search;
pub mod model;
mod motor;
mod multistart;
mod output_error;
mod part;
mod projection;
mod projection_grid;
mod projection_sums;
mod recover;
mod reference;
mod refine;
mod refined;
mod resampled;
mod rough;
mod sandwich;
mod score;
mod sensitivity;
mod separate;
mod shaped;
#[cfg(test)]
mod simulated;
mod starts;
mod steiglitz_mcbride;
mod triangle;
mod uncertainty;
mod weights;

pub use failure::SmFailure;
pub use fitted::{Block, Fitted, Place, Point};
pub use gram::Products;
pub use initial::initial_states;
pub use local_search::descend;
pub use multistart::optima;
pub use reference::reference_beside;
pub use reference::{Reference, ReferenceKind, global_reference, residual_squares};
pub use refine::{RefineOptions, fit_problem, refine, refine_on};
pub use refined::Refined;
pub use resampled::steiglitz_mcbride_resampled;
pub use rough::refine_coarse;
pub use sandwich::robust_uncertainty;
pub use score::{Score, scores};
pub use separate::{Separate, separate_fits};
pub use starts::signal_deviations;
pub use starts::{
    best_start, coordinate_search, coordinate_searched, delay_starts, delayed_estimates, transferred, warm_start,
    warm_start_with_delays,
};
pub use steiglitz_mcbride::{Estimate, steiglitz_mcbride, steiglitz_mcbride_on};
pub use uncertainty::{EFFECTIVE_RATIO_MIN, student95};
pub use uncertainty::{Uncertainty, Whiteness, describe_direction};

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
