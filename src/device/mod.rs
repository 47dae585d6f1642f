//! Hardware: which device evaluates, the throughput measured on it, and searches driven on it batch by batch.

mod batch_search;
mod select;
mod throughput_profile;

pub use batch_search::BatchSearchEvaluator;
pub use select::{DeviceSettings, DeviceSpec, OnLoss, PrecisionSpec};
pub use throughput_profile::{AdapterThroughput, ThroughputCurve, ThroughputProfile, Work};

use crate::limit::{Limit, limit_of};
use crate::setting::text;
use crate::{Error, Result};

/// The most threads that may be asked for; more than any machine has cores help nobody.
pub const THREADS_MAX: usize = 1024;

/// The limits of devices.
pub const LIMITS: [Limit; 1] = [limit_of("threads", THREADS_MAX, "refused")];

/// Checks how many threads are asked for.
///
/// # Errors
/// `Usage` for none, and for more than [`THREADS_MAX`].
pub fn check_threads(count: Option<usize>) -> Result<()> {
    match count.filter(|count| !(1..=THREADS_MAX).contains(count)) {
        None => Ok(()),
        Some(count) => {
            let remedy = format!("Give 1 to {THREADS_MAX}, or leave it out for all.");
            Err(Error::usage(text!([Threads] " is {count}"), remedy))
        }
    }
}

/// Does `work` inside a pool of so many threads, `None` in that of the caller: its threads then need no waking between
/// one batch and the next.
///
/// # Errors
/// `Usage` when so many cannot be, or threads cannot be started, and those of `work`.
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
