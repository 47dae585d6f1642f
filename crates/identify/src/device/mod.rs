//! Devices: selection of the CPU or a GPU for a search, measured throughput, and evaluation of searches batch by batch.

mod awake;
mod batch_search;
mod evaluator_spec;
mod model;
mod motor;
mod problem;
mod search_evaluator;
mod select;
mod settings;
mod throughput_profile;
mod used;

pub(crate) use awake::with_threads_awake;
pub use batch_search::BatchSearchEvaluator;
pub use evaluator_spec::EvaluatorSpec;
#[doc(hidden)]
pub use problem::DeviceProblem;
#[cfg(feature = "gpu")]
#[doc(hidden)]
pub use problem::NO_SHADER;
#[doc(hidden)]
pub use search_evaluator::SearchEvaluator;
pub use select::OnLoss;
pub use settings::{DeviceSettings, DeviceSpec, PrecisionSpec};
pub use throughput_profile::{AdapterThroughput, ThroughputCurve, ThroughputProfile, Work};
pub use used::DeviceUsed;

use motorfit_core::limit::{Limit, limit_of};
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};

/// Largest number of threads that may be requested.
pub const THREADS_MAX: usize = 1024;

/// The limits of devices.
pub const LIMITS: [Limit; 1] = [limit_of("threads", THREADS_MAX, "refused")];

/// Checks a requested number of threads.
///
/// # Errors
/// Returns a usage error for 0 threads, and for more than [`THREADS_MAX`].
pub fn check_threads(count: Option<usize>) -> Result<()> {
    match count.filter(|count| !(1..=THREADS_MAX).contains(count)) {
        None => Ok(()),
        Some(count) => {
            let remedy = format!("Give 1 to {THREADS_MAX}, or leave it out to use all.");
            Err(Error::usage(text!([Threads] " is {count}"), remedy))
        }
    }
}

/// Runs `work` inside a pool of `threads` threads, or with `None` inside the pool of the caller. Inside a pool, threads need
/// not be woken between batches.
///
/// # Errors
/// Returns a usage error if the number of threads is invalid or they cannot be started, and propagates the errors of `work`.
pub fn with_threads<T: Send>(threads: Option<usize>, work: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    check_threads(threads)?;
    let pool = threads.map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build()).transpose();
    let hint = || text!("Give fewer " [Threads] ".");
    let pool = pool.map_err(|e| Error::usage(format!("threads cannot be started: {e}"), hint()))?;
    match pool {
        Some(pool) => pool.install(work),
        None => rayon::scope(|_| work()),
    }
}
