//! Proves: a recording that is stored as bytes and restored equals the original; truncated bytes are an error, and changed
//! bytes do not panic.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

use motorfit::experiment::{Excitation, simulated, with_noise};
use motorfit::motor::{Discretization, Parameters};
use motorfit::record::{Preparation, ReadOptions, Record, parse_masks, read_bytes, write_csv};

/// Returns a recording with every attribute: a file, lines, a mask, a filter, resampling.
fn prepared() -> Record {
    let step = Excitation::step(10.5, 0.1, 0.5, 0.001).unwrap();
    let record = with_noise(&simulated(&Parameters::M2, &step, Discretization::Zoh).unwrap(), [0.02, 0.5], 3).unwrap();
    let path = "a b\u{e9}.csv".as_ref();
    let read = read_bytes(write_csv(&record).as_bytes(), Some(path), &ReadOptions::default()).unwrap();
    let preparation = Preparation {
        rate_hz: Some(250.0),
        mask: parse_masks(&["0.2:0.3".to_owned()]).unwrap(),
        filter: Some("butterworth:50".parse().unwrap()),
        ..Preparation::default()
    };
    preparation.apply(&read[0]).unwrap().remove(0)
}

#[test]
fn a_restored_recording_equals_the_original() {
    let record = prepared();
    assert!(!record.excluded().is_empty() && !record.slope().is_empty() && record.effective_sample_ratio() < 1.0);
    assert_eq!(Record::from_stored(&record.to_stored().unwrap()).unwrap(), record);
}

#[test]
fn truncated_bytes_are_an_error_and_changed_ones_do_not_panic() {
    let stored = prepared().to_stored().unwrap();
    for n in (0..stored.len()).step_by(97) {
        assert!(Record::from_stored(&stored[..n]).is_err(), "{n}");
        let mut changed = stored.clone();
        changed[n] ^= 0x15;
        // Changed values are checked like those of a new recording, so that both outcomes are possible.
        let _ = Record::from_stored(&changed);
    }
    assert!(Record::from_stored(b"").is_err());
}
