//! Blocks of MDF files of version 4: their headers, links and texts.

use super::super::log::Medium;
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use std::io::{Read as _, SeekFrom};

pub(crate) const AGAIN: &str = "Copy the file again.";
/// Largest length of a block that is neither data nor a list of them \[bytes\]; the largest table of a conversion has half of it.
const BLOCK_MAX: u64 = 1 << 20;
/// Largest length of a list of data blocks \[bytes\].
const LIST_MAX: u64 = 64 << 20;
/// Length up to which a text is read \[bytes\].
const TEXT_MAX: u64 = 4096;
/// Length of the header of a block \[bytes\].
pub(crate) const HEADER: u64 = 24;

/// A file of blocks.
pub(crate) struct Blocks {
    pub(crate) medium: Box<dyn Medium>,
    /// Length of the file \[bytes\].
    pub(crate) length: u64,
}

/// Header of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Head {
    /// Type of the block, such as `DG`.
    pub(crate) kind: [u8; 2],
    /// Length of the block with its header \[bytes\].
    pub(crate) length: u64,
    /// Number of links.
    links: u64,
}

/// A block that is not data.
#[derive(Debug)]
pub(crate) struct Block {
    /// Places of other blocks \[bytes\].
    pub(crate) links: Vec<u64>,
    /// Bytes behind the links.
    pub(crate) data: Vec<u8>,
}

impl Blocks {
    /// Reads bytes from a place on.
    ///
    /// # Errors
    /// Returns a `Data` error if the file ends before or cannot be read.
    pub(crate) fn bytes(&mut self, at: u64, count: usize, into: &mut Vec<u8>) -> Result<()> {
        into.clear();
        let unreadable = |error| Error::data(format!("cannot be read: {error}"), AGAIN);
        if at.checked_add(count as u64).is_none_or(|end| end > self.length) {
            return Err(self.cut_off(at));
        }
        self.medium.seek(SeekFrom::Start(at)).map_err(unreadable)?;
        into.reserve(count);
        let read = (&mut *self.medium).take(count as u64).read_to_end(into).map_err(unreadable)?;
        if read < count { Err(self.cut_off(at)) } else { Ok(()) }
    }

    fn cut_off(&self, at: u64) -> Error {
        let message = format!("is cut off after {} bytes: the block at byte {at} is missing", self.length);
        Error::data(message, "Copy the file again, or repair it with the software of the logger.")
    }

    /// Reads the header of the block at a place.
    ///
    /// # Errors
    /// Returns a `Data` error if there is no block.
    pub(crate) fn head(&mut self, at: u64) -> Result<Head> {
        let mut bytes = Vec::new();
        self.bytes(at, 24, &mut bytes)?;
        let bytes = &bytes;
        let head = || match (bytes.get(..2)?, bytes.get(2..4)?) {
            (b"##", &[a, b]) => Some(Head { kind: [a, b], length: number(bytes, 8)?, links: number(bytes, 16)? }),
            _ => None,
        };
        head().ok_or_else(|| {
            let found = bytes.get(..4).map(|id| excerpt(&String::from_utf8_lossy(id))).unwrap_or_default();
            Error::data(format!("the block at byte {at} starts with \"{found}\", expected \"##\""), AGAIN)
        })
    }

    /// Checks the type of a block.
    fn check(&self, at: u64, head: &Head, kinds: &[&[u8; 2]]) -> Result<()> {
        if kinds.contains(&&head.kind) {
            return Ok(());
        }
        let expected = kinds.iter().map(|kind| shown(**kind)).collect::<Vec<_>>().join(" or ");
        let message = format!("the block at byte {at} is of type {}, expected {expected}", shown(head.kind));
        Err(Error::data(message, AGAIN))
    }

    /// Reads the block of one of the given types at a place.
    ///
    /// # Errors
    /// Returns a `Data` error if there is none, or if its header is damaged.
    pub(crate) fn block(&mut self, at: u64, kinds: &[&[u8; 2]]) -> Result<Block> {
        let head = self.head(at)?;
        self.check(at, &head, kinds)?;
        let links = head.links.checked_mul(8).and_then(|size| size.checked_add(HEADER));
        let length_max = if &head.kind == b"DL" { LIST_MAX } else { BLOCK_MAX };
        let (true, Some(links)) = (head.length <= length_max, links.filter(|&links| links <= head.length)) else {
            let message = format!("the header of the {} block at byte {at} is damaged", shown(head.kind));
            return Err(Error::data(message, AGAIN));
        };
        let (mut all, mut data) = (Vec::new(), Vec::new());
        self.bytes(at.saturating_add(HEADER), size(links - HEADER), &mut all)?;
        self.bytes(at.saturating_add(links), size(head.length - links), &mut data)?;
        let links = all.as_chunks().0.iter().map(|bytes| u64::from_le_bytes(*bytes)).collect();
        Ok(Block { links, data })
    }

    /// Reads the text of a block; empty for no link.
    ///
    /// # Errors
    /// Returns a `Data` error if the block is damaged.
    pub(crate) fn text(&mut self, at: u64) -> Result<String> {
        if at == 0 {
            return Ok(String::new());
        }
        let head = self.head(at)?;
        self.check(at, &head, &[b"TX", b"MD"])?;
        let mut bytes = Vec::new();
        let length = head.length.saturating_sub(HEADER).min(TEXT_MAX);
        self.bytes(at.saturating_add(HEADER), size(length), &mut bytes)?;
        let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
        let text = String::from_utf8_lossy(bytes.get(..end).unwrap_or_default()).into_owned();
        if &head.kind == b"TX" {
            return Ok(text.trim().to_owned());
        }
        // The text within XML.
        let text = text.split_once("<TX>").and_then(|(_, rest)| rest.split_once("</TX>")).map_or("", |(text, _)| text);
        Ok(text.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&").trim().to_owned())
    }
}

impl Block {
    /// Returns a link; 0 if it does not exist.
    pub(crate) fn link(&self, index: usize) -> u64 {
        self.links.get(index).copied().unwrap_or(0)
    }

    /// Returns a byte; 0 behind the end.
    pub(crate) fn byte(&self, at: usize) -> u8 {
        self.data.get(at).copied().unwrap_or(0)
    }

    /// Returns a number of 16 bits; 0 behind the end.
    pub(crate) fn number16(&self, at: usize) -> u16 {
        u16::from_le_bytes([self.byte(at), self.byte(at + 1)])
    }

    /// Returns a number of 32 bits; 0 behind the end.
    pub(crate) fn number32(&self, at: usize) -> u32 {
        u32::from(self.number16(at)) | u32::from(self.number16(at + 2)) << 16
    }

    /// Returns a number of 64 bits; 0 behind the end.
    pub(crate) fn number64(&self, at: usize) -> u64 {
        number(&self.data, at).unwrap_or(0)
    }
}

/// Returns the type of a block for a message.
fn shown(kind: [u8; 2]) -> String {
    excerpt(&String::from_utf8_lossy(&kind))
}

fn number(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// Returns a length as a size in memory; the largest one if it does not fit.
pub(crate) fn size(length: u64) -> usize {
    usize::try_from(length).unwrap_or(usize::MAX)
}
