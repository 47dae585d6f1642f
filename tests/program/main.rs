//! Tests of the program: its commands, the files that it writes and its pages.

mod cli;
#[cfg(feature = "cli")]
mod pages;
mod reading;
mod reported;
mod reports;
#[path = "../support/mod.rs"]
mod support;
