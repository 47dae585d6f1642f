//! Topics, channels, fields and times of MCAP files made by hand, and the limits of their number.

use super::super::super::log::Medium;
use super::super::limits::{CHANNELS_MAX, NODES_MAX, RECORD_MAX, SCHEMA_MAX, TOPIC_MAX, TOPIC_NODES_MAX};
use super::super::open;
use super::super::walk::{MAGIC, Source, outline};
use super::file::{all, channel, chunk, file, message, record, refused, schema, text};
use super::files::{OTHERS, log};
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Returns the name of a topic: `a` for 0.
fn letter(id: u16) -> [u8; 1] {
    [b'a' + u8::try_from(id).unwrap()]
}

#[test]
fn files_that_decompress_to_too_much_are_refused() {
    let contents = [channel(0, 0, b"a", "json"), message(0, 0, b"1")].concat();
    let error = refused(&file(&[chunk("zstd", (32 << 20) + 1, 0, &contents)]));
    assert_eq!(error.to_string(), "the chunks unpack to more than 33554432 bytes");
    let half = chunk("zstd", (16 << 20) + 1, 0, &contents);
    assert_eq!(refused(&file(&[half.clone(), half])).to_string(), "the chunks unpack to more than 33554432 bytes");
}

#[test]
fn messages_and_names_of_any_size() {
    let large = record(5, &[&[0; 22], &vec![b'1'; RECORD_MAX]]);
    let found = log(&file(&[channel(0, 0, b"a", "json"), message(0, 0, b"1"), large, message(0, 5, b"2")]));
    assert_eq!(found.channels()[0].count, 2);
    assert_eq!(found.notes(), ["left out 1 record of more than 67108864 bytes"]);
    let long = vec![b'n'; TOPIC_MAX + 1];
    let found = log(&file(&[channel(0, 0, b"a", "json"), message(0, 0, b"1"), channel(1, 0, &long, "json")]));
    assert!(found.notes()[0].ends_with("a name of 1001 bytes") && found.notes()[0].len() < 200, "{:?}", found.notes());
    let much = schema(1, "p/M", &vec![b' '; SCHEMA_MAX + 1]);
    let found = log(&file(&[channel(0, 0, b"a", "json"), message(0, 0, b"1"), much, channel(1, 1, b"b", "cdr")]));
    assert_eq!(found.notes(), ["left out topic \"b\": schema 1 is missing"]);
}

#[test]
fn the_number_of_fields_is_limited() {
    let object = |prefix: &str, count: usize| {
        let members: Vec<String> = (0..count).map(|k| format!("\"{prefix}{k}\":{k}")).collect();
        format!("{{{}}}", members.join(",")).into_bytes()
    };
    let two = [channel(0, 0, b"a", "json"), channel(1, 0, b"b", "json"), message(0, 0, &object("x", CHANNELS_MAX - 1))];
    let found = log(&file(&[&two[..], &[message(1, 0, b"1")]].concat()));
    assert_eq!(found.channels().iter().map(|c| c.fields.len()).collect::<Vec<_>>(), [CHANNELS_MAX - 1, 1]);
    let found = log(&file(&[&two[..], &[message(1, 0, b"[1, 2]")]].concat()));
    assert_eq!(
        (found.channels().len(), found.notes()),
        (1, &["left out topic \"b\": more than 10000 fields in all".to_owned()][..])
    );
    // Paths without numbers are counted as well: the first topics leave none to the last one.
    let text = |prefix: usize| {
        let members: Vec<String> = (0..=TOPIC_NODES_MAX / 2).map(|k| format!("\"{prefix}_{k}\":\"\"")).collect();
        format!("{{{},\"last\":1}}", members.join(",")).into_bytes()
    };
    let full = u16::try_from(NODES_MAX / TOPIC_NODES_MAX).unwrap();
    let topic = |id: u16| {
        [
            channel(id, 0, &letter(id), "json"),
            message(id, 0, if id < full { b"{\"first\":1}" } else { b"{\"text\":\"\"}" }),
            message(id, 1, &text(1)),
            message(id, 2, &text(2)),
        ]
    };
    let found = log(&file(&(0..=full).flat_map(topic).collect::<Vec<_>>()));
    assert!(found.channels().iter().all(|channel| channel.fields.len() == 2 && channel.count == 3));
    assert_eq!(found.channels().len(), usize::from(full));
    let names = "topics \"a\", \"b\", \"c\", \"d\", \"e\"";
    let notes = [
        format!("{names}: more paths than can be read; some are left out"),
        "left out topic \"f\": more paths than can be read".to_owned(),
    ];
    assert_eq!(found.notes(), notes);
}

