//! Segments of TDMS files and the blocks of values in them.

use super::super::window::Window;
use super::block::{Block, Part, in_a_row};
use super::kind::Kind;
use super::object::{Objects, Place};
use super::source::{COPY_AGAIN, Source};
use motorfit_core::{Error, Result};
use std::collections::HashMap;

/// Length of the lead-in of a segment \[bytes\].
const LEAD_IN: u64 = 28;
/// Largest number of entries in the lists of objects for each byte of the file, without which segments of a few bytes with long
/// lists would take minutes.
const ENTRIES_PER_BYTE: u64 = 16;
/// Number of bytes by which a file is taken to be longer than it is, when its entries are compared with its length.
const ENTRIES_FREE: u64 = 1 << 20;

/// Raw data of a segment.
#[derive(Debug)]
pub(super) struct Segment {
    /// Position of the data.
    data: u64,
    /// Length of the data that the file holds \[bytes\].
    bytes: u64,
    pub big_endian: bool,
    interleaved: bool,
    /// True if the file ends before the segment does.
    cut: bool,
}

/// Reader of the segments of a file, from the first to the last.
#[derive(Debug, Default)]
pub(super) struct Walker {
    pub objects: Objects,
    /// Position of the next segment.
    position: u64,
    /// Position of the present segment.
    segment: u64,
    /// Note on the end of the file, if it is not the end of a segment.
    pub end: Option<String>,
    /// Number of entries in the lists of objects of all segments with data.
    entries: u64,
}

impl Walker {
    /// Reads the lead-in and the metadata of the next segment; properties are only kept if `keep` is true.
    ///
    /// # Errors
    /// Returns a `Data` error if the segment is damaged.
    pub(super) fn next(&mut self, window: &mut Window, keep: bool) -> Result<Option<Segment>> {
        let size = window.size();
        self.segment = self.position;
        let head = window.get(self.segment, 28)?;
        if head.is_empty() {
            return Ok(None);
        }
        let Some(head) = head.first_chunk::<28>().copied() else {
            return Ok(self.cut_off(size));
        };
        let [t, d, s, m, toc, _, _, _, numbers @ ..] = head;
        if [t, d, s, m] != *b"TDSm" {
            return self.no_segment(window);
        }
        let [big_endian, interleaved, new_list, metadata, raw] = [6, 5, 2, 1, 3].map(|bit| toc >> bit & 1 == 1);
        let long = |at: usize| {
            let bytes = numbers.get(at..).and_then(|rest| rest.first_chunk()).copied().unwrap_or_default();
            if big_endian { u64::from_be_bytes(bytes) } else { u64::from_le_bytes(bytes) }
        };
        let (next, offset) = (long(4), long(12));
        let body = self.segment + LEAD_IN;
        if offset > next {
            let message = format!("the segment at byte {} has its data after its end", self.segment);
            return Err(Error::data(message, COPY_AGAIN));
        }
        let end = body.checked_add(next).filter(|end| *end <= size);
        let Some(data) = body.checked_add(offset).filter(|data| *data <= size) else {
            return Ok(self.cut_off(size));
        };
        if new_list {
            self.objects.clear_list();
        }
        if metadata {
            let mut source = Source { window, at: body, end: data, big_endian, segment: self.segment };
            self.objects.read(&mut source, keep)?;
        }
        if end.is_none() {
            self.cut_off(size);
        }
        self.position = end.unwrap_or(size);
        let bytes = if raw { self.position - data } else { 0 };
        Ok(Some(Segment { data, bytes, big_endian, interleaved, cut: end.is_none() }))
    }

    /// Notes that the file ends within the present segment.
    fn cut_off(&mut self, size: u64) -> Option<Segment> {
        self.position = size;
        let complete = format!("the file is cut off after {size} bytes, within the segment at byte {}", self.segment);
        self.end = Some(format!("{complete}; the samples that follow are lost"));
        None
    }

    /// Ends the reading if only zeros follow, which are space that was reserved.
    fn no_segment(&mut self, window: &mut Window) -> Result<Option<Segment>> {
        let at = self.segment;
        let mut position = at;
        loop {
            let bytes = window.get(position, usize::MAX)?;
            if bytes.iter().any(|&byte| byte != 0) {
                let message = format!("found no segment at byte {at}: expected the letters TDSm");
                return Err(Error::data(message, COPY_AGAIN));
            }
            if bytes.is_empty() {
                break;
            }
            position += bytes.len() as u64;
        }
        self.position = position;
        self.end = Some(format!("the file holds only zeros from byte {at} to its end at byte {position}"));
        Ok(None)
    }

