//! Relative gaps of costs to the known optimum.

/// Relative gap of the headline figures: on the problems of `motors` with noise about one standard error of the parameters.
pub const GAP: f64 = 1e-5;

/// Smallest relative gap: below it there is rounding.
pub const GAP_MIN: f64 = 1e-8;
