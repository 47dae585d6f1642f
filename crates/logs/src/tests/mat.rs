//! MAT-files written by SciPy, and some modified by hand.

use super::super::cells::Cells;
use super::super::mat::mat;

const MIXED_V6: &[u8] = include_bytes!("../../../../tests/golden/formats/mixed_v6.mat");
const MIXED_V7: &[u8] = include_bytes!("../../../../tests/golden/formats/mixed_v7.mat");
const TINY: &[u8] = include_bytes!("../../../../tests/golden/formats/tiny.mat");
const STRUCTS: &[u8] = include_bytes!("../../../../tests/golden/formats/structs.mat");
const BIG_ENDIAN: &[u8] = include_bytes!("../../../../tests/golden/formats/big_endian.mat");
const OPAQUE: &[u8] = include_bytes!("../../../../tests/golden/formats/opaque.mat");
const LEVEL_4: &[u8] = include_bytes!("../../../../tests/golden/formats/mixed_v4.mat");

fn column<'a>(cells: &'a Cells, heading: &str) -> Vec<&'a str> {
    let at = cells.rows[0].1.iter().position(|h| h == heading).unwrap();
    cells.rows[1..].iter().map(|(_, row)| row[at].as_str()).collect()
}

fn refused(bytes: &[u8]) -> String {
    mat(bytes).unwrap_err().to_string()
}

#[test]
fn all_classes_of_numbers_packed_or_not() {
    for bytes in [MIXED_V6, MIXED_V7] {
        let cells = mat(bytes).unwrap();
        let headings = ["t", "u", "i8", "u16", "i32", "i64", "f32", "on", "m(:,1)", "m(:,2)", "thin"];
        assert_eq!(cells.rows[0], (1, headings.map(str::to_owned).to_vec()));
        assert_eq!(cells.rows.iter().map(|row| row.0).collect::<Vec<_>>(), [1, 2, 3, 4, 5, 6]);
        assert_eq!(column(&cells, "t"), ["0", "0.001", "0.002", "0.003", "0.004"]);
        assert_eq!(column(&cells, "u"), ["0", "1.5", "-2.25", "0.3333333333333333", "1e-300"]);
        assert_eq!(column(&cells, "i8"), ["-128", "127", "0", "1", "2"]);
        assert_eq!(column(&cells, "u16"), ["0", "65535", "1", "2", "3"]);
        assert_eq!(column(&cells, "i32"), ["-2147483648", "2147483647", "0", "1", "2"]);
        assert_eq!(column(&cells, "i64"), ["-9007199254740992", "9007199254740992", "0", "1", "2"]);
        assert_eq!(column(&cells, "f32"), ["0.5", "0.10000000149011612", "nan", "inf", "-inf"]);
        assert_eq!(column(&cells, "on"), ["1", "0", "1", "1", "0"]);
        assert_eq!(column(&cells, "m(:,1)"), ["1", "3", "5", "7", "9"]);
        assert_eq!(column(&cells, "m(:,2)"), ["2", "4", "6", "8", "10"]);
        assert_eq!(column(&cells, "thin"), ["0", "1", "2", "3", "4"]);
        let notes = [
            "short: 3 values, others have 5",
            "fs: 1 value, 1000",
            "wide: 2 × 70 values, expected at most 64 columns; transpose it to use it",
            "cube: 2 × 3 × 4 values, expected a vector or a matrix",
            "z: complex numbers",
            "label: text",
            "mixed: a cell array",
            "empty: empty",
        ];
        assert_eq!(cells.notes, notes);
    }
}

#[test]
fn structures_give_their_fields() {
    let cells = mat(STRUCTS).unwrap();
    let headings = ["out.time", "out.signals(1).values", "out.signals(2).values", "out.inner.more.w"];
    assert_eq!(cells.rows[0].1, headings);
    assert_eq!(column(&cells, "out.signals(2).values"), ["0", "0.003", "0.006", "0.009000000000000001", "0.012"]);
    assert_eq!(column(&cells, "out.inner.more.w"), ["0", "0.005", "0.01", "0.015", "0.02"]);
    assert!(cells.notes.contains(&"deep.b.c.d.e: inside more than 4 structures".to_owned()), "{:?}", cells.notes);
    assert!(cells.notes.contains(&"out.signals(2).label: text".to_owned()), "{:?}", cells.notes);
}

