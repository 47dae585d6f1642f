//! Messages in CDR, encoded by Cyclone DDS.

use super::super::cdr::{Fault, read, stamp};
use super::super::schema::Schema;
use super::super::tree::Tree;

const TYPES: &str = "uint8 a\nfloat64 b\nstring[] words\nInner inner\nInner[2] pair\nInner[] list\nfloat64[3] axis\n\
                     float64[] many\nint64 c\n===\nMSG: p/Inner\nuint8 level\nfloat64 value";
const VALUES: [f64; 16] = [1.0, 2.5, 3.0, 4.5, 5.0, 6.5, 7.0, 8.5, 9.0, 10.5, 1.0, 2.0, 3.0, 4.0, 5.0, -6.0];

/// A message with [`VALUES`], encoded by Cyclone DDS in XCDR1, and in XCDR2 of both byte orders.
const MESSAGES: [&str; 3] = [
    "000100000100000000000000000000000000044002000000020000007800000003000000797a00030000000000000000000012400500\
     0000000000000000000000001a400700000000000000000000000000214001000000090000000000000000002540000000000000f03f\
     00000000000000400000000000000840020000000000000000000000000010400000000000001440faffffffffffffff",
    "000700000100000000000000000004401300000002000000020000007800000003000000797a00030000000000001240180000000500\
     00000000000000001a400700000000000000000021401000000001000000090000000000000000002540000000000000f03f00000000\
     0000004000000000000008400200000000000000000010400000000000001440faffffffffffffff",
    "000600000100000040040000000000000000001300000002000000027800000000000003797a00034012000000000000000000180500\
     0000401a00000000000007000000402100000000000000000010000000010900000040250000000000003ff000000000000040000000\
     0000000040080000000000000000000240100000000000004014000000000000fffffffffffffffa",
];

fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> = hex.bytes().filter(u8::is_ascii_hexdigit).collect();
    digits.chunks(2).map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

fn schema(text: &str) -> Schema {
    Schema::ros2("p/msg/M", text, &mut 100).unwrap()
}

/// Returns the values of a message after the tree has grown with it.
fn values(schema: &Schema, message: &[u8]) -> (Vec<f64>, Result<(), Fault>) {
    let mut tree = Tree::new();
    tree.allow(100);
    let grown = read(schema, message, &mut tree);
    let (leaves, _) = tree.leaves();
    tree.select(leaves.iter());
    assert_eq!(read(schema, message, &mut tree), grown);
    (tree.row, grown)
}

#[test]
fn both_variants_in_both_byte_orders() {
    for message in MESSAGES {
        assert_eq!(values(&schema(TYPES), &bytes(message)), (VALUES.to_vec(), Ok(())), "{message}");
    }
}

#[test]
fn messages_that_are_not_understood() {
    let message = bytes(MESSAGES[0]);
    for length in 0..message.len() {
        let (found, read) = values(&schema(TYPES), &message[..length]);
        assert_eq!(read, Err(Fault::Short), "{length}");
        assert!(VALUES.starts_with(&found), "{length}: {found:?}");
    }
    let (found, read) = values(&schema("float64 a"), &bytes("000900000000000000000000"));
    assert_eq!((found, read), (vec![], Err(Fault::Encapsulation(9))));
    // A sequence with more elements than the message has bytes.
    assert_eq!(values(&schema("float64[] a"), &bytes("00010000ffffffff")).1, Err(Fault::Short));
    assert_eq!(values(&schema("string[] a"), &bytes("00010000ffffffff")).1, Err(Fault::Short));
    assert_eq!(values(&schema("E[] a\n===\nMSG: p/E"), &bytes("00010000ffffffff0000")).1, Err(Fault::Short));
}

#[test]
fn times_of_headers() {
    assert_eq!(stamp(&bytes("000100000200000005000000")), Some(2_000_000_005));
    assert_eq!(stamp(&bytes("000000000000000200000005")), Some(2_000_000_005));
    for not in ["000100000000000000000000", "00010000ffffffff00000000", "000100000200000000ca9a3b", "0001000002000000"]
    {
        assert_eq!(stamp(&bytes(not)), None, "{not}");
    }
}
