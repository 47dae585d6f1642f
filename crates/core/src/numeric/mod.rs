//! Numerics for every layer: conversions between counts and real numbers, statistics of signals, and points that fill a cube.
//!
//! All conversions between integers and floating-point numbers are done here, so that their limits are stated once.

mod autoregression;
mod conversion;
mod sequence;
mod statistics;

pub use autoregression::{Autoregression, autoregression};
#[doc(hidden)]
pub use conversion::rounded;
pub use conversion::{count, count_u64, index, real, single, whole, whole_u64, wide};
#[doc(hidden)]
pub use sequence::spread;
#[doc(hidden)]
pub use statistics::interpolate_between;
pub use statistics::{
    chi_square_limit, differences, dot, extremes, mean, median, noise_sigma, order_statistic, peak, quantile, rms,
    running_sums, runs, sample_deviation, slope, sorted, squares_about, standard_deviation, sum, upper_median,
};
