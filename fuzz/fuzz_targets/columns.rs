//! `cargo fuzz run columns fuzz/found fuzz/corpus/columns`; docs/extending.md says more.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    motorfit_fuzz::columns(bytes, "".as_ref());
});
