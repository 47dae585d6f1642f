//! Drivers that call the public functions of each module.

pub mod analysis;
pub mod estimate;
pub mod evaluate;
pub mod files;
pub mod ground;
pub mod identify;
pub mod mechanisms;
pub mod models;
pub mod motor;
pub mod optimize;
pub mod record;
pub mod report;
pub mod settings;
pub mod study;
pub mod suite;
pub mod sweep;
