//! Channels, constants and notes of TDMS files.

use super::super::log::{Channel, Field, IsTime};
use super::file::Walker;
use super::kind::Kind;
use super::object::{Object, Place, Properties};
use super::scale::Scales;
use super::time::{Clock, Waveform};
use motorfit_core::text::{counted, excerpt};
use motorfit_core::{Error, Result};
use std::collections::{HashMap, HashSet};

/// Largest number of fields of a file.
pub(super) const CHANNELS_MAX: usize = 10_000;
/// Largest number of channels that a note names.
const NAMED_MAX: usize = 5;

/// Fields with the same number of samples and the same times.
#[derive(Debug)]
pub(super) struct Table {
    pub group: String,
    pub count: u64,
    waveform: Option<Waveform>,
    /// Times of the samples of a waveform, since the earliest sample of the log.
    pub clock: Option<Clock>,
    pub columns: Vec<Column>,
}

/// Values of a field.
#[derive(Debug)]
pub(super) struct Column {
    pub object: usize,
    pub scales: Scales,
    field: Field,
}

/// Returns the tables of a file whose segments are counted, and notes on the channels that are left out.
///
/// # Errors
/// Returns a `Data` error if the file has no channel of numbers, or too many.
pub(super) fn tables(walker: &Walker, is_time: IsTime) -> Result<(Vec<Table>, Vec<String>)> {
    let mut tables: Vec<Table> = Vec::new();
    let mut fields = 0;
    let mut left_out: Vec<(String, String)> = Vec::new();
    let owners = Owners::of(&walker.objects.all);
    let timed = groups_with_times(&walker.objects.all, is_time);
    for (at, object) in walker.objects.all.iter().enumerate() {
        let Place::Channel { group, name } = &object.place else { continue };
        let path = format!("{}/{}", excerpt(group), excerpt(name));
        let (kind, scales) = match usable(object, &owners.of_group(group)) {
            Ok(usable) => usable,
            Err(reason) => {
                left_out.push((reason, path));
                continue;
            }
        };
        fields += 1;
        if fields > CHANNELS_MAX {
            let message = format!("holds more than {CHANNELS_MAX} channels");
            return Err(Error::data(message, "Save the channels of one recording alone."));
        }
        // An increment of 1 is what LabVIEW writes where none was set.
        let is_unset = |waveform: &Waveform| waveform.increment_s.to_bits() == 1.0_f64.to_bits();
        let waveform = waveform(object).filter(|waveform| !(is_unset(waveform) && timed.contains(group.as_str())));
        let unit = if kind == Kind::Time { Some("s") } else { object.properties.text("unit_string") };
        let unit = unit.map(str::trim).filter(|unit| !unit.is_empty()).map(str::to_owned);
        let column = Column { object: at, scales, field: Field { path: name.clone(), unit } };
        let mut others = tables.iter_mut();
        let same =
            others.find(|table| table.count == object.count && table.waveform == waveform && table.group == *group);
        match same {
            Some(table) => table.columns.push(column),
            None => {
                let (group, count, columns) = (group.clone(), object.count, vec![column]);
                tables.push(Table { group, count, waveform, clock: None, columns });
            }
        }
    }
    let mut notes = reasons(left_out);
    notes.extend(set_clocks(&mut tables));
    if tables.is_empty() {
        notes.extend(walker.end.clone());
        let found = if notes.is_empty() { "no channels".to_owned() } else { notes.join("; ") };
        let hint = "Save time, voltage, current and speed as channels of numbers in one group.";
        return Err(Error::data(format!("holds no channel of numbers with samples; found {found}"), hint));
    }
    Ok((tables, notes))
}

/// Returns the groups that have a channel of times.
fn groups_with_times(objects: &[Object], is_time: IsTime) -> HashSet<&str> {
    let mut timed = HashSet::new();
    for object in objects {
        if let Place::Channel { group, name } = &object.place
            && (object.kind == Some(Kind::Time) || is_time(name))
        {
            timed.insert(group.as_str());
        }
    }
    timed
}

/// Properties of the groups and of the file.
struct Owners<'o> {
    groups: HashMap<&'o str, &'o Properties>,
    file: Option<&'o Properties>,
}

impl<'o> Owners<'o> {
    fn of(objects: &'o [Object]) -> Self {
        let mut owners = Self { groups: HashMap::new(), file: None };
        for object in objects {
            match &object.place {
                Place::File => owners.file = Some(&object.properties),
                Place::Group(group) => drop(owners.groups.insert(group, &object.properties)),
                Place::Channel { .. } => (),
            }
        }
        owners
    }

