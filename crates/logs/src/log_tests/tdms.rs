//! TDMS files written by npTDMS, and some written by hand and read by it.

use super::super::log::Log;
use super::open_tdms as open;
use super::tdms_built::{bytes_channel, segment};
use super::{channel, field, medium, names, recording, refused, units};

const RECORDING: &[u8] = include_bytes!("../../../../tests/golden/formats/recording.tdms");
const INTERLEAVED: &[u8] = include_bytes!("../../../../tests/golden/formats/interleaved.tdms");
const WAVEFORM: &[u8] = include_bytes!("../../../../tests/golden/formats/waveform.tdms");
const CHANGING: &[u8] = include_bytes!("../../../../tests/golden/formats/changing.tdms");
const SCALED: &[u8] = include_bytes!("../../../../tests/golden/formats/scaled.tdms");
const TYPES: &[u8] = include_bytes!("../../../../tests/golden/formats/types.tdms");

fn opened(bytes: &[u8]) -> Box<dyn Log> {
    open(medium(bytes)).unwrap()
}

fn message(bytes: &[u8]) -> String {
    let error = refused(open, bytes);
    assert!(error.hint().to_string().ends_with('.'));
    error.to_string()
}

/// Returns a file with a byte replaced.
fn with(bytes: &[u8], at: usize, value: u8) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes[at] = value;
    bytes
}

#[test]
fn recordings_of_either_layout_and_byte_order() {
    for bytes in [RECORDING, INTERLEAVED] {
        let mut log = opened(bytes);
        assert_eq!(names(&*log), ["motor: time_s, voltage_V, current_A, speed_rad_s"]);
        assert_eq!(units(&*log, "motor"), [Some("s"), Some("V"), Some("A"), Some("rad/s")]);
        assert_eq!(channel(&mut *log, "motor").columns, recording());
        assert_eq!(log.channels()[0].span_s, None);
        assert!(log.notes().is_empty());
        let [_, _, current, speed] = recording();
        let series = log.read(&[(0, vec![3, 2, 3]), (0, vec![]), (0, vec![2])]).unwrap();
        assert_eq!(series[0].columns, [speed.clone(), current.clone(), speed]);
        assert!(series[1].columns.is_empty() && series[1].time_s.is_empty());
        assert_eq!(series[2].columns, [current]);
        assert!(log.read(&[(1, vec![0])]).is_err() && log.read(&[(0, vec![4])]).is_err());
    }
    assert_eq!(opened(INTERLEAVED).constants(), [("supply_V".to_owned(), 24.0)]);
    let constants = [("on", 1.0), ("supply_V", 24.0), ("motor/gear_ratio", 12.0)].map(|(n, v)| (n.to_owned(), v));
    assert_eq!(opened(RECORDING).constants(), constants);
}

#[test]
fn waveforms_have_times() {
    let mut log = opened(WAVEFORM);
    // A waveform over a frequency has no times, like channels without properties.
    let mixed = ["mixed/a: a, c, magnitude", "mixed/b: b"];
    assert_eq!(names(&*log), [&["motor: voltage_V, current_A, speed_rad_s", "slow: temperature"], &mixed[..]].concat());
    let [time_s, voltage, current, speed] = recording();
    let motor = channel(&mut *log, "motor");
    assert_eq!(motor.columns, [voltage, current, speed]);
    assert_eq!(motor.time_s, time_s);
    let slow = channel(&mut *log, "slow");
    assert_eq!(slow.columns, [[0.0, 0.25, 0.5, 0.75, 1.0]]);
    // Starts 0.25 s later, with an offset of 0.5 s, at 512 samples per second.
    assert_eq!(slow.time_s, [0, 1, 2, 3, 4].map(|n| 0.75 + f64::from(n) / 512.0));
    assert_eq!(units(&*log, "slow"), [Some("°C")]);
    let mixed = channel(&mut *log, "mixed/a");
    assert_eq!(mixed.columns, [[1.0, 2.0, 3.0], [6.0, 7.0, 8.0], [9.0, 10.0, 11.0]]);
    assert_eq!(channel(&mut *log, "mixed/b").columns, [[4.0, 5.0]]);
    assert!(log.notes().is_empty());
}

#[test]
fn waveforms_without_a_common_start() {
    // The start of the slow group becomes unknown.
    let name = b"wf_start_time";
    let at = WAVEFORM.windows(name.len()).rposition(|window| window == name).unwrap() + name.len() + 4;
    let mut unknown = WAVEFORM.to_vec();
    unknown[at..at + 16].fill(0);
    let mut log = opened(&unknown);
    assert_eq!(log.notes(), ["some waveforms have no wf_start_time; all are assumed to start at the same time"]);
    assert_eq!(channel(&mut *log, "motor").time_s[1], 0.002);
    assert_eq!(channel(&mut *log, "slow").time_s[0], 0.5);
}

