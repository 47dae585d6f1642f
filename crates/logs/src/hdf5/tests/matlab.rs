//! MAT-files of level 7.3 in the layout of MATLAB, and by hdf5storage.

use super::files::{HDF5STORAGE_MAT, MIXED_MAT, OBJECT_MAT, column, log, names, refused, times};

#[test]
fn variables_of_matlab() {
    let mut log = log(MIXED_MAT);
    let matrix = ["m(:,1)", "m(:,2)", "m(:,3)"];
    let out = ["on", "out.signals(1).values", "out.signals(2).values", "out.time", "row", "t", "u64"];
    assert_eq!(names(&*log), [&["f32", "i8"][..], &matrix, &out].concat());
    let scaled = |factor: f64| times(12).iter().map(|t| factor * t).collect::<Vec<_>>();
    for (name, expected) in [
        ("t", scaled(1.0)),
        ("row", scaled(1.0)),
        ("i8", (0..12).map(|n| f64::from(n) - 6.0).collect()),
        ("u64", (0..12).map(|n| f64::from(n) * 2f64.powi(50)).collect()),
        ("on", (0..12).map(|n| f64::from((n + 1) % 2)).collect()),
        ("m(:,2)", (0..12).map(|n| f64::from(3 * n + 1)).collect()),
        ("out.time", scaled(2.0)),
        ("out.signals(1).values", scaled(3.0)),
        ("out.signals(2).values", scaled(4.0)),
    ] {
        assert_eq!(column(&mut *log, name), expected, "{name}");
    }
    assert_eq!(log.constants(), [("fs".to_owned(), 500.0)]);
    let notes = [
        "short: 3 values, others have 12",
        "fs: 1 value, 500",
        "cube: 2 × 3 × 4 values, expected a vector or a matrix",
        "empty: empty",
        "label: text",
        "mixed: a cell array",
        "out.signals(1).label: text",
        "out.signals(2).label: text",
        "sparse: a sparse matrix",
        "ts: an object of class timeseries",
        "tt: an object of class timetable",
        "wide: 2 × 70 values, expected at most 64 columns; transpose it to use it",
        "z: complex numbers",
    ];
    assert_eq!(log.notes(), notes);
}

#[test]
fn variables_of_matlab_by_another_writer() {
    let mut log = log(HDF5STORAGE_MAT);
    let names_expected = [
        "i16",
        "m(:,1)",
        "m(:,2)",
        "m(:,3)",
        "on",
        "s.deep.u",
        "s.speed",
        "several(1).values",
        "several(2).values",
        "t",
    ];
    assert_eq!(names(&*log), names_expected);
    assert_eq!(column(&mut *log, "m(:,3)")[..3], [2.0, 5.0, 8.0]);
    assert_eq!(column(&mut *log, "s.deep.u")[1..2], [0.002 * 6.0]);
    assert_eq!(column(&mut *log, "several(2).values")[1..2], [0.002 * 4.0]);
    assert_eq!(log.constants(), [("fs".to_owned(), 500.0)]);
}

#[test]
fn objects_of_matlab_are_refused_with_a_remedy() {
    let (message, hint) = refused(OBJECT_MAT);
    assert_eq!(message, "no vector of at least 2 numbers; found fs: 1 value; ts: an object of class timeseries");
    assert!(hint.starts_with("Save the data of objects as vectors, for a timeseries ts: t = ts.Time;"));
}
