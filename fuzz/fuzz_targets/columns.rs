//! `cargo fuzz run columns fuzz/found fuzz/corpus/columns`; see docs/extending.md.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    motorfit_fuzz::columns(bytes, "".as_ref());
});
