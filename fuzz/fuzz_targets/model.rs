//! `cargo fuzz run model fuzz/found crates/model/src/library`; see docs/extending.md.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    motorfit_fuzz::model(bytes, std::path::Path::new("."));
});
