//! Tests of MDF files that asammdf wrote or reads (`tests/golden/formats/make_mdf.py`).

use super::super::log::{Log, Series};
use super::open;
use motorfit_core::Result;
use std::io::Cursor;

const RECORDING: &[u8] = include_bytes!("../../../../tests/golden/formats/recording.mf4");
const DEFLATE: &[u8] = include_bytes!("../../../../tests/golden/formats/deflate.mf4");
const TRANSPOSED: &[u8] = include_bytes!("../../../../tests/golden/formats/transposed.mf4");
const GROUPS: &[u8] = include_bytes!("../../../../tests/golden/formats/groups.mf4");
const UNSORTED: &[u8] = include_bytes!("../../../../tests/golden/formats/unsorted.mf4");
const UNFINISHED: &[u8] = include_bytes!("../../../../tests/golden/formats/unfinished.mf4");
const LISTS: &[u8] = include_bytes!("../../../../tests/golden/formats/lists.mf4");

fn try_log(bytes: &[u8]) -> Result<Box<dyn Log>> {
    open(Box::new(Cursor::new(bytes.to_vec())))
}

fn log(bytes: &[u8]) -> Box<dyn Log> {
    try_log(bytes).unwrap()
}

fn message(bytes: &[u8]) -> String {
    try_log(bytes).err().unwrap().to_string()
}

/// Columns of the recording: time, voltage, current, speed.
fn csv() -> [Vec<f64>; 4] {
    let text = include_str!("../../../../tests/golden/formats/recording.csv");
    let column = |n: usize| text.lines().skip(1).map(|line| line.split(',').nth(n).unwrap().parse().unwrap()).collect();
    [0, 1, 2, 3].map(column)
}

fn names(log: &dyn Log) -> Vec<(String, Vec<(String, String)>)> {
    let fields = |c: &super::super::log::Channel| {
        c.fields.iter().map(|field| (field.path.clone(), field.unit.clone().unwrap_or_default())).collect()
    };
    log.channels().iter().map(|channel| (channel.name.clone(), fields(channel))).collect()
}

/// Column of a channel as bits.
fn column(log: &mut dyn Log, channel: usize, name: &str) -> Vec<u64> {
    let field = log.channels()[channel].fields.iter().position(|field| field.path == name).unwrap();
    bits(&log.read(&[(channel, vec![field])]).unwrap()[0].columns[0])
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() }).collect()
}

/// Values of rows as bits.
fn rows(count: u32, value: impl Fn(u32) -> f64) -> Vec<u64> {
    bits(&(0..count).map(value).collect::<Vec<_>>())
}

#[test]
fn a_recording_is_read_to_the_last_bit() {
    let [t, u, i, w] = csv();
    for bytes in [RECORDING, DEFLATE, TRANSPOSED] {
        let mut log = log(bytes);
        let units = [("voltage_V", "V"), ("current_A", "A"), ("speed_rad_s", "rad/s")];
        let units = units.map(|(name, unit)| (name.to_owned(), unit.to_owned()));
        assert_eq!(names(&*log), [("motor".to_owned(), units.to_vec())]);
        assert_eq!((log.channels()[0].count, log.channels()[0].span_s), (401, Some([0.0, 0.8])));
        assert!(log.notes().is_empty());
        let read = log.read(&[(0, vec![2, 0]), (0, vec![1])]).unwrap();
        assert_eq!(read[0], Series { time_s: t.clone(), columns: vec![w.clone(), u.clone()] });
        assert_eq!(read[1], Series { time_s: t.clone(), columns: vec![i.clone()] });
    }
}

