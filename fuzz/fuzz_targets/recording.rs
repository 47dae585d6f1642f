//! `cargo fuzz run recording fuzz/found fuzz/corpus/recording tests/golden/formats`; see docs/extending.md.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    motorfit_fuzz::recording(bytes, "".as_ref());
});
