//! `cargo fuzz run study fuzz/found fuzz/corpus/study`; docs/extending.md says more.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir().expect("a folder for files");
    motorfit_fuzz::study(bytes, folder.path());
});
