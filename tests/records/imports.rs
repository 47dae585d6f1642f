//! Proves: conventions of loggers are read correctly, and ambiguous files are rejected with file, line and column: files
//! without heading or time, rows of nan, unfilled rows, names in comments, units below headings, ticks, duty cycles, flags,
//! positions, other formats, several files as one; damaged files never panic and never give part of a recording.
//! Does not prove: the readers against all programs that write these formats (tests/golden/formats lists those tested).
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::float_cmp,
    reason = "small numbers; exact equality is meant"
)]

use motorfit::Error;
use motorfit::record::{BadRows, Gaps, ReadOptions, Record, parse_columns, read, read_bytes, read_joined};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

fn options(columns: &str) -> ReadOptions {
    ReadOptions { columns: parse_columns(columns).unwrap(), ..ReadOptions::default() }
}

fn records(text: &str, options: &ReadOptions) -> Result<Vec<Record>, Error> {
    read_bytes(text.as_bytes(), None, options)
}

fn one(text: &str, columns: &str) -> Record {
    let mut records = records(text, &options(columns)).unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert_eq!(records.len(), 1);
    records.pop().unwrap()
}

fn refused(text: &str, columns: &str) -> Error {
    let error = records(text, &options(columns)).unwrap_err();
    assert!(!error.hint().is_empty(), "{error}");
    error
}

const ROWS: [[f64; 4]; 4] =
    [[0.0, 0.0, 0.0, 0.0], [0.001, 10.5, 0.25, 1.5], [0.002, 10.5, 0.5, 3.0], [0.003, 0.0, 0.75, 4.5]];

fn rows(separator: &str, end: &str) -> String {
    let row = |row: &[f64; 4]| row.map(|v| v.to_string()).join(separator) + end;
    ROWS.iter().map(row).collect()
}

/// Asserts that a recording has the samples of [`ROWS`].
fn is_rows(record: &Record) {
    let samples = record.samples();
    for (n, row) in ROWS.iter().enumerate() {
        let found =
            [samples.time_s[n], samples.voltage[n], record.measured()[0].unwrap()[n], record.measured()[1].unwrap()[n]];
        assert!(found.iter().zip(row).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?} {row:?}");
    }
    assert_eq!(record.len(), ROWS.len());
}

#[test]
fn columns_by_number_where_there_is_no_heading() {
    for (separator, end) in [(",", "\n"), (";", "\r\n"), ("\t", "\n"), ("   ", " \n"), (" , ", " ;\n")] {
        is_rows(&one(&rows(separator, end), "time=1:s,voltage=2:V,current=3:A,speed=4:rad/s"));
        is_rows(&one(&rows(separator, end), "time=#1,voltage=#2,current=#3,speed=#4"));
    }
    assert!(refused(&rows(",", "\n"), "").to_string().contains("found numbers, expected a heading"));
    assert!(refused(&rows(",", "\n"), "time=1,voltage=2,current=5").to_string().contains("no column \"5\""));
    let numbered = format!("t,u,i,x\n{}", rows(",", "\n"));
    is_rows(&one(&numbered, "speed=#4:rad/s"));
}

#[test]
fn time_from_a_rate_where_there_is_no_column() {
    let text = "voltage_V,current_A\n0,0\n5,0.1\n5,0.2\n";
    let timed = ReadOptions { rate_hz: Some(2000.0), ..ReadOptions::default() };
    let record = records(text, &timed).unwrap().pop().unwrap();
    assert_eq!(record.samples().time_s, [0.0, 0.0005, 0.001]);
    assert!(record.source().notes.iter().any(|note| note.contains("2.00000 kHz")), "{:?}", record.source().notes);
    assert!(refused(text, "").hint().to_string().contains("rate HZ"));
    // A column of clock times can be ignored.
    let clock = "time,voltage_V,current_A\n12:00:00.1,0,0\n12:00:00.2,5,0.1\n";
    assert!(refused(clock, "").hint().to_string().contains("time=- rate HZ"));
    let counted = ReadOptions { rate_hz: Some(10.0), ..options("time=-") };
    assert_eq!(records(clock, &counted).unwrap()[0].samples().time_s, [0.0, 0.1]);
    assert!(
        refused("time,voltage_V,current_A\n0,0,0\n1,5,0.1\n", "time=-").to_string().contains("no column for time_s")
    );
    // A time column takes precedence.
    let own = records("t,voltage_V,current_A\n0,0,0\n0.1,5,0.1\n0.2,5,0.1\n", &timed).unwrap().pop().unwrap();
    assert_eq!(own.samples().time_s, [0.0, 0.1, 0.2]);
}

#[test]
fn rows_of_nan_are_skipped_and_a_single_nan_is_an_error() {
    let text = "t,u,i,w\n0,0,0,0\nnan,nan,nan,NaN\n0.001,10.5,0.25,1.5\n0.0012,nan,NAN,nan\n0.002,10.5,0.5,3\n0.003,0,0.75,4.5\n";
    let record = one(text, "");
    is_rows(&record);
    assert_eq!(record.source().notes, ["2 rows of nan left out"]);
    assert_eq!(record.source().lines.get(1), Some(4), "lines are those of the file");
    let lone = refused("t,u,i,w\n0,0,0,0\n0.001,10.5,nan,1.5\n", "");
    assert_eq!(lone.line(), Some(3));
    assert!(lone.to_string().contains("column i: found \"nan\""), "{lone}");
    // With a single signal a row of nan cannot be distinguished from a single nan.
    assert!(refused("t,u,i\n0,0,0\n0.001,1,nan\n", "").to_string().contains("not a number"));
}

#[test]
fn rows_with_time_zero_at_the_end_were_never_filled() {
    let text = format!("t,u,i,w\n{}0,0,0.75,4.5\n0,0,0.75,4.5\n", rows(",", "\n"));
    let record = one(&text, "");
    is_rows(&record);
    assert_eq!(record.source().notes, ["2 rows with time 0 at the end left out"]);
    let inside = format!("t,u,i,w\n{}0,0,0,0\n0.004,0,0,0\n", rows(",", "\n"));
    assert!(refused(&inside, "").to_string().contains("time goes back"), "only at the end");
}

