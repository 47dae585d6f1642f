//! Calls of `record`: reading, preparation, diagnostics.

use crate::hostile::arguments::{COUNTS, FEW, NUMBERS, WIDE, records, signals, step, texts};
use crate::hostile::calls::{Calls, ask, drive};
use motorfit::Error;
use motorfit::named::Named;
use motorfit::record::{
    BadRows, ColumnRequest, FilterKind, Gaps, Lines, LowPass, Mask, Offset, Preparation, Quantity, ReadOptions,
    Reading, Record, Samples, can_cause_poor_fit, diagnose, driver, is_driven_by_current, joined_columns,
    parse_columns, parse_crop, parse_masks, parse_number, parse_offset, preview, read, read_bytes, read_inputs,
    read_joined, read_recording, write_csv,
};
use std::path::{Path, PathBuf};

const QUANTITIES: [Quantity; 6] =
    [Quantity::Time, Quantity::Voltage, Quantity::Torque, Quantity::Current, Quantity::Speed, Quantity::Position];

pub fn words(calls: &mut Calls) {
    let plain = write_csv(&step(20));
    for word in texts() {
        ask!(calls, word;
            "record::parse_columns" => parse_columns(&word),
            "record::joined_columns" => Ok::<_, Error>((joined_columns(&word, ""), joined_columns("time=t:s", &word))),
            "record::parse_crop" => parse_crop(&word),
            "record::parse_masks" => parse_masks(&[word.clone(), String::new()]),
            "record::parse_offset" => parse_offset(&word),
            "record::LowPass::from_str" => word.parse::<LowPass>(),
            "record::BadRows::named" => <BadRows as Named>::named("bad_rows", &word),
            "record::Gaps::named" => <Gaps as Named>::named("gaps", &word),
            "record::read_bytes" => read_bytes(word.as_bytes(), Some(Path::new(&word)), &ReadOptions::default()),
            "record::preview" => preview(word.as_bytes(), Some(Path::new(&word)), &ReadOptions::default()),
            "record::Record::from_stored" => Record::from_stored(word.as_bytes()),
        );
        drive!(calls, word;
            "record::parse_number" => [true, false].map(|comma| parse_number(&word, comma)),
            "record::can_cause_poor_fit" => can_cause_poor_fit(&word),
            "record::Reading::files" => Reading::files(Path::new(&word)),
        );
        for quantity in QUANTITIES {
            let columns = vec![ColumnRequest { quantity, name: word.clone() }; 2];
            let options =
                ReadOptions { columns: columns[..1].to_vec(), sheet: Some(word.clone()), ..ReadOptions::default() };
            let twice = ReadOptions { columns: columns.clone(), ..ReadOptions::default() };
            ask!(calls, columns;
                "record::read_bytes" => read_bytes(plain.as_bytes(), None, &options),
                "record::read_bytes" => read_bytes(plain.as_bytes(), None, &twice),
            );
        }
        let path = PathBuf::from(&word);
        ask!(calls, word;
            "record::read" => read(&path, &ReadOptions::default()),
            "record::read_recording" => read_recording(&path, &[]),
            "record::read_inputs" => read_inputs(&path, &[]),
            "record::read_joined" => read_joined(&[path.clone(), path.clone()], &ReadOptions::default()),
            "record::Reading::records" => Reading::default().records(&path),
        );
    }
    ask!(calls, "none"; "record::read_joined" => read_joined(&[], &ReadOptions::default()));
    for (rate, decimate) in NUMBERS.into_iter().zip(COUNTS.into_iter().cycle()) {
        let options = ReadOptions { rate_hz: Some(rate), ..ReadOptions::default() };
        let preparation = Preparation { rate_hz: Some(rate), decimate: Some(decimate), ..Preparation::default() };
        let headless = "voltage,current,speed\n1,2,3\n4,5,6\n7,8,9\n";
        ask!(calls, (rate, decimate);
            "record::read_bytes" => read_bytes(headless.as_bytes(), None, &options),
            "record::Reading::records_from_bytes" =>
                Reading { options: options.clone(), preparation: preparation.clone() }.records_from_bytes(plain.as_bytes(), None),
        );
    }
    drive!(calls, ();
        "record::Quantity::canonical" => QUANTITIES.map(Quantity::canonical),
        "record::Quantity::key" => QUANTITIES.map(Quantity::key),
        "record::Quantity::units" => QUANTITIES.map(|quantity| quantity.units().count()),
        "record::Quantity::unit" => QUANTITIES.map(Quantity::unit),
        "record::BadRows::name" => BadRows::ALL.map(BadRows::name),
        "record::Gaps::name" => Gaps::ALL.map(Gaps::name),
        "record::driver" => driver(&[]),
        "record::is_driven_by_current" => is_driven_by_current(&[]),
    );
}