#[test]
fn channels_of_one_topic_are_one_if_their_types_are_equal() {
    let (number, other) = (schema(1, "p/M", b"float64 x"), schema(2, "p/M", b"float64 x # again"));
    let different = schema(3, "p/M", b"float32 x");
    let channels = [
        channel(0, 1, b"a", "cdr"),
        channel(1, 2, b"a", "cdr"),
        channel(2, 3, b"a", "cdr"),
        channel(0, 3, b"b", "cdr"),
    ];
    let value = |x: f64| [&[0, 1, 0, 0][..], &x.to_le_bytes()].concat();
    let messages =
        [message(0, 0, &value(1.0)), message(1, 1, &value(2.0)), message(2, 2, &value(3.0)), message(9, 3, b"")];
    let mut log = log(&file(&[&[number, other, different], &channels[..], &messages].concat()));
    assert_eq!(all(&mut *log).unwrap()[0].columns, [[1.0, 2.0]]);
    assert_eq!(log.notes(), ["left out topic \"a\": a second type of messages"]);
}

#[test]
fn times_of_logging_are_used_if_a_header_is_far_from_them() {
    let stamped = |seconds: u32| {
        [&[0, 1, 0, 0][..], &seconds.to_le_bytes(), &[0; 4], &[1, 0, 0, 0, 0, 0, 0, 0], &seconds.to_le_bytes()].concat()
    };
    let start = [schema(1, "p/M", b"std_msgs/Header h\nuint32 x"), channel(0, 1, b"a", "cdr")];
    let with = |seconds: u32| {
        let messages = [message(0, 100_000_000_000, &stamped(100)), message(0, 101_000_000_000, &stamped(seconds))];
        let mut log = log(&file(&[&start[..], &messages].concat()));
        let series = all(&mut *log).unwrap();
        let mut expected = [100.0, f64::from(seconds)];
        if seconds == 99 {
            // Sorted by the times of the headers.
            expected.reverse();
        }
        assert_eq!(series[0].columns[2], expected);
        series[0].time_s.clone()
    };
    assert_eq!(with(100), [0.0, 0.0]);
    assert_eq!(with(161), [0.0, 61.0]);
    assert_eq!(with(162), [0.0, 1.0]);
    assert_eq!(with(99), [0.0, 1.0]);
    assert_eq!(with(0), [0.0, 1.0]);
}

/// A medium that counts the bytes that are read.
struct Counted(Cursor<Vec<u8>>, Arc<AtomicU64>);

impl Read for Counted {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.0.read(buffer)?;
        self.1.fetch_add(count as u64, Ordering::Relaxed);
        Ok(count)
    }
}

impl Seek for Counted {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.0.seek(to)
    }
}