#[test]
fn names_and_units_may_be_in_comments_or_below() {
    let body = rows(",", ";\n");
    let text = format!("%Motor data\n%Date:,today\n\n%time,voltage,current,velocity\n%[ms],[V],[mA],[turns/s]\n{body}");
    let record = one(&text, "");
    assert!((record.samples().time_s[1] - 1e-6).abs() < 1e-18);
    assert!((record.measured()[0].unwrap()[1] - 0.25e-3).abs() < 1e-18);
    assert!((record.measured()[1].unwrap()[1] - 1.5 * std::f64::consts::TAU).abs() < 1e-12);
    assert!(record.source().notes.iter().any(|note| note.contains("comment")));
    is_rows(&one(&format!("# a comment\n# t,u,i,w\n{}", rows(",", "\n")), ""));
    // A comment with another number of columns is not a heading.
    assert!(refused(&format!("# t,u\n{}", rows(",", "\n")), "").to_string().contains("found numbers"));
    for units in ["s;V;A;rad/s", "[s];[V];[A];[rad/s]", "(s);(V);(A);(rad/s)"] {
        let record = one(&format!("t;u;i;w\n{units}\n{}", rows(";", "\n")), "");
        is_rows(&record);
        assert!(record.source().columns.iter().all(|column| column.unit_named));
    }
    assert!(
        refused(&format!("t;u;i;w\ns;V;A;parsec\n{}", rows(";", "\n")), "")
            .to_string()
            .contains("\"s\", expected a number")
    );
    let before = format!("Logger 3000\nSerial 7, Room 5\n\nt,u,i,w\n{}", rows(",", "\n"));
    let record = one(&before, "");
    is_rows(&record);
    assert_eq!(record.source().notes, ["2 lines before the heading left out"]);
    let index = format!(
        ",t,u,i,w\n{}",
        ROWS.iter()
            .enumerate()
            .map(|(n, r)| format!("{n},{}\n", r.map(|v| v.to_string()).join(",")))
            .collect::<String>()
    );
    let record = one(&index, "");
    is_rows(&record);
    assert!(record.source().ignored.is_empty(), "an index without a name is no news");
}

#[test]
fn ticks_duty_and_flags_become_volts_and_seconds() {
    let text = "tick;pwm;on;mA\n0;0;0.6;1\n80;255;0.6;2\n160;-51;0.7;3\n";
    let record = one(text, "time=tick:8kHz,voltage=pwm*12/255:V,current=mA:mA");
    assert_eq!(record.samples().time_s, [0.0, 0.01, 0.02]);
    assert!(record.samples().voltage.iter().zip([0.0, 12.0, -2.4]).all(|(a, b)| (a - b).abs() < 1e-12));
    assert_eq!(record.source().columns[1].conversion, "× 0.047059");
    let flag = one(text, "time=tick/8000:s,voltage=on:11.04*154/255..11.04*180/255,current=mA:mA");
    assert!((flag.samples().voltage[0] - 6.667_294_117_647_059).abs() < 1e-12);
    assert!((flag.samples().voltage[2] - 7.792_941_176_470_588).abs() < 1e-12);
    let offset = one(text, "time=tick:8kHz,voltage=pwm+51*0.1:V,current=mA*-1+0.5:mA");
    assert!((offset.samples().voltage[2]).abs() < 1e-12);
    assert!((offset.measured()[0].unwrap()[0] + 0.5e-3).abs() < 1e-15);
    for (columns, part) in [
        ("time=tick:8kHz,voltage=pwm:0..12,current=mA:mA", "expected a flag of two values"),
        ("time=tick:furlong,voltage=pwm,current=mA:mA", "unit \"furlong\""),
        (
            "time=tick:8kHz,voltage=pwm*12/0:V,current=mA:mA",
            "line 2: voltage of \"pwm*12/0\" is no number with pwm = 0",
        ),
        ("time=tick:8kHz,voltage=duty,current=mA:mA", "no column \"duty\" for voltage"),
    ] {
        assert!(refused(text, columns).to_string().contains(part), "{columns}: {}", refused(text, columns));
    }
    assert!(
        refused(&text.replace("0.7", "0.6"), "time=tick:8kHz,voltage=on:0..12,current=mA:mA")
            .to_string()
            .contains("throughout")
    );
    assert!(refused(text, "").hint().to_string().contains("voltage=pwm*12/255:V"), "{}", refused(text, "").hint());
    // A heading that contains operators is matched literally first.
    let odd = "t,U*2,I/mA\n0,1,500\n0.1,2,600\n";
    assert_eq!(one(odd, "voltage=U*2").samples().voltage, [1.0, 2.0]);
    assert_eq!(one(odd, "voltage=U*2*3").samples().voltage, [3.0, 6.0]);
}

