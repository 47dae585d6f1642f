//! Records of the channel groups of MDF files, and their times.

use super::block::Blocks;
use super::data::Data;
use super::group::{Clock, Group};
use super::value::Records;
use motorfit_core::Result;
use motorfit_core::numeric::{count_u64, real, wide};
use std::collections::HashMap;

/// Largest length of a record of varying length \[bytes\].
const VARYING_MAX: usize = 64 << 20;
/// Number of bytes of records that are collected from unsorted data before they are handed on.
const BATCH: usize = 1 << 18;

/// A data group: channel groups whose records are stored together.
#[derive(Debug, Default)]
pub(crate) struct DataGroup {
    pub(crate) data: Data,
    /// Length of the number before each record \[bytes\].
    pub(crate) identity: usize,
    pub(crate) groups: Vec<Group>,
}

/// Records of a channel group that are complete.
#[derive(Debug, Default, Clone)]
pub(crate) struct Found {
    pub(crate) count: u64,
    first: Vec<u8>,
    last: Vec<u8>,
}

impl DataGroup {
    fn is_sorted(&self) -> bool {
        self.groups.len() == 1
    }

    /// Returns the length of the records of sorted data \[bytes\].
    fn stride(&self) -> usize {
        self.groups.first().map_or(0, |group| group.record.saturating_add(self.identity))
    }

    /// Counts the complete records of each channel group. `is_open` says that the file does not state their number.
    ///
    /// # Errors
    /// Returns a `Data` error if the data are damaged.
    pub(crate) fn count(&self, blocks: &mut Blocks, is_open: bool) -> Result<Vec<Found>> {
        let mut found = vec![Found::default(); self.groups.len()];
        if !self.is_sorted() {
            self.unsorted(blocks, &mut |group, record| {
                if let Some(found) = found.get_mut(group) {
                    if found.count == 0 {
                        found.first = record.to_vec();
                    }
                    found.last.clear();
                    found.last.extend_from_slice(record);
                    found.count += 1;
                }
                Ok(())
            })?;
            return Ok(found);
        }
        let stride = self.stride();
        let (Some(found), Some(group)) = (found.first_mut(), self.groups.first()) else { return Ok(found) };
        let complete = self.data.size.checked_div(stride as u64).unwrap_or(0);
        found.count = if is_open { complete } else { complete.min(group.cycles) };
        if let Some(last) = found.count.checked_sub(1) {
            found.first = self.record(blocks, 0)?;
            found.last = self.record(blocks, last)?;
        }
        Ok(vec![found.clone()])
    }

    /// Reads one record of sorted data.
    fn record(&self, blocks: &mut Blocks, index: u64) -> Result<Vec<u8>> {
        let stride = self.stride();
        let mut record = Vec::new();
        self.data.read(blocks, index.saturating_mul(stride as u64), &mut |bytes| {
            let missing = stride - record.len();
            record.extend_from_slice(bytes.get(..missing).unwrap_or(bytes));
            Ok(record.len() < stride)
        })?;
        Ok(record.get(self.identity..).unwrap_or_default().to_vec())
    }

    /// Reads the complete records of a channel group and calls `each` with some of them at a time, in order.
    ///
    /// # Errors
    /// Returns a `Data` error if the data are damaged.
    pub(crate) fn records(&self, blocks: &mut Blocks, group: usize, each: &mut dyn FnMut(Records)) -> Result<()> {
        if self.is_sorted() {
            return self.sorted(blocks, each);
        }
        let stride = self.groups.get(group).map_or(0, |group| group.record);
        let mut batch = Vec::new();
        self.unsorted(blocks, &mut |other, record| {
            if other == group {
                batch.extend_from_slice(record);
                if batch.len() >= BATCH {
                    each(Records { bytes: &batch, stride, skip: 0 });
                    batch.clear();
                }
            }
            Ok(())
        })?;
        each(Records { bytes: &batch, stride, skip: 0 });
        Ok(())
    }

