//! HDF5 files that are cut off, damaged or of another format.

use super::super::open;
use super::files::{
    COMPOUND, GROUPS, HDF5STORAGE_MAT, MIXED_MAT, OBJECT_MAT, PANDAS, RECORDING, RECORDING_MAT, STORAGE, TYPES, UNREAD,
    bits, column, fields, log, names, recording, refused,
};
use std::io::Cursor;

const GROWING: &[u8] = include_bytes!("../../../../../tests/golden/formats/growing.h5");
const CONTIGUOUS: &[u8] = include_bytes!("../../../../../tests/golden/formats/contiguous.h5");
const UNCLOSED: &[u8] = include_bytes!("../../../../../tests/golden/formats/unclosed.h5");

#[test]
fn the_complete_rows_of_a_file_that_is_cut_off_are_read() {
    let mut cut = log(&GROWING[..15_500]);
    assert_eq!(cut.notes(), ["the file is cut off after 15500 of 16288 bytes; 50 rows after 350 lost"]);
    assert_eq!(cut.channels()[0].count, 350);
    for (name, values) in recording() {
        assert_eq!(bits(&column(&mut *cut, name)), bits(&values[..350]), "{name}");
    }
    let mut cut = log(&CONTIGUOUS[..5000]);
    assert_eq!(cut.notes(), ["the file is cut off after 5000 of 6848 bytes; 77 rows after 23 lost"]);
    assert_eq!(column(&mut *cut, "b"), (0..23).map(f64::from).collect::<Vec<_>>());
    assert_eq!(column(&mut *cut, "d[2]"), (0..23).map(|n| f64::from(3 * n + 2)).collect::<Vec<_>>());
    let cut = log(&CONTIGUOUS[..3424]);
    assert_eq!((names(&*cut), cut.channels()[0].count), (vec!["a", "b"], 72));
    assert_eq!(cut.notes()[1..], ["c: lost, the file is cut off", "d: lost, the file is cut off"]);
    assert!(
        refused(&RECORDING[..3000]).0.starts_with("no vector of at least 2 numbers; found current_A: not readable")
    );
    assert!(refused(&RECORDING[..50]).0.starts_with("the file is damaged: unexpected end of data at offset 48"));
}

#[test]
fn a_file_that_was_not_closed_is_read() {
    let mut log = log(UNCLOSED);
    assert_eq!(column(&mut *log, "x"), (0..12).map(f64::from).collect::<Vec<_>>());
    let note = "the file was not closed by the program that wrote it; its last rows may be missing";
    assert_eq!(log.notes(), [note]);
}

#[test]
fn other_and_damaged_files_are_refused() {
    assert_eq!(refused(b"PK\x03\x04").0, "is not an HDF5 file: found no signature of HDF5");
    assert_eq!(refused(b"").0, "is not an HDF5 file: found no signature of HDF5");
    let (message, hint) = refused(&RECORDING_MAT[..300]);
    assert_eq!(message, "is a MAT-file that is cut off: found no signature of HDF5");
    assert!(hint.starts_with("Copy the file again"));
    let mut version = RECORDING.to_vec();
    version[8] = 9;
    assert_eq!(refused(&version).0, "the file is damaged: unsupported superblock version 9");
    let mut flipped = GROWING.to_vec();
    flipped[20] ^= 1;
    assert!(refused(&flipped).0.starts_with("the file is damaged: checksum mismatch"));
}

#[test]
fn a_damaged_chunk_is_an_error_with_the_name_of_its_dataset() {
    let mut damaged = RECORDING.to_vec();
    // The start of a chunk that is compressed with gzip at level 4.
    let at = damaged.windows(2).position(|bytes| bytes == [0x78, 0x5e]).unwrap();
    damaged[at + 40] ^= 0x55;
    let mut log = log(&damaged);
    let error = log.read(&[(0, vec![0, 1, 2, 3])]).unwrap_err();
    let message = error.to_string();
    assert!(message.starts_with("the file is damaged: dataset \""), "{message}");
    assert_eq!(error.hint().to_string(), "Copy the file again, or save it again.");
}

