//! MDF files of version 4 (.mf4), as loggers of vehicles and machines write them: channel groups with a clock each.

mod block;
mod data;
mod group;
mod records;
#[cfg(test)]
mod tests;
mod value;

use super::cells::shortened;
use super::log::{Channel, Field, Log, Medium, Series};
use block::{AGAIN, Blocks};
use data::{Closing, Data};
use group::{Group, Groups, Signal};
use motorfit_core::text::{counted, excerpt, quoted};
use motorfit_core::{Error, Result};
use records::{DataGroup, Found, Times};
use std::collections::HashSet;
use std::io::SeekFrom;
use value::Records;

/// Largest number of values that are read at once.
const VALUES_MAX: u64 = 100_000_000;
/// Largest number of notes of one kind.
const NOTES_MAX: usize = 20;

/// An MDF file.
struct Mdf {
    blocks: Blocks,
    data: Vec<DataGroup>,
    /// Data group, channel group and times of each channel.
    places: Vec<(usize, usize, Times)>,
    channels: Vec<Channel>,
    notes: Vec<String>,
}

/// Reads the groups of an MDF file of version 4.
///
/// Each channel group with a clock is a channel, named by its acquisition or `group 1`, `group 2` and so on. A file that was
/// not closed or that is cut off is read as far as its records are complete.
///
/// # Errors
/// Returns a `Data` error if the file is damaged, of another version, or has too many channels.
pub(crate) fn open(mut medium: Box<dyn Medium>) -> Result<Box<dyn Log>> {
    let length = medium.seek(SeekFrom::End(0));
    let length = length.map_err(|error| Error::data(format!("cannot be read: {error}"), AGAIN))?;
    let mut blocks = Blocks { medium, length };
    let closing = identify(&mut blocks)?;
    let header = blocks.block(64, &[b"HD"])?;
    let mut groups = Groups { blocks: &mut blocks, seen: HashSet::new(), channels: 0 };
    let mut data = Vec::new();
    let mut next = header.link(0);
    while next != 0 {
        let block = groups.visit(next, b"DG")?;
        let channel_groups = groups.read(block.link(1))?;
        let link = block.link(2);
        let found = Data::find(groups.blocks, link, closing)?;
        data.push(DataGroup { data: found, identity: usize::from(block.byte(0)), groups: channel_groups });
        next = block.link(0);
    }
    let mut mdf = Mdf { blocks, data, places: vec![], channels: vec![], notes: vec![] };
    mdf.find_channels(closing.is_open)?;
    Ok(Box::new(mdf))
}

/// Checks the identification at the start of a file.
fn identify(blocks: &mut Blocks) -> Result<Closing> {
    let mut bytes = Vec::new();
    let is_long = blocks.bytes(0, 64, &mut bytes).is_ok();
    let id = bytes.get(..8).unwrap_or_default();
    if !is_long || id != b"MDF     " && id != b"UnFinMF " {
        return Err(Error::data("is not an MDF file: expected it to start with \"MDF\"", AGAIN));
    }
    let version = String::from_utf8_lossy(bytes.get(8..16).unwrap_or_default());
    let version = version.trim_matches(|c: char| c == '\0' || c == ' ');
    if !version.starts_with('4') {
        let message = format!("is an MDF file of version {}, expected version 4", excerpt(version));
        let hint = "Convert it with asammdf: MDF(\"file.mdf\").convert(\"4.10\").save(\"file.mf4\").";
        return Err(Error::data(message, hint));
    }
    let is_open = id != b"MDF     ";
    let flags = bytes.get(60).copied().unwrap_or(0);
    Ok(Closing { is_open, lacks_length: is_open && flags & 4 != 0 })
}

/// A channel group that has a clock, numbers and records.
struct Usable {
    place: (usize, usize),
    name: String,
    found: Found,
}

