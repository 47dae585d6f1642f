//! Tests with files written by independent tools (`tests/golden/formats`) and with damaged files.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

mod cdr;
mod damage;
mod file;
mod files;
mod limits;
mod schema;
