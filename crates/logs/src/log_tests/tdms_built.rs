//! TDMS files that the tests build: long ones, and such with unusual metadata.

use super::super::log::Log;
use super::open_tdms as open;
use super::{channel, field, medium, refused, units};
use std::io::{Read, Seek, SeekFrom};

fn opened(bytes: &[u8]) -> Box<dyn Log> {
    open(medium(bytes)).unwrap()
}

fn message(bytes: &[u8]) -> String {
    refused(open, bytes).to_string()
}

/// Returns a file with a byte replaced.
fn with(bytes: &[u8], at: usize, value: u8) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes[at] = value;
    bytes
}

/// Returns the lead-in and the metadata of a segment.
pub(super) fn segment(toc: u8, objects: &[Vec<u8>], data_length: u64) -> Vec<u8> {
    let count = u32::try_from(objects.len()).unwrap().to_le_bytes();
    let metadata = [&count[..], &objects.concat()].concat();
    let offset = metadata.len() as u64;
    let lead_in = [b"TDSm", &[toc, 0, 0, 0][..], &4713_u32.to_le_bytes()].concat();
    [lead_in, (offset + data_length).to_le_bytes().to_vec(), offset.to_le_bytes().to_vec(), metadata].concat()
}

/// Returns the metadata of a channel of bytes.
pub(super) fn bytes_channel(path: &str, count: u64) -> Vec<u8> {
    let length = u32::try_from(path.len()).unwrap().to_le_bytes();
    let index = [20_u32, 5, 1].map(u32::to_le_bytes).concat();
    [&length, path.as_bytes(), &index, &count.to_le_bytes(), &[0; 4]].concat()
}

#[test]
fn unusual_metadata() {
    let x = bytes_channel("/'g'/'x'", 2);
    let with_type = |kind: u8| with(&x, 4 + 8 + 4, kind);
    // Without the bit for raw data, there are none.
    let none = [segment(14, std::slice::from_ref(&x), 2), vec![1, 2], segment(2, &[], 2), vec![3, 4]].concat();
    assert_eq!(field(&mut *opened(&none), "g", "x"), [1.0, 2.0]);
    // A channel without values, with an impossible count.
    let void = [segment(14, &[with_type(0), bytes_channel("/'g'/'y'", 2)], 2), vec![1, 2]].concat();
    assert_eq!(field(&mut *opened(&void), "g", "y"), [1.0, 2.0]);
    let later = [
        segment(14, std::slice::from_ref(&x), 2),
        vec![1, 2],
        segment(14, &[with_type(0), bytes_channel("/'g'/'y'", 2)], 2),
    ];
    assert_eq!(field(&mut *opened(&[&later.concat()[..], &[3, 4]].concat()), "g", "x"), [1.0, 2.0]);
    // The unit is too long.
    let unit = [&11_u32.to_le_bytes()[..], b"unit_string", &0x20_u32.to_le_bytes(), &300_u32.to_le_bytes()].concat();
    let unit = [&x[..x.len() - 4], &1_u32.to_le_bytes(), &unit, &[b'V'; 300]].concat();
    let log = opened(&[segment(14, &[unit], 2), vec![1, 2]].concat());
    assert_eq!(units(&*log, "g"), [None]);
    // The type of a channel changes.
    let changes =
        [segment(14, std::slice::from_ref(&x), 2), vec![1, 2], segment(14, &[with_type(0x44)], 32), vec![0; 32]]
            .concat();
    assert!(message(&changes).ends_with("changes the type of a channel from U8 to Time"));
    let dimension = with(&x, 4 + 8 + 8, 2);
    let found = message(&[segment(14, &[dimension], 2), vec![1, 2]].concat());
    assert_eq!(found, "the segment at byte 0 holds values of 2 dimensions, expected 1");
    let found = message(&[segment(14, &[with_type(11)], 2), vec![1, 2]].concat());
    assert_eq!(found, "the segment at byte 0 holds values of the type 0xb, which is not supported");
    // The layout of a text has its length in addition.
    let text = [&with_type(0x20)[..32], &[9, 0, 0, 0, 0, 0, 0, 0], &[0; 4]].concat();
    let y = bytes_channel("/'g'/'y'", 2);
    let mixed = [segment(14 | 32, &[text.clone(), y.clone()], 11), vec![0; 11]].concat();
    assert_eq!(message(&mixed), "the segment at byte 0 has text between its numbers");
    let texts = [segment(14 | 32, &[text], 9), vec![0; 9], segment(14, &[y], 2), vec![1, 2]].concat();
    assert_eq!(field(&mut *opened(&texts), "g", "y"), [1.0, 2.0]);
    let lengths = [segment(14 | 32, &[x, bytes_channel("/'g'/'y'", 3)], 5), vec![0; 5]].concat();
    assert_eq!(message(&lengths), "the segment at byte 0 interleaves channels of different lengths");
}

