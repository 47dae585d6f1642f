//! Tests of rates over many seeds and of real recordings, which take longest: `tests/run quick` leaves them out, and
//! `MOTORFIT_FULL=1` takes all their seeds.

mod coverage;
mod diagnose;
mod limits;
mod machines;
mod model_trust;
mod real;
mod recovery;
#[path = "../support/mod.rs"]
mod support;
mod trust;