#[test]
fn groups_have_their_clocks_and_numbers_their_conversions() {
    let mut log = log(GROUPS);
    let (log, [t, _, i, w]) = (&mut *log, csv());
    assert_eq!(log.channels().iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["fast", "group 2"]);
    let current = |k: u32| ((i[k as usize] * 1000.0).round_ties_even()) * 0.001 - 2.0;
    assert_eq!(column(log, 0, "current"), rows(401, current));
    #[allow(clippy::cast_possible_truncation, reason = "the rounding is meant")]
    let single = |k: u32| f64::from(w[k as usize] as f32);
    assert_eq!(column(log, 0, "speed"), rows(401, single));
    assert_eq!(column(log, 0, "on"), rows(401, |k| f64::from(k % 2)));
    assert_eq!(column(log, 1, "u64"), rows(40, |k| (u64::from(k) << 40) as f64));
    assert_eq!(column(log, 1, "i32"), rows(40, |k| f64::from(k) - 20.0));
    assert_eq!(column(log, 1, "f16"), rows(40, f64::from));
    assert_eq!(column(log, 1, "rational"), rows(40, |k| f64::from(k + 1) / 4.0));
    let stored = |k: u32| f64::from(k) - 5.0;
    let interpolated = |k: u32| if k <= 15 { 10.0 + stored(k).max(0.0) } else { (40.0 - 2.0 * stored(k)).max(0.0) };
    assert_eq!(column(log, 1, "interpolated"), rows(40, interpolated));
    let nearest = |x: f64| {
        if x <= 5.0 {
            10.0
        } else if x <= 15.0 {
            20.0
        } else {
            0.0
        }
    };
    assert_eq!(column(log, 1, "nearest"), rows(40, |k| nearest(stored(k))));
    // The names of states are left out, their numbers are not.
    assert_eq!(column(log, 1, "state"), rows(40, |k| f64::from(k % 2)));
    let read = log.read(&[(0, vec![]), (1, vec![0])]).unwrap();
    assert_eq!(read[0].time_s, t);
    assert_eq!(bits(&read[1].time_s), rows(40, |k| f64::from(k) * 0.02 + 0.005));
    let notes = ["left out formula: a formula", "left out text: values of varying length", "left out array: an array"];
    assert_eq!(log.notes(), notes);
}

#[test]
fn unsorted_records_with_packed_and_big_endian_numbers_are_read() {
    let mut log = log(UNSORTED);
    let (log, [t, _, i, w]) = (&mut *log, csv());
    assert_eq!(
        log.channels().iter().map(|c| (c.name.as_str(), c.count)).collect::<Vec<_>>(),
        [("fast", 401), ("slow", 41)]
    );
    let notes = ["left out text: values of varying length", "left out group 3: signals of varying length"];
    assert_eq!(log.notes(), notes);
    assert_eq!(column(log, 0, "speed"), bits(&w));
    assert_eq!(column(log, 0, "packed"), rows(401, |k| f64::from(k % 1024) - 512.0));
    assert_eq!(column(log, 0, "flag"), rows(401, |k| f64::from(u8::from(k % 3 == 0))));
    assert_eq!(column(log, 0, "be16"), rows(401, |k| f64::from(k) - 200.0));
    assert_eq!(column(log, 0, "be24"), rows(401, |k| f64::from(k * 40_000)));
    assert_eq!(column(log, 0, "f32be"), rows(401, |k| if k % 5 == 0 { f64::NAN } else { f64::from(k) / 4.0 }));
    assert_eq!(column(log, 1, "current"), rows(41, |k| (i[10 * k as usize] * 1000.0).round_ties_even() * 0.001));
    // Nanoseconds are subtracted before they are converted; the other clock counts seconds.
    let read = log.read(&[(0, vec![]), (1, vec![])]).unwrap();
    assert_eq!(read[0].time_s, t);
    assert_eq!(bits(&read[1].time_s), rows(41, |k| 0.5 + f64::from(10 * k) / 256.0));
    assert_eq!(log.channels()[1].span_s, Some([0.5, 0.5 + 400.0 / 256.0]));
}

#[test]
fn lists_of_blocks_are_read_and_other_groups_named_in_notes() {
    let mut log = log(LISTS);
    let (log, [.., w]) = (&mut *log, csv());
    let fields = [("speed", "rad/s"), ("inner", ""), ("number <k>", "m/s&")];
    let fields = fields.map(|(name, unit)| (name.to_owned(), unit.to_owned()));
    assert_eq!(names(log), [("group 1".to_owned(), fields.to_vec())]);
    assert_eq!(column(log, 0, "speed"), bits(&w));
    assert_eq!(column(log, 0, "inner"), rows(401, |k| f64::from(k % 7)));
    assert_eq!(column(log, 0, "number <k>"), rows(401, |k| f64::from(k % 256) * 0.5 + 1.0));
    let time = log.read(&[(0, vec![])]).unwrap().remove(0).time_s;
    assert_eq!(bits(&time), rows(401, |k| f64::from(k) / 500.0));
    let notes = [
        "left out angle: a master that is not the time",
        "left out lost: values that are all invalid",
        "left out phase: complex numbers",
        "left out group 2: no time",
        "left out CAN1: bus messages, which asammdf decodes",
        "left out group 4: no samples",
    ];
    assert_eq!(log.notes(), notes);
}