#[test]
fn the_other_byte_order() {
    let cells = mat(BIG_ENDIAN).unwrap();
    assert_eq!(cells.rows[0].1, ["t", "u", "b", "w"]);
    assert_eq!(column(&cells, "t"), ["0", "0.25", "0.5"]);
    assert_eq!(column(&cells, "u"), ["-300", "0", "300"]);
    assert_eq!(column(&cells, "b"), ["1", "0", "1"]);
    assert_eq!(column(&cells, "w"), ["1.5", "-0.25", "3"]);
}

#[test]
fn other_levels_and_objects_are_named() {
    let error = mat(OPAQUE).unwrap_err();
    assert!(error.to_string().contains("ts: an object of class timeseries"), "{error}");
    assert!(error.hint().to_string().contains("t = ts.Time; v = ts.Data"), "{}", error.hint());
    assert!(refused(LEVEL_4).contains("of level 4"));
    let mut header = TINY[..128].to_vec();
    header[124..].copy_from_slice(b"\x00\x02IM");
    assert!(refused(&header).contains("of level 7.3"));
    header.resize(512, 0);
    header.extend(b"\x89HDF\r\n\x1a\n");
    assert!(refused(&header).contains("of level 7.3"));
    assert!(refused(b"\x89HDF\r\n\x1a\n").contains("of level 7.3"));
    assert!(mat(&header).unwrap_err().hint().to_string().contains("save('file.mat','-v7')"));
    for other in [&b""[..], b"abc", b"time_s,voltage_V\n0,1\n", &[0; 200]] {
        assert!(refused(other).contains("is not a MAT-file"));
    }
    assert!(refused(&TINY[..128]).contains("found nothing"));
}

/// Returns the index of bytes that occur exactly once.
fn index_of(bytes: &[u8], part: &[u8]) -> usize {
    let mut found = bytes.windows(part.len()).enumerate().filter(|(_, window)| *window == part);
    let at = found.next().unwrap().0;
    assert!(found.next().is_none());
    at
}

#[test]
fn a_file_cut_off_anywhere_is_noticed() {
    for bytes in [TINY, MIXED_V7, STRUCTS, BIG_ENDIAN, OPAQUE] {
        let whole = mat(bytes).unwrap_or_default();
        // A file that is cut off between two variables is a valid file with fewer variables.
        let mut ends = vec![128];
        while let Some(rest) = bytes.get(ends[ends.len() - 1]..).filter(|rest| !rest.is_empty()) {
            let length = <[u8; 4]>::try_from(&rest[4..8]).unwrap();
            let big = bytes[127] == b'I';
            let length = if big { u32::from_be_bytes(length) } else { u32::from_le_bytes(length) };
            ends.push(ends[ends.len() - 1] + 8 + length as usize);
        }
        assert_eq!(ends.last(), Some(&bytes.len()));
        for at in 0..bytes.len() {
            match mat(&bytes[..at]) {
                Ok(cells) => assert!(ends.contains(&at) && cells != whole, "cut at {at}"),
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    }
}

#[test]
fn wrong_sizes_are_refused() {
    // Offsets of the dimensions of t, 1 × 2, and of its two numbers, 16 bytes.
    let dimensions = index_of(TINY, b"\x05\0\0\0\x08\0\0\0\x01\0\0\0\x02\0\0\0\x01\0\x01\0t") + 8;
    let numbers = index_of(TINY, b"t\0\0\0\x09\0\0\0\x10\0\0\0") + 8;
    let with = |at: usize, value: u32| {
        let mut bytes = TINY.to_vec();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        refused(&bytes)
    };
    assert!(with(dimensions + 4, 3).contains("column t: the file is damaged: found 16 bytes of type 9, expected 3"));
    assert!(with(dimensions, i32::MAX as u32).contains("damaged"));
    assert!(with(dimensions + 4, u32::MAX).contains("a dimension is negative"));
    assert!(with(dimensions + 4, i32::MAX as u32).contains("expected 2147483647 numbers"));
    assert!(with(numbers, u32::MAX).contains("found 16 bytes, expected 4294967295"));
    assert!(with(numbers, 15).contains("found 15 bytes"));
    assert!(with(numbers - 4, 77).contains("of type 77"));
    assert!(with(132, u32::MAX).contains("was it cut off?"));
}
