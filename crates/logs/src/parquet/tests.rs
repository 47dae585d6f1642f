//! Tests of Parquet files that pyarrow wrote (`tests/golden/formats/make_parquet.py`).

use super::super::log::Log;
use super::open;
use std::io::Cursor;

const RECORDING: &[u8] = include_bytes!("../../../../tests/golden/formats/recording.parquet");
const TYPES: &[u8] = include_bytes!("../../../../tests/golden/formats/types.parquet");
const ENCODINGS: &[u8] = include_bytes!("../../../../tests/golden/formats/encodings.parquet");
const LEROBOT: &[u8] = include_bytes!("../../../../tests/golden/formats/lerobot.parquet");
const INT96: &[u8] = include_bytes!("../../../../tests/golden/formats/int96.parquet");

fn log(bytes: &[u8]) -> Box<dyn Log> {
    open(Box::new(Cursor::new(bytes.to_vec()))).unwrap()
}

fn message(bytes: &[u8]) -> String {
    open(Box::new(Cursor::new(bytes.to_vec()))).err().unwrap().to_string()
}

/// Columns of the recording: time, voltage, current, speed.
fn csv() -> [Vec<f64>; 4] {
    let text = include_str!("../../../../tests/golden/formats/recording.csv");
    let column = |n: usize| text.lines().skip(1).map(|line| line.split(',').nth(n).unwrap().parse().unwrap()).collect();
    [0, 1, 2, 3].map(column)
}

/// Column of a name as bits, with those of the same NaN for all NaN.
fn column(log: &mut dyn Log, name: &str) -> Vec<u64> {
    let field = log.channels()[0].fields.iter().position(|field| field.path == name).unwrap();
    bits(&log.read(&[(0, vec![field])]).unwrap()[0].columns[0])
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() }).collect()
}

/// Returns a number rounded to 32 bits.
#[allow(clippy::cast_possible_truncation, reason = "the rounding is meant")]
fn single(value: f64) -> f64 {
    f64::from(value as f32)
}

/// Values of rows 0 to 400 as bits.
fn rows(value: impl Fn(u32) -> f64) -> Vec<u64> {
    bits(&(0..401).map(value).collect::<Vec<_>>())
}

/// The same, with NaN where the files have nulls.
fn with_nulls(value: impl Fn(u32) -> f64) -> Vec<u64> {
    rows(|k| if k % 7 == 3 { f64::NAN } else { value(k) })
}

#[test]
fn a_recording_is_read_to_the_last_bit() {
    let mut log = log(RECORDING);
    let channel = &log.channels()[0];
    assert_eq!((channel.name.as_str(), channel.count, channel.span_s), ("", 401, None));
    let names: Vec<_> = channel.fields.iter().map(|field| field.path.clone()).collect();
    assert_eq!(names, ["time_s", "voltage_V", "current_A", "speed_rad_s"]);
    assert!(log.notes().is_empty() && channel.fields.iter().all(|field| field.unit.is_none()));
    let read = log.read(&[(0, vec![3, 0, 1]), (0, vec![2, 2])]).unwrap();
    let [t, u, i, w] = csv();
    assert_eq!(read[0].columns, [w, t, u]);
    assert_eq!(read[1].columns, [i.clone(), i]);
    assert!(read[0].time_s.is_empty());
}

