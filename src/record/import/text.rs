//! A file as lines of text, a piece at a time: memory does not grow with the file.
//!
//! Lines are counted as a text editor does, so that an error names the line that its reader will find.

use crate::text::{hexadecimal, printable};
use crate::{Error, Result};
use sha2::{Digest as _, Sha256};
use std::borrow::Cow;
use std::io::Read;

/// The longest line that is read.
pub(super) const LINE_MAX: usize = 64 << 10;
/// Bytes that are read at once.
const PIECE: usize = 256 << 10;

/// A line without its end.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    pub number: u64,
    pub bytes: &'a [u8],
}

impl<'a> Line<'a> {
    /// The line as text. Only headings and comments hold other letters than numbers do; what is no UTF-8 is read as
    /// Latin-1.
    pub(super) fn text(self) -> Result<Cow<'a, str>> {
        let bytes = self.bytes;
        if bytes.iter().fold(false, |found, &b| found | (b < 0x20 && !matches!(b, b'\t' | b'\r' | 0x0c))) {
            let sort = if bytes.contains(&0) { "a zero byte: binary data or UTF-16" } else { "a control character" };
            return Err(Error::data(format!("found {sort}, expected text"), SAVE_AS).at_line(self.number));
        }
        Ok(match std::str::from_utf8(bytes) {
            Ok(text) => Cow::Borrowed(text),
            Err(_) => Cow::Owned(bytes.iter().map(|&b| char::from(b)).collect()),
        })
    }
}

/// Sources of lines.
pub(super) trait Lines {
    /// The next line; `None` at the end.
    fn next_line(&mut self) -> Result<Option<Line<'_>>>;

    /// The number of the next line, and what has been read already from there on, where line feeds end lines.
    fn ahead(&self) -> (u64, &[u8]) {
        (0, &[])
    }

    /// Passes over lines that were taken from there.
    fn pass(&mut self, _lines: u64, _bytes: usize) {}

    /// Returns whether the last line had no end, so that it may be cut off; known at the end.
    fn is_open(&self) -> bool {
        false
    }
}

/// The lines of bytes as they come.
pub(super) struct TextLines<R> {
    reader: R,
    digest: Sha256,
    buffer: Vec<u8>,
    start: usize,
    line: u64,
    at_end: bool,
    open: bool,
    /// The end of a line: a line feed, or a carriage return on old systems.
    end: u8,
}

const SAVE_AS: &str = "Save it as CSV in UTF-8 with a heading such as time_s,voltage_V,current_A,speed_rad_s.";

impl<R: Read> TextLines<R> {
    pub(super) fn new(reader: R) -> Result<Self> {
        let mut lines = Self {
            reader,
            digest: Sha256::new(),
            buffer: Vec::with_capacity(2 * PIECE),
            start: 0,
            line: 0,
            at_end: false,
            open: false,
            end: b'\n',
        };
        lines.fill()?;
        if lines.buffer.starts_with(&[0xff, 0xfe]) || lines.buffer.starts_with(&[0xfe, 0xff]) {
            return Err(Error::data("is UTF-16 text, expected UTF-8", SAVE_AS));
        }
        if lines.buffer.starts_with(b"\xef\xbb\xbf") {
            lines.start = 3;
        }
        if lines.start == lines.buffer.len() {
            return Err(Error::data("is empty, expected a heading and rows of numbers", SAVE_AS));
        }
        if !lines.buffer.contains(&b'\n') && lines.buffer.contains(&b'\r') {
            lines.end = b'\r';
        }
        Ok(lines)
    }

    /// The digest of all bytes, in hexadecimal; reads what is left.
    pub(super) fn sha256(mut self) -> Result<String> {
        while !self.at_end {
            self.start = self.buffer.len();
            self.fill()?;
        }
        Ok(hexadecimal(&self.digest.finalize()))
    }

    /// Reads another piece behind what is left of the last.
    fn fill(&mut self) -> Result<()> {
        self.buffer.drain(..self.start);
        self.start = 0;
        let before = self.buffer.len();
        // Memory behind what a small file fills is never touched.
        let piece = self.reader.by_ref().take(PIECE as u64).read_to_end(&mut self.buffer);
        self.at_end = piece.map_err(|e| unreadable(&e))? < PIECE;
        self.digest.update(&self.buffer[before..]);
        Ok(())
    }

    /// Where the next line stands in the buffer, its end left out.
    fn find(&mut self) -> Result<Option<std::ops::Range<usize>>> {
        let mut searched = self.start;
        loop {
            if let Some(at) = memchr::memchr(self.end, &self.buffer[searched..]) {
                let line = self.start..searched + at;
                self.start = line.end + 1;
                return Ok(Some(line));
            }
            if self.at_end {
                let line = self.start..self.buffer.len();
                self.start = self.buffer.len();
                self.open |= !line.is_empty();
                return Ok((!line.is_empty()).then_some(line));
            }
            let length = self.buffer.len() - self.start;
            if length > LINE_MAX {
                return Err(too_long(length).at_line(self.line + 1));
            }
            self.fill()?;
            searched = length;
        }
    }
}

impl<R: Read> Lines for TextLines<R> {
    fn next_line(&mut self) -> Result<Option<Line<'_>>> {
        let Some(range) = self.find()? else { return Ok(None) };
        self.line += 1;
        let bytes = &self.buffer[range];
        let bytes = bytes.strip_suffix(b"\r").unwrap_or(bytes);
        if bytes.len() > LINE_MAX {
            return Err(too_long(bytes.len()).at_line(self.line));
        }
        Ok(Some(Line { number: self.line, bytes }))
    }

    fn ahead(&self) -> (u64, &[u8]) {
        (self.line + 1, if self.end == b'\n' { &self.buffer[self.start..] } else { &[] })
    }

    fn pass(&mut self, lines: u64, bytes: usize) {
        self.line += lines;
        self.start += bytes;
    }

    fn is_open(&self) -> bool {
        self.open
    }
}

fn too_long(length: usize) -> Error {
    let message = format!("is {length} bytes long or more, expected at most {LINE_MAX}");
    Error::data(message, "Check that it is CSV with one sample per line.")
}

/// Why a file cannot be read.
pub(super) fn unreadable(error: &std::io::Error) -> Error {
    let remedy = match error.kind() {
        std::io::ErrorKind::NotFound => "Check the path; relative paths start at the current folder.",
        std::io::ErrorKind::PermissionDenied => "Allow reading it, or run as a user with permission to read it.",
        _ => "Check the file and its disk.",
    };
    Error::data(format!("cannot be read: {}", printable(&error.to_string())), remedy)
}

/// SHA-256 in hexadecimal.
pub(super) fn digest(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}
