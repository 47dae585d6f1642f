//! Upper limits of sizes that users, files or callers can request.

/// A limit of a size. The number is the constant that the code enforces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limit {
    /// The limited size with its unit, such as `bytes of a study`.
    pub of: &'static str,
    /// Largest accepted value, in that unit.
    pub most: u64,
    /// Consequence of a larger value, as a sentence without a full stop.
    pub beyond: &'static str,
}

/// Creates a row of the table of limits.
#[doc(hidden)]
pub const fn limit(of: &'static str, most: u64, beyond: &'static str) -> Limit {
    Limit { of, most, beyond }
}

/// Creates a row of the table of limits from a `usize`.
#[doc(hidden)]
pub const fn limit_of(of: &'static str, most: usize, beyond: &'static str) -> Limit {
    limit(of, most as u64, beyond)
}
