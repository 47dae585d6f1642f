//! MCAP files that are cut off or damaged.

use super::super::walk::MAGIC;
use super::file::{all, channel, chunk, file, message, opened, record, refused};
use super::files::{LZ4, RECORDING, UNCOMPRESSED, log};

#[test]
fn what_is_complete_in_a_file_that_was_cut_off_is_read() {
    for whole in [RECORDING, LZ4, UNCOMPRESSED] {
        let mut full = log(whole);
        let expected = all(&mut *full).unwrap();
        let end = whole.windows(9).position(|bytes| bytes == record(15, &[&[0; 4]])[..9].to_vec()).unwrap();
        let mut before = 0;
        for length in (0..whole.len()).step_by(61) {
            let mut log = match opened(&whole[..length]) {
                Ok(log) => log,
                Err(error) => {
                    assert!(before == 0 && length < 6000, "{length}: {error}");
                    continue;
                }
            };
            let found = all(&mut *log).unwrap();
            let count: usize = found.iter().map(|series| series.time_s.len()).sum();
            assert!(count >= before, "{length}");
            before = count;
            for ((found, expected), channel) in found.iter().zip(&expected).zip(log.channels()) {
                assert_eq!(found.time_s.len() as u64, channel.count);
                assert!(expected.time_s.starts_with(&found.time_s));
                for (found, expected) in found.columns.iter().zip(&expected.columns) {
                    assert!(expected.starts_with(found));
                }
            }
            let last = found.iter().filter_map(|series| series.time_s.last()).fold(0.0_f64, |a, b| a.max(*b));
            let last = (last * 1000.0).round() / 1000.0;
            let note = format!("the file is cut off after {length} bytes; samples after {last} s are lost");
            assert_eq!(log.notes().contains(&note), length < end + 9, "{length} {end}: {:?}", log.notes());
        }
        assert_eq!(before, expected.iter().map(|series| series.time_s.len()).sum::<usize>());
    }
}

#[test]
fn messages_of_an_incomplete_chunk_are_read() {
    let messages: Vec<Vec<u8>> = (0..10).map(|k| message(0, k, k.to_string().as_bytes())).collect();
    let contents = [channel(0, 0, b"a", "json"), messages.concat()].concat();
    let whole = file(&[chunk("", contents.len() as u64, 0, &contents)]);
    let read = |bytes: &[u8]| all(&mut *log(bytes)).unwrap()[0].columns[0].len();
    assert_eq!(read(&whole), 10);
    let size = messages[9].len();
    let tail = whole.len() - whole.windows(size).rposition(|bytes| bytes == messages[9]).unwrap();
    for lost in 1..5 {
        assert_eq!(read(&whole[..whole.len() - tail - (lost - 1) * size]), 10 - lost);
        assert_eq!(read(&whole[..whole.len() - tail + 1 - lost * size]), 9 - lost);
    }
    // After a power loss, a file can end in zeros.
    let zeros = [&whole[..whole.len() - tail - size], &[0; 1000]].concat();
    assert_eq!(read(&zeros), 8);
    let outside = [&MAGIC[..], &contents, &[0; 1000]].concat();
    assert_eq!(read(&outside), 10);
    assert!(log(&outside).notes()[0].starts_with(&format!("the file is cut off after {} bytes", contents.len() + 8)));
}

#[test]
fn damaged_files_are_refused() {
    assert_eq!(refused(b"").to_string(), "is not an MCAP file");
    assert_eq!(refused(b"time,voltage\n").to_string(), "is not an MCAP file");
    assert_eq!(
        refused(&MAGIC).to_string(),
        "no topic with numbers: found no topics; the file is cut off after 8 bytes"
    );
    assert_eq!(refused(&file(&[])).to_string(), "no topic with numbers: found no topics");
    for (whole, place) in [(RECORDING, "chunk at byte"), (LZ4, "chunk at byte"), (UNCOMPRESSED, "chunk at byte")] {
        let mut damaged = whole.to_vec();
        damaged[whole.len() / 4] ^= 4;
        let error = refused(&damaged);
        assert!(error.to_string().starts_with("the file is damaged") && error.to_string().contains(place), "{error}");
        assert!(error.hint().to_string().contains("mcap recover"));
    }
    let contents = [channel(0, 0, b"a", "json"), message(0, 0, b"1")].concat();
    let size = contents.len() as u64;
    let good = file(&[chunk("", size, 0, &contents)]);
    assert_eq!(log(&good).channels()[0].count, 1);
    let checksum = crc32fast::hash(&contents);
    assert_eq!(log(&file(&[chunk("", size, checksum, &contents)])).channels()[0].count, 1);
    let with = |records: &[Vec<u8>]| refused(&file(records)).to_string();
    let expected =
        format!("the file is damaged: chunk at byte 8: found the checksum {checksum:08x}, expected 00000001");
    assert_eq!(with(&[chunk("", size, 1, &contents)]), expected);
    let expected = format!("the file is damaged: chunk at byte 8: found {size} bytes, expected {}", size + 1);
    assert_eq!(with(&[chunk("", size + 1, 0, &contents)]), expected);
    let expected = "the file is damaged: chunk at byte 8: found a record of type 5 and 23 bytes in 31 bytes";
    assert_eq!(with(&[chunk("", size - 1, 0, &contents[..contents.len() - 1])]), expected);
    assert!(with(&[chunk("zstd", size, 0, &contents)]).starts_with("the file is damaged: chunk at byte 8: "));
    assert!(with(&[chunk("lz4", size, 0, &contents)]).starts_with("the file is damaged: chunk at byte 8: "));
    let other = "chunk at byte 8: compression \"bz2\", expected zstd, lz4 or none";
    assert_eq!(with(&[chunk("bz2", size, 0, &contents)]), other);
    let long = "the file is damaged: chunk at byte 8: the name of its compression is too long";
    assert_eq!(with(&[chunk(&"x".repeat(17), size, 0, &contents)]), long);
    assert_eq!(with(&[record(0, &[]), contents.clone()]), "the file is damaged: found no record at byte 8");
    let footer = "the file is damaged: found a footer at byte 8, which is not the end";
    assert_eq!(with(&[record(2, &[&[0; 20]]), contents.clone()]), footer);
    let short = with(&[contents, record(5, &[&[0; 21]])]);
    assert_eq!(short, "the file is damaged: records at byte 8: found a record of type 5 and 21 bytes in 30 bytes");
}
