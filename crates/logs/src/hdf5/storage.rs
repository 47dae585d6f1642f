//! Bytes of an HDF5 file for the decoder.

use super::super::log::Medium;
use hdf5_reader::StorageBuffer;
use hdf5_reader::error::{Error, Result};
use std::io::SeekFrom;
use std::sync::{Mutex, PoisonError};

/// Largest number of bytes that are read at once.
const READ_MAX: usize = 1 << 30;

/// A file whose ranges are read on request.
pub(super) struct Storage {
    medium: Mutex<Box<dyn Medium>>,
    length: u64,
}

impl Storage {
    /// Measures the length of a file.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read.
    pub fn new(mut medium: Box<dyn Medium>) -> std::io::Result<Self> {
        let length = medium.seek(SeekFrom::End(0))?;
        Ok(Self { medium: Mutex::new(medium), length })
    }

    /// Returns the first bytes of the file, at most `count`.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read.
    pub fn start(&self, count: u64) -> std::io::Result<Vec<u8>> {
        self.bytes(0, usize::try_from(self.length.min(count)).unwrap_or(READ_MAX))
    }

    fn bytes(&self, offset: u64, count: usize) -> std::io::Result<Vec<u8>> {
        let mut medium = self.medium.lock().unwrap_or_else(PoisonError::into_inner);
        medium.seek(SeekFrom::Start(offset))?;
        let mut bytes = vec![0; count];
        medium.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}

impl hdf5_reader::Storage for Storage {
    fn len(&self) -> u64 {
        self.length
    }

    fn read_range(&self, offset: u64, count: usize) -> Result<StorageBuffer> {
        if offset.checked_add(count as u64).is_none_or(|end| end > self.length) {
            return Err(Error::OffsetOutOfBounds(offset));
        }
        if count > READ_MAX {
            return Err(Error::ResourceLimit(format!("{count} bytes at once, expected at most {READ_MAX}")));
        }
        Ok(StorageBuffer::from_vec(self.bytes(offset, count)?))
    }
}
