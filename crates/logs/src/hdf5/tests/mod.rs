//! Tests with files written by independent tools (`tests/golden/formats`) and with damaged files.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

mod damage;
mod files;
mod matlab;
