//! Proves: variants of CSV give the same recording; faults of a file are reported with line and column; the time axis is
//! checked; real recordings are read as documented (with MOTORFIT_RECORDINGS).
//! Does not prove: fits of real recordings.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_possible_truncation, clippy::float_cmp, reason = "small numbers; exact equality is meant")]

use crate::support::{changed, m2_record};
use motorfit::Error;
use motorfit::record::{Quantity, ReadOptions, Record, parse_columns, read_bytes, read_recording, write_csv};
use proptest::prelude::*;
use std::path::Path;

fn read(text: &str) -> Result<Record, Error> {
    read_with(text, "")
}

fn read_with(text: &str, columns: &str) -> Result<Record, Error> {
    let options = ReadOptions { columns: parse_columns(columns)?, ..ReadOptions::default() };
    Ok(read_bytes(text.as_bytes(), None, &options)?.remove(0))
}

const CANONICAL: &str = "time_s,voltage_V,current_A,speed_rad_s\n0,0,0,0\n0.001,10.5,0.25,1.5\n0.002,10.5,0.5,3\n";

#[test]
fn csv_variants_give_the_same_recording() {
    let canonical = read(CANONICAL).unwrap();
    let semicolons = CANONICAL.replace(',', ";");
    let tau60 = std::f64::consts::TAU / 60.0;
    let variants = [
        CANONICAL.replace('\n', "\r\n"),
        CANONICAL.trim_end().to_owned(),
        semicolons.clone(),
        semicolons.replace('.', ","),
        CANONICAL.replace(',', "\t"),
        format!("\u{feff}{CANONICAL}"),
        format!("# recorded today, \"quoted\n% and more\n\n{CANONICAL}\n\n"),
        CANONICAL.replace('\n', ",\n"),
        CANONICAL.replace('\n', ",\n").replacen(",\n", "\n", 1),
        CANONICAL
            .replace("time_s,voltage_V,current_A,speed_rad_s", "t[s],U (V),Current (A),\"speed, measured (rad/s)\""),
        CANONICAL.replace("time_s,voltage_V,current_A,speed_rad_s", "Time (s),Motor Voltage [V],i_A,omega"),
        "t[ms],voltage_mV,Current (mA),n_extra,speed_rad_s\n0,0,0,7,0\n1,10500,250,7,1.5\n2,10500,500,7,3\n".to_owned(),
        format!(
            "time_s,voltage_V,current_A,Motor_Speed(RPM)\n0,0,0,0\n0.001,10.5,0.25,{}\n0.002,10.5,0.5,{}\n",
            1.5 / tau60,
            3.0 / tau60
        ),
        CANONICAL.replace("0.5,3", " 0.5 , 3.0e0 "),
        CANONICAL.replace('\n', "\r"),
        CANONICAL.replace('\n', ";\n"),
        CANONICAL
            .replace("speed_rad_s\n", "speed_rad_s,T,speed_ref\n")
            .replace("0,0,0,0\n", "0,0,0,0,1,1\n")
            .replace("1.5\n", "1.5,1,1\n")
            .replace("0.5,3\n", "0.5,3,1,1\n"),
    ];
    for text in &variants {
        let record = read(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        for (ours, theirs) in [
            (&record.samples().time_s, &canonical.samples().time_s),
            (&record.samples().voltage, &canonical.samples().voltage),
        ]
        .into_iter()
        .map(|(a, b)| (a.as_slice(), b.as_slice()))
        .chain(record.measured().map(Option::unwrap).into_iter().zip(canonical.measured().map(Option::unwrap)))
        {
            // Unit conversion is one multiplication.
            assert!(
                ours.iter().zip(theirs).all(|(a, b)| (a - b).abs() <= 1e-15 * b.abs().max(1.0)),
                "{text}\n{ours:?}"
            );
        }
    }
}

#[test]
fn columns_can_be_named() {
    let text = "Tempo;Corrente;Velocidade;Degrau\n0;1000;60;0\n0,001;2000;61;5\n";
    let record = read_with(text, "time=Tempo:s,current=Corrente:mA,speed=Velocidade:rpm,voltage=Degrau").unwrap();
    assert_eq!(record.measured()[0].unwrap(), [1.0, 2.0]);
    assert!((record.measured()[1].unwrap()[0] - std::f64::consts::TAU).abs() < 1e-12);
    assert_eq!(record.samples().voltage, [0.0, 5.0]);
    let columns = &record.source().columns;
    assert!(columns.iter().any(|c| c.quantity == Quantity::Current && c.unit == "mA" && c.unit_named));
    assert!(columns.iter().any(|c| c.quantity == Quantity::Voltage && c.unit == "V" && !c.unit_named));
    // A heading may contain a colon; columns that are not named are still recognized.
    let odd = CANONICAL.replace("voltage_V", "ch:1");
    assert_eq!(read_with(&odd, "voltage=ch:1").unwrap().samples().voltage[1], 10.5);
    for (columns, part) in [
        ("voltage=Spannung", "no column \"Spannung\""),
        ("current=current_A:furlong", "unit \"furlong\""),
        ("power=current_A", "\"power\" is not a quantity"),
        ("current", "names no column"),
        ("current=a,current=b", "twice"),
    ] {
        let error = read_with(CANONICAL, columns).unwrap_err();
        assert!(error.to_string().contains(part), "{error}");
        assert!(!error.hint().is_empty());
    }
    let both = CANONICAL.replace("voltage_V", "current_1_A").replace("current_A", "current_2_A");
    assert!(read(&both).unwrap_err().to_string().contains("look like current"));
}

#[test]
fn faults_are_reported_with_line_and_column() {
    let rows = |middle: &str| CANONICAL.replace("0.001,10.5,0.25,1.5", middle);
    for (text, line, part) in [
        (rows("0.001,10.5,x,1.5"), Some(3), "column current_A: found \"x\", expected a number"),
        (rows("0.001,10.5,,1.5"), Some(3), "found an empty cell"),
        (rows("0.001,10.5,NaN,1.5"), Some(3), "found \"NaN\", not a number"),
        (rows("0.001,10.5,-inf,1.5"), Some(3), "infinite"),
        (rows("0.001,10.5,1e400,1.5"), Some(3), "infinite or too large"),
        (rows("0.001,10.5,1e308,1.5"), Some(3), "expected a finite value up to 1e9"),
        (rows("0.001,10.5,0.25"), Some(3), "found 3 cells, expected 4"),
        (rows("0.001,10,5,0.25,1.5"), Some(3), "found 5 cells"),
        (rows("0,10.5,0.25,1.5"), Some(3), "time is repeated"),
        (rows("-0.001,10.5,0.25,1.5"), Some(3), "time goes back"),
        (rows("0.001,10.5,\u{1},1.5"), Some(3), "control character"),
        (format!("{CANONICAL}0.003,10.5,1,4\n0.006,10.5,1,4\n"), Some(6), "gap in time"),
        (format!("{CANONICAL}0.003,10"), Some(5), "cut off"),
        (format!("# a comment\n\n{}", rows("0.001,10.5,x,1.5")), Some(5), "found \"x\""),
        (String::new(), None, "is empty"),
        ("# nothing\n".to_owned(), None, "only comments"),
        ("time_s,voltage_V,current_A,speed_rad_s\n".to_owned(), None, "found 0 rows"),
        ("time_s,voltage_V,current_A,speed_rad_s\n0,0,0,0\n".to_owned(), None, "found 1 row of"),
        ("0,0,0,0\n0.001,0,0,0\n".to_owned(), Some(1), "found numbers, expected a heading"),
        ("time_s,current_A\n0,0\n".to_owned(), Some(1), "no column for voltage_V"),
        ("time_s,voltage_V\n0,0\n".to_owned(), Some(1), "current_A or speed_rad_s"),
        (format!("time_s,voltage_V,current_A,speed_rad_s\n{}", "1".repeat(100_000)), Some(2), "bytes long"),
    ] {
        let error = read(&text).unwrap_err();
        assert_eq!(error.line(), line, "{error}");
        assert!(error.to_string().contains(part), "{error} lacks {part}");
        assert!(!error.hint().is_empty());
    }
    for bytes in [&b"\xff\xfet\0i\0"[..], b"\x7fELF\0\0\0", b"\xef\xbb\xbf"] {
        assert!(read_bytes(bytes, None, &ReadOptions::default()).is_err());
    }
}

#[test]
fn time_is_a_grid_or_a_table() {
    let m2 = m2_record();
    assert!(m2.steps().step_index.is_empty() && (m2.period_s() - 0.001).abs() < 1e-18);
    let irregular = changed(&m2, |s| s.time_s.iter_mut().enumerate().for_each(|(n, t)| *t += 2e-4 * (n as f64).sin()));
    let steps = irregular.steps();
    assert_eq!(steps.step_index.len(), 3001);
    assert!(steps.jitter > 0.15 && steps.jitter < 0.25, "{}", steps.jitter);
    // The tabulated steps add up to the times within 5e-4 periods, without drift.
    let mut t = irregular.samples().time_s[0];
    for (n, expected) in irregular.samples().time_s.iter().enumerate() {
        assert!((t - expected).abs() < 0.51e-6, "{n}: {t} {expected}");
        t += steps.step(n);
    }
}

#[test]
fn writing_and_reading_keeps_every_digit() {
    let record = m2_record();
    let again = read(&write_csv(&record)).unwrap();
    assert_eq!(again.measured(), record.measured());
    assert_eq!(again.samples().voltage, record.samples().voltage);
    assert!(write_csv(&record).lines().nth(1010).unwrap().starts_with("1.009,"), "times are not 1.0089999999999999");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let _ = read_bytes(&bytes, None, &ReadOptions::default());
    }

    #[test]
    fn no_text_panics(
        heading in "[tuiw\u{b5}]?[a-z_ (),;\"\\[\\]/]{0,40}",
        body in "[-0-9.,;eE\t\r\n\"naif# %]{0,200}",
    ) {
        for head in [heading.as_str(), "t,u,i,w", "t;u;i;w"] {
            if let Err(error) = read(&format!("{head}\n{body}")) {
                prop_assert!(!error.hint().is_empty());
                prop_assert!(!error.to_string().chars().any(motorfit::text::is_unsafe));
            }
        }
    }
}

#[test]
fn real_recordings() {
    let Some(folder) = std::env::var_os("MOTORFIT_RECORDINGS") else {
        assert!(
            std::env::var_os("MOTORFIT_NO_SKIP").is_none(),
            "MOTORFIT_RECORDINGS is not set and skips are failures"
        );
        println!("SKIPPED: set MOTORFIT_RECORDINGS to the folder of real recordings");
        return;
    };
    let columns = parse_columns("time=Tempo:s,current=Corrente:mA,speed=Velocidade:rad/s,voltage=Degrau:V").unwrap();
    let folder = Path::new(&folder).join("waam-ufjf-ensaio-frequencia");
    let mut read = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "csv") {
            continue;
        }
        let record = read_recording(&path, &columns).unwrap_or_else(|e| panic!("{e}"));
        assert!((record.period_s() - 0.001).abs() < 1e-12 && record.len() > 9000, "{}", path.display());
        read += 1;
    }
    assert_eq!(read, 12);
}
