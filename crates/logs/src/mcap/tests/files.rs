//! MCAP recordings written by the Python packages mcap, mcap-ros2-support and rosbags.

use super::super::super::log::{Log, Series};
use super::super::open;
use std::io::Cursor;

pub(super) const RECORDING: &[u8] = include_bytes!("../../../../../tests/golden/formats/recording.mcap");
pub(super) const LZ4: &[u8] = include_bytes!("../../../../../tests/golden/formats/lz4.mcap");
pub(super) const UNCOMPRESSED: &[u8] = include_bytes!("../../../../../tests/golden/formats/uncompressed.mcap");
const TYPES: &[u8] = include_bytes!("../../../../../tests/golden/formats/types.mcap");
const JSON: &[u8] = include_bytes!("../../../../../tests/golden/formats/json.mcap");
const CLOCKS: &[u8] = include_bytes!("../../../../../tests/golden/formats/clocks.mcap");
const JOINTS: &[u8] = include_bytes!("../../../../../tests/golden/formats/joints.mcap");
pub(super) const OTHERS: &[u8] = include_bytes!("../../../../../tests/golden/formats/others.mcap");
const ROSBAGS: &[u8] = include_bytes!("../../../../../tests/golden/formats/rosbags.mcap");

/// Returns the columns of the recording: time, voltage, current and speed.
fn recording() -> [Vec<f64>; 4] {
    let rows = include_str!("../../../../../tests/golden/formats/recording.csv").lines().skip(1);
    let mut columns = [const { Vec::new() }; 4];
    for row in rows {
        for (column, text) in columns.iter_mut().zip(row.split(',')) {
            column.push(text.parse().unwrap());
        }
    }
    columns
}

pub(super) fn log(bytes: &[u8]) -> Box<dyn Log> {
    open(Box::new(Cursor::new(bytes.to_vec()))).unwrap()
}

/// Returns the time and the values of a field.
fn column(log: &mut dyn Log, channel: &str, path: &str) -> (Vec<f64>, Vec<f64>) {
    let at = log.channels().iter().position(|c| c.name == channel).unwrap();
    let field = log.channels()[at].fields.iter().position(|f| f.path == path).unwrap();
    let [Series { time_s, columns }] = &log.read(&[(at, vec![field])]).unwrap()[..] else { panic!() };
    assert_eq!(time_s.len() as u64, log.channels()[at].count);
    assert_eq!(log.channels()[at].span_s, Some([time_s[0], time_s[time_s.len() - 1]]));
    (time_s.clone(), columns[0].clone())
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

fn paths(log: &dyn Log, channel: &str) -> Vec<String> {
    let fields = &log.channels().iter().find(|c| c.name == channel).unwrap().fields;
    fields.iter().map(|field| field.path.clone()).collect()
}

#[test]
fn recordings_in_all_compressions() {
    let [time, voltage, current, speed] = recording();
    for (bytes, count) in [(RECORDING, 401), (LZ4, 100), (UNCOMPRESSED, 100)] {
        let mut log = log(bytes);
        let names: Vec<&str> = log.channels().iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["/motor/voltage", "/motor/current", "/joint_states"]);
        let notes = [
            "topic \"/joint_states\": the times are those of the headers, header.stamp",
            "topics \"/motor/voltage\", \"/motor/current\": the times are those of logging, later than those of the headers by \
             the latency of the messages",
        ];
        assert_eq!(log.notes(), notes);
        assert_eq!(paths(&*log, "/joint_states"), ["header.stamp.sec", "header.stamp.nanosec", "velocity/shaft"]);
        let units: Vec<Option<&str>> = log.channels()[2].fields.iter().map(|f| f.unit.as_deref()).collect();
        assert_eq!(units, [None, None, Some("rad/s")]);
        let expected = [("/motor/voltage", "data", &voltage), ("/motor/current", "data", &current)];
        for (channel, path, values) in expected.into_iter().chain([("/joint_states", "velocity/shaft", &speed)]) {
            let (t, v) = column(&mut *log, channel, path);
            assert_eq!(bits(&t), bits(&time[..count]));
            assert_eq!(bits(&v), bits(&values[..count]));
        }
    }
}

#[test]
fn several_requests_at_once() {
    let mut log = log(CLOCKS);
    let series = log.read(&[(2, vec![0]), (0, vec![]), (2, vec![0, 0]), (1, vec![0])]).unwrap();
    let [speed, none, twice, current] = &series[..] else { panic!() };
    assert_eq!((none.time_s.len(), none.columns.len()), (10, 0));
    assert_eq!(twice.columns, [speed.columns[0].clone(), speed.columns[0].clone()]);
    assert_eq!(current.time_s.len(), 100);
    assert_eq!(log.read(&[]).unwrap(), []);
    for wrong in [(3, vec![0]), (0, vec![1])] {
        assert!(log.read(&[wrong]).unwrap_err().to_string().contains("has no such field"));
    }
    let message = log.read(&[(1, vec![0; 1_000_000])]).unwrap_err().to_string();
    assert_eq!(message, "100000100 values are requested, expected at most 100000000");
}

