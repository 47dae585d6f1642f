//! HDF5 files by h5py, pandas and hdf5storage, and MAT-files of level 7.3 in the layout of MATLAB.

use super::super::super::log::{Field, Log};
use super::super::{is_hdf5, open};
use std::io::Cursor;

const CSV: &str = include_str!("../../../../../tests/golden/formats/recording.csv");
pub(super) const RECORDING: &[u8] = include_bytes!("../../../../../tests/golden/formats/recording.h5");
pub(super) const RECORDING_MAT: &[u8] = include_bytes!("../../../../../tests/golden/formats/recording_v73.mat");
pub(super) const TYPES: &[u8] = include_bytes!("../../../../../tests/golden/formats/types.h5");
pub(super) const STORAGE: [&[u8]; 2] = [
    include_bytes!("../../../../../tests/golden/formats/storage_earliest.h5"),
    include_bytes!("../../../../../tests/golden/formats/storage_latest.h5"),
];
pub(super) const GROUPS: [&[u8]; 2] = [
    include_bytes!("../../../../../tests/golden/formats/groups_earliest.h5"),
    include_bytes!("../../../../../tests/golden/formats/groups_latest.h5"),
];
pub(super) const COMPOUND: [&[u8]; 2] = [
    include_bytes!("../../../../../tests/golden/formats/compound_earliest.h5"),
    include_bytes!("../../../../../tests/golden/formats/compound_latest.h5"),
];
pub(super) const PANDAS: &[u8] = include_bytes!("../../../../../tests/golden/formats/pandas.h5");
pub(super) const UNREAD: &[u8] = include_bytes!("../../../../../tests/golden/formats/unread.h5");
pub(super) const MIXED_MAT: &[u8] = include_bytes!("../../../../../tests/golden/formats/mixed_v73.mat");
pub(super) const OBJECT_MAT: &[u8] = include_bytes!("../../../../../tests/golden/formats/object_v73.mat");
pub(super) const HDF5STORAGE_MAT: &[u8] = include_bytes!("../../../../../tests/golden/formats/hdf5storage_v73.mat");

pub(super) fn log(bytes: &[u8]) -> Box<dyn Log> {
    open(Box::new(Cursor::new(bytes.to_vec()))).unwrap()
}

pub(super) fn refused(bytes: &[u8]) -> (String, String) {
    let error = open(Box::new(Cursor::new(bytes.to_vec()))).err().unwrap();
    (error.to_string(), error.hint().to_string())
}

pub(super) fn fields(log: &dyn Log) -> &[Field] {
    &log.channels()[0].fields
}

pub(super) fn names(log: &dyn Log) -> Vec<&str> {
    fields(log).iter().map(|field| field.path.as_str()).collect()
}

pub(super) fn column(log: &mut dyn Log, name: &str) -> Vec<f64> {
    let at = names(log).iter().position(|found| *found == name).unwrap_or_else(|| panic!("no column {name}"));
    log.read(&[(0, vec![at])]).unwrap().remove(0).columns.remove(0)
}

/// Returns the columns of the recording with their names.
pub(super) fn recording() -> Vec<(&'static str, Vec<f64>)> {
    let mut lines = CSV.lines();
    let mut columns: Vec<_> = lines.next().unwrap().split(',').map(|name| (name, Vec::new())).collect();
    for line in lines {
        for (column, text) in columns.iter_mut().zip(line.split(',')) {
            column.1.push(text.parse().unwrap());
        }
    }
    columns
}

/// Returns `count` times in steps of 2 ms, as the generator of the files computes them.
pub(super) fn times(count: u32) -> Vec<f64> {
    (0..count).map(|n| f64::from(n) * 0.002).collect()
}

pub(super) fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn the_recording_is_read_to_the_last_bit() {
    for (bytes, units) in [(RECORDING, true), (RECORDING_MAT, false)] {
        let mut log = log(bytes);
        let channel = &log.channels()[0];
        assert_eq!((log.channels().len(), channel.name.as_str(), channel.count, channel.span_s), (1, "", 401, None));
        assert_eq!(names(&*log), ["current_A", "speed_rad_s", "time_s", "voltage_V"]);
        let found: Vec<_> = fields(&*log).iter().map(|field| field.unit.as_deref()).collect();
        assert_eq!(found, ["A", "rad/s", "s", "V"].map(|unit| units.then_some(unit)));
        for (name, values) in recording() {
            assert_eq!(bits(&column(&mut *log, name)), bits(&values), "{name}");
        }
        assert!(log.notes().is_empty() && log.constants().is_empty());
    }
}

