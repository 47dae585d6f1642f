//! The JSON files of WPILib's tool SysId and of its predecessor frc-characterization.
//!
//! A file holds four tests: the voltage ramps `slow-forward` and `slow-backward`, the voltage steps `fast-forward` and
//! `fast-backward`. Each is a list of rows of numbers; `test` names the mechanism:
//!
//! * SysId (the key `sysid` is present), one motor: time, voltage, position, speed.
//! * SysId, `Drivetrain` and `Drivetrain (Angular)`: time, voltages, positions and speeds, each left before right, then
//!   angle and rate of the gyro.
//! * frc-characterization, any mechanism: time, battery voltage, commanded speed as a fraction of full speed, then
//!   voltages, positions and speeds, each left before right, and the angle of the gyro. A single motor has the same values
//!   on both sides. The voltages are magnitudes; they are given the sign of the commanded speed. (If the drivetrain turned
//!   on the spot, which the file does not record, the left side has the opposite sign.)
//!
//! Times are in seconds. Positions are always rotations of the output shaft and speeds rotations per second, independently
//! of `units`: `units` is the unit of the results, which the tool obtains by multiplying the stored numbers by
//! `unitsPerRotation` (1, 360, 2π, or the circumference of the wheel). No conversion is needed here; both keys are only
//! checked. The angle of the gyro is in rad, its rate in rad/s.
//!
//! Sources, in the repository wpilibsuite/sysid: `docs/data-collection.md` ("all positions and velocities should be in
//! rotations of the output and rotations/sec of the output"), `AnalysisManager.cpp` (multiplies by `m_factor`, the
//! "rotation -> output units factor"; `units::radian_t{angleDelta}`), `Logger.cpp` (the values of `unitsPerRotation`),
//! `JSONConverter.cpp` (the old columns), `SysIdSetup.cpp` (gyro). In wpilibsuite/frc-characterization:
//! `logger_analyzer/data_analyzer.py` and `templates/Robot.java.mako`.

use super::cells::{Cells, number};
use motorfit_core::text::{alternatives, quoted};
use motorfit_core::{Error, Result};
use serde_json::{Map, Value};

const TESTS: [&str; 4] = ["slow-forward", "slow-backward", "fast-forward", "fast-backward"];
const UNITS: [&str; 6] = ["Meters", "Feet", "Inches", "Radians", "Rotations", "Degrees"];
const AGAIN: &str = "Save the file again from SysId, or save the tests as CSV.";

/// Headings of the columns of one motor.
const ONE_MOTOR: &[&str] = &["time [s]", "voltage [V]", "position [turns]", "speed [turns/s]"];
/// Headings of the columns of a drivetrain with two sides.
const TWO_SIDES: &[&str] = &[
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
/// Index of the commanded speed in a row of frc-characterization.
const OLD_COMMAND: usize = 2;

/// Layout of the rows of a file.
struct Layout {
    headings: &'static [&'static str],
    /// Index of each column in a row of the file.
    indices: &'static [usize],
    /// Number of values of a row.
    width: usize,
    /// True for files of frc-characterization.
    old: bool,
}

/// Returns true if the first 4096 bytes of a file have a key of SysId or frc-characterization.
#[must_use]
pub fn is_sysid(bytes: &[u8]) -> bool {
    let start = bytes.get(..4096).unwrap_or(bytes);
    let text = String::from_utf8_lossy(start);
    let text = text.trim_start_matches('\u{feff}').trim_start();
    let keys = TESTS.into_iter().chain(["sysid", "unitsPerRotation"]);
    text.starts_with('{') && keys.into_iter().any(|key| text.contains(&format!("\"{key}\"")))
}

/// Reads each test of a file that has rows as a table with the name of the test.
///
/// Row 1 is the heading; sample `n`, counted from 0, has the row number `n + 2`.
///
/// # Errors
/// Returns a `Data` error, with test and row, if the file is not JSON of this kind, a row does not have the expected numbers,
/// or no test has rows.
pub fn sysid(bytes: &[u8]) -> Result<Vec<Cells>> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let value: Value =
        serde_json::from_slice(bytes).map_err(|e| Error::data(format!("is not readable JSON: {e}"), AGAIN))?;
    let Value::Object(file) = value else {
        return Err(Error::data(format!("found {}, expected a JSON object with tests", described(&value)), AGAIN));
    };
    if !TESTS.iter().any(|test| file.contains_key(*test)) {
        let keys: Vec<String> = file.keys().take(5).map(|key| quoted(key)).collect();
        let found = if keys.is_empty() { "nothing".to_owned() } else { keys.join(", ") };
        let message = format!("is not a file of SysId: found {found}, expected {}", alternatives(&TESTS));
        return Err(Error::data(message, AGAIN));
    }
    let layout = layout(&file)?;
    let mut notes = vec![unit_note(&file)?];
    if layout.old {
        notes.push("voltages are given the sign of the commanded speed; the file has magnitudes".to_owned());
    }
    let mut tests = Vec::new();
    for test in TESTS {
        match file.get(test) {
            None | Some(Value::Null) => notes.push(format!("test {test} is missing")),
            Some(Value::Array(rows)) if rows.is_empty() => notes.push(format!("test {test} is empty")),
            Some(Value::Array(rows)) => tests.push(table(test, rows, &layout)?),
            Some(other) => {
                let message = format!("test {test}: found {}, expected a list of rows", described(other));
                return Err(Error::data(message, AGAIN));
            }
        }
    }
    if tests.is_empty() {
        let message = format!("holds no samples: {}", notes[notes.len() - TESTS.len()..].join(", "));
        return Err(Error::data(message, "Run the tests again; the robot sends the samples when it is disabled."));
    }
    let known = |key: &str| TESTS.contains(&key) || ["test", "units", "unitsPerRotation", "sysid"].contains(&key);
    let others = file.iter().filter(|(key, value)| value.is_array() && !known(key)).take(5);
    notes.extend(others.map(|(key, _)| format!("{} is not one of the four tests and is not used", quoted(key))));
    for test in &mut tests {
        test.notes.clone_from(&notes);
    }
    Ok(tests)
}

