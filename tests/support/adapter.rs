//! GPU adapter of the tests.
#![allow(clippy::print_stdout, reason = "a skip is printed")]

use motorfit::evaluate::gpu::{Gpu, Precision, Selector, list};

/// Opens the best adapter in a precision; prints a note and returns `None` if there is none and skips are allowed.
pub fn open(precision: Precision) -> Option<Gpu> {
    let adapters = list();
    let wanted = adapters.iter().find(|a| precision != Precision::F64 || a.f64);
    let Some(adapter) = wanted else {
        assert!(std::env::var_os("MOTORFIT_NO_SKIP").is_none(), "no adapter for {precision:?}: {adapters:?}");
        println!("SKIPPED: no adapter for {precision:?}");
        return None;
    };
    Some(Gpu::open(&Selector::Index(adapter.index), Some(precision)).unwrap_or_else(|e| panic!("{e}")))
}