#[test]
fn waveforms_of_a_group_with_different_increments() {
    let name = b"wf_increment";
    let places = WAVEFORM.windows(name.len()).enumerate().filter(|(_, window)| window == name);
    let third = places.map(|(at, _)| at).nth(2).unwrap() + name.len() + 4;
    let mut changed = WAVEFORM.to_vec();
    changed[third..third + 8].copy_from_slice(&0.004_f64.to_le_bytes());
    let mut log = opened(&changed);
    let expected = ["motor/voltage_V: voltage_V, current_A", "motor/speed_rad_s: speed_rad_s"];
    assert_eq!(names(&*log)[..2], expected);
    assert_eq!(channel(&mut *log, "motor/speed_rad_s").time_s[3], 0.012);
}

#[test]
fn lists_of_objects_change() {
    let mut log = opened(CHANGING);
    assert_eq!(names(&*log), ["it's/a: a", "it's/b: b", "it's/c: c"]);
    assert_eq!(field(&mut *log, "it's/a", "a"), (0..19).map(f64::from).collect::<Vec<_>>());
    assert_eq!(field(&mut *log, "it's/b", "b"), (1..18).map(|n| f64::from(-n)).collect::<Vec<_>>());
    assert_eq!(field(&mut *log, "it's/c", "c"), [1.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    assert_eq!(units(&*log, "it's/a"), [Some("mV")]);
    assert_eq!(log.constants(), [("it's/mass".to_owned(), 0.5)]);
    assert_eq!(log.notes(), ["1 channel left out (it's/text): holds text"]);
}

#[test]
#[expect(clippy::cast_possible_truncation, reason = "the file holds the values as f32")]
fn scales_are_applied() {
    let mut log = opened(SCALED);
    assert_eq!(names(&*log), ["motor: stamp, voltage, current, speed, done"]);
    let reason = "has a scale of type \"Table\", expected Linear or Polynomial";
    assert_eq!(log.notes(), [format!("1 channel left out (motor/sensor): {reason}")]);
    let [time_s, voltage, current, speed] = recording();
    let motor = channel(&mut *log, "motor").columns;
    assert_eq!(motor[0], time_s);
    let counts = voltage.iter().map(|v| (v * 1000.0).round_ties_even());
    assert_eq!(motor[1], counts.map(|n| n * 0.001 + 0.25).collect::<Vec<_>>());
    let current = current.iter().map(|i| f64::from(*i as f32) * 0.5 + 1.0);
    assert_eq!(motor[2], current.map(|x| (0.25 * x - 2.0) * x + 0.5).collect::<Vec<_>>());
    assert_eq!(motor[3], (0..401).map(|n| f64::from(n) * 0.125).collect::<Vec<_>>());
    assert_eq!(motor[4], speed.iter().map(|w| f64::from(*w as f32)).collect::<Vec<_>>());
    assert_eq!(units(&*log, "motor"), [Some("s"), Some("V"), None, None, None]);
    assert!(log.constants().is_empty());
}

#[test]
fn all_types_of_numbers() {
    let mut log = opened(TYPES);
    assert_eq!(names(&*log), ["types: 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 25, 26, 33, stamp"]);
    let notes = [
        "1 channel left out (card/ai0): has raw DAQmx data",
        "2 channels left out (types/complex, types/double complex): holds complex numbers",
    ];
    assert_eq!(log.notes(), notes);
    let power = |exponent: i32| 2_f64.powi(exponent);
    let expected = [
        [-128.0, 127.0],
        [-32768.0, 32767.0],
        [-power(31), power(31) - 1.0],
        [-power(63), power(63)],
        [0.0, 255.0],
        [0.0, 65535.0],
        [0.0, power(32) - 1.0],
        [0.0, power(64)],
        [f64::from(0.1_f32), -2.5],
        [0.1, -2.5],
        [f64::from(0.1_f32), -2.5],
        [0.1, -2.5],
        [1.0, 0.0],
        [0.0, 0.75],
    ];
    assert_eq!(channel(&mut *log, "types").columns, expected);

    // The first time is unknown.
    let stamp = [[0; 7].as_slice(), &[0x80]].concat();
    let at = TYPES.windows(8).rposition(|window| window == stamp).unwrap();
    let mut unknown = TYPES.to_vec();
    unknown[at..at + 16].fill(0);
    let times = field(&mut *opened(&unknown), "types", "stamp");
    assert_eq!(times, [-3_800_000_001.25, 0.0]);
}

#[test]
fn channels_of_an_acquisition_card_and_others() {
    let bytes = [TYPES, &segment(14, &[bytes_channel("/'card'/'ai0'", 1)], 1), &[5]].concat();
    let mut log = opened(&bytes);
    assert_eq!(field(&mut *log, "card", "ai0"), [5.0]);
    assert_eq!(log.notes()[1], "channels lack the samples of segments with raw DAQmx data");
}

#[test]
fn files_that_are_cut_off() {
    let complete = recording();
    // 10 values of the last column are missing; all columns are shortened to the same length.
    let mut log = opened(&RECORDING[..RECORDING.len() - 77]);
    let note = "the file is cut off after 13238 bytes, within the segment at byte 0; the samples that follow are lost";
    assert_eq!(log.notes(), [note]);
    let motor = channel(&mut *log, "motor").columns;
    assert_eq!(motor, complete.each_ref().map(|column| column[..391].to_vec()));
    assert!(message(&RECORDING[..RECORDING.len() - 401 * 8]).starts_with("holds no channel of numbers with samples"));

    // A row and a part of a row are missing from the second segment.
    let mut log = opened(&INTERLEAVED[..INTERLEAVED.len() - 33]);
    assert_eq!(channel(&mut *log, "motor").columns, complete.each_ref().map(|column| column[..399].to_vec()));
    assert!(log.notes()[0].contains("within the segment at byte"));

    // The end of the second segment is unknown, as after a crash of LabVIEW.
    let second = INTERLEAVED.windows(4).rposition(|window| window == b"TDSm").unwrap();
    let mut open_end = INTERLEAVED.to_vec();
    open_end[second + 12..second + 20].fill(0xff);
    let mut log = opened(&open_end);
    assert_eq!(channel(&mut *log, "motor").columns, complete);
    assert_eq!(log.notes().len(), 1);

    // Only a part of the lead-in of the second segment is left, or zeros in its place.
    for rest in [&INTERLEAVED[..second + 20], &[&INTERLEAVED[..second], &[0; 300_000]].concat()] {
        let mut log = opened(rest);
        assert_eq!(channel(&mut *log, "motor").columns, complete.each_ref().map(|column| column[..300].to_vec()));
        assert_eq!(log.notes().len(), 1);
    }
    let zeros = [&INTERLEAVED[..second], &[0; 300_000], b"x"].concat();
    assert!(message(&zeros).starts_with("found no segment at byte"));
    // Only the second of two groups lacks values.
    let groups = segment(14, &[bytes_channel("/'a'/'x'", 4), bytes_channel("/'b'/'x'", 4)], 8);
    let mut log = opened(&[groups, (0..7).collect()].concat());
    assert_eq!(channel(&mut *log, "a").columns, [[0.0, 1.0, 2.0, 3.0]]);
    assert_eq!(channel(&mut *log, "b").columns, [[4.0, 5.0, 6.0]]);
    for length in 0..CHANGING.len() {
        if let Ok(mut log) = open(medium(&CHANGING[..length])) {
            for name in names(&*log).iter().map(|name| name.split_once(':').unwrap().0.to_owned()) {
                channel(&mut *log, &name);
            }
        }
    }
}

#[test]
fn other_files_are_refused() {
    assert_eq!(message(b""), "is not a TDMS file: it does not begin with the letters TDSm");
    let index = refused(open, &with(RECORDING, 3, b'h'));
    assert_eq!(index.to_string(), "is the index of a TDMS file, expected the file with the data");
    assert!(index.hint().to_string().contains(".tdms_index"));
    assert!(message(&CHANGING[..28]).starts_with("holds no channel of numbers with samples; found the file is cut"));
}

#[test]
fn damaged_files_are_refused() {
    let second = INTERLEAVED.windows(4).rposition(|window| window == b"TDSm").unwrap();
    let found = message(&with(INTERLEAVED, second, b'X'));
    assert_eq!(found, format!("found no segment at byte {second}: expected the letters TDSm"));
    // Lead-in: position of the data, then the number of objects, the length of the path "/", its layout.
    assert_eq!(message(&with(RECORDING, 27, 1)), "the segment at byte 0 has its data after its end");
    assert!(message(&with(RECORDING, 28, 200)).starts_with("the segment at byte 0 "));
    let path = message(&with(RECORDING, 34, 1));
    assert_eq!(path, "the segment at byte 0 holds a path of 65537 bytes, expected at most 4096");
    assert_eq!(message(&with(RECORDING, 36, b'x')), "the segment at byte 0 names an object \"x\"");
    let layout = message(&[&RECORDING[..37], &[0; 4], &RECORDING[41..]].concat());
    assert_eq!(layout, "the segment at byte 0 refers to an earlier layout of an object that has none");
}

#[test]
fn files_may_follow_each_other() {
    let mut log = opened(&[RECORDING, RECORDING].concat());
    assert_eq!(channel(&mut *log, "motor").columns[1], [&recording()[1][..], &recording()[1]].concat());
    assert_eq!(log.constants().len(), 3);
}
