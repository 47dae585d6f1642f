//! Size limits of recordings, of the files that they are read from and of their preparation.

use super::requests::REQUEST_MAX;
use super::samples::SAMPLES_MAX;
use super::{import, prepare};
use motorfit_core::limit::{Limit, limit_of};

/// Returns the size limits of recordings, of files that are read and of preparation.
#[must_use]
pub fn limits() -> Vec<Limit> {
    let samples = limit_of(
        "samples of a recording, read or simulated",
        SAMPLES_MAX,
        "refused: cut the recording, or lengthen its period",
    );
    let request = limit_of("bytes of a request for columns", REQUEST_MAX, "refused");
    [samples, request].into_iter().chain(import::limits()).chain(prepare::LIMITS).collect()
}