    fn sorted(&self, blocks: &mut Blocks, each: &mut dyn FnMut(Records)) -> Result<()> {
        let (stride, skip) = (self.stride(), self.identity);
        if stride == 0 {
            return Ok(());
        }
        // The start of a record that continues in the next block.
        let mut start: Vec<u8> = Vec::new();
        self.data.read(blocks, 0, &mut |mut bytes| {
            if !start.is_empty() {
                let missing = stride - start.len();
                let Some((end, rest)) = bytes.split_at_checked(missing) else {
                    start.extend_from_slice(bytes);
                    return Ok(true);
                };
                start.extend_from_slice(end);
                each(Records { bytes: &start, stride, skip });
                start.clear();
                bytes = rest;
            }
            let (whole, rest) = bytes.split_at(bytes.len() - bytes.len() % stride);
            each(Records { bytes: whole, stride, skip });
            start.extend_from_slice(rest);
            Ok(true)
        })
    }

    /// Reads unsorted records and calls `each` with the index of the channel group and the record, up to the end or to a record
    /// of an unknown number.
    fn unsorted(&self, blocks: &mut Blocks, each: &mut dyn FnMut(usize, &[u8]) -> Result<()>) -> Result<()> {
        if !matches!(self.identity, 1 | 2 | 4 | 8) {
            return Ok(());
        }
        let numbers = self.groups.iter().enumerate().map(|(index, group)| (group.identity, index));
        let numbers: HashMap<u64, usize> = numbers.collect();
        let mut buffer: Vec<u8> = Vec::new();
        self.data.read(blocks, 0, &mut |bytes| {
            buffer.extend_from_slice(bytes);
            let mut rest = &buffer[..];
            loop {
                match self.next_record(rest, &numbers) {
                    Next::Record(group, record, after) => {
                        each(group, record)?;
                        rest = after;
                    }
                    Next::Incomplete => break,
                    Next::Unknown => return Ok(false),
                }
            }
            let done = buffer.len() - rest.len();
            buffer.drain(..done);
            Ok(true)
        })
    }

    fn next_record<'a>(&self, bytes: &'a [u8], numbers: &HashMap<u64, usize>) -> Next<'a> {
        let Some((number, rest)) = bytes.split_at_checked(self.identity) else { return Next::Incomplete };
        let number = number.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte));
        let group = numbers.get(&number).and_then(|&index| Some((index, self.groups.get(index)?)));
        let Some((index, group)) = group else { return Next::Unknown };
        let (rest, length) = match (group.varies, rest.split_first_chunk()) {
            (false, _) => (rest, group.record),
            (true, None) => return Next::Incomplete,
            (true, Some((length, rest))) => (rest, usize::try_from(u32::from_le_bytes(*length)).unwrap_or(usize::MAX)),
        };
        match rest.split_at_checked(length) {
            Some((record, rest)) => Next::Record(index, record, rest),
            None if length > VARYING_MAX => Next::Unknown,
            None => Next::Incomplete,
        }
    }
}

/// The next record of unsorted data.
enum Next<'a> {
    /// Index of the channel group, the record, and the bytes that follow.
    Record(usize, &'a [u8], &'a [u8]),
    Incomplete,
    Unknown,
}

/// Times of the records of a channel group \[s\], since the earliest record of the file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Times {
    clock: Clock,
    /// Count that is subtracted.
    first: i128,
    /// Time that is added.
    shift: f64,
}

