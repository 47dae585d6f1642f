//! MCAP files made by hand.

use super::super::super::log::{Log, Series};
use super::super::open;
use super::super::walk::MAGIC;
use motorfit_core::{Error, Result};
use std::io::Cursor;

pub fn opened(bytes: &[u8]) -> Result<Box<dyn Log>> {
    open(Box::new(Cursor::new(bytes.to_vec())))
}

pub fn refused(bytes: &[u8]) -> Error {
    match opened(bytes) {
        Ok(log) => panic!("opened with {:?} and {:?}", log.channels(), log.notes()),
        Err(error) => error,
    }
}

pub fn all(log: &mut dyn Log) -> Result<Vec<Series>> {
    let requests: Vec<(usize, Vec<usize>)> =
        log.channels().iter().enumerate().map(|(at, channel)| (at, (0..channel.fields.len()).collect())).collect();
    log.read(&requests)
}

pub fn record(kind: u8, contents: &[&[u8]]) -> Vec<u8> {
    let contents = contents.concat();
    [&[kind][..], &(contents.len() as u64).to_le_bytes(), &contents].concat()
}

pub fn text(text: &[u8]) -> Vec<u8> {
    [&u32::try_from(text.len()).unwrap().to_le_bytes(), text].concat()
}

pub fn schema(id: u16, name: &str, data: &[u8]) -> Vec<u8> {
    record(3, &[&id.to_le_bytes(), &text(name.as_bytes()), &text(b"ros2msg"), &text(data)])
}

pub fn channel(id: u16, schema: u16, topic: &[u8], encoding: &str) -> Vec<u8> {
    record(4, &[&id.to_le_bytes(), &schema.to_le_bytes(), &text(topic), &text(encoding.as_bytes()), &text(b"")])
}

pub fn message(id: u16, time: u64, data: &[u8]) -> Vec<u8> {
    record(5, &[&id.to_le_bytes(), &[0; 4], &time.to_le_bytes(), &[0; 8], data])
}

pub fn chunk(compression: &str, size: u64, checksum: u32, packed: &[u8]) -> Vec<u8> {
    let sizes = [&size.to_le_bytes()[..], &checksum.to_le_bytes()].concat();
    record(6, &[&[0; 16], &sizes, &text(compression.as_bytes()), &(packed.len() as u64).to_le_bytes(), packed])
}

/// Returns a file of records with a footer.
pub fn file(records: &[Vec<u8>]) -> Vec<u8> {
    [&MAGIC[..], &records.concat(), &record(15, &[&[0; 4]]), &record(2, &[&[0; 20]]), &MAGIC].concat()
}
