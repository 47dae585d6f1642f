//! Buffered reading of a file as lines of text: memory is independent of the size of the file.
//!
//! Lines are counted from 1 like in a text editor, so that errors name the line that an editor shows.

use motorfit_core::text::hexadecimal;
use motorfit_core::{Error, Result};
use motorfit_logs::unreadable;
use sha2::{Digest as _, Sha256};
use std::borrow::Cow;
use std::io::Read;

/// Length of the longest accepted line \[bytes\].
pub(super) const LINE_MAX: usize = 64 << 10;
/// Number of bytes that are read at once.
const BLOCK: usize = 256 << 10;

/// A line without its line break.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    pub number: u64,
    pub bytes: &'a [u8],
}

impl<'a> Line<'a> {
    /// Returns the line as text. Bytes that are not UTF-8 are read as Latin-1, which affects headings and comments only.
    ///
    /// # Errors
    /// Returns a `Data` error if the line has control characters other than tab, carriage return and form feed.
    pub(super) fn text(self) -> Result<Cow<'a, str>> {
        let bytes = self.bytes;
        if bytes.iter().fold(false, |found, &b| found | (b < 0x20 && !matches!(b, b'\t' | b'\r' | 0x0c))) {
            let found = if bytes.contains(&0) { "a zero byte: binary data or UTF-16" } else { "a control character" };
            return Err(Error::data(format!("found {found}, expected text"), SAVE_AS).at_line(self.number));
        }
        Ok(match std::str::from_utf8(bytes) {
            Ok(text) => Cow::Borrowed(text),
            Err(_) => Cow::Owned(bytes.iter().map(|&b| char::from(b)).collect()),
        })
    }
}

/// A source of lines.
pub(super) trait Lines {
    /// Returns the next line; `None` at the end.
    fn next_line(&mut self) -> Result<Option<Line<'_>>>;

    /// Returns the number of the next line and the bytes from there on that are in the buffer; empty if lines do not end with
    /// line feeds or nothing is buffered.
    fn ahead(&self) -> (u64, &[u8]) {
        (0, &[])
    }

    /// Skips lines that were parsed from the bytes of [`Lines::ahead`].
    fn pass(&mut self, _lines: u64, _bytes: usize) {}

    /// Returns true if the last line has no line break, so that it may be cut off; valid at the end of the file.
    fn is_open(&self) -> bool {
        false
    }
}

/// Lines of a reader of bytes, with a digest of all bytes.
pub(super) struct TextLines<R> {
    reader: R,
    digest: Sha256,
    buffer: Vec<u8>,
    start: usize,
    line: u64,
    at_end: bool,
    open: bool,
    /// Byte that ends a line: a line feed, or a carriage return if the file has no line feeds.
    end: u8,
}

const SAVE_AS: &str = "Save it as CSV in UTF-8 with a heading such as time_s,voltage_V,current_A,speed_rad_s.";

impl<R: Read> TextLines<R> {
    /// Creates the source from the start of a file and skips a byte-order mark.
    ///
    /// # Errors
    /// Returns a `Data` error if the file cannot be read, is empty or is UTF-16 text.
    pub(super) fn new(reader: R) -> Result<Self> {
        let mut lines = Self {
            reader,
            digest: Sha256::new(),
            buffer: Vec::with_capacity(2 * BLOCK),
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

    /// Reads the remaining bytes and returns the SHA-256 digest of the file, in hexadecimal.
    pub(super) fn sha256(mut self) -> Result<String> {
        while !self.at_end {
            self.start = self.buffer.len();
            self.fill()?;
        }
        Ok(hexadecimal(&self.digest.finalize()))
    }

    /// Drops the consumed bytes and appends the next block of the file to the buffer.
    fn fill(&mut self) -> Result<()> {
        self.buffer.drain(..self.start);
        self.start = 0;
        let before = self.buffer.len();
        // `read_to_end` touches only the memory that a small file fills.
        let count = self.reader.by_ref().take(BLOCK as u64).read_to_end(&mut self.buffer);
        self.at_end = count.map_err(|e| unreadable(&e))? < BLOCK;
        self.digest.update(&self.buffer[before..]);
        Ok(())
    }

    /// Returns the range of the next line in the buffer, without its line break.
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

/// Returns the SHA-256 digest in hexadecimal.
pub(super) fn digest(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}
