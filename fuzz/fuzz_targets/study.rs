//! `cargo fuzz run study fuzz/found fuzz/corpus/study`; see docs/extending.md.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir().expect("a folder for files");
    motorfit_fuzz::study(bytes, folder.path());
});
