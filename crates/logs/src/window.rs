//! Buffered access to the bytes of a file at any position.

use super::log::Medium;
use motorfit_core::{Error, Result};
use std::io::SeekFrom;

/// Largest number of bytes that are in memory at once.
pub(crate) const WINDOW_MAX: usize = 256 << 10;

/// Part of a file that is in memory.
pub(crate) struct Window {
    medium: Box<dyn Medium>,
    /// Length of the file \[bytes\].
    size: u64,
    /// Position of the first buffered byte.
    start: u64,
    buffer: Vec<u8>,
}

impl Window {
    /// Returns the window of a file, without reading from it yet.
    ///
    /// # Errors
    /// Returns a `Data` error if the length of the file cannot be found.
    pub(crate) fn new(mut medium: Box<dyn Medium>) -> Result<Self> {
        let size = medium.seek(SeekFrom::End(0)).map_err(|error| unreadable(0, &error))?;
        Ok(Self { medium, size, start: 0, buffer: Vec::new() })
    }

    /// Returns the length of the file \[bytes\].
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// Returns `count` bytes from a position, at most [`WINDOW_MAX`], and fewer only at the end of the file.
    ///
    /// # Errors
    /// Returns a `Data` error if the file cannot be read.
    pub(crate) fn get(&mut self, at: u64, count: usize) -> Result<&[u8]> {
        let count = count.min(WINDOW_MAX);
        let left = usize::try_from(self.size.saturating_sub(at)).unwrap_or(usize::MAX);
        let inside = at.checked_sub(self.start).and_then(|offset| usize::try_from(offset).ok());
        let offset = match inside.filter(|offset| self.buffer.len().saturating_sub(*offset) >= count.min(left)) {
            Some(offset) => offset,
            None => {
                self.fill(at, left)?;
                0
            }
        };
        let bytes = self.buffer.get(offset..).unwrap_or_default();
        Ok(bytes.get(..count).unwrap_or(bytes))
    }

    /// Fills the buffer from a position, with at most `left` bytes.
    fn fill(&mut self, at: u64, left: usize) -> Result<()> {
        self.buffer.resize(left.min(WINDOW_MAX), 0);
        self.start = at;
        let mut filled = 0;
        let filling = self.medium.seek(SeekFrom::Start(at)).and_then(|_| {
            while let Some(rest) = self.buffer.get_mut(filled..).filter(|rest| !rest.is_empty()) {
                match self.medium.read(rest) {
                    Ok(0) => break,
                    Ok(count) => filled += count,
                    Err(error) if error.kind() == std::io::ErrorKind::Interrupted => (),
                    Err(error) => return Err(error),
                }
            }
            Ok(())
        });
        self.buffer.truncate(filled);
        filling.map_err(|error| unreadable(at, &error))
    }
}

/// Returns the error for a file that cannot be read.
fn unreadable(at: u64, error: &std::io::Error) -> Error {
    Error::data(format!("cannot be read at byte {at}: {error}"), "Copy the file to this computer and try again.")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn bytes_at_any_position() {
        let bytes: Vec<u8> = (0..WINDOW_MAX + 10).map(|n| u8::try_from(n % 251).unwrap()).collect();
        let mut window = Window::new(Box::new(Cursor::new(bytes.clone()))).unwrap();
        assert_eq!(window.size(), bytes.len() as u64);
        for (at, count) in [(0, 3), (5, WINDOW_MAX), (WINDOW_MAX + 7, 3), (2, 0), (1, 1), (WINDOW_MAX - 1, 4)] {
            assert_eq!(window.get(at as u64, count).unwrap(), &bytes[at..at + count]);
        }
        assert_eq!(window.get(0, usize::MAX).unwrap(), &bytes[..WINDOW_MAX]);
        assert_eq!(window.get(WINDOW_MAX as u64 + 8, 9).unwrap(), &bytes[WINDOW_MAX + 8..]);
        assert!(window.get(WINDOW_MAX as u64 + 10, 1).unwrap().is_empty());
        assert!(window.get(u64::MAX, 1).unwrap().is_empty());
    }
}