#[test]
fn files_that_were_not_closed_are_read_up_to_the_last_complete_record() {
    let [t, u, ..] = csv();
    let mut log = log(UNFINISHED);
    assert_eq!(log.notes(), ["the logger did not close the file: \"group 1\" has 400 samples up to 0.798 s"]);
    let read = log.read(&[(0, vec![0])]).unwrap().remove(0);
    assert_eq!((read.time_s, read.columns), (t[..400].to_vec(), vec![u[..400].to_vec()]));
}

#[test]
fn files_that_are_cut_off_are_read_up_to_the_last_complete_record() {
    let [t, ..] = csv();
    let mut bytes = UNFINISHED.to_vec();
    bytes[..8].copy_from_slice(b"MDF     ");
    let place = |kind: &[u8]| UNFINISHED.windows(4).position(|four| four == kind).unwrap();
    let (cg, dt) = (place(b"##CG"), place(b"##DT"));
    bytes[cg + 80..cg + 88].copy_from_slice(&401_u64.to_le_bytes());
    bytes[dt + 8..dt + 16].copy_from_slice(&(24 + 401 * 32_u64).to_le_bytes());
    bytes.truncate(dt + 24 + 100 * 32 + 31);
    let mut log = log(&bytes);
    let note =
        format!("the file is cut off after {} bytes: samples of \"group 1\" after 0.198 s are lost", bytes.len());
    assert_eq!(log.notes(), [note]);
    assert_eq!(log.read(&[(0, vec![1])]).unwrap()[0].time_s, t[..100]);
    // asammdf writes the descriptions at the end.
    let error = message(&RECORDING[..13000]);
    assert!(error.starts_with("is cut off after 13000 bytes: the block at byte "), "{error}");
}

#[test]
fn files_that_cannot_be_read_are_named() {
    assert!(message(b"").starts_with("is not an MDF file"));
    assert!(message(&[b'x'; 100]).starts_with("is not an MDF file"));
    let mut bytes = RECORDING.to_vec();
    bytes[8..16].copy_from_slice(b"3.30    ");
    let error = try_log(&bytes).err().unwrap();
    assert_eq!(error.to_string(), "is an MDF file of version 3.30, expected version 4");
    assert!(error.hint().to_string().contains("asammdf"));
    let mut bytes = RECORDING.to_vec();
    bytes[66] = b'x';
    assert_eq!(message(&bytes), "the block at byte 64 is of type xD, expected HD");
    bytes[64] = 0;
    assert_eq!(message(&bytes), "the block at byte 64 starts with \"\\u{0}#xD\", expected \"##\"");
}

#[test]
fn damaged_blocks_are_named() {
    let mut bytes = TRANSPOSED.to_vec();
    let dz = TRANSPOSED.windows(4).position(|four| four == b"##DZ").unwrap();
    bytes[dz + 100] ^= 0xff;
    assert_eq!(message(&bytes), format!("the data at byte {} cannot be decompressed", dz + 48));
    // A group that links itself.
    let mut bytes = RECORDING.to_vec();
    let dg = RECORDING.windows(4).position(|four| four == b"##DG").unwrap();
    bytes[dg + 24..dg + 32].copy_from_slice(&(dg as u64).to_le_bytes());
    assert_eq!(message(&bytes), format!("the block at byte {dg} is linked twice"));
}

#[test]
fn fields_that_do_not_exist_are_refused() {
    for request in [(0, vec![3]), (1, vec![])] {
        assert_eq!(log(RECORDING).read(&[request]).unwrap_err().to_string(), "has no such field");
    }
}
