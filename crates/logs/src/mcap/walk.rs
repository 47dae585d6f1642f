//! Outline of an MCAP file: the places of its messages and chunks.
//!
//! A file is a magic text, records, and the magic text again. A record has a type of 1 byte, a length of 8 bytes, and contents.
//! Messages are records of the file or of a chunk, whose records are compressed together; after a chunk, records name its
//! channels. The outline is read from types and lengths, without the summary at the end, which a file that was cut off lacks.

use super::super::log::Medium;
use super::limits::{GAP_MAX, PIECES_MAX, UNPACKED_FREE, UNPACKED_RATIO};
use motorfit_core::text::quoted;
use motorfit_core::{Error, Result};
use std::borrow::Cow;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};

/// Text at the start and at the end of a file.
pub(super) const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
/// Length of type and length of a record \[bytes\].
pub(super) const RECORD_HEAD: usize = 9;
/// Size of the buffer for reading \[bytes\].
pub(super) const BUFFER: usize = 64 << 10;
const AGAIN: &str = "Copy the file again, or repair it with `mcap recover`.";

/// Types of records.
pub(super) mod kind {
    pub const FOOTER: u8 = 2;
    pub const SCHEMA: u8 = 3;
    pub const CHANNEL: u8 = 4;
    pub const MESSAGE: u8 = 5;
    pub const CHUNK: u8 = 6;
    pub const MESSAGE_INDEX: u8 = 7;
    pub const DATA_END: u8 = 15;
}

/// Returns the error for a damaged file.
pub(super) fn damaged(what: &str) -> Error {
    Error::data(format!("the file is damaged: {what}"), AGAIN)
}

/// Returns the error for a file that the system cannot read.
pub(super) fn unreadable(error: &io::Error) -> Error {
    Error::data(format!("the file cannot be read: {error}"), "Copy the file again.")
}

/// A file with its length and the position of the next byte.
pub(super) struct Source {
    reader: BufReader<Box<dyn Medium>>,
    at: u64,
    pub length: u64,
    /// Buffer for records.
    pub record: Vec<u8>,
}

impl Source {
    pub fn new(mut medium: Box<dyn Medium>) -> io::Result<Self> {
        let length = medium.seek(SeekFrom::End(0))?;
        medium.rewind()?;
        Ok(Self { reader: BufReader::with_capacity(BUFFER, medium), at: 0, length, record: Vec::new() })
    }

    /// Moves to a byte of the file.
    pub fn go(&mut self, to: u64) -> io::Result<()> {
        let step = i64::try_from(i128::from(to) - i128::from(self.at)).map_err(io::Error::other)?;
        self.reader.seek_relative(step)?;
        self.at = to;
        Ok(())
    }

    /// Returns the bytes at a place, or as many of them as the file has.
    fn bytes<const N: usize>(&mut self, at: u64) -> Result<Vec<u8>> {
        let mut bytes = Vec::with_capacity(N);
        self.go(at).and_then(|()| self.take(N as u64).read_to_end(&mut bytes)).map_err(|e| unreadable(&e))?;
        Ok(bytes)
    }
}

impl Read for Source {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.reader.read(buffer)?;
        self.at += count as u64;
        Ok(count)
    }
}

impl BufRead for Source {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.reader.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.reader.consume(count);
        self.at += count as u64;
    }
}

/// Remaining contents of a record.
pub(super) struct Body<'a>(pub &'a [u8]);

impl<'a> Body<'a> {
    pub fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    pub fn u16(&mut self) -> Option<u16> {
        self.take(2)?.first_chunk().map(|bytes| u16::from_le_bytes(*bytes))
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.take(4)?.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))
    }

    pub fn u64(&mut self) -> Option<u64> {
        self.take(8)?.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))
    }

    /// Returns bytes after their length.
    pub fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()?;
        self.take(length as usize)
    }

    pub fn text(&mut self) -> Option<Cow<'a, str>> {
        self.bytes().map(String::from_utf8_lossy)
    }
}

/// Compression of a chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Compression {
    None,
    Lz4,
    Zstd,
}

/// Chunk around a piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Chunk {
    pub compression: Compression,
    /// Size of the decompressed records \[bytes\].
    pub size: u64,
    /// Checksum of the decompressed records; 0 if there is none.
    pub checksum: u32,
}

/// A part of a file with records of messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Piece {
    /// Place of the record of the chunk, or of the first record.
    pub at: u64,
    pub start: u64,
    pub end: u64,
    /// Chunk; `None` for records of the file itself.
    pub chunk: Option<Chunk>,
    /// Channels with messages; empty if not known.
    pub channels: Vec<u16>,
    /// True if the piece may be incomplete.
    pub cut: bool,
}

/// Pieces of a file in their order.
#[derive(Debug, Default)]
pub(super) struct Outline {
    pub pieces: Vec<Piece>,
    /// Place at which the file is cut off.
    pub cut: Option<u64>,
    /// Sum of the sizes of decompressed chunks \[bytes\].
    unpacked: u64,
}

/// Result of a record.
enum Step {
    Next(u64),
    End,
    Cut(u64),
}

