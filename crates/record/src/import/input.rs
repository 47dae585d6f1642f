//! A file that is read: opened on disk, a pipe, or bytes in memory.

use motorfit_core::{Error, Result};
use motorfit_logs::{Medium, refused_name, unreadable};
use std::fs::File;
use std::io::{Cursor, Read, Seek as _};
use std::path::Path;

/// Largest log that is read from a pipe \[bytes\].
pub(super) const PIPED_MAX: u64 = 1 << 30;

/// Bytes of a file.
pub(super) enum Input<'a> {
    /// An open file or pipe.
    File(File),
    /// Bytes, and the part of them that was not read yet.
    Bytes { all: &'a [u8], rest: &'a [u8] },
}

impl<'a> Input<'a> {
    /// Opens a file, and refuses a folder.
    ///
    /// # Errors
    /// Returns `Data` if the file cannot be opened, is a folder, or has the name of a format that is not read.
    pub(super) fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|e| motorfit_core::file::unreadable(path, &e))?;
        if file.metadata().map_err(|e| unreadable(&e))?.is_dir() {
            return Err(Error::data("is a folder, expected a file", "Give the path of a recording in it."));
        }
        // Closed formats are known by their names alone.
        refused_name(&path.extension().unwrap_or_default().to_string_lossy())?;
        Ok(Self::File(file))
    }

    /// Takes bytes.
    pub(super) fn bytes(all: &'a [u8]) -> Self {
        Self::Bytes { all, rest: all }
    }

    /// Returns the complete file for reading in any order; `head` are the bytes that were read from it. A pipe is read into memory.
    ///
    /// # Errors
    /// Returns `Data` if the file cannot be read, or a pipe has more than [`PIPED_MAX`] bytes.
    pub(super) fn medium(self, head: Vec<u8>) -> Result<Box<dyn Medium>> {
        let mut file = match self {
            Self::Bytes { all, .. } => return Ok(Box::new(Cursor::new(all.to_vec()))),
            Self::File(file) => file,
        };
        if file.rewind().is_ok() {
            return Ok(Box::new(file));
        }
        let mut bytes = head;
        file.take(PIPED_MAX + 1).read_to_end(&mut bytes).map_err(|error| unreadable(&error))?;
        if bytes.len() as u64 > PIPED_MAX {
            let message = format!("comes from a pipe and is larger than {} MiB", PIPED_MAX >> 20);
            return Err(Error::data(message, "Save it as a file, which may have any size."));
        }
        Ok(Box::new(Cursor::new(bytes)))
    }
}

impl Read for Input<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        match self {
            Self::File(file) => file.read(buffer),
            Self::Bytes { rest, .. } => rest.read(buffer),
        }
    }
}
