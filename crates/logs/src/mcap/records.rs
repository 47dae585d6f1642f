//! Records of a piece of an MCAP file, decompressed on the way.

use super::limits::RECORD_MAX;
use super::walk::{BUFFER, Body, Chunk, Compression, Piece, RECORD_HEAD, Source, damaged, kind, unreadable};
use lz4_flex::frame::FrameDecoder;
use motorfit_core::{Error, Result};
use std::borrow::Cow;
use std::io::{self, BufReader, Read};

/// A record that concerns messages.
pub(super) enum Record<'a> {
    Schema {
        id: u16,
        name: Cow<'a, str>,
        encoding: Cow<'a, str>,
        data: &'a [u8],
    },
    Channel {
        id: u16,
        schema: u16,
        topic: Cow<'a, str>,
        encoding: Cow<'a, str>,
    },
    Message {
        channel: u16,
        time: u64,
        data: &'a [u8],
    },
    /// A record that is too large.
    TooLarge,
}

/// Reason for which the records of a piece cannot be read.
enum Trouble {
    Read(io::Error),
    Damaged(String),
    Visit(Error),
}

impl From<io::Error> for Trouble {
    fn from(error: io::Error) -> Self {
        Self::Read(error)
    }
}

/// Visits the records of a piece in their order.
///
/// # Errors
/// Returns a `Data` error if the piece is damaged or cannot be read, and the error of the visit. The records before the end
/// of a piece that was cut off are visited without an error.
pub(super) fn visit_records(
    source: &mut Source,
    piece: &Piece,
    visit: &mut dyn FnMut(Record<'_>) -> Result<()>,
) -> Result<()> {
    let mut record = std::mem::take(&mut source.record);
    let read = match piece.chunk {
        Some(chunk) => unpacked(source, piece, chunk, (&mut record, visit)),
        None => source.go(piece.start).map_err(Trouble::Read).and_then(|()| {
            let length = piece.end.saturating_sub(piece.start);
            records(source, length, (&mut record, visit))
        }),
    };
    source.record = record;
    let what = match read {
        Ok(()) => return Ok(()),
        Err(Trouble::Visit(error)) => return Err(error),
        Err(Trouble::Read(error)) if error.raw_os_error().is_some() => return Err(unreadable(&error)),
        Err(_) if piece.cut => return Ok(()),
        Err(Trouble::Read(error)) => error.to_string(),
        Err(Trouble::Damaged(what)) => what,
    };
    let place = if piece.chunk.is_some() { "chunk" } else { "records" };
    Err(damaged(&format!("{place} at byte {}: {what}", piece.at)))
}

/// Buffer for a record and function that takes records.
type Visit<'a> = (&'a mut Vec<u8>, &'a mut dyn FnMut(Record<'_>) -> Result<()>);

/// Visits the records of a chunk.
fn unpacked(source: &mut Source, piece: &Piece, chunk: Chunk, visit: Visit<'_>) -> std::result::Result<(), Trouble> {
    source.go(piece.start)?;
    let packed = source.by_ref().take(piece.end.saturating_sub(piece.start));
    let decoder: Box<dyn Read + '_> = match chunk.compression {
        Compression::None => Box::new(packed),
        Compression::Lz4 => Box::new(FrameDecoder::new(packed)),
        Compression::Zstd => Box::new(zstd::stream::read::Decoder::with_buffer(packed)?),
    };
    let checked = Checked { inner: decoder.take(chunk.size), hasher: crc32fast::Hasher::new() };
    let mut stream = BufReader::with_capacity(BUFFER, checked);
    records(&mut stream, chunk.size, visit)?;
    let checksum = stream.into_inner().hasher.finalize();
    if chunk.checksum != 0 && chunk.checksum != checksum {
        return Err(Trouble::Damaged(format!("found the checksum {checksum:08x}, expected {:08x}", chunk.checksum)));
    }
    Ok(())
}

/// Reader that computes the checksum of what it read.
struct Checked<R> {
    inner: R,
    hasher: crc32fast::Hasher,
}

impl<R: Read> Read for Checked<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.hasher.update(buffer.get(..count).unwrap_or_default());
        Ok(count)
    }
}

/// Visits the records in `length` bytes of a stream.
fn records<R: Read>(stream: &mut R, length: u64, (buffer, visit): Visit<'_>) -> std::result::Result<(), Trouble> {
    let mut left = length;
    while left > 0 {
        let mut head = [0; RECORD_HEAD];
        stream.read_exact(&mut head)?;
        let [kind, length @ ..] = head;
        let length = u64::from_le_bytes(length);
        let rest = left.checked_sub(RECORD_HEAD as u64).and_then(|left| left.checked_sub(length));
        let before = left;
        let damaged =
            || Trouble::Damaged(format!("found a record of type {kind} and {length} bytes in {before} bytes"));
        left = rest.ok_or_else(damaged)?;
        let wanted = matches!(kind, kind::SCHEMA | kind::CHANNEL | kind::MESSAGE);
        if !wanted || length > RECORD_MAX as u64 {
            if io::copy(&mut stream.take(length), &mut io::sink())? < length {
                return Err(Trouble::Read(io::ErrorKind::UnexpectedEof.into()));
            }
            if wanted {
                visit(Record::TooLarge).map_err(Trouble::Visit)?;
            }
            continue;
        }
        let length = usize::try_from(length).unwrap_or(RECORD_MAX);
        if buffer.len() < length {
            buffer.resize(length, 0);
        }
        let Some(body) = buffer.get_mut(..length) else { continue };
        stream.read_exact(body)?;
        let record = parsed(kind, body).ok_or_else(damaged)?;
        visit(record).map_err(Trouble::Visit)?;
    }
    Ok(())
}

/// Parses a record; `None` if it is too short.
fn parsed(kind: u8, body: &[u8]) -> Option<Record<'_>> {
    let mut body = Body(body);
    Some(match kind {
        kind::SCHEMA => {
            let (id, name, encoding) = (body.u16()?, body.text()?, body.text()?);
            Record::Schema { id, name, encoding, data: body.bytes()? }
        }
        kind::CHANNEL => {
            let (id, schema) = (body.u16()?, body.u16()?);
            Record::Channel { id, schema, topic: body.text()?, encoding: body.text()? }
        }
        _ => {
            let channel = body.u16()?;
            let _sequence = body.take(4)?;
            let time = body.u64()?;
            let _published = body.take(8)?;
            Record::Message { channel, time, data: body.0 }
        }
    })
}
