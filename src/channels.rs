//! Pairs of values of the two channels, as objects with the keys `current` and `speed`.

use serde::{Deserialize, Serialize, Serializer};

/// A value for the current and one for the speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Channels<T> {
    /// Of the current.
    pub current: T,
    /// Of the speed.
    pub speed: T,
}

impl<T> From<[T; 2]> for Channels<T> {
    fn from([current, speed]: [T; 2]) -> Self {
        Self { current, speed }
    }
}

/// Serializes a pair `[current, speed]` as an object.
///
/// # Errors
/// Those of the serializer.
pub fn by_name<T: Serialize, S: Serializer>([current, speed]: &[T; 2], serializer: S) -> Result<S::Ok, S::Error> {
    Channels { current, speed }.serialize(serializer)
}