    /// Returns the properties of a group, and those of the file.
    fn of_group(&self, group: &str) -> Vec<&'o Properties> {
        self.groups.get(group).copied().into_iter().chain(self.file).collect()
    }
}

/// Returns type and scales of a channel of numbers or times, or else the reason for leaving it out.
fn usable(object: &Object, owners: &[&Properties]) -> std::result::Result<(Kind, Scales), String> {
    let kind = match object.kind {
        None if object.daqmx => return Err("has raw DAQmx data".to_owned()),
        None => return Err("has no samples".to_owned()),
        Some(kind) => kind,
    };
    if let Some(what) = kind.left_out() {
        return Err(format!("holds {what}"));
    }
    if object.count == 0 {
        return Err("has no samples".to_owned());
    }
    let properties = std::iter::once(&object.properties).chain(owners.iter().copied());
    let scales = if kind == Kind::Time { Scales::default() } else { Scales::of(properties)? };
    Ok((kind, scales))
}

/// Returns the waveform of a channel with an increment, unless it is over another quantity than time.
fn waveform(object: &Object) -> Option<Waveform> {
    let properties = &object.properties;
    let is_time = properties.text("wf_xunit_string").is_none_or(|unit| matches!(unit.trim(), "" | "s"));
    let increment = properties.number("wf_increment").filter(|_| is_time)?;
    Waveform::new(properties.time("wf_start_time"), properties.number("wf_start_offset").unwrap_or(0.0), increment)
}

/// Sets the clocks of waveforms, since the earliest sample. Returns a note if they cannot be aligned.
fn set_clocks(tables: &mut [Table]) -> Option<String> {
    let starts = || tables.iter().filter_map(|table| table.waveform).map(|waveform| waveform.start);
    let absolute = starts().all(|start| start.is_some());
    let note = (!absolute && starts().any(|start| start.is_some()))
        .then(|| "some waveforms have no wf_start_time; all are assumed to start at the same time".to_owned());
    for table in tables.iter_mut() {
        table.clock = table.waveform.map(|waveform| waveform.clock(absolute));
    }
    let origin = tables.iter().filter_map(|table| table.clock).map(|clock| clock.start()).min().unwrap_or(0);
    for table in tables.iter_mut() {
        table.clock = table.clock.map(|clock| clock.since(origin));
    }
    note
}

/// Returns a note for each reason, with the first channels that it concerns.
fn reasons(mut left_out: Vec<(String, String)>) -> Vec<String> {
    // Stable: the channels of a reason stay in the order of the file.
    left_out.sort_by(|(a, _), (b, _)| a.cmp(b));
    let same_reason = left_out.chunk_by(|(a, _), (b, _)| a == b);
    let notes = same_reason.map(|group| {
        let names: Vec<&str> = group.iter().take(NAMED_MAX).map(|(_, name)| name.as_str()).collect();
        let more = if group.len() > NAMED_MAX { ", …" } else { "" };
        let reason = group.first().map_or("", |(reason, _)| reason);
        format!("{} left out ({}{more}): {reason}", counted(group.len(), "channel"), names.join(", "))
    });
    notes.collect()
}

/// Returns the tables as channels: a group whose channels form one table has its name, one of several tables has the name of
/// the group and of its first channel.
pub(super) fn channels(tables: &[Table]) -> Vec<Channel> {
    let mut of_group: HashMap<&str, usize> = HashMap::new();
    for table in tables {
        *of_group.entry(&table.group).or_insert(0) += 1;
    }
    let channel = |table: &Table| {
        let name = if of_group.get(table.group.as_str()) == Some(&1) {
            table.group.clone()
        } else {
            let first = table.columns.first().map_or("", |column| &column.field.path);
            format!("{}/{first}", table.group)
        };
        let last = table.count.saturating_sub(1);
        Channel {
            name,
            fields: table.columns.iter().map(|column| column.field.clone()).collect(),
            count: table.count,
            span_s: table.clock.map(|clock| [clock.time_s(0), clock.time_s(last)]),
        }
    };
    tables.iter().map(channel).collect()
}

/// Returns the numbers among the properties of the file and of its groups, the latter with the name of the group.
pub(super) fn constants(walker: &Walker) -> Vec<(String, f64)> {
    let mut constants = Vec::new();
    for object in &walker.objects.all {
        let prefix = match &object.place {
            Place::File => String::new(),
            Place::Group(group) => format!("{group}/"),
            Place::Channel { .. } => continue,
        };
        constants.extend(object.properties.constants().map(|(name, value)| (format!("{prefix}{name}"), value)));
    }
    constants
}
