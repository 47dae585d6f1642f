//! Pairs of values, one for each output channel, serialized as objects with the keys `current` and `speed`.

use serde::{Deserialize, Serialize, Serializer};

/// A value for the current and one for the speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Channels<T> {
    /// Value for the current.
    pub current: T,
    /// Value for the speed.
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
/// Propagates the errors of the serializer.
pub fn by_name<T: Serialize, S: Serializer>([current, speed]: &[T; 2], serializer: S) -> Result<S::Ok, S::Error> {
    Channels { current, speed }.serialize(serializer)
}