impl Times {
    /// Returns the times of groups with their clocks and records.
    pub(crate) fn of(groups: &[(Clock, &Found)]) -> Vec<Self> {
        let starts: Vec<(i128, f64)> = groups.iter().map(|(clock, found)| start(clock, &found.first)).collect();
        let (mut first, mut earliest, mut reference) = (0, f64::INFINITY, None);
        for ((clock, _), &(count, time)) in groups.iter().zip(&starts) {
            if time < earliest {
                (first, earliest, reference) = (count, time, Some(*clock));
            }
        }
        let earliest = if earliest.is_finite() { earliest } else { 0.0 };
        let times = groups.iter().zip(starts).map(|(&(clock, _), (count, time))| match (clock, reference) {
            // Counts of the same clock are subtracted before they are converted.
            (Clock::Counts(_, a, b), Some(Clock::Counts(_, c, d)))
                if a.total_cmp(&c).is_eq() && b.total_cmp(&d).is_eq() =>
            {
                Self { clock, first, shift: 0.0 }
            }
            (Clock::Counts(..), _) => Self { clock, first: count, shift: time - earliest },
            (Clock::Index(_, offset), _) => Self { clock, first: 0, shift: offset - earliest },
            (Clock::Reals(..), _) => Self { clock, first: 0, shift: -earliest },
        });
        times.collect()
    }

    /// Returns the times of the first and the last record.
    pub(crate) fn span(&self, found: &Found) -> [f64; 2] {
        let time = |record: &[u8], index| self.time(record, index);
        [time(&found.first, 0), time(&found.last, found.count.saturating_sub(1))]
    }

    /// Returns the time of a record with its index.
    pub(crate) fn time(&self, record: &[u8], index: u64) -> f64 {
        match &self.clock {
            Clock::Counts(place, per_second, _) => {
                let count = place.whole(record) - self.first;
                // Most counts fit 64 bits, which are converted faster.
                let count = i64::try_from(count).map_or(wide(count), real);
                count / per_second + self.shift
            }
            Clock::Index(per_second, _) => count_u64(index) / per_second + self.shift,
            Clock::Reals(place, offset, factor) => place.real(record) * factor + offset + self.shift,
        }
    }
}

/// Returns the count and the time \[s\] of the first record.
fn start(clock: &Clock, record: &[u8]) -> (i128, f64) {
    match clock {
        Clock::Counts(place, per_second, offset) => {
            let count = place.whole(record);
            (count, wide(count) / per_second + offset)
        }
        Clock::Index(_, offset) => (0, *offset),
        Clock::Reals(place, offset, factor) => (0, place.real(record) * factor + offset),
    }
}

#[cfg(test)]
mod tests {
    use super::super::value::{Kind, Place};
    use super::*;

    #[test]
    fn times_count_from_the_earliest_record_of_all_clocks() {
        let place = Place { kind: Kind::Unsigned, big_endian: false, byte: 0, bit: 0, bits: 64, invalid: None };
        let found = |first: u64| Found { count: 1, first: first.to_le_bytes().to_vec(), last: vec![] };
        let real = Clock::Reals(Place { kind: Kind::Real, ..place }, 0.0, 1.0);
        let clocks = [
            (Clock::Counts(place, 1e3, 0.0), found(10_500)),
            (Clock::Counts(place, 1e9, 0.0), found(10_250_000_000)),
            (Clock::Counts(place, 1e9, 0.0), found(12_000_000_000)),
            (real, found(11_f64.to_bits())),
            (Clock::Index(4.0, 10.5), found(0)),
        ];
        let times = Times::of(&clocks.iter().map(|(clock, found)| (*clock, found)).collect::<Vec<_>>());
        let starts = times.iter().zip(&clocks).map(|(times, (_, found))| times.time(&found.first, 0).to_bits());
        assert_eq!(starts.collect::<Vec<_>>(), [0.25, 0.0, 1.75, 0.75, 0.25].map(f64::to_bits));
        assert_eq!(times[0].time(&10_502_u64.to_le_bytes(), 2).to_bits(), (0.002 + 0.25_f64).to_bits());
        assert_eq!(times[1].time(&10_252_000_000_u64.to_le_bytes(), 2).to_bits(), 0.002_f64.to_bits());
        assert_eq!(times[4].time(&[], 3).to_bits(), 1.0_f64.to_bits());
    }
}