#[test]
fn topics_have_their_own_clocks() {
    let [time, voltage, current, speed] = recording();
    let mut log = log(CLOCKS);
    assert_eq!(log.notes(), [""; 0]);
    let every = |values: &[f64], step: usize| values[..100].iter().step_by(step).copied().collect::<Vec<_>>();
    assert_eq!(column(&mut *log, "/motor/voltage", "data"), (every(&time, 10), every(&voltage, 10)));
    assert_eq!(column(&mut *log, "/motor/current", "data"), (every(&time, 1), every(&current, 1)));
    let late: Vec<f64> = (0..50).map(|k| format!("{}.{:03}", 0, 4 * k + 1).parse().unwrap()).collect();
    assert_eq!(column(&mut *log, "/motor/speed", "data"), (late, every(&speed, 2)));
}

#[test]
fn joints_by_name() {
    let mut log = log(JOINTS);
    let fields = ["header.stamp.sec", "header.stamp.nanosec", "position/wheel_left", "position/wheel_right"];
    let more = ["position/arm/tilt", "velocity/wheel_left", "velocity/wheel_right", "velocity/arm/tilt"];
    assert_eq!(paths(&*log, "/joint_states"), [fields, more].concat());
    let units: Vec<Option<&str>> = log.channels()[0].fields[2..].iter().map(|f| f.unit.as_deref()).collect();
    assert_eq!(units, [[Some("rad"); 3], [Some("rad/s"); 3]].concat());
    for (name, offset) in [("wheel_left", 1.0), ("wheel_right", 2.0), ("arm/tilt", 3.0)] {
        let (time, velocity) = column(&mut *log, "/joint_states", &format!("velocity/{name}"));
        let (_, position) = column(&mut *log, "/joint_states", &format!("position/{name}"));
        assert_eq!(time, (0..12).map(|k| f64::from(k) / 100.0).collect::<Vec<_>>());
        for k in 0..12 {
            let expected = if k == 7 && name == "wheel_right" { f64::NAN } else { offset + k as f64 / 10.0 };
            assert_eq!(velocity[k].to_bits(), expected.to_bits(), "{name} {k}");
            let expected = if k == 4 { f64::NAN } else { -expected };
            assert!(position[k].to_bits() == expected.to_bits() || position[k].is_nan() && expected.is_nan());
        }
    }
    // Headers without a time, and joints without names.
    assert_eq!(log.notes()[0], "topic \"/joint_states\": the times are those of the headers, header.stamp");
    assert!(log.notes()[1].starts_with("topic \"/unnamed\": the times are those of logging"), "{:?}", log.notes());
    let (time, velocity) = column(&mut *log, "/unnamed", "velocity/0");
    assert_eq!(time, (0..12).map(|k| f64::from(k) / 100.0).collect::<Vec<_>>());
    assert_eq!(velocity, (0..12).map(f64::from).collect::<Vec<_>>());
}

#[test]
fn all_types_in_both_byte_orders() {
    let mut log = log(TYPES);
    let k: Vec<f64> = (0..6).map(f64::from).collect();
    let of = |f: &dyn Fn(f64) -> f64| k.iter().map(|&k| f(k)).collect::<Vec<f64>>();
    let from = |first: f64, f: &dyn Fn(f64) -> f64| of(&|k| if k < first { f64::NAN } else { f(k) });
    let expected = [
        ("on", of(&|k| k % 2.0)),
        ("i8", of(&|k| -k)),
        ("u8", of(&|k| 200.0 + k)),
        ("octet", k.clone()),
        ("letter", of(&|_| 250.0)),
        ("i16", of(&|k| -300.0 - k)),
        ("u16", of(&|k| 60000.0 + k)),
        ("i32", of(&|k| k - 2_147_483_648.0)),
        ("u32", of(&|k| 4_294_967_295.0 - k)),
        ("i64", of(&|k| k - 9_007_199_254_740_992.0)),
        ("u64", of(&|k| 9_007_199_254_740_992.0 - k)),
        ("f32", of(&|_| f64::from(0.1_f32))),
        ("f64", of(&|k| k / 3.0)),
        ("axis[0]", k.clone()),
        ("axis[1]", of(&|_| 0.1)),
        ("axis[2]", of(&|k| -k)),
        ("few[0]", vec![f64::NAN, 0.0, 0.0, 0.0, 0.0, f64::NAN]),
        ("few[3]", vec![f64::NAN, f64::NAN, f64::NAN, f64::NAN, 3.0, f64::NAN]),
        ("many[0]", from(1.0, &|_| 0.0)),
        ("many[4]", from(5.0, &|_| 4.0 / 7.0)),
        ("inner.level", k.clone()),
        ("inner.value", of(&|k| k / 9.0)),
        ("pair[1].level", of(&|k| k + 1.0)),
        ("pair[1].value", of(&|k| -0.5 * k)),
        ("list[1].value", vec![f64::NAN, f64::NAN, -1.0, f64::NAN, f64::NAN, -2.5]),
        ("time.sec", k.clone()),
        ("time.nanosec", of(&|_| 5.0)),
        ("span.sec", of(&|k| -k)),
        ("span.nanosec", of(&|_| 7.0)),
        ("last", of(&|_| 77.0)),
    ];
    for channel in ["/little", "/big"] {
        assert_eq!(paths(&*log, channel).len(), 40);
        for (path, values) in &expected {
            let (time, found) = column(&mut *log, channel, path);
            assert_eq!(time, (0..6).map(|k| f64::from(k) / 1000.0).collect::<Vec<_>>());
            for (found, value) in found.iter().zip(values) {
                assert!(
                    found.to_bits() == value.to_bits()
                        || found.abs() + value.abs() == 0.0
                        || found.is_nan() && value.is_nan(),
                    "{channel} {path}: {found}, expected {value}"
                );
            }
        }
    }
}