#[test]
fn data_that_are_shorter_than_their_dataset_are_damaged() {
    // Version and class of a layout, the address of the data unless they follow, and their size.
    for (bytes, start, at) in [(TYPES, [3, 1], 10), (STORAGE[0], [3, 0], 2)] {
        let mut damaged = bytes.to_vec();
        let is_layout = |bytes: &[u8]| bytes[..2] == start && bytes[at..at + 2] == [96, 0];
        let found = damaged.windows(12).position(is_layout).unwrap();
        damaged[found + at] = 95;
        let mut log = log(&damaged);
        let all = (0..fields(&*log).len()).collect();
        let error = log.read(&[(0, all)]).unwrap_err().to_string();
        assert!(error.ends_with("\": invalid data: 95 bytes, expected 96"), "{error}");
    }
}

#[test]
fn a_member_that_is_damaged_does_not_hide_the_others() {
    let mut damaged = GROWING.to_vec();
    let headers: Vec<usize> = (0..damaged.len() - 4).filter(|&at| damaged[at..].starts_with(b"OHDR")).collect();
    damaged[headers[1] + 20] ^= 1;
    let log = log(&damaged);
    assert_eq!(fields(&*log).len(), 3);
    assert!(log.notes()[0].contains(": not readable: checksum mismatch"), "{}", log.notes()[0]);
}

/// Pseudo-random numbers of a xorshift generator.
struct Random(u64);

impl Random {
    /// Returns a number below `end`.
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 32).unwrap() % end.max(1)
    }

    /// Changes a file in 1 to 5 places.
    fn change(&mut self, bytes: &mut Vec<u8>) {
        for _ in 0..=self.below(5) {
            let at = self.below(bytes.len());
            let end = (at + 1 + self.below(32)).min(bytes.len());
            let value = u8::try_from(self.below(256)).unwrap();
            match self.below(8) {
                _ if bytes.is_empty() => {}
                0 | 1 => bytes[at] ^= 1 << self.below(8),
                2 => bytes[at] = [0, 1, 2, 127, 128, 254, 255][self.below(7)],
                3 => bytes[at] = value,
                4 => bytes.insert(at, value),
                5 => drop(bytes.drain(at..end)),
                6 => {
                    let part = bytes[at..end].to_vec();
                    let to = self.below(bytes.len() - part.len() + 1);
                    bytes[to..to + part.len()].copy_from_slice(&part);
                }
                _ if self.below(4) == 0 => bytes.truncate(at),
                _ => bytes[at..end].fill([0, 255][self.below(2)]),
            }
        }
    }
}

/// Reads changed files and checks that each is refused, or gives columns of the announced length.
fn read_changed_files(count: usize) {
    let singles = [RECORDING, RECORDING_MAT, TYPES, PANDAS, UNREAD, GROWING, CONTIGUOUS, UNCLOSED];
    let files = [&singles[..], &[MIXED_MAT, OBJECT_MAT, HDF5STORAGE_MAT], &STORAGE, &GROUPS, &COMPOUND].concat();
    let mut random = Random(1);
    for number in 0..count {
        let mut bytes = files[number % files.len()].to_vec();
        random.change(&mut bytes);
        let Ok(mut log) = open(Box::new(Cursor::new(bytes))) else { continue };
        let length = usize::try_from(log.channels()[0].count).unwrap();
        let all: Vec<usize> = (0..fields(&*log).len()).collect();
        assert!(!all.is_empty() && length > 0);
        match log.read(&[(0, all.clone())]) {
            Ok(series) => {
                assert_eq!(series[0].columns.len(), all.len());
                assert!(series[0].columns.iter().all(|column| column.len() == length));
            }
            Err(error) => assert!(!error.to_string().is_empty() && !error.hint().is_empty()),
        }
    }
}

#[test]
fn changed_files_are_read_or_refused() {
    read_changed_files(5000);
}

#[test]
#[ignore = "takes minutes"]
fn a_million_changed_files_are_read_or_refused() {
    read_changed_files(1_000_000);
}
