//! Limits of the reader.

/// Largest number of fields of all channels.
pub(super) const CHANNELS_MAX: usize = 10_000;
/// Largest number of values that are read.
pub(super) const VALUES_MAX: u64 = 100_000_000;
/// Largest number of elements of an array whose elements are fields.
pub(super) const ELEMENTS_MAX: usize = 128;
/// Number of messages of a JSON channel from which its fields are found.
pub(super) const FIRST_MESSAGES: u64 = 100;
/// Largest depth of nested types and JSON values.
pub(super) const DEPTH_MAX: usize = 32;
/// Largest distance of the time of a header from that of logging \[ns\].
pub(super) const STAMP_AWAY_MAX_NS: u64 = 60_000_000_000;
/// Largest size of a message, schema or channel \[bytes\].
pub(super) const RECORD_MAX: usize = 64 << 20;
/// Largest number of chunks.
pub(super) const PIECES_MAX: usize = 1_000_000;
/// Largest gap between records that is read instead of passed over \[bytes\].
pub(super) const GAP_MAX: u64 = 64 << 10;
/// Decompressed size that is accepted at any compression ratio \[bytes\].
pub(super) const UNPACKED_FREE: u64 = 32 << 20;
/// Largest compression ratio of a file whose decompressed size exceeds [`UNPACKED_FREE`].
pub(super) const UNPACKED_RATIO: u64 = 50;
/// Largest size of a schema \[bytes\].
pub(super) const SCHEMA_MAX: usize = 1 << 20;
/// Largest size of all schemas \[bytes\].
pub(super) const SCHEMAS_MAX: usize = 64 << 20;
/// Largest number of members of all schemas.
pub(super) const MEMBERS_MAX: usize = 200_000;
/// Length of the longest name of a topic \[bytes\].
pub(super) const TOPIC_MAX: usize = 1000;
/// Length of the longest name of a member or joint \[bytes\].
pub(super) const NAME_MAX: usize = 255;
/// Largest number of paths of all topics, including those that have no number.
pub(super) const NODES_MAX: usize = 100_000;
/// Largest number of paths of a topic.
pub(super) const TOPIC_NODES_MAX: usize = 20_000;
/// Largest number of names in a note, and of notes on arrays.
pub(super) const SHOWN_MAX: usize = 10;