#[test]
fn formulas_of_several_columns() {
    let text = "dt,pwm,supply,mA,count,load-1\n10,0,12,1,0,0\n10,128,11,2,256,65535\n20,255,10,3,-512,2\n";
    let voltage = |formula: &str| {
        let record = one(text, &format!("time=cumsum(dt):ms,current=mA:mA,voltage={formula}"));
        (record.samples().voltage.clone(), record)
    };
    for (formula, expected) in [
        ("pwm/255*supply", [0.0, 128.0 / 255.0 * 11.0, 10.0]),
        ("supply*(pwm-64)/128", [-6.0, 5.5, 10.0 * 191.0 / 128.0]),
        ("-supply+pwm^2/1000:mV", [-0.012, -0.011 + 0.016_384, -0.010 + 0.065_025]),
        ("#2 - #3", [-12.0, 117.0, 245.0]),
        ("int16(load-1) + 0*pwm", [0.0, -1.0, 2.0]),
        ("int16(\"load-1\")", [0.0, -1.0, 2.0]),
        ("abs(count)/512*12", [0.0, 6.0, 12.0]),
        ("12*sin(pi/2)*cos(0*pwm)", [12.0; 3]),
        // With one column and numbers, operations apply from left to right; with several columns the usual precedence holds.
        ("pwm+1*2", [2.0, 258.0, 512.0]),
        ("pwm+supply*2", [24.0, 150.0, 275.0]),
        ("pwm+(1*2)", [2.0, 130.0, 257.0]),
    ] {
        let (found, record) = voltage(formula);
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{formula}: {found:?}");
        let column = &record.source().columns[1];
        let shown = format!("{}:{}", column.heading, column.unit);
        assert!(shown.starts_with(formula.trim_end_matches("*1*2").split("+1").next().unwrap()), "{formula}: {shown}");
    }
    let (_, record) = voltage("pwm/255*supply");
    assert!(record.samples().time_s.iter().zip([0.01, 0.02, 0.04]).all(|(a, b)| (a - b).abs() < 1e-15));
    assert_eq!(record.source().columns[1].heading, "pwm/255*supply", "the echo shows the formula");
    let counted = one(text, "time=cumsum(dt):ms,voltage=pwm,position=cumsum(count)/1024:turns");
    let speed = counted.measured()[1].unwrap();
    assert!((speed[0] - 0.25 * std::f64::consts::TAU / 0.01).abs() < 1e-9 && speed[2] < 0.0, "{speed:?}");
    // A missing term of a running sum would make all later values wrong.
    let hole = text.replace("10,128,11,2,256,65535\n", "10,128,11,2,256,65535\nnan,nan,nan,nan,nan,nan\n");
    let error = refused(&hole, "time=cumsum(dt):ms,voltage=pwm,current=mA");
    assert!(error.line() == Some(4) && error.to_string().contains("needs every row"), "{error}");
}

#[test]
fn a_load_is_a_formula_of_the_position() {
    let text = "t,u,w,deg\n0,1,0.5,0\n0.1,1,1,30\n0.2,1,1.5,90\n";
    let torque = |record: &Record| record.samples().torque.clone().unwrap();
    let gravity = "load_torque=0.5*9.80665*0.1*sin(position)";
    let both = one(text, &format!("position=deg:deg,{gravity}"));
    assert_eq!(both.measured()[1].unwrap(), [0.5, 1.0, 1.5], "a speed that is given wins");
    assert!(torque(&both).iter().zip([0.0, 0.5, 1.0]).all(|(a, b)| (a - 0.490_332_5 * b).abs() < 1e-12));
    assert!(both.source().columns.iter().any(|column| column.heading.contains("sin(position)")));
    let alone = one(text, &format!("position=deg:deg,speed=-,{gravity}"));
    assert!((alone.measured()[1].unwrap()[1] - std::f64::consts::FRAC_PI_2 / 0.2).abs() < 1e-9);
    assert_eq!(torque(&alone), torque(&both));
    // `position` means the position in rad if it is in the list, else the column of this heading.
    let named = text.replace("deg", "position");
    assert_eq!(torque(&one(&named, &format!("position=position:deg,{gravity}"))), torque(&both));
    assert_eq!(torque(&one(&named, "position=position:deg,load_torque=position*2"))[1], 2.0 * 30f64.to_radians());
    let shifted = one(&named, &format!("position=(position-w)*2:deg,{gravity}"));
    assert!((torque(&shifted)[1] - 0.490_332_5 * 58f64.to_radians().sin()).abs() < 1e-12);
    assert!((torque(&one(&named, gravity))[1] - 0.490_332_5 * 30f64.sin()).abs() < 1e-12);
    for (text, columns, part) in [
        (text, gravity.to_owned(), "no column \"position\""),
        (&named, format!("position=w*1:rad,{gravity}"), "is a heading and a quantity"),
        (&text.replace("deg", "angle_deg"), "load_torque=sin(angle_deg)".to_owned(), "sin and cos take rad"),
        (text, "position=deg+speed:deg,speed=position*2".to_owned(), "a formula of itself"),
        (
            text,
            "load_torque=1/w+1/(w-1)*u".to_owned(),
            "line 3: load torque of \"1/w+1/(w-1)*u\" is infinite with w = 1",
        ),
        (
            text,
            "load_torque=int8(deg*10)".to_owned(),
            "line 3: load torque of \"int8(deg*10)\" is no number with deg = 30",
        ),
        (text, "load_torque=tan(deg)".to_owned(), "expected one of the functions sin, cos"),
        (text, "load_torque=(u+w".to_owned(), "closing parenthesis"),
        (text, "load_torque=2*3".to_owned(), "numbers alone"),
        (text, "load_torque=u*w:".to_owned(), "expected an operation or a unit"),
        (text, "load_torque=u*w:furlong".to_owned(), "unit \"furlong\""),
        (text, format!("load_torque=u{}", "*w".repeat(300)), "expected at most 400"),
    ] {
        let error = refused(text, &columns);
        assert!(error.to_string().contains(part), "{columns}: {error}");
    }
    assert!(refused(text, gravity).hint().to_string().contains("position=HEADING:UNIT"));
    // The input of a simulation may be a formula as well.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("input.csv");
    std::fs::write(&path, text).unwrap();
    let inputs = motorfit::record::read_inputs(&path, &parse_columns(&format!("position=deg:deg,{gravity}")).unwrap());
    assert_eq!(inputs.unwrap().torque.unwrap(), torque(&both));
}

#[test]
fn a_position_is_a_source_of_speed() {
    let text = |count: &dyn Fn(f64) -> f64| {
        let rows: String = (0..50).map(|n| f64::from(n) * 0.01).map(|t| format!("{t},5,{}\n", count(t))).collect();
        format!("t,u,position\n{rows}")
    };
    let rising = |per_turn: f64| move |t: f64| per_turn * 3.0 * t;
    for (columns, per_turn) in [
        ("position=position/4096:turns", 4096.0),
        ("position=position:deg", 360.0),
        ("position=position:rad", std::f64::consts::TAU),
    ] {
        let record = one(&text(&rising(per_turn)), columns);
        assert!(
            record.measured()[1].unwrap().iter().all(|w| (w - 3.0 * std::f64::consts::TAU).abs() < 1e-9),
            "{columns}"
        );
        assert!(record.source().notes.iter().any(|note| note.contains("central difference")));
    }
    let wrapping = one(&text(&|t| (3.0 * t * 360.0) % 360.0), "position=position:deg");
    assert!(wrapping.measured()[1].unwrap().iter().all(|w| (w - 3.0 * std::f64::consts::TAU).abs() < 1e-9));
    assert!(refused(&text(&|t| t), "position=position:counts").hint().to_string().contains("/4096:turns"));
    let both = "t,u,w,position\n0,0,1,0\n0.1,0,2,0\n";
    assert_eq!(one(both, "").measured()[1].unwrap(), [1.0, 2.0], "a speed is a speed");
    assert!(records(both, &options("position=position")).is_err());
}

