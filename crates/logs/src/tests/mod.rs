//! Tests of the readers with files written by independent tools (`tests/golden/formats`) and with damaged files.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

mod mat;
mod mutation;
mod sysid;
mod xlsx;