#[test]
fn columns_are_read_in_the_order_of_the_request() {
    let mut log = log(RECORDING);
    let series = log.read(&[(0, vec![3, 0, 3]), (0, vec![]), (0, vec![2])]).unwrap();
    let lengths: Vec<_> = series.iter().map(|s| s.columns.iter().map(Vec::len).collect::<Vec<_>>()).collect();
    assert_eq!(lengths, [vec![401, 401, 401], vec![], vec![401]]);
    assert!(series.iter().all(|s| s.time_s.is_empty()));
    let recording = recording();
    let expected = [&recording[1].1, &recording[2].1, &recording[1].1];
    assert!(series[0].columns.iter().eq(expected));
    assert_eq!(series[2].columns[0][..3], [0.0, 0.002, 0.004]);
    let refused = |log: &mut dyn Log, request| log.read(&[request]).unwrap_err().to_string();
    assert_eq!(refused(&mut *log, (0, vec![4])), "no column 4, the table has 4");
    assert_eq!(refused(&mut *log, (1, vec![0])), "no channel 1, the file has one table");
    let many = refused(&mut *log, (0, vec![0; 249_377]));
    assert_eq!(many, "249377 columns of 401 values, expected at most 100000000 values");
}

#[test]
fn numbers_of_all_types() {
    let mut log = log(TYPES);
    let mut checked = 0;
    for (size, lowest) in [
        ("i1", -128.0),
        ("u1", 0.0),
        ("i2", -32768.0),
        ("u2", 0.0),
        ("i4", -2_147_483_648.0),
        ("u4", 0.0),
        ("i8", -9_223_372_036_854_775_808.0),
        ("u8", 0.0),
        ("f2", -65504.0),
        ("f4", f64::from(f32::MIN)),
        ("f8", f64::MIN),
    ] {
        let order: &[&str] = if size.ends_with('1') { &[""] } else { &["le_", "be_"] };
        for order in order {
            let expected = [lowest, 1.0].into_iter().chain((0..10).map(f64::from));
            assert_eq!(column(&mut *log, &format!("{order}{size}")), expected.collect::<Vec<_>>(), "{order}{size}");
            checked += 1;
        }
    }
    let numbers = |value: fn(f64) -> f64| (0..12).map(f64::from).map(value).collect::<Vec<_>>();
    for (name, expected) in [
        ("i8max", numbers(|_| 9_223_372_036_854_775_807.0)),
        ("u8max", numbers(|_| 18_446_744_073_709_551_615.0)),
        ("bool", numbers(|n| if n % 3.0 == 0.0 { 1.0 } else { 0.0 })),
        ("enum", numbers(|n| n % 3.0 - 1.0)),
        ("int12", numbers(|n| n - 6.0)),
        ("bfloat16", numbers(|n| n / 4.0)),
        ("bitfield", numbers(|n| n)),
    ] {
        assert_eq!(column(&mut *log, name), expected, "{name}");
        checked += 1;
    }
    assert_eq!(fields(&*log).len(), checked);
    assert_eq!(log.notes(), ["long_double: floating-point numbers of an unusual format"]);
}

#[test]
fn all_kinds_of_storage() {
    for (bytes, count) in STORAGE.into_iter().zip([17, 29]) {
        let mut log = log(bytes);
        let names: Vec<String> = names(&*log).into_iter().map(str::to_owned).collect();
        assert_eq!((names.len(), log.notes().len()), (count, 0));
        for name in names {
            let values = column(&mut *log, &name);
            let expected: Vec<f64> = match name.as_str() {
                "scaleoffset" => (0..12).map(|n| f64::from(7 * n)).collect(),
                "unwritten" => vec![4.5; 12],
                "unwritten_chunks" => vec![-1.5; 12],
                "part" => [vec![-1.0; 5], times(5), vec![-1.0; 2]].concat(),
                name if name.starts_with("matrix") => {
                    let (_, number) = name.rsplit_once('[').unwrap();
                    let number: u32 = number.trim_end_matches(']').parse().unwrap();
                    (0..12).map(|n| f64::from(3 * n + number)).collect()
                }
                _ => times(12),
            };
            assert_eq!(bits(&values), bits(&expected), "{name}");
        }
    }
}

