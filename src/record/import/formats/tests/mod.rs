//! The readers against files that independent tools wrote (`tests/golden/formats`), and against damaged ones.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

mod mat;
mod mutation;
mod sysid;
mod xlsx;