#[test]
fn ambiguous_files_are_rejected() {
    // A comma as thousands separator, in a file with decimal points.
    let thousands = "time_s,voltage_V,current_A,speed_rpm\n0.000,6.0,0.07,\"1,127\"\n0.001,6.0,0.07,\"1,128\"\n";
    let error = refused(thousands, "");
    assert!(error.line() == Some(2) && error.to_string().contains("decimal points too"), "{error}");
    refused("t;u;i\n0,000;1;0,5\n0,001;1;0.5\n", "");
    assert_eq!(one("t;u;i\n0,000;1;0,500\n0,001;1;0,125\n", "").measured()[0].unwrap(), [0.5, 0.125]);
    let twice = "t,u,i,i\n0,1,2,3\n1,1,2,3\n";
    assert!(refused(twice, "").to_string().contains("columns 3 and 4 are both headed \"i\""));
    assert_eq!(one(twice, "current=#4").measured()[0].unwrap(), [3.0, 3.0]);
    assert_eq!(one(twice, "current=#4+0*#3").measured()[0].unwrap(), [3.0, 3.0]);
    assert!(refused(twice, "current=#4+i").to_string().contains("columns 3 and 4 are both headed \"i\""));
    let units = "time_s,u,i\nms,V,A\n0,1,2\n1,1,2\n";
    assert!(refused(units, "").to_string().contains("names the unit s, the row below it ms"));
    assert_eq!(one(units, "time=time_s:ms").samples().time_s, [0.0, 0.001]);
    refused("t,u,i\n0,1,2\n1,8,2\n", "voltage=u:3...8");
    let bare = "t,u,position\n0,1,0\n1,1,5\n2,1,9\n";
    assert!(refused(bare, "").hint().to_string().contains("/4096:turns"), "nothing is taken to be radians");
    let counter: String = (0..60).map(|n| format!("{n},5,{}\n", (60_000 + 300 * n) % 65_536)).collect();
    let error = refused(&format!("t,u,count\n{counter}"), "position=count/4096:turns");
    assert!(error.to_string().contains("wraps") && error.line() == Some(21), "{error}");
    // The resolution of seconds since 1970 is limited by their digits.
    let epoch: String = (0..3000).map(|n| format!("{:.3},1,{n}\n", 1.7e9 + f64::from(n) * 1e-3)).collect();
    let epoch = one(&format!("t,u,i\n{epoch}"), "");
    assert!(epoch.steps().step_index.is_empty() && (epoch.period_s() - 1e-3).abs() < 1e-9, "{}", epoch.period_s());
}

#[test]
fn gaps_and_repeats_follow_the_options() {
    let with_gap: String = (0..60)
        .map(|n| f64::from(n) * 0.01 + if n < 25 { 0.0 } else { 0.2 })
        .map(|t| format!("{t:.2},1,{t}\n"))
        .collect();
    let text = format!("t,u,i\n{with_gap}");
    assert!(refused(&text, "").to_string().contains("gap in time"));
    let with = |gaps| records(&text, &ReadOptions { gaps, ..ReadOptions::default() }).unwrap();
    let kept = with(Gaps::Keep).pop().unwrap();
    assert_eq!(kept.len(), 60);
    assert!((kept.steps().step(24) - 0.21).abs() < 1e-9, "{}", kept.steps().step(24));
    let split = with(Gaps::Split);
    assert_eq!(split.iter().map(Record::len).collect::<Vec<_>>(), [25, 35]);
    assert_eq!(split[1].source().part.as_deref(), Some("segment 2"));
    assert_eq!(split[1].source().lines.get(0), Some(27));
    let repeated = "t,u,i\n0,0,1\n0.1,1,2\n0.1,1,3\n0.2,1,4\n0.3,1,5\n";
    assert!(refused(repeated, "").hint().to_string().contains("drop_repeats"));
    let dropped =
        records(repeated, &ReadOptions { drop_repeats: true, ..ReadOptions::default() }).unwrap().pop().unwrap();
    assert_eq!(dropped.measured()[0].unwrap(), [1.0, 2.0, 4.0, 5.0]);
    // Occasional long steps of a polling logger are not gaps.
    let mut t = 0.0;
    let polled: String = (0..200)
        .map(|n| {
            t += if n % 50 == 49 { 0.04 } else { 0.01 * (1.0 + 0.1 * f64::from(n).sin()) };
            format!("{t:.6},1,{n}\n")
        })
        .collect();
    assert_eq!(one(&format!("t,u,i\n{polled}"), "").len(), 200);
    // Neither are those of a clock with two periods whose ratio is not an integer; lost samples are gaps.
    for (long, is_clock) in [(0.0154, true), (0.0165, true), (0.02, false), (0.0305, false)] {
        let mut t = 0.0;
        let two: String = (0..200)
            .map(|n| {
                t += if n % 5 == 4 { long } else { 0.01 };
                format!("{t:.6},1,{n}\n")
            })
            .collect();
        let read = records(&format!("t,u,i\n{two}"), &ReadOptions::default());
        assert_eq!(read.is_ok(), is_clock, "{long}");
    }
}