#[test]
fn groups_units_and_constants() {
    for bytes in GROUPS {
        let mut log = log(bytes);
        let many: Vec<String> = (0..10).map(|at| format!("many/c{at:02}")).collect();
        let mut expected = vec!["again", "log/motor/speed", "log/phases[0]", "log/phases[1]", "log/phases[2]"];
        expected.extend(many.iter().map(String::as_str));
        expected.extend(["of_kind", "ordered/z", "ordered/y", "ordered/x", "packed"]);
        assert_eq!(names(&*log), expected);
        let units: Vec<_> = fields(&*log).iter().take(5).map(|field| field.unit.as_deref()).collect();
        assert_eq!(units, [Some("s"), Some("rad/s"), Some("A"), Some("V"), None]);
        assert_eq!(column(&mut *log, "log/phases[1]")[..3], [1.0, 4.0, 7.0]);
        assert_eq!(column(&mut *log, "many/c07")[..1], [7.0]);
        assert_eq!(bits(&column(&mut *log, "of_kind")), bits(&times(12)));
        let constants = [("fs", 500.0), ("pole_pairs", 7.0), ("count", 3.0), ("resistance", 0.25)];
        let mut found: Vec<(&str, f64)> = log.constants().iter().map(|(name, value)| (name.as_str(), *value)).collect();
        found[2..].sort_by(|a, b| a.0.cmp(b.0));
        assert_eq!(found, constants);
        let notes = log.notes();
        assert_eq!(notes[0], "short: 3 values, others have 12");
        assert_eq!(notes[1..3], ["fs: 1 value, 500", "pole_pairs: 1 value, 7"]);
        assert_eq!(notes[5..], ["elsewhere: in another file"]);
        // Packed with a scale_factor of 0.1.
        assert_eq!(column(&mut *log, "packed"), (0..12).map(|n| f64::from(n) * 0.1).collect::<Vec<_>>());
    }
}

#[test]
fn what_is_not_read_is_named() {
    let log = log(UNREAD);
    assert_eq!(names(&*log), ["t"]);
    let expected = [
        "blosc: compressed with Blosc, expected gzip, szip or lzf: rewrite it with h5repack -f GZIP=4",
        "complex: complex numbers",
        "complex_2: complex numbers",
        "cube: 2 × 3 × 4 values, expected a vector or a matrix",
        ": inside more than 32 groups",
        "empty: empty",
        "huge: 1000000000 values, expected at most 100000000",
        "large: 10000000 values, more than a file of this size is expected to hold",
        "lists: lists of variable length",
        "none: empty",
        "opaque: opaque data",
        "outside: its values are in another file",
        "references: references",
        "text: text",
        "texts: text",
        "virtual: a virtual dataset",
        "wide: 2 × 70 values, expected at most 64 columns; transpose it to use it",
    ];
    assert_eq!(log.notes().len(), expected.len());
    for (note, expected) in log.notes().iter().zip(expected) {
        assert!(if expected.starts_with(':') { note.ends_with(expected) } else { note == expected }, "{note}");
    }
}

#[test]
fn members_of_compound_elements_are_columns() {
    for bytes in COMPOUND {
        let mut log = log(bytes);
        let members = ["t", "id", "on", "abc[0]", "abc[1]", "abc[2]", "pos/x", "pos/y"];
        let of = |dataset: &str| members.map(|member| format!("{dataset}/{member}"));
        assert_eq!(names(&*log), [of("chunked"), of("log")].concat());
        for dataset in ["chunked", "log"] {
            let mut column = |member: &str| column(&mut *log, &format!("{dataset}/{member}"));
            assert_eq!(bits(&column("t")), bits(&times(12)));
            assert_eq!(column("id"), (0..12).map(|n| f64::from(n) - 5.0).collect::<Vec<_>>());
            assert_eq!(column("on")[..4], [0.0, 1.0, 0.0, 1.0]);
            assert_eq!(column("abc[1]"), (0..12).map(|n| f64::from(3 * n + 1)).collect::<Vec<_>>());
            assert_eq!(column("pos/y"), times(12).iter().map(|t| 2.0 * t).collect::<Vec<_>>());
        }
        let constants: Vec<&str> = log.constants().iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(constants, of("one"));
        assert_eq!(log.constants()[1], ("one/id".to_owned(), -4.0));
        let others = ["chunked/name: text", "log/name: text", "one/name: text", "pairs: a matrix of 2 numbers each"];
        assert_eq!(log.notes()[8..], others);
    }
}

#[test]
fn tables_of_pandas() {
    let mut log = log(PANDAS);
    let blocks = ["index", "values_block_0[0]", "values_block_0[1]", "values_block_1[0]"];
    let log_names = ["index", "time", "speed", "n"];
    let all = [blocks.map(|n| format!("blocks/table/{n}")), log_names.map(|n| format!("log/table/{n}"))].concat();
    assert_eq!(names(&*log), all);
    assert_eq!(column(&mut *log, "log/table/speed"), times(12).iter().map(|t| 3.0 * t).collect::<Vec<_>>());
    let note = "blocks/table: pandas hides the names of the columns: save it with data_columns=True";
    assert_eq!(log.notes(), [note]);
}

#[test]
fn the_signature_may_follow_a_user_block() {
    for block in [0, 512, 1024, 4096] {
        let bytes = [&vec![7; block][..], RECORDING].concat();
        assert!(is_hdf5(&bytes));
        assert_eq!(bits(&column(&mut *log(&bytes), "time_s")), bits(&recording()[0].1));
    }
    assert!(!is_hdf5(&[&[7; 256][..], RECORDING].concat()));
    assert!(is_hdf5(RECORDING_MAT) && !is_hdf5(b"") && !is_hdf5(CSV.as_bytes()));
}