/// Reads the outline of a file.
///
/// # Errors
/// Returns a `Data` error if the file is not an MCAP file, is damaged, or decompresses to too much.
pub(super) fn outline(source: &mut Source) -> Result<Outline> {
    if source.bytes::<8>(0)? != MAGIC {
        return Err(Error::data("is not an MCAP file", "Choose a recording with the ending .mcap."));
    }
    let mut outline = Outline::default();
    let mut at = 8;
    let mut complete = false;
    let cut = loop {
        let head = source.bytes::<9>(at)?;
        let Some((&kind, length)) = head.split_first() else { break source.length };
        let Some(length) = length.first_chunk::<8>() else { break source.length };
        complete |= kind == kind::DATA_END;
        match outline.record(source, at, (kind, u64::from_le_bytes(*length)))? {
            Step::Next(next) => at = next,
            Step::End => return Ok(outline),
            Step::Cut(cut) => break cut,
        }
        if outline.pieces.len() > PIECES_MAX {
            let message = format!("has more than {PIECES_MAX} chunks");
            return Err(Error::data(message, "Write it with larger chunks: `mcap compress`."));
        }
    };
    if complete {
        return Ok(outline);
    }
    if at < source.length && source.bytes::<8>(source.length - 8)? == MAGIC {
        return Err(damaged(&format!("found no record at byte {at}")));
    }
    outline.cut = Some(cut);
    if let Some(last) = outline.pieces.last_mut() {
        (last.cut, last.channels) = (true, Vec::new());
    }
    Ok(outline)
}

impl Outline {
    /// Adds the record at a place.
    fn record(&mut self, source: &mut Source, at: u64, (kind, length): (u8, u64)) -> Result<Step> {
        let start = at + RECORD_HEAD as u64;
        let end = start.checked_add(length).filter(|&end| end <= source.length);
        let Some(end) = end.filter(|_| kind != 0) else {
            if kind == kind::CHUNK {
                self.chunk(source, at, length)?;
            }
            return Ok(Step::Cut(if kind == 0 { at } else { source.length }));
        };
        match kind {
            kind::SCHEMA | kind::CHANNEL | kind::MESSAGE => match self.pieces.last_mut() {
                Some(last) if last.chunk.is_none() && at - last.end <= GAP_MAX => last.end = end,
                _ => self.pieces.push(Piece { at, start: at, end, chunk: None, channels: Vec::new(), cut: false }),
            },
            kind::CHUNK => self.chunk(source, at, length)?,
            kind::MESSAGE_INDEX => {
                // The channel and the length of its list.
                if let [low, high, ref list @ ..] = source.bytes::<6>(start)?[..]
                    && *list != [0; 4]
                    && let Some(last) = self.pieces.last_mut()
                {
                    last.channels.push(u16::from_le_bytes([low, high]));
                }
            }
            kind::FOOTER => {
                let rest = source.bytes::<8>(end)?;
                if rest.len() == MAGIC.len() && rest != MAGIC {
                    return Err(damaged(&format!("found a footer at byte {at}, which is not the end")));
                }
                return Ok(Step::End);
            }
            _ => {}
        }
        Ok(Step::Next(end))
    }

    /// Adds a chunk, whose records may be incomplete.
    fn chunk(&mut self, source: &mut Source, at: u64, length: u64) -> Result<()> {
        // Two times, size, checksum, compression and compressed size.
        const SIZE: usize = 16 + 8 + 4 + 4 + NAME + 8;
        const NAME: usize = 16;
        let broken = |what: &str| damaged(&format!("chunk at byte {at}: {what}"));
        let head = source.bytes::<SIZE>(at + RECORD_HEAD as u64)?;
        let mut rest = Body(&head);
        let mut parts = || Some((rest.take(16)?, rest.u64()?, rest.u32()?, rest.bytes()?, rest.u64()?));
        let Some((_times, size, checksum, name, packed)) = parts() else {
            return if head.len() < SIZE { Ok(()) } else { Err(broken("the name of its compression is too long")) };
        };
        let compression = match name {
            b"" | b"none" => Compression::None,
            b"lz4" => Compression::Lz4,
            b"zstd" => Compression::Zstd,
            other => {
                let other = quoted(&String::from_utf8_lossy(other));
                let message = format!("chunk at byte {at}: compression {other}, expected zstd, lz4 or none");
                return Err(Error::data(message, "Convert the file with `mcap compress`."));
            }
        };
        let before = (head.len() - rest.0.len()) as u64;
        if length.checked_sub(before).is_none_or(|most| packed > most) {
            return Err(broken(&format!("{packed} bytes in a record of {length} bytes")));
        }
        if compression == Compression::None && packed != size {
            return Err(broken(&format!("found {packed} bytes, expected {size}")));
        }
        self.unpacked = self.unpacked.saturating_add(size);
        let unpacked_max = source.length.saturating_mul(UNPACKED_RATIO).max(UNPACKED_FREE);
        if self.unpacked > unpacked_max {
            let message = format!("the chunks unpack to more than {unpacked_max} bytes");
            return Err(Error::data(message, "Write only the topics of the motor: `mcap filter`."));
        }
        let start = at + RECORD_HEAD as u64 + before;
        let end = start.saturating_add(packed).min(source.length);
        let chunk = Some(Chunk { compression, size, checksum });
        self.pieces.push(Piece { at, start, end, chunk, channels: Vec::new(), cut: false });
        Ok(())
    }
}
