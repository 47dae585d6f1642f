//! Property tests: files with bytes flipped, inserted, removed and repeated are read or refused, without a panic.

use super::super::cells::Cells;
use super::super::{mat::mat, sysid::sysid, xlsx::xlsx};
use motorfit_core::Result;
use proptest::prelude::*;
use std::io::{Cursor, Read as _, Write as _};

type Change = (u8, prop::sample::Index, u8, u8);

fn changes() -> impl Strategy<Value = Vec<Change>> {
    prop::collection::vec(any::<Change>(), 1..6)
}

fn changed(bytes: &[u8], changes: &[Change]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for (sort, index, value, length) in changes {
        if bytes.is_empty() {
            break;
        }
        let at = index.index(bytes.len());
        let end = (at + usize::from(*length)).min(bytes.len());
        match sort % 5 {
            0 => bytes[at] ^= 1 << (value % 8),
            1 => bytes[at] = *value,
            2 => bytes.insert(at, *value),
            3 => drop(bytes.drain(at..end)),
            _ => {
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
        }
    }
    bytes
}

fn consistent(read: Result<Cells>) {
    match read {
        Ok(cells) => {
            let width = cells.rows.first().map_or(0, |(_, row)| row.len());
            assert!(width > 0 && cells.rows.iter().all(|(_, row)| row.len() == width));
            assert!(cells.rows.windows(2).all(|pair| pair[0].0 < pair[1].0));
        }
        Err(error) => assert!(!error.to_string().is_empty() && !error.hint().is_empty()),
    }
}

const MATS: [&[u8]; 6] = [
    include_bytes!("../../../../tests/golden/formats/mixed_v6.mat"),
    include_bytes!("../../../../tests/golden/formats/mixed_v7.mat"),
    include_bytes!("../../../../tests/golden/formats/tiny.mat"),
    include_bytes!("../../../../tests/golden/formats/structs.mat"),
    include_bytes!("../../../../tests/golden/formats/big_endian.mat"),
    include_bytes!("../../../../tests/golden/formats/opaque.mat"),
];
const WORKBOOKS: [&[u8]; 3] = [
    include_bytes!("../../../../tests/golden/formats/log.xlsx"),
    include_bytes!("../../../../tests/golden/formats/far.xlsx"),
    include_bytes!("../../../../tests/golden/formats/iso.xlsx"),
];
const TESTS: [&[u8]; 3] = [
    include_bytes!("../../../../tests/golden/formats/sysid_simple.json"),
    include_bytes!("../../../../tests/golden/formats/sysid_drivetrain.json"),
    include_bytes!("../../../../tests/golden/formats/frc_characterization.json"),
];

/// Returns a workbook with one file of the archive changed, in a new archive.
fn with_changed_part(bytes: &[u8], which: prop::sample::Index, changes: &[Change]) -> Vec<u8> {
    let mut from = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
    let mut to = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let chosen = which.index(from.len());
    for index in 0..from.len() {
        let mut part = from.by_index(index).unwrap();
        let mut text = Vec::new();
        part.read_to_end(&mut text).unwrap();
        let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        to.start_file(part.name().unwrap(), options).unwrap();
        to.write_all(&if index == chosen { changed(&text, changes) } else { text }).unwrap();
    }
    to.finish().unwrap().into_inner()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn mats(which in 0..MATS.len(), changes in changes()) {
        consistent(mat(&changed(MATS[which], &changes)));
    }

    #[test]
    fn workbooks(which in 0..WORKBOOKS.len(), changes in changes()) {
        consistent(xlsx(&changed(WORKBOOKS[which], &changes), None));
    }

    #[test]
    fn parts_of_workbooks(which in 0..WORKBOOKS.len(), part in any::<prop::sample::Index>(), changes in changes()) {
        consistent(xlsx(&with_changed_part(WORKBOOKS[which], part, &changes), None));
    }

    #[test]
    fn sysid_files(which in 0..TESTS.len(), changes in changes()) {
        if let Ok(tests) = sysid(&changed(TESTS[which], &changes)) {
            tests.into_iter().for_each(|test| consistent(Ok(test)));
        }
    }
}
