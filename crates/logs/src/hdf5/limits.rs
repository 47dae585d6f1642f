//! Limits of the reader.

/// Largest number of columns.
pub(super) const CHANNELS_MAX: usize = 10_000;
/// Largest number of values that are read at once.
pub(super) const VALUES_MAX: usize = 100_000_000;
/// Largest decompressed size of a dataset \[bytes\] as a multiple of the size of the file.
pub(super) const UNPACKED_RATIO: u64 = 50;
/// Decompressed size of a dataset that is accepted at any compression ratio \[bytes\].
pub(super) const UNPACKED_FREE: u64 = 32 << 20;
/// Largest decompressed size of a chunk \[bytes\].
pub(super) const CHUNK_MAX: usize = 1 << 30;