impl Mdf {
    /// Finds the channels with their times.
    fn find_channels(&mut self, is_open: bool) -> Result<()> {
        let mut usable: Vec<Usable> = Vec::new();
        let (mut left_out, mut number) = (Vec::new(), 0);
        let mut names = HashSet::new();
        for (d, data) in self.data.iter().enumerate() {
            let lacks = data.groups.iter().all(|group| lack(group, &data.data).is_some());
            let found = if lacks { Vec::new() } else { data.count(&mut self.blocks, is_open)? };
            for (g, group) in data.groups.iter().enumerate() {
                number += 1;
                let name = if group.name.is_empty() { format!("group {number}") } else { group.name.clone() };
                let name = if names.insert(name.clone()) { name } else { format!("{name} (group {number})") };
                let found = found.get(g).cloned().unwrap_or_default();
                let reason = lack(group, &data.data).or((found.count == 0).then_some("no samples"));
                left_out.extend(reason.map(|reason| format!("left out {}: {reason}", excerpt(&name))));
                left_out.extend(group.others.iter().map(|other| format!("left out {other}")));
                if reason.is_none() {
                    usable.push(Usable { place: (d, g), name, found });
                }
            }
        }
        let clocks = usable.iter().filter_map(|usable| Some((self.group(usable.place)?.clock?, &usable.found)));
        let times = Times::of(&clocks.collect::<Vec<_>>());
        let mut incomplete = Vec::new();
        for (Usable { place, name, found }, times) in usable.into_iter().zip(times) {
            let span = times.span(&found);
            let Some(group) = self.group(place) else { continue };
            let is_cut = self.data.get(place.0).is_some_and(|data| data.data.is_cut) || found.count < group.cycles;
            if is_open || is_cut {
                incomplete.push(self.incomplete(is_open, &name, found.count, span[1]));
            }
            let field = |signal: &Signal| Field { path: signal.name.clone(), unit: signal.unit.clone() };
            let fields = group.signals.iter().map(field).collect();
            self.places.push((place.0, place.1, times));
            self.channels.push(Channel { name, fields, count: found.count, span_s: Some(span) });
        }
        self.notes = [shortened(incomplete, NOTES_MAX), shortened(left_out, NOTES_MAX)].concat();
        Ok(())
    }

    fn group(&self, (data, group): (usize, usize)) -> Option<&Group> {
        self.data.get(data)?.groups.get(group)
    }

    /// Returns a note on a group without its last samples.
    fn incomplete(&self, is_open: bool, name: &str, count: u64, end_s: f64) -> String {
        let name = quoted(name);
        let count = counted(usize::try_from(count).unwrap_or(usize::MAX), "sample");
        if is_open {
            return format!("the logger did not close the file: {name} has {count} up to {end_s} s");
        }
        let length = self.blocks.length;
        format!("the file is cut off after {length} bytes: samples of {name} after {end_s} s are lost")
    }

    /// Reads signals of a channel.
    fn series(&mut self, channel: usize, fields: &[usize]) -> Result<Series> {
        let no_field = || Error::data("has no such field", "Choose one of the fields of the file.");
        let &(d, g, times) = self.places.get(channel).ok_or_else(no_field)?;
        let data = self.data.get(d).ok_or_else(no_field)?;
        let group = data.groups.get(g).ok_or_else(no_field)?;
        let signals = fields.iter().map(|&field| group.signals.get(field).ok_or_else(no_field));
        let signals = signals.collect::<Result<Vec<&Signal>>>()?;
        let (name, expected) = self.channels.get(channel).map_or(("", 0), |c| (c.name.as_str(), c.count));
        let mut series = Series { time_s: Vec::new(), columns: vec![Vec::new(); signals.len()] };
        data.records(&mut self.blocks, g, &mut |mut records: Records| {
            let left = expected - series.time_s.len() as u64;
            let end = usize::try_from(left).unwrap_or(usize::MAX).saturating_mul(records.stride);
            records.bytes = records.bytes.get(..end).unwrap_or(records.bytes);
            let index = series.time_s.len() as u64..;
            series.time_s.extend(records.each().zip(index).map(|(record, index)| times.time(record, index)));
            for (signal, column) in signals.iter().zip(&mut series.columns) {
                signal.place.append(records, column);
            }
        })?;
        let found = series.time_s.len() as u64;
        if found != expected {
            let message = format!("group {} has {found} samples, expected {expected}", quoted(name));
            return Err(Error::data(message, AGAIN));
        }
        for (signal, column) in signals.iter().zip(&mut series.columns) {
            signal.conversion.apply(column);
        }
        Ok(series)
    }
}

/// Returns the reason why a channel group is left out.
fn lack(group: &Group, data: &Data) -> Option<&'static str> {
    let without = match (&group.clock, group.signals.is_empty()) {
        (_, true) => Some("no channels of numbers"),
        (None, _) => Some("no time"),
        _ => None,
    };
    group.unsupported.or(data.unsupported).or(without)
}

impl Log for Mdf {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&mut self, requests: &[(usize, Vec<usize>)]) -> Result<Vec<Series>> {
        let values = requests.iter().map(|(channel, fields)| {
            let count = self.channels.get(*channel).map_or(0, |channel| channel.count);
            count.saturating_mul(fields.len() as u64 + 1)
        });
        let values = values.fold(0, u64::saturating_add);
        if values > VALUES_MAX {
            let message = format!("the channels have {values} values, expected at most {VALUES_MAX}");
            return Err(Error::data(message, "Select fewer channels, or save a part of the recording."));
        }
        requests.iter().map(|(channel, fields)| self.series(*channel, fields)).collect()
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }
}
