//! Any bytes as a file of any format: read whole, or refused with a remedy; what was read is then diagnosed and prepared.
//!
//! `cargo install cargo-fuzz`, then `cargo fuzz run recording fuzz/corpus/recording tests/golden/formats examples`
//! (on a stable compiler: `RUSTC_BOOTSTRAP=1`, and `-s none` where there is no sanitizer).
#![no_main]

use libfuzzer_sys::fuzz_target;
use motorfit::record::{BadRows, Gaps, Mask, Offset, Preparation, ReadOptions, diagnose, parse_columns, read_bytes};

fuzz_target!(|bytes: &[u8]| {
    let Some((&how, bytes)) = bytes.split_first() else { return };
    let columns = match how % 4 {
        0 => "",
        1 => "time=#1:8kHz,voltage=#2*12/255:V,speed=#3:rpm",
        2 => "voltage=#2:0..12,position=cumsum(#3)/4096:turns,load_torque=int16(#2)*sin(position)/(#3-1)",
        _ => "time=#1,voltage=#2,current=#3*-1+0.5:mA",
    };
    let options = ReadOptions {
        columns: parse_columns(columns).unwrap_or_default(),
        rate_hz: (how & 4 != 0).then_some(1000.0),
        gaps: [Gaps::Error, Gaps::Keep, Gaps::Split][usize::from(how / 8) % 3],
        bad_rows: if how & 128 != 0 { BadRows::Skip } else { BadRows::Error },
        drop_repeats: how & 64 != 0,
        ..ReadOptions::default()
    };
    match read_bytes(bytes, None, &options) {
        Err(error) => assert!(!error.hint().is_empty()),
        Ok(records) => {
            for record in records {
                let samples = record.samples();
                assert!(samples.time_s.windows(2).all(|t| t[1] > t[0]));
                assert!(record.measured().into_iter().flatten().all(|s| s.len() == record.len() && s.iter().all(|v| v.is_finite())));
                for finding in diagnose(&record) {
                    assert!(finding.places.iter().all(|p| p.start < p.end && p.end <= record.len()));
                }
                let preparation = Preparation {
                    offset: Offset::Auto,
                    mask: vec![Mask::Auto],
                    rate_hz: (how & 128 != 0).then_some(0.3 / record.period_s()).filter(|_| record.len() < 10_000),
                    filter: "butterworth:50:2".parse().ok().filter(|_| how & 32 != 0),
                    ..Preparation::default()
                };
                let _ = preparation.apply(&record);
            }
        }
    }
});
