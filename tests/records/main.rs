//! Tests of the crates that read, prepare and store recordings.

mod clocks;
mod imports;
mod logs;
mod preparation;
mod recordings;
mod robots;
mod stored;
#[path = "../support/mod.rs"]
mod support;
