//! Values of the outputs of the DC motor, serialized as objects with the keys `current` and `speed`.

use serde::{Serialize, Serializer};

/// Names of the outputs of the DC motor.
pub const NAMES: [&str; 2] = ["current", "speed"];

/// Serializes values of `[current, speed]` as an object; a value that is missing has no key.
///
/// # Errors
/// Propagates the errors of the serializer.
pub fn by_name<T: Serialize, V: AsRef<[T]>, S: Serializer>(values: &V, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(NAMES.iter().zip(values.as_ref()))
}
