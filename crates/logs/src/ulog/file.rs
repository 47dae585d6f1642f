//! Messages of ULog files, with recovery after damage.

use super::super::window::{WINDOW_MAX, Window};
use motorfit_core::{Error, Result};

/// Length of the header of the file \[bytes\].
const HEADER: u64 = 16;
/// Length of the header of a message \[bytes\].
const HEAD: u64 = 3;
/// First bytes of a file.
const MAGIC: &[u8] = b"ULog\x01\x12\x35";
/// Bytes of a message from which reading resumes after damage.
const SYNC: &[u8] = &[0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12];
/// Length of the message with the flags \[bytes\].
const FLAGS: usize = 40;

/// Reader of the messages of a file, from the first to the last.
#[derive(Debug)]
pub(super) struct Messages {
    /// Position of the next message.
    position: u64,
    /// Position after the present section.
    end: u64,
    /// Positions of appended sections that follow, the last one first.
    appended: Vec<u64>,
    /// Length of the file \[bytes\].
    size: u64,
    /// Position of the message at the end that is incomplete.
    pub cut: Option<u64>,
    /// Number of bytes that are not messages, and the position of the first.
    pub damaged: Option<(u64, u64)>,
    /// Note on appended sections that are missing.
    pub missing: Option<String>,
}

impl Messages {
    /// Returns a reader at the first message, after reading the header and the flags.
    ///
    /// # Errors
    /// Returns a `Data` error if the file is not a ULog file or of an incompatible version.
    pub(super) fn new(window: &mut Window) -> Result<Self> {
        let size = window.size();
        if !window.get(0, MAGIC.len())?.starts_with(MAGIC) || size < HEADER {
            let message = "is not a ULog file: it does not begin with the header of one";
            return Err(Error::data(message, "Choose a file that PX4 has logged, which ends in .ulg."));
        }
        let mut all =
            Self { position: HEADER, end: size, appended: Vec::new(), size, cut: None, damaged: None, missing: None };
        let first = window.get(HEADER, 3 + FLAGS)?;
        if first.get(2) == Some(&b'B') {
            let length = first.first_chunk().map_or(0, |b| u16::from_le_bytes(*b));
            let flags = first.get(3..).unwrap_or_default();
            all.set_flags(length, flags)?;
        }
        Ok(all)
    }

    /// Checks the flags and sets the sections of the file.
    fn set_flags(&mut self, length: u16, flags: &[u8]) -> Result<()> {
        if usize::from(length) < FLAGS || flags.len() < FLAGS {
            let message = format!("the flags have {} bytes, expected {FLAGS}", usize::from(length).min(flags.len()));
            return Err(Error::data(message, "Copy the file again."));
        }
        let (flags, offsets) = flags.split_at(16);
        let incompatible = flags.get(8..).unwrap_or_default();
        if let Some((byte, bits)) = (0..).zip(incompatible).find(|(byte, bits)| **bits > u8::from(*byte == 0)) {
            let message =
                format!("has the unknown flag {bits:#04x} in byte {byte} of the features that a reader must know");
            return Err(Error::data(message, "Convert the recording to CSV with ulog2csv of a current pyulog."));
        }
        if incompatible.first() == Some(&0) {
            return Ok(());
        }
        let offsets = offsets.as_chunks::<8>().0.iter().map(|bytes| u64::from_le_bytes(*bytes));
        let mut previous = HEADER;
        for offset in offsets.take(3).take_while(|offset| *offset != 0) {
            if offset < previous || offset > self.size {
                self.missing = Some(format!(
                    "the data that were appended at byte {offset} are missing; the file has {} bytes",
                    self.size
                ));
                break;
            }
            self.appended.push(offset);
            previous = offset;
        }
        self.appended.reverse();
        self.end = self.appended.last().copied().unwrap_or(self.size);
        Ok(())
    }

    /// Returns the type and the content of the next message.
    ///
    /// # Errors
    /// Returns a `Data` error if the file cannot be read.
    pub(super) fn next<'w>(&mut self, window: &'w mut Window) -> Result<Option<(u8, &'w [u8])>> {
        loop {
            if self.position >= self.end {
                let Some(start) = self.appended.pop() else { return Ok(None) };
                self.position = start;
                self.end = self.appended.last().copied().unwrap_or(self.size);
                continue;
            }
            let left = self.end - self.position;
            let head = window.get(self.position, 3)?.first_chunk().copied().filter(|_| left >= HEAD);
            let Some([low, high, kind]) = head else {
                self.incomplete(window, true)?;
                continue;
            };
            let length = u16::from_le_bytes([low, high]);
            if length == 0 || !kind.is_ascii_alphabetic() {
                self.incomplete(window, false)?;
            } else if HEAD + u64::from(length) > left {
                self.incomplete(window, true)?;
            } else {
                let start = self.position + HEAD;
                self.position = start + u64::from(length);
                return Ok(Some((kind, window.get(start, usize::from(length))?)));
            }
        }
    }

    /// Continues after the next synchronization message of the section, or at its end. Without one, the section ends with an
    /// incomplete message if `cut` is true.
    fn incomplete(&mut self, window: &mut Window, cut: bool) -> Result<()> {
        let start = self.position;
        let mut at = start;
        while at < self.end {
            let length = usize::try_from(self.end - at).unwrap_or(usize::MAX).min(WINDOW_MAX);
            let bytes = window.get(at, length)?;
            if let Some(found) = bytes.windows(SYNC.len()).position(|window| window == SYNC) {
                self.position = at + (found + SYNC.len()) as u64;
                self.damage(start, self.position);
                return Ok(());
            }
            // The bytes may end within the synchronization message.
            at = if bytes.len() < WINDOW_MAX { self.end } else { at + (WINDOW_MAX - SYNC.len()) as u64 };
        }
        self.position = self.end;
        if !cut {
            self.damage(start, self.end);
        } else if self.appended.is_empty() {
            self.cut = Some(start);
        }
        Ok(())
    }

    /// Counts damaged bytes.
    fn damage(&mut self, start: u64, end: u64) {
        let (bytes, first) = self.damaged.unwrap_or((0, start));
        self.damaged = Some((bytes.saturating_add(end.saturating_sub(start)), first));
    }
}