    /// Returns the blocks of a segment that [`Walker::next`] has returned last.
    ///
    /// # Errors
    /// Returns a `Data` error if the layout of the segment is impossible.
    pub(super) fn blocks(&mut self, segment: &Segment) -> Result<Vec<Block>> {
        if self.objects.is_daqmx() || segment.bytes == 0 || self.objects.chunk() == 0 {
            return Ok(Vec::new());
        }
        self.entries = self.entries.saturating_add(self.objects.list_len() as u64);
        if self.entries / ENTRIES_PER_BYTE > ENTRIES_FREE.saturating_add(self.position) {
            let message = format!("the segments up to byte {} list too many objects for their length", self.position);
            return Err(Error::data(message, "Save the file again in LabVIEW, with longer segments."));
        }
        let texts = self.objects.with_data().any(|(_, index)| index.kind == Kind::Text);
        if segment.interleaved && !texts {
            return self.interleaved(segment);
        }
        if segment.interleaved && self.objects.with_data().count() > 1 {
            let message = format!("the segment at byte {} has text between its numbers", self.segment);
            return Err(Error::data(message, "Save the numbers without text channels."));
        }
        Ok(self.contiguous(segment, texts))
    }

    /// Returns the block of a segment that holds one value of each object after the other.
    fn interleaved(&self, segment: &Segment) -> Result<Vec<Block>> {
        let with_values = || self.objects.with_data().filter(|(_, index)| index.bytes > 0);
        let mut counts = with_values().map(|(_, index)| index.count);
        let first = counts.next().unwrap_or(0);
        if counts.any(|count| count != first) {
            let message = format!("the segment at byte {} interleaves channels of different lengths", self.segment);
            return Err(Error::data(message, COPY_AGAIN));
        }
        let (parts, length) = in_a_row(with_values().map(|(object, index)| (object, index.kind, 1)));
        let chunks = segment.bytes.checked_div(length).unwrap_or(0);
        Ok(vec![Block { start: segment.data, length, chunks, parts }])
    }

    /// Returns the blocks of a segment that holds all values of an object before those of the next one: the complete chunks
    /// and an incomplete last one.
    fn contiguous(&self, segment: &Segment, texts: bool) -> Vec<Block> {
        let chunk = self.objects.chunk();
        // A chunk that is longer than the data is incomplete.
        let length = u64::try_from(chunk).unwrap_or(u64::MAX);
        let (chunks, rest) = (segment.bytes / length, segment.bytes % length);
        let mut blocks = Vec::new();
        if chunks > 0 {
            let mut offset = 0;
            let parts = self.objects.with_data().map(|(object, index)| {
                let part = Part { object, kind: index.kind, offset, count: index.count };
                offset += index.bytes;
                part
            });
            blocks.push(Block { start: segment.data, length, chunks, parts: parts.collect() });
        }
        // Less than a byte for each object holds no sample of all of them.
        if texts || rest < self.objects.with_data().count() as u64 {
            return blocks;
        }
        let start = segment.data + chunks * length;
        let parts = if segment.cut { self.cut_parts(rest) } else { self.shorter_parts(rest, chunk) };
        blocks.push(Block { start, length: rest, chunks: 1, parts });
        blocks
    }

    /// Returns the parts of the first `rest` bytes of a chunk. Channels of a group that have the same number of values in a
    /// complete chunk keep the same number.
    fn cut_parts(&self, rest: u64) -> Vec<Part> {
        let mut offset = 0_u64;
        let mut parts = Vec::new();
        let mut complete: HashMap<(&str, u64), u64> = HashMap::new();
        for (object, index) in self.objects.with_data().filter(|(_, index)| index.bytes > 0) {
            let left = rest.saturating_sub(offset).checked_div(u64::from(index.kind.size())).unwrap_or(0);
            let count = complete.entry((self.group(object), index.count)).or_insert(index.count);
            *count = left.min(*count);
            parts.push((Part { object, kind: index.kind, offset, count: index.count }, self.group(object)));
            offset = offset.saturating_add(index.bytes);
        }
        for (part, group) in &mut parts {
            part.count = complete.get(&(*group, part.count)).copied().unwrap_or(0);
        }
        parts.into_iter().map(|(part, _)| part).collect()
    }

    /// Returns the parts of a last chunk in which all objects have proportionally fewer values.
    fn shorter_parts(&self, rest: u64, chunk: u128) -> Vec<Part> {
        let shorter = |count: u64| u64::try_from(u128::from(count) * u128::from(rest) / chunk).unwrap_or(0);
        in_a_row(self.objects.with_data().map(|(object, index)| (object, index.kind, shorter(index.count)))).0
    }

    /// Returns the name of the group of a channel.
    fn group(&self, object: usize) -> &str {
        match self.objects.all.get(object).map(|object| &object.place) {
            Some(Place::Channel { group, .. } | Place::Group(group)) => group,
            _ => "",
        }
    }
}
