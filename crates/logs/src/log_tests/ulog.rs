//! ULog files written byte by byte after the specification, and read by pyulog.

use super::super::log::Log;
use super::super::ulog::open;
use super::super::window::WINDOW_MAX;
use super::{channel, medium, names, recording, refused};

const RECORDING: &[u8] = include_bytes!("../../../../tests/golden/formats/recording.ulg");
const NESTED: &[u8] = include_bytes!("../../../../tests/golden/formats/nested.ulg");
const APPENDED: &[u8] = include_bytes!("../../../../tests/golden/formats/appended.ulg");
const DAMAGED: &[u8] = include_bytes!("../../../../tests/golden/formats/damaged.ulg");
/// Position of the first flag of a feature that a reader must know.
const INCOMPATIBLE: usize = 16 + 3 + 8;
/// Position of the first offset of appended data.
const OFFSETS: usize = 16 + 3 + 16;

fn opened(bytes: &[u8]) -> Box<dyn Log> {
    open(medium(bytes)).unwrap()
}

fn message(bytes: &[u8]) -> String {
    let error = refused(open, bytes);
    assert!(error.hint().to_string().ends_with('.'));
    error.to_string()
}

/// Returns a file with bytes replaced.
fn with(bytes: &[u8], at: usize, new: &[u8]) -> Vec<u8> {
    [&bytes[..at], new, &bytes[at + new.len()..]].concat()
}

/// Returns the messages of a file with a message added at the end.
fn and(bytes: &[u8], kind: u8, content: &[u8]) -> Vec<u8> {
    let length = u16::try_from(content.len()).unwrap().to_le_bytes();
    [bytes, &length, &[kind], content].concat()
}

#[test]
fn recordings() {
    let mut log = opened(RECORDING);
    assert_eq!(names(&*log), ["motor: voltage_V, current_A, speed_rad_s"]);
    let [time_s, voltage, current, speed] = recording();
    let motor = channel(&mut *log, "motor");
    assert_eq!(motor.time_s, time_s);
    assert_eq!(motor.columns, [voltage.clone(), current, speed.clone()]);
    assert_eq!(log.channels()[0].span_s, Some([0.0, 0.8]));
    assert_eq!(log.constants(), [("MOT_KV".to_owned(), 920.0), ("MOT_POLES".to_owned(), 14.0)]);
    assert!(log.notes().is_empty());
    let series = log.read(&[(0, vec![2, 0, 2]), (0, vec![]), (0, vec![0])]).unwrap();
    assert_eq!(series[0].columns, [speed.clone(), voltage.clone(), speed]);
    assert!(series[1].columns.is_empty());
    assert_eq!((&series[2].time_s, &series[2].columns), (&time_s, &vec![voltage]));
    assert!(log.read(&[(1, vec![0])]).is_err() && log.read(&[(0, vec![3])]).is_err());
    let error = log.read(&[(0, vec![0; 249_377])]).unwrap_err().to_string();
    assert_eq!(error, "the chosen fields have 100000578 values, expected at most 100000000");
}

#[test]
fn nested_formats_and_instances() {
    let mut log = opened(NESTED);
    let report = |n| format!("esc[{n}].timestamp, esc[{n}].esc_rpm, esc[{n}].esc_current[0], esc[{n}].esc_current[1]");
    let expected = [
        "attitude[1]: q[0], q[1], q[2], q[3], a, b, c, d".to_owned(),
        format!("esc_status: counter, {}, {}, armed", report(0), report(1)),
        "attitude: q[0], q[1], q[2], q[3], a, b, c, d".to_owned(),
    ];
    assert_eq!(names(&*log), expected);
    let status = channel(&mut *log, "esc_status");
    assert_eq!(status.time_s, [0.0, 0.01, 0.02, 0.03, 0.04]);
    assert_eq!(status.columns[0], [0.0, 1.0, 2.0, 3.0, 4.0]);
    assert_eq!(status.columns[1], [5_000_000.0, 5_000_001.0, 5_000_002.0, 5_000_003.0, 5_000_004.0]);
    assert_eq!(status.columns[6], [1.0, 1001.0, 2001.0, 3001.0, 4001.0]);
    assert_eq!(status.columns[7], [0.5, 1.5, 2.5, 3.5, 4.5]);
    assert_eq!(status.columns[9], [0.0, 1.0, 0.0, 1.0, 0.0]);
    for (name, shift) in [("attitude", 0.0), ("attitude[1]", 0.0005)] {
        let attitude = channel(&mut *log, name);
        assert_eq!(attitude.time_s[0], 0.001 + shift);
        let row: Vec<f64> = attitude.columns.iter().map(|column| column[4]).collect();
        let q = [4.0, f64::from(0.1_f32), -1.0, 2.0];
        assert_eq!(row, [&q[..], &[-4.0, -300.0, -9_007_199_254_740_992.0, 4_294_967_295.0]].concat());
    }
    assert!(log.channels().iter().flat_map(|channel| &channel.fields).all(|field| field.unit.is_none()));
}