#[test]
fn unreadable_rows_are_rejected_or_left_out() {
    let skip = |columns: &str| ReadOptions { bad_rows: BadRows::Skip, ..options(columns) };
    let row = |n: i32| format!("{:.2},{},{}\n", f64::from(n) * 0.01, n % 7, n);
    let rows = |bad: &dyn Fn(i32) -> Option<&'static str>| -> String {
        (0..60).map(|n| bad(n).map_or_else(|| row(n), |line| format!("{line}\n"))).collect()
    };
    let garbled = |n: i32| match n {
        20 => Some("Sensor reset!"),
        30 => Some("0.30,2,\u{1}\u{2}"),
        31 => Some("0.31,3,n/a"),
        45 => Some("0.45,nan,45"),
        _ => None,
    };
    let text = format!("Booting...\nt,u,i\n{}0.60,1,", rows(&garbled));
    for (without, part) in [
        (text.clone(), "line 23: found 1 cell, expected 3"),
        (text.replace("Sensor reset!\n", ""), "line 32: found a control character"),
        (format!("t,u,i\n{}", rows(&|n| (n == 31).then_some("0.31,3,n/a"))), "line 33, column i: found \"n/a\""),
    ] {
        let error = refused(&without, "");
        assert!(error.to_string().contains(part), "{error}");
        assert!(error.hint().to_string().contains("bad_rows skip"), "{}", error.hint());
    }
    let record = records(&text, &skip("")).unwrap().pop().unwrap();
    assert_eq!(record.len(), 56);
    let notes = record.source().notes.join("\n");
    assert!(
        notes.contains("5 rows that could not be read left out: line 23 (found 1 cell, expected 3 as in the heading)")
    );
    assert!(notes.contains("line 33 (found a control character") && notes.contains("line 34 (column i: found \"n/a\""));
    assert!(notes.contains("3 gaps in time where rows were left out"), "{notes}");
    assert!(notes.contains("1 line before the heading left out"), "{notes}");
    // The steps over skipped rows have the length of their times.
    assert!((record.steps().step(19) - 0.02).abs() < 1e-9 && (record.steps().step(28) - 0.03).abs() < 1e-9);
    assert_eq!(record.measured()[0].unwrap()[20], 21.0);
    assert_eq!(record.source().lines.get(20), Some(24));
    let longer = text.replace(&row(21), "");
    assert!(
        records(&longer, &skip("")).unwrap_err().to_string().contains("gap in time"),
        "more is missing than was read"
    );
    let split = records(&text, &ReadOptions { gaps: Gaps::Split, ..skip("") }).unwrap();
    assert_eq!(split.iter().map(Record::len).collect::<Vec<_>>(), [20, 13, 14], "but of fewer than ten samples");
    // A row for which a formula is not a number is a bad row; a running sum does not allow skipping it.
    let zero = format!("t,u,i\n{}", rows(&|n| (n == 50).then_some("0.50,0,-1")));
    let record = records(&zero, &skip("voltage=u/(i+1)")).unwrap().pop().unwrap();
    assert!(
        record.len() == 59 && record.source().notes.join("").contains("line 52 (voltage of"),
        "{:?}",
        record.source()
    );
    let sum = records(&text, &skip("voltage=cumsum(u)")).unwrap_err();
    assert!(sum.line() == Some(23) && sum.to_string().contains("needs every row"), "{sum}");
    // Without a time column a skipped row would make all later times uncertain.
    let counted = ReadOptions { rate_hz: Some(100.0), ..skip("time=-") };
    assert!(records(&text, &counted).unwrap_err().to_string().contains("time is counted"));
    assert_eq!(records(&format!("x\nu,i\n{}boot\n", "1,2\n".repeat(9)), &counted).unwrap()[0].len(), 9);
    // Rows after messages of a logger are not headings.
    let bare = format!("Booting...\n\u{7}\n{}", rows(&garbled));
    let record = records(&bare, &skip("time=#1,voltage=#2,current=#3")).unwrap().pop().unwrap();
    assert!(record.len() == 56 && record.samples().time_s[0] == 0.0, "{}", record.len());
    assert!(record.source().notes.join("").contains("2 lines before the rows left out"), "{:?}", record.source().notes);
}

#[test]
fn a_clock_that_starts_again_splits_a_file() {
    let run = |from: f64, count: i32, period: f64, far: f64| -> String {
        let position = |n: i32| far + f64::from(n) * f64::from(n);
        (0..count).map(|n| format!("{:.3},1,{}\n", from + f64::from(n) * period, position(n))).collect()
    };
    let text =
        format!("t,u,position\n{}{}{}", run(5.0, 20, 0.01, 0.0), run(0.0, 30, 0.1, 5000.0), run(0.0, 4, 0.1, 0.0));
    let with = |gaps| ReadOptions { gaps, ..options("position=position:rad") };
    for gaps in [Gaps::Error, Gaps::Keep] {
        let error = records(&text, &with(gaps)).unwrap_err();
        assert!(error.to_string().contains("time goes back") && error.line() == Some(22), "{error}");
        assert!(error.hint().to_string().contains("gaps split"), "{}", error.hint());
    }
    let split = records(&text, &with(Gaps::Split)).unwrap();
    assert_eq!(split.iter().map(Record::len).collect::<Vec<_>>(), [20, 30]);
    assert_eq!(split.iter().map(Record::period_s).collect::<Vec<_>>(), [0.01, 0.1], "each has its own clock");
    assert!(split[0].source().notes.iter().any(|note| note == "1 segment of fewer than 10 samples left out"));
    assert_eq!(split[1].source().lines.get(0), Some(22));
    // Speeds are not computed across a cut: the differences of positions on a parabola are exact.
    for (record, period) in split.iter().zip([0.01, 0.1]) {
        let speed = record.measured()[1].unwrap();
        assert!(
            (speed[record.len() - 1] * period - (2.0 * (record.len() as f64 - 1.0) - 1.0)).abs() < 1e-6,
            "{speed:?}"
        );
        assert!((speed[0] * period - 1.0).abs() < 1e-6);
    }
}