#[test]
fn json_with_and_without_a_schema() {
    let [time, voltage, current, speed] = recording();
    let mut log = log(JSON);
    let fields = ["voltage", "current", "motor.speed", "motor.on", "motor.limits[0]", "motor.limits[1]"];
    assert_eq!(paths(&*log, "/telemetry"), fields);
    for (path, values) in [("voltage", voltage), ("current", current), ("motor.speed", speed)] {
        let (t, v) = column(&mut *log, "/telemetry", path);
        assert_eq!(bits(&t), bits(&time[..120]));
        assert_eq!(bits(&v), bits(&values[..120]));
    }
    let on: Vec<f64> = (0..120).map(|k| f64::from(u8::from(k % 2 == 0))).collect();
    assert_eq!(column(&mut *log, "/telemetry", "motor.on").1, on);
    let (t, plain) = column(&mut *log, "/plain", "");
    assert_eq!(t[..2], [0.0005, 0.0025]);
    assert!(plain.iter().enumerate().all(|(k, &v)| if k == 5 {
        v.is_nan()
    } else {
        v.to_bits() == (k as f64).to_bits()
    }));
    let note =
        "topic \"/plain\": 1 of 120 messages cannot be read to the end (not valid JSON); their values are missing";
    assert_eq!(log.notes(), [note]);
}

#[test]
fn a_recording_of_another_writer() {
    let [time, voltage, ..] = recording();
    let mut log = log(ROSBAGS);
    assert_eq!(column(&mut *log, "/voltage", "data"), (time[..20].to_vec(), voltage[..20].to_vec()));
    let (t, z) = column(&mut *log, "/imu", "angular_velocity.z");
    assert_eq!((t, z), (time[..20].to_vec(), (0..20).map(|k| f64::from(k) / 3.0).collect()));
    assert_eq!(column(&mut *log, "/imu", "linear_acceleration_covariance[8]").1, [8.0; 20]);
}

#[test]
fn what_is_left_out_or_assumed_is_noted() {
    let mut log = log(OTHERS);
    let notes = [
        "topic \"/array\": messages are out of order and were sorted by time",
        "topic \"/wide\": members after a wide string are left out",
        "topic \"/short\": 1 of 8 messages cannot be read to the end (shorter than the definition); their values are missing",
        "left out topic \"/protobuf\": encoding \"protobuf\", expected cdr or json",
        "left out topic \"/ros1\": encoding \"ros1\", expected cdr or json",
        "left out topic \"/idl\": encoding cdr with a schema in \"ros2idl\", expected ros2msg",
        "left out topic \"/unknown\": schema \"a_msgs/msg/A\": type \"b_msgs/B\" is not defined",
        "left out topic \"/diagnostics\": diagnostics",
        "left out topic \"/words\": no numbers",
        "left out topic \"/silent\": no messages",
    ];
    assert_eq!(log.notes(), notes);
    let names: Vec<&str> = log.channels().iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["/wide", "/array", "/battery", "/short"]);
    let (time, data) = column(&mut *log, "/array", "data[0]");
    assert_eq!(time, (0..8).map(|k| f64::from(k) / 1e6).collect::<Vec<_>>());
    for (at, value) in data.iter().enumerate() {
        let k = (3 - at / 2) * 2 + at % 2;
        assert!(
            if k % 4 == 0 { value.is_nan() } else { value.to_bits() == (at as f64 / 2.0).to_bits() },
            "{at}: {value}"
        );
    }
    let battery = (0..8).map(|k| 12.5 + f64::from(k)).collect::<Vec<_>>();
    assert_eq!(column(&mut *log, "/battery", "voltage").1, battery);
    assert_eq!(column(&mut *log, "/battery", "current").1, (0..8).map(|k| -1.5 * f64::from(k)).collect::<Vec<_>>());
    assert_eq!(column(&mut *log, "/battery", "cell_voltage[1]").1, [5.0; 8]);
    assert_eq!(paths(&*log, "/wide"), ["before"]);
    let (_, y) = column(&mut *log, "/short", "y");
    let (_, z) = column(&mut *log, "/short", "z");
    assert_eq!(y, (0..8).map(|k| -f64::from(k)).collect::<Vec<_>>());
    assert!(z.iter().enumerate().all(|(k, z)| z.is_nan() == (k == 3)));
}