#[test]
fn parameters_and_dropouts() {
    let log = opened(NESTED);
    assert_eq!(log.constants(), [("MOT_KV".to_owned(), f64::from(0.1_f32)), ("MOT_POLES".to_owned(), -7.0)]);
    let expected = [
        "1 topic left out (text_only): has no numbers",
        "2 dropouts of 300 ms in total",
        "the parameter MOT_KV changes to 2.5 at 0.0215 s",
    ];
    assert_eq!(log.notes(), expected);
    let mut many = NESTED.to_vec();
    for _ in 0..25 {
        many = and(&many, b'P', b"\x0bint32_t ABC\x01\0\0\0");
    }
    let log = opened(&many);
    let notes = log.notes();
    assert_eq!(notes.iter().filter(|note| note.ends_with("ABC changes to 1 at 0.0415 s")).count(), 19);
    assert_eq!(notes.last().unwrap(), "6 more changes of parameters not listed");
    assert_eq!(log.constants().len(), 2);
}

#[test]
fn topics_without_times_or_formats() {
    let mut bytes = and(RECORDING, b'F', b"untimed:uint8_t value;uint8_t[2] _padding0;");
    bytes = and(&bytes, b'F', b"broken");
    bytes = and(&bytes, b'F', b"loop:loop x;");
    for (id, name) in (1..).zip(["untimed", "none", "loop"]) {
        bytes = and(&bytes, b'A', &[&[0, id, 0], name.as_bytes()].concat());
    }
    // The padding at the end may be there in part.
    for data in
        [&[1, 0, 5][..], &[1, 0, 6, 0], &[1, 0, 7, 0, 0], &[1, 0], &[1, 0, 8, 0, 0, 0], &[2, 0, 1], &[9, 0], &[9]]
    {
        bytes = and(&bytes, b'D', data);
    }
    let mut log = opened(&bytes);
    let untimed = channel(&mut *log, "untimed");
    assert_eq!(untimed.columns, [[5.0, 6.0, 7.0]]);
    assert!(untimed.time_s.is_empty());
    let series = log.read(&[(1, vec![]), (0, vec![0]), (1, vec![0])]).unwrap();
    assert_eq!((series[1].time_s.len(), series[1].columns[0].len(), series[2].columns[0].len()), (401, 401, 3));
    let expected = [
        "1 topic left out (none): has no format",
        "1 topic left out (loop): has formats within formats of more than 32 levels",
        "1 format left out; the first is the format \"broken\"",
        "1 sample of topics without a subscription left out",
        "2 samples of another length than their format left out",
    ];
    let mut notes = log.notes().to_vec();
    notes[..2].sort_by_key(|note| note.len());
    assert_eq!(notes, expected);
}

#[test]
fn too_many_fields_are_left_out() {
    let mut bytes = and(RECORDING, b'F', b"wide:uint64_t timestamp;uint8_t[6000] x;");
    for instance in 0..4 {
        bytes = and(&bytes, b'A', &[&[instance, instance + 1, 0], &b"wide"[..]].concat());
        bytes = and(&bytes, b'D', &[&[instance + 1, 0], &[7; 6008][..]].concat());
    }
    let mut log = opened(&bytes);
    assert_eq!(log.channels().iter().map(|channel| channel.name.as_str()).collect::<Vec<_>>(), ["motor", "wide"]);
    assert_eq!(channel(&mut *log, "wide").columns, vec![vec![7.0]; 6000]);
    let note = "3 topics left out (wide[1], wide[2], wide[3]): exceeds 10000 fields of the file";
    assert_eq!(log.notes(), [note]);
}

#[test]
fn appended_data() {
    let mut log = opened(APPENDED);
    let motor = channel(&mut *log, "motor");
    assert_eq!(motor.columns, [(0..12).map(f64::from).collect::<Vec<_>>()]);
    assert_eq!(motor.time_s, (0..12).map(|n| f64::from(n) / 1000.0).collect::<Vec<_>>());
    assert!(log.notes().is_empty());
    // The earliest sample need not be the first one.
    let earlier = [&[2, 0], &999_000_u64.to_le_bytes()[..], &[0; 4]].concat();
    let mut log = opened(&and(APPENDED, b'D', &earlier));
    let times = channel(&mut *log, "motor").time_s;
    assert_eq!((times[0], times[12]), (0.001, 0.0));
    // The last section is missing from the file, in part or as a whole.
    let mut log = opened(&APPENDED[..APPENDED.len() - 1]);
    assert_eq!(channel(&mut *log, "motor").columns[0].len(), 11);
    assert!(log.notes()[0].ends_with("samples after 0.01 s are lost"));
    let last = u16::from_le_bytes([APPENDED[OFFSETS + 8], APPENDED[OFFSETS + 9]]);
    let mut log = opened(&APPENDED[..usize::from(last) - 1]);
    assert_eq!(channel(&mut *log, "motor").columns[0].len(), 8);
    let note = format!("the data that were appended at byte {last} are missing; the file has {} bytes", last - 1);
    assert_eq!(log.notes()[0], note);
    // Without the flag, the offsets do not count.
    let log = opened(&with(RECORDING, OFFSETS, &[20, 0, 0, 0]));
    assert_eq!(log.channels()[0].count, 401);
}

