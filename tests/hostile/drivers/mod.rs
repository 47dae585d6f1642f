//! The drivers of public functions, by module.

pub mod evaluate;
pub mod ground;
pub mod motor;
pub mod optimize;
pub mod record;