#[test]
fn several_files_are_one_recording() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| -> PathBuf {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let drive = file("drive.csv", "t,u\n0,0\n0.001,10.5\n0.002,10.5\n0.003,0\n");
    let current = file("current.csv", "t,i\n0,0\n0.001,0.25\n0.002,0.5\n0.003,0.75\n");
    let speed = file("speed.csv", "t,w\n0,0\n0.001,1.5\n0.002,3\n0.003,4.5\n");
    let plain = ReadOptions::default();
    let joined = read_joined(&[drive.clone(), current, speed], &plain).unwrap().pop().unwrap();
    is_rows(&joined);
    assert!(joined.source().path.as_ref().unwrap().to_str().unwrap().contains("drive.csv+"));
    let first = file("1.csv", "t,u,i,w\n0,0,0,0\n0.001,10.5,0.25,1.5\n");
    let later = file("2.csv", "t,u,i,w\n0.002,10.5,0.5,3\n0.003,0,0.75,4.5\n");
    let anew = file("3.csv", "t,u,i,w\n5,10.5,0.5,3\n5.001,0,0.75,4.5\n");
    let zero = file("4.csv", "t,u,i,w\n0,10.5,0.5,3\n0.001,0,0.75,4.5\n");
    is_rows(&read_joined(&[first.clone(), later], &plain).unwrap()[0]);
    is_rows(&read_joined(&[first.clone(), zero], &plain).unwrap()[0]);
    assert!(read_joined(&[first.clone(), anew], &plain).unwrap_err().to_string().contains("gap"));
    let shifted = file("5.csv", "t,i\n0,0\n0.0015,0.25\n0.002,0.5\n0.003,0.75\n");
    let error = read_joined(&[drive.clone(), shifted], &plain).unwrap_err();
    assert!(error.to_string().contains("sample 2 is at 0.0015 s") && error.to_string().contains("5.csv"), "{error}");
    let partly = file("6.csv", "t,u,i\n0,0,0\n0.001,1,1\n");
    assert!(read_joined(&[drive, partly], &plain).unwrap_err().to_string().contains("but not all"));
}

fn golden(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden/formats").join(name)
}

#[test]
#[cfg(feature = "formats")]
fn other_formats_are_recordings() {
    // t, u, and an i32 variable as the current, from a file written by scipy.
    let mat = read(&golden("mixed_v7.mat"), &options("time=t:s,voltage=u:V,current=on:A")).unwrap().pop().unwrap();
    assert_eq!(mat.samples().time_s, [0.0, 0.001, 0.002, 0.003, 0.004]);
    assert_eq!(mat.samples().voltage[3], 1.0 / 3.0);
    assert!(mat.source().notes.iter().any(|note| note.contains("fs")), "{:?}", mat.source().notes);
    // Headings of matrix columns contain a comma; scalars are constants.
    for current in ["m(:,2):A", "\"m(:,2)\":A", "#10", "m(:,1)*0 + \"m(:,2)\"*(fs/fs)"] {
        let mat = read(&golden("mixed_v7.mat"), &options(&format!("voltage=u:V,current={current},time=t:s"))).unwrap();
        assert_eq!(mat[0].measured()[0].unwrap(), [2.0, 4.0, 6.0, 8.0, 10.0], "{current}");
    }
    let book = read(&golden("log.xlsx"), &options("current=took:s")).unwrap_err();
    assert!(book.to_string().contains("log.xlsx, Log, line 3, column took: unit \"s\" of current"), "{book}");
    let book = read(&golden("log.xlsx"), &options("current=on:mA,voltage=voltage_V*1e-15:V")).unwrap().pop().unwrap();
    assert!(book.len() > 1 && book.source().part.as_deref() == Some("Log"), "{book:?}");
    let sheet = ReadOptions { sheet: Some("Nothing".to_owned()), ..ReadOptions::default() };
    assert!(read(&golden("log.xlsx"), &sheet).unwrap_err().to_string().contains("the workbook has"));
    let tests = |rows: &str| {
        let tests = ["slow-forward", "slow-backward", "fast-forward", "fast-backward"];
        let tests = tests.map(|test| format!("\"{test}\": [{rows}]")).join(",");
        let sort = if rows.matches(',').count() > 8 { "Drivetrain" } else { "Simple" };
        format!(
            "{{\"sysid\": true, \"test\": \"{sort}\", \"units\": \"Radians\", \"unitsPerRotation\": 6.283, {tests}}}"
        )
    };
    let simple = records(&tests("[1.0, 0.5, 0.0, 0.0], [1.005, 0.5, 0.001, 0.25]"), &ReadOptions::default()).unwrap();
    assert_eq!(simple.len(), 4);
    assert_eq!(simple[2].source().part.as_deref(), Some("fast-forward"));
    assert_eq!(simple[0].measured()[1].unwrap()[1], 0.25 * std::f64::consts::TAU);
    let short = records(&tests("[1.0, 0.5, 0.0, 0.0]"), &ReadOptions::default()).unwrap_err();
    assert!(short.to_string().contains("slow-forward: found 1 row"), "{short}");
    let sides = tests("[1.0, 0.5, 0.6, 0, 0, 0, 0, 0, 0], [1.005, 0.5, 0.6, 0, 0, 0.25, 0.5, 0, 0]");
    assert!(records(&sides, &ReadOptions::default()).unwrap_err().to_string().contains("look like voltage"));
    let right = options("voltage=right voltage [V],speed=right speed [turns/s]");
    assert_eq!(records(&sides, &right).unwrap()[3].measured()[1].unwrap()[1], 0.5 * std::f64::consts::TAU);
    let json = records("{\"a\": 1}", &ReadOptions::default()).unwrap_err();
    assert!(json.to_string().contains("JSON"), "{json}");
}