/// Returns the layout of the rows of a file, by its mechanism and its tool.
fn layout(file: &Map<String, Value>) -> Result<Layout> {
    let mechanism = text(file, "test", "the mechanism, such as \"Simple\" or \"Drivetrain\"")?;
    let two_sides = mechanism.starts_with("Drivetrain");
    let old = !file.contains_key("sysid");
    let (indices, width): (&[usize], usize) = match (old, two_sides) {
        (false, false) => (&[0, 1, 2, 3], 4),
        (false, true) => (&[0, 1, 2, 3, 4, 5, 6, 7, 8], 9),
        (true, false) => (&[0, 3, 5, 7], 10),
        // The files of frc-characterization have no rate of the gyro.
        (true, true) => (&[0, 3, 4, 5, 6, 7, 8, 9], 10),
    };
    let headings = &(if two_sides { TWO_SIDES } else { ONE_MOTOR })[..indices.len()];
    Ok(Layout { headings, indices, width, old })
}

/// Checks the unit of results and its factor, and returns the note that they are not used.
fn unit_note(file: &Map<String, Value>) -> Result<String> {
    let unit = text(file, "units", &alternatives(&UNITS))?;
    if !UNITS.contains(&unit) {
        let message = format!("found \"units\": {}, expected {}", quoted(unit), alternatives(&UNITS));
        return Err(Error::data(message, "Correct the unit in the file."));
    }
    let factor = file.get("unitsPerRotation");
    match factor.and_then(Value::as_f64).filter(|factor| *factor > 0.0 && factor.is_finite()) {
        Some(factor) => Ok(format!(
            "positions and speeds are in turns of the output shaft, as recorded; the file's unit {unit} ({} per turn) \
             is not used",
            number(factor)
        )),
        None => {
            let found = factor.map_or("nothing".to_owned(), described);
            let message = format!("found {found} as \"unitsPerRotation\", expected a number above 0");
            Err(Error::data(message, "Correct it in the file: 1 where \"units\" is \"Rotations\"."))
        }
    }
}

/// Returns the text of a key; `expected` describes it in the error if it is missing or not a text.
fn text<'a>(file: &'a Map<String, Value>, key: &str, expected: &str) -> Result<&'a str> {
    file.get(key).and_then(Value::as_str).ok_or_else(|| {
        let found = file.get(key).map_or("nothing".to_owned(), described);
        let remedy = "Old files lack it; where their positions are rotations, add \
                      \"test\": \"Simple\", \"units\": \"Rotations\", \"unitsPerRotation\": 1.";
        Error::data(format!("found {found} as \"{key}\", expected {expected}"), remedy)
    })
}

/// Returns the rows of a test as a table.
fn table(test: &str, rows: &[Value], layout: &Layout) -> Result<Cells> {
    let heading = layout.headings.iter().map(|heading| (*heading).to_owned()).collect();
    let mut cells = Cells { name: test.to_owned(), rows: vec![(1, heading)], ..Cells::default() };
    for (counted, row) in (1..).zip(rows) {
        let wrong = |what: String| Error::data(format!("test {test}, row {counted}: {what}"), AGAIN);
        let Value::Array(row) = row else {
            return Err(wrong(format!("found {}, expected a list of {} numbers", described(row), layout.width)));
        };
        if row.len() != layout.width {
            let old =
                if layout.old { ", as a file without the key \"sysid\" is one of frc-characterization" } else { "" };
            return Err(wrong(format!("found {} numbers, expected {}{old}", row.len(), layout.width)));
        }
        let finite = |(position, value): (usize, &Value)| {
            let wrong = || wrong(format!("found {} as value {position}, expected a finite number", described(value)));
            value.as_f64().filter(|value| value.is_finite()).ok_or_else(wrong)
        };
        let values: Vec<f64> = (1..).zip(row).map(finite).collect::<Result<_>>()?;
        let negative = layout.old && values[OLD_COMMAND] < 0.0;
        let texts = layout.headings.iter().zip(layout.indices).map(|(heading, &at)| {
            let value = values[at];
            number(if negative && value > 0.0 && heading.ends_with("[V]") { -value } else { value })
        });
        cells.rows.push((counted + 1, texts.collect()));
    }
    Ok(cells)
}

/// Returns a description of a JSON value for a message.
fn described(value: &Value) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(value) => value.to_string(),
        Value::Number(value) => value.to_string(),
        Value::String(text) => format!("the text {}", quoted(text)),
        Value::Array(_) => "a list".to_owned(),
        Value::Object(_) => "an object".to_owned(),
    }
}
