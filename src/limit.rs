//! Limits of sizes that a user, a file or a caller can give.

/// A limit of a size. Its number is that of the code that holds to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limit {
    /// The size, with its unit.
    pub of: &'static str,
    /// The largest value.
    pub most: u64,
    /// The consequence of a larger one, a sentence without a full stop.
    pub beyond: &'static str,
}

/// Makes the row of a limit.
pub(crate) const fn limit(of: &'static str, most: u64, beyond: &'static str) -> Limit {
    Limit { of, most, beyond }
}

/// Makes the row of a limit that is counted in memory.
pub(crate) const fn limit_of(of: &'static str, most: usize, beyond: &'static str) -> Limit {
    limit(of, most as u64, beyond)
}