#[test]
fn objects_of_a_json_list_are_samples() {
    let list = "[{\"t\": 0, \"u\": 1, \"on\": true, \"i\": 65535, \"note\": \"x\", \"raw\": [1]}, \
                {\"u\": 2, \"t\": 0.1, \"on\": false, \"i\": 2}, {\"t\": 2e-1, \"u\": 4, \"on\": true, \"i\": 3}]";
    let object = format!("{{\"gain\": 0.5, \"name\": \"arm\", \"active\": true, \"log\": {list}, \"other\": [1, 2]}}");
    let lines = list.trim_matches(['[', ']']).replace("}, ", "}\n");
    let columns = "time=t:s,voltage=u*on,current=int16(i)";
    for text in [list, &object, &format!("\u{feff} {list}\n"), &lines] {
        let record = one(text, columns);
        assert_eq!(record.samples().voltage, [1.0, 0.0, 4.0], "{text}");
        assert_eq!(record.measured()[0].unwrap(), [-1.0, 2.0, 3.0]);
        assert_eq!(record.source().lines.get(2), Some(3), "objects are counted from 1");
        assert!(record.source().notes.iter().any(|note| note.contains("\"raw\"")), "{:?}", record.source().notes);
    }
    let record = one(&object, "time=t:s,voltage=u*on*gain,current=i*gain*active");
    assert_eq!(record.samples().voltage, [0.5, 0.0, 2.0]);
    assert_eq!(record.measured()[0].unwrap()[1], 1.0);
    assert!(record.source().notes.iter().any(|note| note.contains("gain = 0.5, active = 1")));
    assert_eq!(one(&object, "time=t:s,voltage=u*gain,current=i").samples().voltage, [0.5, 1.0, 2.0]);
    let two = object.replace("[1, 2]", "[{\"t\": 1}]");
    assert!(refused(&two, columns).hint().to_string().contains("sheet log"));
    let chosen = ReadOptions { sheet: Some("log".to_owned()), ..options(columns) };
    assert_eq!(records(&two, &chosen).unwrap()[0].len(), 3);
    for (text, part) in [
        (list.replacen("\"u\": 2, ", "", 1), "line 2, column u: found an empty cell"),
        (list.replacen("\"u\": 2", "\"u\": null", 1), "line 2, column u: found an empty cell"),
        (list.replacen("\"u\": 2", "\"u\": \"off\"", 1), "line 2, column u: found \"off\""),
        (list.replace("\"u\"", "\"volts_in\""), "no column \"u\" in \"u*on\" for voltage; the heading has \"t\""),
        (list[..list.len() - 3].to_owned(), "not readable JSON"),
        ("[]".to_owned(), "holds no recording"),
        ("[1, 2]".to_owned(), "holds no recording"),
        ("{\"log\": [{\"t\": 1}, 2]}".to_owned(), "holds no recording"),
        (two.clone(), "holds 2 lists of objects: \"log\", \"other\""),
        ("[".repeat(100_000), "not readable JSON"),
    ] {
        assert!(refused(&text, columns).to_string().contains(part), "{text:.200}: {}", refused(&text, columns));
    }
    let error = refused(&object, "time=t:s,voltage=u*gains,current=i");
    assert!(error.to_string().contains("constants are gain, active") && error.line().is_none(), "{error}");
}

/// Returns the folder of real recordings.
fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("MOTORFIT_RECORDINGS").map(PathBuf::from);
    if folder.is_none() {
        let skips_fail = std::env::var_os("MOTORFIT_NO_SKIP").is_some();
        assert!(!skips_fail, "MOTORFIT_RECORDINGS is not set and skips are failures");
        println!("SKIPPED: set MOTORFIT_RECORDINGS to the folder of real recordings");
    }
    folder
}

fn files(folder: &Path) -> Vec<PathBuf> {
    files_of(folder, "csv")
}

fn files_of(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    paths.filter(|path| path.extension().is_some_and(|e| e == extension)).collect()
}

/// Returns the rows of numbers of a text, by splitting lines: the oracle of the readers.
fn numbers(path: &Path, separator: char) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let row = |line: &str| line.trim_end_matches(';').split(separator).map(|cell| cell.trim().parse().ok()).collect();
    text.lines().filter_map(row).collect()
}

fn is_near(ours: &[f64], theirs: impl Iterator<Item = f64>) {
    let theirs: Vec<f64> = theirs.collect();
    assert_eq!(ours.len(), theirs.len());
    assert!(ours.iter().zip(&theirs).all(|(a, b)| (a - b).abs() <= 1e-12 * b.abs().max(1e-3)));
}

#[test]
fn real_recordings_agree_with_simple_parsing() {
    let Some(folder) = folder() else { return };
    let tau = std::f64::consts::TAU;
    let mut read_so_far = 0;
    for path in files(&folder.join("labmrd-odrive")) {
        let record = read(&path, &options("time=timestep (8Hz):8kHz")).unwrap().pop().unwrap();
        let rows: Vec<Vec<f64>> =
            numbers(&path, ',').into_iter().filter(|r| r.iter().all(|v| v.is_finite()) && r[0] > 0.0).collect();
        is_near(&record.samples().time_s, rows.iter().map(|r| r[0] / 8000.0));
        is_near(&record.samples().voltage, rows.iter().map(|r| r[1]));
        is_near(record.measured()[1].unwrap(), rows.iter().map(|r| r[3] * tau));
        assert!(read(&path, &options("")).unwrap_err().hint().to_string().contains("8kHz"), "its own heading is wrong");
        read_so_far += 1;
    }
    for path in files(&folder.join("tutla53-dc-motor")) {
        let record = read(&path, &options("voltage=Commanded_PWM*12/7200:V")).unwrap().pop().unwrap();
        let rows = numbers(&path, ',');
        is_near(&record.samples().time_s, rows.iter().map(|r| r[0] * 1e-3));
        is_near(&record.samples().voltage, rows.iter().map(|r| r[2] / 600.0));
        is_near(record.measured()[1].unwrap(), rows.iter().map(|r| r[1] * tau / 60.0));
        read_so_far += 1;
    }
    for path in files(&folder.join("waam-ufjf-ensaio-frequencia")) {
        let columns = "current=Corrente:mA,speed=Velocidade:rad/s,voltage=Degrau:11.04*154/255..11.04*180/255";
        let record = read(&path, &options(columns)).unwrap().pop().unwrap();
        let rows = numbers(&path, ';');
        let first = rows[0].len() - 4;
        is_near(&record.samples().time_s, rows.iter().map(|r| r[first]));
        is_near(record.measured()[0].unwrap(), rows.iter().map(|r| r[first + 1] * 1e-3));
        let low = rows.iter().map(|r| r[first + 3]).fold(f64::INFINITY, f64::min);
        let volts = |flag: f64| 11.04 / 255.0 * if flag > low { 180.0 } else { 154.0 };
        is_near(&record.samples().voltage, rows.iter().map(|r| volts(r[first + 3])));
        read_so_far += 1;
    }
    for path in files_of(&folder.join("rhoban-bam-xl330"), "json") {
        let columns = "time=timestamp:s,speed=speed:rad/s,voltage=int16(load)/885*input_volts*torque_enable,\
                       load_torque=mass*9.80665*length*sin(position)";
        let record = read(&path, &options(columns)).unwrap().pop().unwrap();
        let file: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        let entries = file["entries"].as_array().unwrap();
        let number = |entry: &serde_json::Value, key: &str| entry[key].as_f64().unwrap();
        is_near(&record.samples().time_s, entries.iter().map(|entry| number(entry, "timestamp")));
        is_near(record.measured()[1].unwrap(), entries.iter().map(|entry| number(entry, "speed")));
        is_near(
            &record.samples().voltage,
            entries.iter().map(|entry| {
                let load = f64::from(number(entry, "load") as u16 as i16);
                load / 885.0 * number(entry, "input_volts") * f64::from(entry["torque_enable"].as_bool().unwrap())
            }),
        );
        let weight = 9.80665 * number(&file, "mass") * number(&file, "length");
        let torque = entries.iter().map(|entry| weight * number(entry, "position").sin());
        is_near(record.samples().torque.as_ref().unwrap(), torque);
        assert!(record.samples().voltage.iter().any(|v| v.abs() > 0.3), "{}", path.display());
        read_so_far += 1;
    }
    assert_eq!(read_so_far, 20 + 104 + 12 + 16);
}