#[test]
fn all_types_of_numbers_are_read_from_dictionaries_with_nulls() {
    let mut log = log(TYPES);
    let (log, [t, u, i, w]) = (&mut *log, csv());
    let at = |column: &[f64], k: u32| column[k as usize];
    assert_eq!(column(log, "voltage"), with_nulls(|k| at(&u, k)));
    assert_eq!(column(log, "state/velocity"), bits(&w));
    assert_eq!(column(log, "state/motor/current"), with_nulls(|k| at(&i, k)));
    for name in ["stamp_ns", "stamp_ms", "clock_us", "clock_ms"] {
        assert_eq!(column(log, name), bits(&t), "{name}");
    }
    assert_eq!(column(log, "stamp_us"), rows(|k| if k == 0 { f64::NAN } else { at(&t, k - 1) }));
    assert_eq!(column(log, "i8"), rows(|k| f64::from(k % 256) - 128.0));
    assert_eq!(column(log, "u8"), rows(|k| f64::from(k % 256)));
    assert_eq!(column(log, "i16"), rows(|k| f64::from(k) * 163.0 - 32768.0));
    assert_eq!(column(log, "u16"), rows(|k| f64::from(k) * 163.0));
    assert_eq!(column(log, "i32"), rows(|k| f64::from(k) * 1e7 - 2f64.powi(31)));
    assert_eq!(column(log, "u32"), rows(|k| f64::from(k) * 1e7));
    assert_eq!(column(log, "i64"), rows(|k| (i64::from(k) * 20_000_000_000_000_000 - (1 << 62)) as f64));
    assert_eq!(column(log, "u64"), rows(|k| (u64::from(k) * 40_000_000_000_000_000) as f64));
    assert_eq!(column(log, "f32"), rows(|k| single(at(&w, k))));
    assert_eq!(column(log, "on"), with_nulls(|k| f64::from(u8::from(k % 3 == 0))));
    let parsed = |text: String| text.parse::<f64>().unwrap();
    assert_eq!(column(log, "cents"), rows(|k| parsed(format!("{}e-2", i64::from(k) - 200))));
    assert_eq!(column(log, "micro"), rows(|k| parsed(format!("{}e-6", i64::from(k) * 1_000_003 - 5))));
    let huge = |k: u32| (i128::from(k) - 200) * 10_i128.pow(33) + 12_345_678_901_234_567;
    assert_eq!(column(log, "huge"), rows(|k| parsed(format!("{}e-20", huge(k)))));
    assert_eq!(column(log, "empty"), rows(|_| f64::NAN));
    assert_eq!(column(log, "points[0]/x"), rows(f64::from));
    assert_eq!(column(log, "points[1]/x"), rows(|_| 0.5));
    assert_eq!(column(log, "points[0]/y"), rows(|k| -f64::from(k)));
    assert_eq!(column(log, "points[1]/y"), rows(|_| f64::NAN));
    let half = column(log, "f16");
    assert_eq!(half[..2], bits(&[0.575_195_312_5, -0.642_578_125]));
    assert!(half.iter().zip(&w).enumerate().all(|(k, (half, w))| {
        let half = f64::from_bits(*half);
        if k % 7 == 3 { half.is_nan() } else { (half - w).abs() <= w.abs() * 2f64.powi(-11) + 2f64.powi(-25) }
    }));
}

#[test]
fn times_have_a_unit_and_other_columns_are_named_in_notes() {
    let log = log(TYPES);
    let units = log.channels()[0].fields.iter().filter_map(|field| field.unit.as_deref());
    assert_eq!(units.collect::<Vec<_>>(), ["s"; 5]);
    let expected = [
        "stamp_ns: points in time, counted from the first one",
        "stamp_us: points in time, counted from the first one",
        "stamp_ms: points in time, counted from the first one",
        "left out day: dates",
        "left out wide: decimals of 26 bytes",
        "left out text: texts",
        "left out nested: lists of lists",
        "left out pairs/key_value/key: maps",
        "left out pairs/key_value/value: maps",
    ];
    assert_eq!(log.notes(), expected);
}

#[test]
fn differences_and_split_bytes_are_decoded_from_many_pages() {
    let mut log = log(ENCODINGS);
    let (log, [_, u, _, w]) = (&mut *log, csv());
    assert_eq!(column(log, "delta32"), with_nulls(|k| f64::from(k * k % 1000) - 400.0));
    let stamp = |k: u32| (1_700_000_000_123_456_789 + 2_000_000 * i64::from(k)) as f64;
    assert_eq!(column(log, "delta64"), rows(stamp));
    assert_eq!(column(log, "split64"), with_nulls(|k| w[k as usize]));
    assert_eq!(column(log, "split32"), rows(|k| single(w[k as usize])));
    let mut types = self::log(TYPES);
    assert_eq!(column(log, "split16"), column(&mut *types, "f16"));
    assert_eq!(column(log, "plain"), bits(&u));
    assert_eq!(column(log, "bits"), with_nulls(|k| f64::from(u8::from(k % 3 == 0))));
}