#[test]
fn chunks_and_attachments_without_the_channels_are_not_read() {
    let contents = |id: u16, size: usize| {
        [channel(id, 0, &letter(id), ["json", "x"][usize::from(id == 2)]), message(id, 0, &vec![b'1'; size])].concat()
    };
    let index = |id: u16| record(7, &[&id.to_le_bytes(), &text(&[0; 16])]);
    let part = |id: u16, size: usize| {
        let contents = contents(id, size);
        [chunk("", contents.len() as u64, 0, &contents), index(id)].concat()
    };
    const SIZE: usize = 1_000_000;
    let attachment = record(9, &[&vec![0; SIZE]]);
    let bytes = file(&[part(0, 1), part(1, 300), part(2, 1), part(2, SIZE), attachment, part(1, SIZE / 2), part(0, 1)]);
    let mut source = Source::new(Box::new(Cursor::new(bytes.clone()))).unwrap();
    let pieces = outline(&mut source).unwrap().pieces;
    assert_eq!(pieces.iter().map(|piece| piece.channels.clone()).collect::<Vec<_>>(), [[0], [1], [2], [2], [1], [0]]);
    let count = Arc::new(AtomicU64::new(0));
    let medium: Box<dyn Medium> = Box::new(Counted(Cursor::new(bytes), Arc::clone(&count)));
    let mut log = open(medium).unwrap();
    let read = count.swap(0, Ordering::Relaxed);
    assert!((SIZE as u64 / 2..SIZE as u64).contains(&read), "{read}");
    assert_eq!(log.read(&[(0, vec![0])]).unwrap()[0].columns, [[1.0, 1.0]]);
    let read = count.swap(0, Ordering::Relaxed);
    assert!(read < SIZE as u64 / 4, "{read}");
    let messages =
        [channel(0, 0, b"a", "json"), message(0, 0, b"1"), record(9, &[&vec![0; SIZE]]), message(0, 0, b"1")];
    let medium: Box<dyn Medium> = Box::new(Counted(Cursor::new(file(&messages)), Arc::clone(&count)));
    assert_eq!(open(medium).unwrap().channels()[0].count, 2);
    let read = count.swap(0, Ordering::Relaxed);
    assert!(read < SIZE as u64 / 4, "{read}");
}

#[test]
fn topics_that_cannot_be_read_are_named() {
    let bytes =
        file(&[channel(0, 0, b"/a", "protobuf"), channel(1, 0, b"/b", "ros1"), channel(2, 0, b"/c", "protobuf")]);
    let error = refused(&bytes);
    let expected = "no topic with numbers: left out topics \"/a\", \"/c\": encoding \"protobuf\", expected cdr or json; \
                    left out topic \"/b\": encoding \"ros1\", expected cdr or json";
    assert_eq!(error.to_string(), expected);
    assert!(error.hint().to_string().contains("ROS 2") && error.hint().to_string().ends_with('.'));
    let many: Vec<Vec<u8>> = (0..50).map(|k| channel(k, 0, format!("/{k}").as_bytes(), "x")).collect();
    assert!(refused(&file(&many)).to_string().contains("\"/9\" and 40 more: encoding"));
    assert_eq!(log(OTHERS).channels().len(), 4);
}

#[test]
fn a_channel_with_messages_before_its_record_is_not_read() {
    let records = [channel(0, 0, b"a", "json"), message(1, 0, b"1"), message(0, 0, b"1"), channel(1, 0, b"b", "json")];
    let log = log(&file(&[&records[..], &[message(1, 1, b"1")]].concat()));
    assert_eq!(log.channels().len(), 1);
    assert_eq!(log.notes(), ["left out topic \"b\": messages before the record of the channel"]);
}

#[test]
fn incomplete_lists_of_channels_are_not_used() {
    let start = [channel(0, 0, b"a", "json"), channel(1, 0, b"b", "x")].concat();
    let contents = [message(0, 0, b"1"), message(1, 0, b"")].concat();
    let chunk = chunk("", contents.len() as u64, 0, &contents);
    let index = |id: u16, times: usize| record(7, &[&id.to_le_bytes(), &text(&vec![0; 16 * times])]);
    // The list that names the first channel is cut off.
    let cut = [&MAGIC[..], &start, &chunk, &index(1, 1), &index(0, 1)[..9]].concat();
    assert_eq!(log(&cut).channels()[0].count, 1);
    let whole = file(&[start, chunk, index(1, 1), index(0, 1), index(7, 0)]);
    let mut source = Source::new(Box::new(Cursor::new(whole))).unwrap();
    assert_eq!(outline(&mut source).unwrap().pieces[1].channels, [1, 0]);
}