/// Returns a file with changed bytes.
fn mutated(mut bytes: Vec<u8>, changes: &[(usize, u8, u8)]) -> Vec<u8> {
    for &(at, what, value) in changes {
        let at = at % (bytes.len() + 1);
        match what % 6 {
            0 if at < bytes.len() => bytes[at] = value,
            1 => bytes.insert(at, value),
            2 if at < bytes.len() => {
                bytes.remove(at);
            }
            3 => bytes.truncate(at),
            4 => {
                let end = (at + usize::from(value)).min(bytes.len());
                let copy = bytes[at..end].to_vec();
                bytes.splice(at..at, copy);
            }
            _ => bytes.splice(at..at, *b"nan").for_each(drop),
        }
    }
    bytes
}

const SEEDS: [&str; 6] = [
    "time_s,voltage_V,current_A,speed_rad_s\n0,0,0,0\n0.001,10.5,0.25,1.5\n0.002,10.5,0.5,3\n0.003,0,1e-3,-4.5\n",
    "%t,u,w\n%[s],[V],[rpm]\nnan,nan,nan;\n1,0,0;\n2,5,0.5;\n3,5,0.75;\n0,0,0;\n0,0,0;\n",
    "\u{feff}Tempo [ms];Spannung (V);\"Strom (mA)\"\r\n0;0,5;1,5\r\n1;0,5;2\r\n2;1;2,5\r\n",
    "Logger\nt u position\ns V deg\n0.0  1 0\n0.1  1 5\n0.2  2 10\n",
    "{\"m\": 2, \"log\": [{\"t\": 0, \"u\": 1, \"w\": 0}, {\"t\": 0.1, \"u\": 2, \"w\": 1}, {\"t\": 0.2, \"u\": 1, \"w\": true}]}",
    "14:03:00.000 -> t:0 u:0 w:19\nboot\n14:03:00.010 -> t:1 u:2 w:-13\n14:03:00.018 -> t:2 u:3 w:2\n",
];

proptest! {
    // 50,000 formulas, and 50,000 damaged files with and without column names.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(50_000) })]

    #[test]
    fn any_formula_is_read_or_refused(
        words in proptest::collection::vec(
            proptest::sample::select(vec![
                "t", "u", "w", "\"i,x\"", "#3", "#9", "position", "voltage", "sin", "int16", "cumsum", "(", "(", ")", ")",
                "+", "-", "*", "/", "^", ":", "V", "..", "2", "1e9", ".", "\"", " ", ",", "=", "load_torque=", "ü",
            ]),
            1..14,
        ),
    ) {
        let text = "t,u,\"i,x\",w\n0,0,1,2\n0.1,1,2,3\n0.2,3,1,2\n";
        if let Ok(columns) = parse_columns(&format!("position=w:rad,current=#3,speed=w/2,voltage={}", words.concat())) {
            match read_bytes(text.as_bytes(), None, &ReadOptions { columns, ..ReadOptions::default() }) {
                Ok(records) => prop_assert!(records[0].samples().voltage.iter().all(|v| v.is_finite())),
                Err(error) => prop_assert!(!error.hint().is_empty()),
            }
        }
    }

    #[test]
    fn damaged_files_are_read_completely_or_rejected(
        seed in 0..SEEDS.len(),
        changes in proptest::collection::vec((any::<usize>(), any::<u8>(), any::<u8>()), 1..8),
        named in 0..3_usize,
    ) {
        let bytes = mutated(SEEDS[seed].as_bytes().to_vec(), &changes);
        let columns = [
            "",
            "time=#1:8kHz,voltage=#2*12/255:V,speed=#3:rpm",
            "time=cumsum(#1)/100,voltage=int16(#2)*12/(#3-1),position=#3:turns,load_torque=sin(position)*#2",
        ][named];
        for (gaps, bad_rows) in [(Gaps::Error, BadRows::Error), (Gaps::Split, BadRows::Error), (Gaps::Error, BadRows::Skip)] {
            match read_bytes(&bytes, None, &ReadOptions { gaps, bad_rows, ..options(columns) }) {
                Ok(records) => for record in records {
                    let samples = record.samples();
                    prop_assert!(samples.time_s.windows(2).all(|t| t[1] > t[0]));
                    let outputs = record.measured().into_iter().flatten();
                    prop_assert!(outputs.chain([record.input()]).all(|s| s.len() == record.len() && s.iter().all(|v| v.is_finite())));
                    // Samples and lines correspond one to one, except for lines that are reported as left out.
                    let lines = &record.source().lines;
                    prop_assert_eq!(lines.len(), record.len());
                },
                Err(error) => {
                    prop_assert!(!error.hint().is_empty());
                    prop_assert!(!error.to_string().chars().any(motorfit::text::is_unsafe));
                }
            }
        }
    }
}
