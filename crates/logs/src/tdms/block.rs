//! Blocks of values in the segments of TDMS files.

use super::super::window::Window;
use super::kind::Kind;
use super::source::COPY_AGAIN;
use motorfit_core::{Error, Result};

/// Length of the longest chunk that is read as a whole \[bytes\].
const CHUNK_MAX: u64 = 64 << 10;
/// Number of bytes of one object that are converted at once; a multiple of the size of each type.
const SLICE: u64 = 64 << 10;

/// Values of an object in a chunk.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    pub object: usize,
    pub kind: Kind,
    /// Position in the chunk \[bytes\].
    pub offset: u64,
    /// Number of values.
    pub count: u64,
}

/// Chunks of equal layout in a row.
#[derive(Debug)]
pub(super) struct Block {
    /// Position of the first chunk.
    pub start: u64,
    /// Length of a chunk \[bytes\].
    pub length: u64,
    /// Number of chunks.
    pub chunks: u64,
    pub parts: Vec<Part>,
}

/// Returns parts that follow each other, and their total length \[bytes\].
pub(super) fn in_a_row(objects: impl Iterator<Item = (usize, Kind, u64)>) -> (Vec<Part>, u64) {
    let mut length = 0_u64;
    let parts = objects.map(|(object, kind, count)| {
        let part = Part { object, kind, offset: length, count };
        length = length.saturating_add(count.saturating_mul(u64::from(kind.size())));
        part
    });
    (parts.collect(), length)
}

/// Calls `use_values` with the bytes of all values of the wanted objects of a block, in pieces of whole values.
///
/// # Errors
/// Returns a `Data` error if the file cannot be read or has become shorter.
pub(super) fn read_block(
    window: &mut Window,
    block: &Block,
    is_wanted: impl Fn(&Part) -> bool,
    mut use_values: impl FnMut(&Part, &[u8]),
) -> Result<()> {
    let parts: Vec<&Part> = block.parts.iter().filter(|part| part.count > 0 && is_wanted(part)).collect();
    if parts.is_empty() {
        return Ok(());
    }
    for chunk in 0..block.chunks {
        let start = block.start + chunk * block.length;
        if block.length <= CHUNK_MAX {
            let bytes = window.get(start, usize::try_from(block.length).unwrap_or(usize::MAX))?;
            for part in &parts {
                let values = usize::try_from(part.offset).ok().zip(usize::try_from(part.length()).ok());
                let values = values.and_then(|(offset, length)| bytes.get(offset..)?.get(..length));
                use_values(part, values.ok_or_else(|| shorter(start))?);
            }
            continue;
        }
        for part in &parts {
            let mut at = start + part.offset;
            let end = at + part.length();
            while at < end {
                let count = (end - at).min(SLICE);
                let bytes = window.get(at, usize::try_from(count).unwrap_or(usize::MAX))?;
                if (bytes.len() as u64) < count {
                    return Err(shorter(at));
                }
                use_values(part, bytes);
                at += count;
            }
        }
    }
    Ok(())
}

impl Part {
    /// Returns the length of the values \[bytes\].
    fn length(&self) -> u64 {
        self.count.saturating_mul(u64::from(self.kind.size()))
    }
}

/// Returns the error for values beyond the end of the file.
fn shorter(at: u64) -> Error {
    Error::data(format!("found the end of the file within the values at byte {at}"), COPY_AGAIN)
}