#[test]
fn repeated_properties_count_once() {
    let property = [&2_u32.to_le_bytes()[..], b"ab", &5_u32.to_le_bytes(), &[7]].concat();
    let root = [&1_u32.to_le_bytes()[..], b"/", &[0xff; 4], &100_u32.to_le_bytes(), &property.repeat(100)].concat();
    let channel = bytes_channel("/'g'/'x'", 1);
    let mut bytes = [segment(14, &[channel], 1), vec![1]].concat();
    (0..1001).for_each(|_| bytes.extend(segment(2, std::slice::from_ref(&root), 0)));
    assert_eq!(opened(&bytes).constants()[0], ("ab".to_owned(), 7.0));
}

#[test]
fn many_channels_are_refused() {
    let file = |count: usize| {
        let objects: Vec<_> = (0..count).map(|n| bytes_channel(&format!("/'g'/'{n}'"), 1)).collect();
        [segment(14, &objects, count as u64), vec![9; count]].concat()
    };
    let mut log = opened(&file(10_000));
    assert_eq!(channel(&mut *log, "g").columns, vec![vec![9.0]; 10_000]);
    assert_eq!(message(&file(10_001)), "holds more than 10000 channels");
    assert_eq!(message(&file(20_001)), "holds more than 20000 groups and channels");
}

#[test]
fn long_chunks() {
    let count = 200_001;
    let bytes = |factor: usize| (0..3 * count).map(move |n| u8::try_from(n * factor % 251).unwrap());
    let (a, b): (Vec<u8>, Vec<u8>) = (bytes(1).collect(), bytes(7).collect());
    let objects = ["/'g'/'a'", "/'g'/'b'"].map(|path| bytes_channel(path, count as u64));
    let mut file = segment(14, &objects, 6 * count as u64);
    for chunk in 0..3 {
        file.extend(&a[chunk * count..(chunk + 1) * count]);
        file.extend(&b[chunk * count..(chunk + 1) * count]);
    }
    let numbers = |bytes: &[u8]| bytes.iter().copied().map(f64::from).collect::<Vec<_>>();
    assert_eq!(channel(&mut *opened(&file), "g").columns, [numbers(&a), numbers(&b)]);
    let cut = channel(&mut *opened(&file[..file.len() - 1000]), "g").columns;
    assert_eq!(cut, [numbers(&a[..3 * count - 1000]), numbers(&b[..3 * count - 1000])]);
}

#[test]
fn long_lists_in_short_segments_are_refused() {
    let objects: Vec<_> = (0..5000).map(|n| bytes_channel(&format!("/'g'/'{n}'"), 1)).collect();
    let mut file = [segment(14, &objects, 5000), vec![1; 5000]].concat();
    // A byte of data for 5000 objects: the rest of a chunk, which holds no sample of all of them.
    let short = [b"TDSm", &[8, 0, 0, 0][..], &4713_u32.to_le_bytes(), &1_u64.to_le_bytes(), &[0; 8], &[1]].concat();
    (0..1000).for_each(|_| file.extend(&short));
    assert_eq!(opened(&file).channels()[0].count, 1);
    (0..4000).for_each(|_| file.extend(&short));
    assert!(message(&file).ends_with("list too many objects for their length"));
}

/// File of a beginning and zeros.
struct Zeros {
    beginning: Vec<u8>,
    size: u64,
    position: u64,
}

impl Read for Zeros {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let left = usize::try_from(self.size.saturating_sub(self.position)).unwrap().min(buffer.len());
        let from = usize::try_from(self.position).unwrap();
        for (at, byte) in (from..).zip(&mut buffer[..left]) {
            *byte = self.beginning.get(at).copied().unwrap_or(0);
        }
        self.position += left as u64;
        Ok(left)
    }
}

impl Seek for Zeros {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.position = match to {
            SeekFrom::Start(position) => position,
            SeekFrom::End(offset) => self.size.saturating_add_signed(offset),
            SeekFrom::Current(offset) => self.position.saturating_add_signed(offset),
        };
        Ok(self.position)
    }
}

#[test]
fn long_files_are_read_in_parts() {
    let count = 50_000_001;
    let objects = ["/'g'/'a'", "/'g'/'b'", "/'g'/'c'"].map(|path| bytes_channel(path, count));
    let beginning = segment(14, &objects, 3 * count);
    let size = beginning.len() as u64 + 3 * count;
    let mut log = open(Box::new(Zeros { beginning, size, position: 0 })).unwrap();
    assert_eq!(log.channels()[0].count, count);
    let error = log.read(&[(0, vec![0, 1])]).unwrap_err().to_string();
    assert_eq!(error, "the chosen channels have 100000002 values, expected at most 100000000");
}
