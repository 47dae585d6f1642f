//! Files of SysId and frc-characterization.

use super::super::cells::Cells;
use super::super::sysid::{is_sysid, sysid};
use motorfit_core::Error;

const SIMPLE: &[u8] = include_bytes!("../../../../tests/golden/formats/sysid_simple.json");
const DRIVETRAIN: &[u8] = include_bytes!("../../../../tests/golden/formats/sysid_drivetrain.json");
const OLD: &[u8] = include_bytes!("../../../../tests/golden/formats/frc_characterization.json");

fn row(cells: &Cells, at: usize) -> (u64, Vec<&str>) {
    (cells.rows[at].0, cells.rows[at].1.iter().map(String::as_str).collect())
}

#[test]
fn one_motor() {
    let tests = sysid(SIMPLE).unwrap();
    assert_eq!(tests.iter().map(|t| t.name.as_str()).collect::<Vec<_>>(), ["slow-backward", "fast-forward"]);
    let slow = &tests[0];
    assert_eq!(row(slow, 0), (1, vec!["time [s]", "voltage [V]", "position [turns]", "speed [turns/s]"]));
    assert_eq!(row(slow, 1), (2, vec!["5.5", "-0.25", "1", "-0.1"]));
    assert_eq!(row(slow, 2), (3, vec!["5.51", "-0.3", "0.999", "-0.30000000000000004"]));
    assert_eq!(row(slow, 3), (4, vec!["5.52", "-0.35", "0.99", "-1e-7"]));
    assert_eq!(row(&tests[1], 2), (3, vec!["10.005", "7", "0.0125", "2.5"]));
    let notes = slow.notes.join("\n");
    assert!(notes.contains("turns of the output shaft"), "{notes}");
    assert!(notes.contains("Radians (6.283185307179586 per turn)"), "{notes}");
    assert!(notes.contains("slow-forward is missing") && notes.contains("fast-backward is empty"), "{notes}");
}

#[test]
fn two_sides_stay_in_turns_whatever_the_unit() {
    let tests = sysid(DRIVETRAIN).unwrap();
    assert_eq!(tests.len(), 4);
    let expected = [
        "time [s]",
        "left voltage [V]",
        "right voltage [V]",
        "left position [turns]",
        "right position [turns]",
        "left speed [turns/s]",
        "right speed [turns/s]",
        "gyro angle [rad]",
        "gyro rate [rad/s]",
    ];
    assert_eq!(row(&tests[0], 0), (1, expected.to_vec()));
    assert_eq!(row(&tests[0], 2).1, ["1.005", "0.51", "0.61", "0.001", "0.101", "0.151", "0.161", "0.011", "0.001"]);
    assert_eq!(row(&tests[3], 1).1[1], "-6");
}

#[test]
fn the_old_format_stores_magnitudes_of_voltages() {
    let tests = sysid(OLD).unwrap();
    assert_eq!(tests.len(), 2);
    assert_eq!(row(&tests[0], 2).1, ["41.52", "0.124", "0.501", "0.1"]);
    assert_eq!(row(&tests[1], 1).1, ["47.6", "0", "0.5", "0"]);
    assert_eq!(row(&tests[1], 2).1, ["47.62", "-0.124", "0.499", "-0.1"]);
    let notes = tests[1].notes.join("\n");
    assert!(notes.contains("sign of the commanded speed") && notes.contains("\"track-width\""), "{notes}");
    let drivetrain = String::from_utf8_lossy(OLD).replace("Elevator", "Drivetrain");
    let tests = sysid(drivetrain.as_bytes()).unwrap();
    assert_eq!(row(&tests[1], 2).1, ["47.62", "-0.124", "-0.124", "0.499", "0.499", "-0.1", "-0.1", "0"]);
    assert_eq!(row(&tests[1], 0).1[7], "gyro angle [rad]");
}

#[test]
fn the_kind_of_file_is_recognized() {
    assert!([SIMPLE, DRIVETRAIN, OLD].into_iter().all(is_sysid));
    assert!(is_sysid(b"\xef\xbb\xbf {\"sysid\":true"));
    for other in [&b""[..], b"time_s,voltage_V\n0,1\n", b"{\"a\": 1}", b"[\"sysid\"]", b"\xff\xfe{"] {
        assert!(!is_sysid(other));
    }
}

fn refused(text: &str) -> Error {
    sysid(text.as_bytes()).unwrap_err()
}

#[test]
fn errors_name_test_and_row() {
    let simple = String::from_utf8_lossy(SIMPLE).into_owned();
    let broken = |from: &str, to: &str| {
        assert!(simple.contains(from), "{from}");
        refused(&simple.replacen(from, to, 1)).to_string()
    };
    let three = broken("-0.3,", "");
    assert_eq!(three, "test slow-backward, row 2: found 3 numbers, expected 4");
    assert!(broken("-0.3,", "-0.3, 1,").contains("row 2: found 5 numbers, expected 4"));
    let null = broken("0.0125", "null");
    assert_eq!(null, "test fast-forward, row 2: found null as value 3, expected a finite number");
    assert!(broken("0.0125", "\"a\"").contains("the text \"a\""));
    assert!(broken("[10.0, 7.0, 0.0, 0.0]", "7").contains("row 1: found 7, expected a list of 4 numbers"));
    assert!(
        broken("\"sysid\": true,", "").contains("found 4 numbers, expected 10, as a file without the key \"sysid\"")
    );
    assert!(broken("[]", "{}").contains("test fast-backward: found an object"));
    assert!(broken("Radians", "Furlongs").contains("\"Furlongs\", expected Meters, Feet"));
    assert!(broken("\"units\"", "\"unit\"").contains("found nothing as \"units\""));
    assert!(broken("6.283185307179586", "0").contains("found 0 as \"unitsPerRotation\""));
    assert!(broken("\"Simple\"", "5").contains("found 5 as \"test\""));
    assert!(broken("6.283185307179586", "NaN").contains("is not readable JSON"));
    assert!(
        refused("{\"fast\": []}").to_string().contains("is not a file of SysId: found \"fast\", expected slow-forward")
    );
    assert!(refused("{}").to_string().contains("found nothing"));
    assert!(refused("[1]").to_string().contains("found a list"));
    assert!(refused("").to_string().contains("is not readable JSON"));
    assert!(refused(&"[".repeat(100_000)).to_string().contains("recursion"));
    let empty = r#"{"slow-forward": [], "test": "Arm", "units": "Degrees", "unitsPerRotation": 360, "sysid": true}"#;
    assert!(refused(empty).to_string().contains("holds no samples: test slow-forward is empty"));
    for at in 0..SIMPLE.len() - 2 {
        assert!(sysid(&SIMPLE[..at]).is_err(), "cut at {at}");
    }
}