#[test]
fn damage_is_passed_over() {
    let mut log = opened(DAMAGED);
    assert_eq!(channel(&mut *log, "motor").columns, [[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 8.0, 9.0, 10.0, 11.0]]);
    let damage = DAMAGED.windows(5).position(|window| window == [0, 0, 0xff, 0xff, 0xff]).unwrap();
    // Two samples and the synchronization message that follows them.
    let bytes = 5 + 2 * 17 + 11;
    assert_eq!(log.notes(), [format!("{bytes} bytes are damaged and left out, the first of them at byte {damage}")]);
    // Other damage: a type that is no letter, and messages without content.
    let after = &DAMAGED[damage + 5..];
    for bytes in [&[2, 0, 0xff, 1, 1][..], &[0, 0, b'z', 0, 0, b'z']] {
        let log = opened(&[&DAMAGED[..damage], bytes, after].concat());
        assert_eq!((log.channels()[0].count, log.notes().len()), (10, 1));
    }
    // A synchronization message across the end of the part of the file that is in memory.
    let sync = after.windows(8).position(|window| window[0] == 0x2f && window[7] == 0x12).unwrap();
    let log = opened(&[&DAMAGED[..damage], &[0; WINDOW_MAX - 4], &after[sync..]].concat());
    assert_eq!(log.channels()[0].count, 10);
    // A length that is too large, before a synchronization message.
    let mut log = opened(&with(DAMAGED, damage - 17, &[0xff, 0xff]));
    assert_eq!(channel(&mut *log, "motor").columns, [[0.0, 1.0, 2.0, 3.0, 4.0, 8.0, 9.0, 10.0, 11.0]]);
    // Damage to the end of the file.
    let mut log = opened(&[RECORDING, &[0; 300_000]].concat());
    assert_eq!(channel(&mut *log, "motor").columns[0].len(), 401);
    let note = format!("300000 bytes are damaged and left out, the first of them at byte {}", RECORDING.len());
    assert_eq!(log.notes(), [note]);
}

#[test]
fn files_that_are_cut_off() {
    let complete = recording();
    for missing in 1..37 {
        let length = RECORDING.len() - missing;
        let mut log = opened(&RECORDING[..length]);
        assert_eq!(channel(&mut *log, "motor").columns[2], complete[3][..400]);
        let at = RECORDING.len() - 37;
        let lost = "samples after 0.798 s are lost";
        let note = format!("the file is cut off after {length} bytes, within the message at byte {at}; {lost}");
        assert_eq!(log.notes(), [note]);
    }
    for length in 0..NESTED.len() {
        if let Ok(mut log) = open(medium(&NESTED[..length])) {
            for name in log.channels().iter().map(|channel| channel.name.clone()).collect::<Vec<_>>() {
                channel(&mut *log, &name);
            }
        }
    }
}

#[test]
fn other_files_are_refused() {
    for bytes in [&b""[..], &RECORDING[..15], &RECORDING[1..]] {
        assert_eq!(message(bytes), "is not a ULog file: it does not begin with the header of one");
    }
    let empty = message(&RECORDING[..200]);
    assert!(empty.starts_with("holds no topic with samples; found the file is cut off after 200 bytes"), "{empty}");
    assert_eq!(message(&RECORDING[..16]), "holds no topic with samples; found no samples");
    let unknown = message(&with(RECORDING, INCOMPATIBLE, &[3]));
    assert_eq!(unknown, "has the unknown flag 0x03 in byte 0 of the features that a reader must know");
    assert!(message(&with(RECORDING, INCOMPATIBLE + 1, &[1])).starts_with("has the unknown flag 0x01 in byte 1"));
    let unknown = message(&with(RECORDING, INCOMPATIBLE + 7, &[0x80]));
    assert_eq!(unknown, "has the unknown flag 0x80 in byte 7 of the features that a reader must know");
    assert_eq!(message(&with(RECORDING, 16, &[39])), "the flags have 39 bytes, expected 40");
    // Flags of compatible features do not matter, nor does the version.
    assert_eq!(opened(&with(RECORDING, INCOMPATIBLE - 8, &[0xff])).channels()[0].count, 401);
    assert_eq!(opened(&with(RECORDING, 7, &[2])).channels()[0].count, 401);
}