#[test]
fn lists_of_equal_length_give_a_field_per_element() {
    let mut log = log(LEROBOT);
    assert_eq!(log.notes(), ["left out frames: lists of 2000 elements, expected at most 1024"]);
    let (log, [_, u, i, w]) = (&mut *log, csv());
    let at = |column: &[f64], k: u32| single(column[k as usize]);
    assert_eq!(column(log, "observation.state[0]"), rows(|k| at(&w, k)));
    assert_eq!(column(log, "observation.state[1]"), rows(|k| at(&i, k)));
    let missing = |k: u32, value: f64| if k == 5 { f64::NAN } else { value };
    assert_eq!(column(log, "action[0]"), rows(|k| missing(k, at(&u, k))));
    assert_eq!(column(log, "action[1]"), rows(|k| missing(k, -at(&u, k))));
    assert_eq!(column(log, "episode_index"), rows(|k| f64::from(k / 200)));
    assert_eq!(column(log, "frame_index"), rows(|k| f64::from(k % 200)));
    // Both elements are read at once.
    let both = log.read(&[(0, vec![1, 0])]).unwrap().remove(0).columns;
    assert_eq!(bits(&both[0]), rows(|k| at(&i, k)));
    let varying = log.channels()[0].fields.iter().position(|field| field.path == "varying[1]").unwrap();
    let error = log.read(&[(0, vec![varying])]).unwrap_err();
    assert_eq!(error.to_string(), "column \"varying\", row group 1: row 170 has 3 elements, expected 2 as before");
    assert!(error.hint().to_string().contains("same length"), "{}", error.hint());
}

#[test]
fn times_of_96_bits_gzip_and_lz4_are_read() {
    let [t, u, ..] = csv();
    for bytes in [
        INT96,
        include_bytes!("../../../../tests/golden/formats/gzip.parquet"),
        include_bytes!("../../../../tests/golden/formats/lz4.parquet"),
    ] {
        let mut log = log(bytes);
        assert_eq!(column(&mut *log, "t"), bits(&t[..40]));
        assert_eq!(column(&mut *log, "u"), bits(&u[..40]));
    }
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let brotli = "column \"t\" has the compression BROTLI, expected SNAPPY, ZSTD, GZIP, LZ4_RAW or none";
    assert_eq!(message(include_bytes!("../../../../tests/golden/formats/brotli.parquet")), brotli);
    assert!(message(b"").starts_with("is not a Parquet file"));
    assert!(message(b"time,voltage\n0,1\n").starts_with("is not a Parquet file"));
    let cut = "is cut off after 11000 bytes or was not closed: found no footer at the end";
    assert_eq!(message(&RECORDING[..11000]), cut);
    let end = RECORDING.len() - 1;
    assert_eq!(message(&[&RECORDING[..end], b"E"].concat()), "is encrypted");
    let mut bytes = RECORDING.to_vec();
    let size = u32::from_le_bytes(bytes[end - 7..end - 3].try_into().unwrap()) as usize;
    let footer = end - 7 - size;
    bytes[footer + 2] = 0xff;
    assert_eq!(message(&bytes), format!("the footer is damaged at byte {}", footer + 3));
}

#[test]
fn damaged_pages_are_named() {
    let mut bytes = RECORDING.to_vec();
    bytes[200..240].fill(0xff);
    let error = log(&bytes).read(&[(0, vec![0])]).unwrap_err().to_string();
    assert_eq!(error, "column \"time_s\", row group 0: the page at byte 4 cannot be decompressed");
    // The other columns are read.
    assert_eq!(log(&bytes).read(&[(0, vec![3])]).unwrap()[0].columns[0], csv()[3]);
}

#[test]
fn columns_of_another_length_than_the_footer_states_are_refused() {
    // 401 and 402 or 400 as signed numbers of the footer, which starts behind the pages.
    for (count, bytes) in [(402, [0xa4, 6]), (400, [0xa0, 6])] {
        let mut file = RECORDING.to_vec();
        for at in file.len() - 2000..file.len() - 1 {
            if file[at..at + 2] == [0xa2, 6] {
                file[at..at + 2].copy_from_slice(&bytes);
            }
        }
        let mut log = log(&file);
        assert_eq!(log.channels()[0].count, count);
        let error = log.read(&[(0, vec![1])]).unwrap_err().to_string();
        let expected = format!("column \"voltage_V\", row group 0: it has 401 rows up to here, expected {count}");
        assert_eq!(error, expected);
    }
}

