//! Channel groups of MDF files: their records, clocks and channels of numbers.

use super::block::{AGAIN, Block, Blocks};
use super::value::{Conversion, Kind, Place};
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use std::collections::HashSet;

/// Largest depth of channels within channels.
const DEPTH_MAX: u32 = 32;
/// Largest number of channels of a file.
pub(crate) const CHANNELS_MAX: usize = 10_000;

/// Largest number of groups and channels of a file.
const BLOCKS_MAX: usize = 4 * CHANNELS_MAX;

/// A channel of numbers.
#[derive(Debug, Clone)]
pub(crate) struct Signal {
    pub(crate) name: String,
    pub(crate) unit: Option<String>,
    pub(crate) place: Place,
    pub(crate) conversion: Conversion,
}

/// Clock of a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Clock {
    /// Whole numbers of counts: the place, counts per second and the offset \[s\].
    Counts(Place, f64, f64),
    /// The index of a record, with counts per second and the offset \[s\].
    Index(f64, f64),
    /// Real numbers, with offset and factor.
    Reals(Place, f64, f64),
}

/// A channel group.
#[derive(Debug, Default)]
pub(crate) struct Group {
    /// Name of the acquisition; empty if there is none.
    pub(crate) name: String,
    /// Number of the records in unsorted data.
    pub(crate) identity: u64,
    /// Number of records as the file states it.
    pub(crate) cycles: u64,
    /// Length of a record without its number \[bytes\].
    pub(crate) record: usize,
    /// True if the records have varying lengths.
    pub(crate) varies: bool,
    /// Clock; `None` if there is none.
    pub(crate) clock: Option<Clock>,
    pub(crate) signals: Vec<Signal>,
    /// Reason why the whole group is left out.
    pub(crate) unsupported: Option<&'static str>,
    /// Names of channels left out, with the reasons.
    pub(crate) others: Vec<String>,
    data_bytes: usize,
}

/// Reader of groups, which visits each block once.
pub(crate) struct Groups<'a> {
    pub(crate) blocks: &'a mut Blocks,
    pub(crate) seen: HashSet<u64>,
    pub(crate) channels: usize,
}

impl Groups<'_> {
    /// Reads a block of a list.
    ///
    /// # Errors
    /// Returns a `Data` error if the block is damaged or part of another list.
    pub(crate) fn visit(&mut self, at: u64, kind: &[u8; 2]) -> Result<Block> {
        if !self.seen.insert(at) {
            return Err(Error::data(format!("the block at byte {at} is linked twice"), AGAIN));
        }
        if self.seen.len() > BLOCKS_MAX {
            return Err(Error::data(format!("has more than {BLOCKS_MAX} groups and channels"), AGAIN));
        }
        self.blocks.block(at, &[kind])
    }

    /// Reads the channel groups from a link on.
    ///
    /// # Errors
    /// Returns a `Data` error if a block is damaged or there are too many channels.
    pub(crate) fn read(&mut self, link: u64) -> Result<Vec<Group>> {
        let mut groups = Vec::new();
        let mut next = link;
        while next != 0 {
            let block = self.visit(next, b"CG")?;
            groups.push(self.group(&block)?);
            next = block.link(0);
        }
        Ok(groups)
    }

    fn group(&mut self, block: &Block) -> Result<Group> {
        let flags = block.number16(16);
        let length = |at| usize::try_from(block.number32(at)).unwrap_or(usize::MAX);
        let mut group = Group {
            name: self.blocks.text(block.link(2))?,
            identity: block.number64(0),
            cycles: block.number64(8),
            record: length(24).saturating_add(length(28)),
            varies: flags & 1 != 0,
            data_bytes: length(24),
            unsupported: match flags {
                _ if flags & 1 != 0 => Some("signals of varying length"),
                _ if flags & 6 != 0 => Some("bus messages, which asammdf decodes"),
                _ if flags & 8 != 0 => Some("columns of another group's clock"),
                _ => None,
            },
            ..Group::default()
        };
        if group.unsupported.is_none() {
            self.signals(block.link(1), &mut group, DEPTH_MAX)?;
        }
        Ok(group)
    }

    /// Reads the channels of a list, and those within them.
    fn signals(&mut self, link: u64, group: &mut Group, depth: u32) -> Result<()> {
        let mut next = link;
        while next != 0 {
            let block = self.visit(next, b"CN")?;
            self.channels += 1;
            if self.channels > CHANNELS_MAX {
                let message = format!("has more than {CHANNELS_MAX} channels");
                return Err(Error::data(message, "Save the channels of one motor alone, for example with asammdf."));
            }
            self.signal(&block, group, depth)?;
            next = block.link(0);
        }
        Ok(())
    }

    /// Adds a channel to its group: as the clock, as numbers, or to those left out.
    fn signal(&mut self, block: &Block, group: &mut Group, depth: u32) -> Result<()> {
        let name = self.blocks.text(block.link(2))?;
        if block.link(1) != 0 {
            let Some(depth) = depth.checked_sub(1) else {
                return Err(Error::data(format!("channels are nested more than {DEPTH_MAX} deep"), AGAIN));
            };
            if &self.blocks.head(block.link(1))?.kind == b"CN" {
                return self.signals(block.link(1), group, depth);
            }
            group.others.push(format!("{}: an array", excerpt(&name)));
            return Ok(());
        }
        let conversion_block = match block.link(4) {
            0 => None,
            at => Some(self.blocks.block(at, &[b"CC"])?),
        };
        let converted = conversion_block.as_ref().map_or(Ok(Conversion::None), Conversion::of);
        let read = place(block, group).and_then(|place| converted.map(|conversion| (place, conversion)));
        let is_master = matches!(block.byte(0), 2 | 3);
        let reason = match read {
            Ok(_) if is_master && block.byte(1) != 1 => "a master that is not the time",
            Ok((place, conversion)) if is_master => {
                group.clock = clock(block.byte(0) == 3, place, &conversion);
                if group.clock.is_some() {
                    return Ok(());
                }
                "a time with a conversion that is not linear"
            }
            Ok((place, conversion)) => {
                let own = self.blocks.text(block.link(6))?;
                let other = conversion_block.as_ref().map_or(0, |block| block.link(1));
                let unit = if own.is_empty() { self.blocks.text(other)? } else { own };
                let unit = Some(unit).filter(|unit| !unit.is_empty());
                group.signals.push(Signal { name, unit, place, conversion });
                return Ok(());
            }
            Err(reason) => reason,
        };
        group.others.push(format!("{}: {reason}", excerpt(&name)));
        Ok(())
    }
}

