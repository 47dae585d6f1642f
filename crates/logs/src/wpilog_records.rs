//! Records of a WPILib data log: a header, then records of an entry number, a time and a payload of bytes, all little-endian.
//!
//! Source: WPILib Data Log File Format Specification, version 1.0.

use super::log::Medium;
use super::unreadable::unreadable;
use motorfit_core::numeric::index;
use motorfit_core::{Error, Result};
use std::io::SeekFrom;

/// First bytes of a log.
pub(crate) const MAGIC: &[u8] = b"WPILOG";
/// Number of bytes that are read at once.
const CHUNK: usize = 1 << 18;
/// Largest payload that is read \[bytes\]; larger ones, such as camera images, are skipped.
pub const PAYLOAD_MAX: usize = 16 << 20;

/// A record of the log.
pub(crate) struct Record<'a> {
    /// Number of its entry; 0 is the log itself.
    pub entry: u32,
    /// Time \[µs\].
    pub time_us: u64,
    /// Payload; empty if it exceeds [`PAYLOAD_MAX`].
    pub payload: &'a [u8],
}

/// Records of a log in the order of the file.
pub(crate) struct Records<'m> {
    medium: &'m mut dyn Medium,
    buffer: Vec<u8>,
    /// First byte of the buffer that was not used, and the end of the bytes in it.
    used: usize,
    filled: usize,
    /// Position in the file of the first unused byte.
    position: u64,
    size: u64,
    /// Position of an incomplete record at the end of the file.
    pub cut_at: Option<u64>,
}

impl<'m> Records<'m> {
    /// Reads the header and begins with the first record.
    ///
    /// # Errors
    /// Returns `Data` if the header is not that of a log of version 1, or the file cannot be read.
    pub(crate) fn new(medium: &'m mut dyn Medium) -> Result<Self> {
        let size = medium.seek(SeekFrom::End(0)).and_then(|size| medium.rewind().map(|()| size));
        let size = size.map_err(|error| unreadable(&error))?;
        let (buffer, used, filled) = (vec![0; CHUNK], 0, 0);
        let mut records = Self { medium, buffer, used, filled, position: 0, size, cut_at: None };
        records.fill(12)?;
        let header = records.ahead();
        let damaged = |found: String| {
            Error::data(format!("{found}, expected the header of a WPILib data log"), "Copy the log again.")
        };
        if !header.starts_with(MAGIC) {
            return Err(damaged("found other bytes".to_owned()));
        }
        let (Some(&[minor, major]), Some(extra)) = (header.get(6..8), header.get(8..12)) else {
            return Err(damaged(format!("found {} bytes", header.len())));
        };
        if major != 1 {
            let message = format!("is a WPILib data log of version {major}.{minor}, expected version 1");
            return Err(Error::data(message, "Convert it with WPILib's DataLogTool, or export it as CSV."));
        }
        let extra = number(extra);
        if extra > size - 12 {
            return Err(damaged(format!("found an extra header of {extra} bytes in a file of {size}")));
        }
        records.skip(12 + extra)?;
        Ok(records)
    }

    fn ahead(&self) -> &[u8] {
        &self.buffer[self.used..self.filled]
    }

    /// Reads until at least `wanted` bytes are ahead, or the file ends.
    fn fill(&mut self, wanted: usize) -> Result<()> {
        if self.filled - self.used >= wanted {
            return Ok(());
        }
        self.buffer.copy_within(self.used..self.filled, 0);
        self.filled -= self.used;
        self.used = 0;
        if self.buffer.len() < wanted {
            self.buffer.resize(wanted.next_multiple_of(CHUNK), 0);
        }
        while self.filled < wanted {
            match self.medium.read(&mut self.buffer[self.filled..]) {
                Ok(0) => break,
                Ok(read) => self.filled += read,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(error) => return Err(unreadable(&error)),
            }
        }
        Ok(())
    }

    /// Passes over bytes, which are not read if they are beyond the buffer.
    fn skip(&mut self, bytes: u64) -> Result<()> {
        self.position += bytes;
        let ahead = (self.filled - self.used) as u64;
        if bytes <= ahead {
            self.used += index(bytes);
            return Ok(());
        }
        (self.used, self.filled) = (0, 0);
        self.medium.seek(SeekFrom::Start(self.position)).map_err(|error| unreadable(&error))?;
        Ok(())
    }

    /// Returns the next record; `None` at the end of the file, or at a record that is cut off.
    ///
    /// # Errors
    /// Returns `Data` if the file cannot be read.
    pub(crate) fn next_record(&mut self) -> Result<Option<Record<'_>>> {
        /// Largest length of a record without its payload: lengths, entry, size and time.
        const HEAD: usize = 1 + 4 + 4 + 8;
        self.fill(HEAD)?;
        let ahead = self.ahead();
        let Some(&lengths) = ahead.first() else { return Ok(None) };
        let [entry, size, time] = [lengths & 3, lengths >> 2 & 3, lengths >> 4 & 7].map(|bits| usize::from(bits) + 1);
        let head = 1 + entry + size + time;
        let Some(fields) = ahead.get(1..head) else { return Ok(self.cut()) };
        let (entry, rest) = fields.split_at(entry);
        let (size, time) = rest.split_at(size);
        let (entry, size, time_us) = (number(entry), number(size), number(time));
        let whole = head as u64 + size;
        if whole > self.size.saturating_sub(self.position) {
            return Ok(self.cut());
        }
        // An entry has at most four bytes.
        let entry = u32::try_from(entry).unwrap_or(u32::MAX);
        if size > PAYLOAD_MAX as u64 {
            self.skip(whole)?;
            return Ok(Some(Record { entry, time_us, payload: &[] }));
        }
        let whole_here = index(whole);
        self.fill(whole_here)?;
        if self.filled - self.used < whole_here {
            return Ok(self.cut());
        }
        let begin = self.used + head;
        self.used += whole_here;
        self.position += whole;
        Ok(Some(Record { entry, time_us, payload: &self.buffer[begin..self.used] }))
    }

    /// Notes that the file ends within a record.
    fn cut(&mut self) -> Option<Record<'static>> {
        self.cut_at = Some(self.position);
        None
    }
}

/// Returns the unsigned integer of up to eight bytes.
pub(crate) fn number(bytes: &[u8]) -> u64 {
    bytes.iter().take(8).rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}