#[test]
fn fields_that_do_not_exist_are_refused() {
    let error = |requests: &[(usize, Vec<usize>)]| log(RECORDING).read(requests).unwrap_err().to_string();
    assert_eq!([error(&[(0, vec![4])]), error(&[(1, vec![])])], ["has no field 4", "has no field 1"]);
}

const CANDIDATES: &[u8] = include_bytes!("../../../../tests/golden/candidates-snappy.parquet");

fn table(bytes: &[u8]) -> super::Table {
    super::Table::open(Box::new(Cursor::new(bytes.to_vec()))).unwrap()
}

#[test]
fn tables_are_read_in_batches_as_at_once() {
    for (bytes, names) in [
        (TYPES, &["state.velocity", "voltage", "i8", "i64", "f32"][..]),
        (ENCODINGS, &["delta32", "split64", "plain"]),
        (CANDIDATES, &["R", "L", "K", "B", "J"]),
        (include_bytes!("../../../../tests/golden/candidates-null.parquet"), &["K", "R"]),
        (LEROBOT, &["frame_index"]),
    ] {
        let mut table = table(bytes);
        let of = |name: &&str| table.columns().iter().position(|column| column.path == *name).unwrap();
        let indices: Vec<usize> = names.iter().map(of).collect();
        for most in [1, 7, 100, usize::MAX] {
            table.choose(&indices).unwrap();
            let mut columns = vec![Vec::new(); names.len()];
            loop {
                let count = table.next(most).unwrap();
                assert!(count <= most);
                for (n, column) in columns.iter_mut().enumerate() {
                    assert_eq!(table.values(n).len(), count);
                    column.extend_from_slice(table.values(n));
                }
                if count == 0 {
                    break;
                }
            }
            for (name, values) in names.iter().zip(&columns) {
                assert_eq!(values.len() as u64, table.rows());
                assert_eq!(bits(values), column(&mut *log(bytes), &name.replace('.', "/")), "{name}, {most}");
            }
        }
    }
}

#[test]
fn tables_tell_the_types_of_all_columns() {
    let table = table(TYPES);
    let kind = |name: &str| {
        let column = table.columns().iter().find(|column| column.path == name).unwrap();
        (column.kind.clone(), column.is_of_numbers())
    };
    for (name, expected, is_of_numbers) in [
        ("voltage", "DOUBLE NONE", true),
        ("state.motor.current", "DOUBLE NONE", true),
        ("i8", "INT32 INT_8", true),
        ("u16", "INT32 UINT_16", false),
        ("i64", "INT64 NONE", true),
        ("on", "BOOLEAN NONE", false),
        ("stamp_us", "INT64 TIMESTAMP_MICROS", false),
        ("stamp_ns", "INT64 NONE", false),
        ("clock_ms", "INT32 TIME_MILLIS", false),
        ("day", "INT32 DATE", false),
        ("text", "BYTE_ARRAY UTF8", false),
        ("points.list.element.x", "DOUBLE NONE", false),
    ] {
        assert_eq!(kind(name), (expected.to_owned(), is_of_numbers), "{name}");
    }
}

#[test]
fn damaged_tables_are_refused_or_read_but_never_stop() {
    let read = |bytes: &[u8]| -> motorfit_core::Result<usize> {
        let mut table = super::Table::open(Box::new(Cursor::new(bytes.to_vec())))?;
        let numbers = table.columns().iter().enumerate().filter(|(_, column)| column.is_of_numbers());
        let numbers: Vec<usize> = numbers.map(|(n, _)| n).collect();
        table.choose(&numbers)?;
        let mut rows = 0;
        loop {
            match table.next(9)? {
                0 => return Ok(rows),
                count => rows += count,
            }
        }
    };
    for whole in [CANDIDATES, TYPES, ENCODINGS] {
        let rows = read(whole).unwrap();
        for at in (0..whole.len()).step_by(if whole.len() > 10_000 { 37 } else { 5 }) {
            assert!(read(&whole[..at]).is_err());
            let mut bytes = whole.to_vec();
            bytes[at] ^= 0x80;
            // A changed number of rows in the footer must fit the pages.
            assert!(read(&bytes).is_ok_and(|n| n <= rows) || read(&bytes).is_err());
        }
    }
    let mut bytes = CANDIDATES.to_vec();
    bytes[60..100].fill(0xff);
    let error = read(&bytes).unwrap_err().to_string();
    assert!(error.contains("row group 0: the page at byte 4"), "{error}");
}