/// Returns the place of the numbers of a channel, or the reason why it has none.
fn place(block: &Block, group: &Group) -> std::result::Result<Place, &'static str> {
    match block.byte(0) {
        1 | 5 => return Err("values of varying length"),
        4 => return Err("places in a video"),
        6 => return Err("numbers of records"),
        _ => {}
    }
    let (kind, big_endian) = match block.byte(2) {
        0 => (Kind::Unsigned, false),
        1 => (Kind::Unsigned, true),
        2 => (Kind::Signed, false),
        3 => (Kind::Signed, true),
        4 => (Kind::Real, false),
        5 => (Kind::Real, true),
        6..=9 => return Err("texts"),
        10..=12 => return Err("bytes"),
        13 | 14 => return Err("dates"),
        15 | 16 => return Err("complex numbers"),
        _ => return Err("values of an unknown type"),
    };
    let flags = block.number32(12);
    let byte = usize::try_from(block.number32(4)).unwrap_or(usize::MAX);
    let bit = usize::try_from(block.number32(16)).unwrap_or(usize::MAX);
    let invalid = match flags & 3 {
        0 => None,
        2 => Some((group.data_bytes.saturating_add(bit / 8), 1 << (bit % 8))),
        // The values of all records are invalid.
        _ => return Err("values that are all invalid"),
    };
    let place = Place { kind, big_endian, byte, bit: u32::from(block.byte(3)), bits: block.number32(8), invalid };
    if block.byte(0) == 3 {
        return Ok(place);
    }
    let fits = byte.checked_add(place.length()).is_some_and(|end| end <= group.data_bytes);
    match place.is_read() {
        true if fits => Ok(place),
        true => Err("values that exceed the record"),
        false => Err("numbers of an unusual width"),
    }
}

/// Returns the clock of a master channel; `None` if its conversion is not linear.
fn clock(is_virtual: bool, place: Place, conversion: &Conversion) -> Option<Clock> {
    let (offset, factor) = match *conversion {
        Conversion::None => (0.0, 1.0),
        Conversion::Linear(offset, factor) => (offset, factor),
        _ => return None,
    };
    // A factor such as 1e-9 stands for a division by a whole number, which rounds only once.
    let whole = (1.0 / factor).round();
    let per_second = if (1.0 / whole).total_cmp(&factor).is_eq() { whole } else { 1.0 / factor };
    if !(offset.is_finite() && factor.is_finite() && per_second.is_finite() && per_second > 0.0) {
        return None;
    }
    Some(match place.kind {
        _ if is_virtual => Clock::Index(per_second, offset),
        Kind::Real => Clock::Reals(place, offset, factor),
        _ => Clock::Counts(place, per_second, offset),
    })
}
