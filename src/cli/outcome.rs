//! The outcome of a command.

/// Outcomes of a command that did not fail.
pub(crate) enum Outcome {
    Done,
    /// A signal ended the work, and the partial result was printed.
    Interrupted,
    /// Some runs of a sweep have no result.
    Incomplete,
    /// `--strict` was given and the level of trust is not good.
    Untrusted,
    /// `--strict-limits` was given and motors are outside the limits.
    OutsideLimits,
}