pub fn made_of_signals(calls: &mut Calls) {
    let all = signals();
    for (time_s, other) in all.iter().flat_map(|a| all.iter().map(move |b| (a, b))) {
        let one = Some(other.clone());
        let samples = Samples {
            time_s: time_s.clone(),
            voltage: other.clone(),
            torque: None,
            current: one.clone(),
            speed: one,
            ..Samples::default()
        };
        ask!(calls, (time_s, other); "record::Record::new" => Record::new(samples.clone()));
        for torque in [Some(vec![f64::NAN]), Some(Vec::new())] {
            let samples = Samples { torque, voltage: Vec::new(), ..samples.clone() };
            ask!(calls, samples; "record::Record::new" => Record::new(samples.clone()));
        }
        drive!(calls, (time_s, other); "record::Samples::signals" => samples.signals().count());
        for (start, end) in COUNTS.into_iter().zip(COUNTS.into_iter().rev()) {
            calls.may_panic("record::Samples::slice", || samples.slice(start..end));
        }
    }
    let mut lines = Lines::default();
    for line in WIDE.into_iter().rev().chain(WIDE) {
        drive!(calls, line; "record::Lines::push" => lines.push(line));
    }
    for at in COUNTS {
        drive!(calls, at;
            "record::Lines::get" => lines.get(at),
            "record::Lines::of" => lines.of([at, 0, at].into_iter()),
            "record::Lines::len" => lines.len(),
            "record::Lines::is_empty" => lines.is_empty(),
        );
    }
}

/// Returns valid and extreme preparations.
fn preparations() -> Vec<Preparation> {
    let mut all = vec![
        Preparation { offset: Offset::Auto, mask: vec![Mask::Auto], ..Preparation::default() },
        Preparation { offset: Offset::Given(Vec::new()), sampled_input: Some(true), ..Preparation::default() },
        Preparation { sampled_input: Some(false), rate_hz: Some(300.0), ..Preparation::default() },
    ];
    for a in FEW {
        for b in FEW {
            all.push(Preparation { crop: [Some(a), Some(b)], ..Preparation::default() });
            let mask = vec![Mask::Time { channels: [a > b, true], from: a, to: b }];
            all.push(Preparation {
                mask,
                offset: Offset::Given(vec![(Quantity::Current, a)]),
                ..Preparation::default()
            });
        }
        all.push(Preparation { rate_hz: Some(a), ..Preparation::default() });
        for order in [0, 1, 2, 12, 13, usize::MAX] {
            for kind in [FilterKind::Butterworth, FilterKind::Chebyshev { ripple_db: a }] {
                let filter = Some(LowPass { kind, order, cutoff_hz: 100.0 * a });
                all.push(Preparation { filter, ..Preparation::default() });
            }
        }
    }
    for quantity in QUANTITIES {
        all.push(Preparation {
            offset: Offset::Given(vec![(quantity, f64::NAN), (quantity, 1.0)]),
            ..Preparation::default()
        });
    }
    all.extend(COUNTS.map(|every| Preparation { decimate: Some(every), ..Preparation::default() }));
    all
}

pub fn recordings(calls: &mut Calls) {
    let preparations = preparations();
    for (n, record) in records().iter().enumerate() {
        drive!(calls, record;
            "record::diagnose" => diagnose(record),
            "record::Record::counting" => record.counting(),
            "record::Record::driver" => record.driver(),
            "record::Record::duration_s" => record.duration_s(),
            "record::Record::excluded" => record.excluded(),
            "record::Record::effective_sample_ratio" => record.effective_sample_ratio(),
            "record::Record::input" => record.input(),
            "record::Record::is_empty" => record.is_empty(),
            "record::Record::is_interpolated" => record.is_interpolated(),
            "record::Record::is_measured" => [0, usize::MAX].map(|n| record.is_measured(Quantity::Speed, n)),
            "record::Record::len" => record.len(),
            "record::Record::measured" => record.measured(),
            "record::Record::period_s" => record.period_s(),
            "record::Record::samples" => record.samples(),
            "record::Record::slope" => record.slope(),
            "record::Record::source" => record.source(),
            "record::Source::file_name" => record.source().file_name(),
            "record::Record::steps" => record.steps().unit_s(),
            "record::Steps::unit_s" => record.steps().unit_s(),
            "record::Steps::step" => COUNTS.map(|n| record.steps().step(n)),
            "record::write_csv" => write_csv(record),
        );
        let stored = calls.ask("record::Record::to_stored", record, || record.to_stored());
        for end in stored.iter().flat_map(|bytes| [0, 1, bytes.len() / 2, bytes.len() - 1, bytes.len()]) {
            let bytes = &stored.as_deref().unwrap_or_default()[..end];
            ask!(calls, (record, end); "record::Record::from_stored" => Record::from_stored(bytes));
        }
        for fraction in NUMBERS {
            ask!(calls, (fraction, record); "record::Record::split" => record.split(fraction));
        }
        for (start, end) in COUNTS.into_iter().zip(COUNTS.into_iter().rev().chain([record.len()])) {
            ask!(calls, (start, end, record); "record::Record::slice" => record.slice(start..end));
        }
        // Each recording gets a tenth of the preparations, because all combinations take minutes.
        for preparation in preparations.iter().skip(n % 10).step_by(10) {
            let made = calls.ask("record::Preparation::apply", &(preparation, record), || preparation.apply(record));
            drive!(calls, preparation; "record::Preparation::is_identity" => preparation.is_identity());
            for prepared in made.iter().flatten().take(2) {
                let finite = prepared.samples().signals().all(|(_, signal)| signal.iter().all(|v| v.is_finite()));
                assert!(finite && prepared.samples().time_s.windows(2).all(|t| t[0] < t[1]), "{preparation:?}");
                drive!(calls, (preparation, record); "record::diagnose" => diagnose(prepared));
            }
        }
    }
    let broken = motorfit::record::Steps { period_s: f64::NAN, jitter: 0.0, step_s: Vec::new(), step_index: vec![9] };
    calls.may_panic("record::Steps::step", || broken.step(0));
}
