//! WPILib data logs (`.wpilog`): entries by name and type. A first pass over the file gives the entries, their times and the
//! states of tests; a second one reads the values of chosen entries.
//!
//! Entries log a value when it is written, often only when it changes. The clock of a robot restarts with its controller: a
//! time of an entry more than [`RESTART_US`] before its last one begins a new part of the log, whose times continue [`PAUSE_US`]
//! later.

use super::log::{Channel, Field, Log, Medium, Series, States};
use super::wpilib_units::symbol;
use super::wpilog_records::{Records, number};
use motorfit_core::numeric::{count_u64, index};
use motorfit_core::text::{counted, quoted};
use motorfit_core::{Error, Result};
use std::collections::HashMap;

/// Largest number of entries.
pub const ENTRIES_MAX: usize = 100_000;
/// Largest number of values of an array entry that are read.
pub const ARRAY_MAX: usize = 64;
/// Largest number of entries that are named because they were declared twice, and of restarts of the clock.
const NAMED_MAX: usize = 5;
/// Largest number of changes of state that are kept.
const CHANGES_MAX: usize = 4000;
/// Largest number of fields of all entries.
const FIELDS_MAX: usize = 200_000;
/// Step back in time from which the clock has restarted \[µs\]. Threads of a robot write records in another order by less.
const RESTART_US: u64 = 1_000_000;
/// Pause between the parts of a log whose clock restarted \[µs\].
const PAUSE_US: u64 = 10_000_000;
/// Latest time of a record \[µs\]: a century.
const TIME_MAX_US: u64 = 100 * 366 * 86_400 * 1_000_000;
/// Names of the tests of SysId, by which their state is logged.
pub const TESTS: [&str; 4] = ["quasistatic-forward", "quasistatic-reverse", "dynamic-forward", "dynamic-reverse"];
/// Text that ends a test.
pub const NO_TEST: &str = "none";

/// Type of the values of an entry.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Boolean,
    Int64,
    Float,
    Double,
    Text,
    /// Other types, which have no numbers.
    Other,
}

impl Kind {
    /// Returns the type of an entry and true for an array.
    fn of(name: &str) -> (Self, bool) {
        let (one, is_array) = name.strip_suffix("[]").map_or((name, false), |one| (one, true));
        let kind = match one {
            "boolean" => Self::Boolean,
            "int64" => Self::Int64,
            "float" => Self::Float,
            "double" => Self::Double,
            "string" if !is_array => Self::Text,
            _ => Self::Other,
        };
        (kind, is_array)
    }

    /// Returns the size of a number \[bytes\]; 0 for types without numbers.
    fn size(self) -> usize {
        match self {
            Self::Boolean => 1,
            Self::Float => 4,
            Self::Int64 | Self::Double => 8,
            Self::Text | Self::Other => 0,
        }
    }

    /// Returns the number in the first bytes.
    fn value(self, bytes: &[u8]) -> Option<f64> {
        Some(match self {
            Self::Boolean => f64::from(*bytes.first()? != 0),
            Self::Int64 => motorfit_core::numeric::real(i64::from_le_bytes(bytes.first_chunk().copied()?)),
            Self::Float => f64::from(f32::from_le_bytes(bytes.first_chunk().copied()?)),
            Self::Double => f64::from_le_bytes(bytes.first_chunk().copied()?),
            Self::Text | Self::Other => return None,
        })
    }
}

/// An entry of the log; entries with the same name and type are one.
#[derive(Debug, Clone)]
struct Entry {
    name: String,
    kind: Kind,
    is_array: bool,
    type_name: String,
    unit: Option<String>,
    count: u64,
    width: usize,
    span_us: [u64; 2],
    changes: Vec<(u64, String)>,
    /// True if a value is the state of a test.
    is_state: bool,
    /// True from its start to its end.
    is_open: bool,
}

/// Entries by the numbers that records have at a place of the file.
#[derive(Debug, Default)]
struct Directory {
    entries: Vec<Entry>,
    by_name: HashMap<(String, String), usize>,
    by_number: HashMap<u32, usize>,
    repeated: Vec<String>,
}

impl Directory {
    /// Reads a control record: the start of an entry, its end, or new metadata.
    fn control(&mut self, payload: &[u8]) -> Option<()> {
        let (&kind, rest) = payload.split_first()?;
        let entry = u32::try_from(number(rest.get(..4)?)).ok()?;
        let mut rest = &rest[4..];
        let mut text = || {
            let length = index(number(rest.get(..4)?));
            let text = rest.get(4..)?.get(..length)?;
            rest = &rest[4 + length..];
            Some(String::from_utf8_lossy(text).into_owned())
        };
        match kind {
            0 => {
                let (name, type_name, metadata) = (text()?, text()?, text()?);
                self.start(entry, name, type_name, &metadata);
            }
            1 => {
                let at = self.by_number.remove(&entry)?;
                self.entries.get_mut(at)?.is_open = false;
            }
            2 => {
                let unit = unit(&text()?);
                let at = *self.by_number.get(&entry)?;
                let entry = self.entries.get_mut(at)?;
                entry.unit = unit.or_else(|| entry.unit.take());
            }
            _ => {}
        }
        Some(())
    }

    fn start(&mut self, number: u32, name: String, type_name: String, metadata: &str) {
        let key = (name.clone(), type_name.clone());
        let at = match self.by_name.get(&key) {
            Some(&at) => {
                if self.entries[at].is_open && !self.repeated.contains(&name) && self.repeated.len() < NAMED_MAX {
                    self.repeated.push(name);
                }
                at
            }
            None if self.entries.len() >= ENTRIES_MAX => return,
            None => {
                let (kind, is_array) = Kind::of(&type_name);
                let (count, width, span_us) = (0, usize::from(!is_array), [u64::MAX, 0]);
                let (unit, changes) = (unit(metadata), Vec::new());
                let (is_state, is_open) = (false, true);
                let entry =
                    Entry { name, kind, is_array, type_name, unit, count, width, span_us, changes, is_state, is_open };
                self.entries.push(entry);
                self.by_name.insert(key, self.entries.len() - 1);
                self.entries.len() - 1
            }
        };
        self.entries[at].is_open = true;
        self.by_number.insert(number, at);
    }
}

/// Returns the unit in the metadata of an entry: its text, or the member `unit` or `units` of its JSON.
fn unit(metadata: &str) -> Option<String> {
    let metadata = metadata.trim();
    let text = if metadata.starts_with('{') {
        let members: serde_json::Map<String, serde_json::Value> = serde_json::from_str(metadata).ok()?;
        ["unit", "units"].into_iter().find_map(|key| members.get(key)?.as_str().map(str::to_owned))?
    } else {
        metadata.to_owned()
    };
    symbol(&text)
}

/// Times that continue where the clock of the log restarts.
#[derive(Debug, Default, Clone)]
struct Clock {
    latest_us: u64,
    /// Latest time of each entry \[µs\].
    last_us: Vec<u64>,
    shift_us: u64,
    /// Latest times before each restart \[µs\].
    restarts: Vec<u64>,
}

impl Clock {
    /// Returns the time of a record of an entry \[µs\]; `None` if it is out of range.
    fn continued(&mut self, entry: usize, time_us: u64) -> Option<u64> {
        let time = time_us.checked_add(self.shift_us).filter(|time| *time <= TIME_MAX_US)?;
        if self.last_us.len() <= entry {
            self.last_us.resize(entry + 1, 0);
        }
        let last = self.last_us.get_mut(entry)?;
        if time + RESTART_US < *last {
            self.restarts.push(self.latest_us);
            self.latest_us += PAUSE_US;
            self.shift_us = self.latest_us - time_us;
            *last = self.latest_us;
            return Some(self.latest_us);
        }
        *last = time.max(*last);
        self.latest_us = self.latest_us.max(time);
        Some(time)
    }
}

struct Wpilog {
    medium: Box<dyn Medium>,
    entries: Vec<Entry>,
    channels: Vec<Channel>,
    states: Vec<States>,
    notes: Vec<String>,
    /// Entry of each channel.
    of: Vec<usize>,
    start_us: u64,
}

/// Opens a log.
///
/// # Errors
/// Returns `Data` if the header is damaged, the file cannot be read, or no record of it is complete.
pub(crate) fn open(mut medium: Box<dyn Medium>) -> Result<Box<dyn Log>> {
    let (mut directory, mut clock, mut strays) = (Directory::default(), Clock::default(), 0_u64);
    let mut records = Records::new(medium.as_mut())?;
    while let Some(record) = records.next_record()? {
        if record.entry == 0 {
            strays += u64::from(directory.control(record.payload).is_none());
            continue;
        }
        let at = directory.by_number.get(&record.entry).copied();
        let time = at.and_then(|at| Some((at, clock.continued(at, record.time_us)?)));
        match time.and_then(|(at, time)| Some((directory.entries.get_mut(at)?, time))) {
            Some((entry, time)) => scan(entry, time, record.payload),
            None => strays += 1,
        }
    }
    let cut_at = records.cut_at;
    let start_us = directory.entries.iter().map(|entry| entry.span_us[0]).min().unwrap_or(0);
    let seconds = |time_us: u64| count_u64(time_us.saturating_sub(start_us)) / 1e6;
    let mut notes = Vec::new();
    if let Some(at) = cut_at {
        notes.push(format!("the log is cut off after {at} bytes: its last record is incomplete and left out"));
    }
    if strays > 0 {
        notes.push(format!(
            "{} that are damaged or without a declared entry left out",
            counted(index(strays), "record")
        ));
    }
    if clock.restarts.len() > NAMED_MAX {
        notes.push(format!("the clock restarts {} times", clock.restarts.len()));
    }
    for before in clock.restarts.iter().take(NAMED_MAX) {
        notes.push(format!(
            "the clock restarts after {} s: later times continue after a pause of 10 s",
            seconds(*before)
        ));
    }
    for name in &directory.repeated {
        notes.push(format!("entry {} is declared twice; its records are read as one", quoted(name)));
    }
    let Directory { entries, .. } = directory;
    let mut fields = 0;
    let is_kept = |at: &usize| {
        fields += entries[*at].width;
        entries[*at].kind.size() > 0 && fields <= FIELDS_MAX
    };
    let of: Vec<usize> = (0..entries.len()).filter(is_kept).collect();
    let channels = of.iter().map(|at| channel(&entries[*at], &seconds)).collect();
    let states = entries.iter().filter(|entry| entry.is_state).map(|entry| {
        let mut changes: Vec<(f64, String)> =
            entry.changes.iter().map(|(time, text)| (seconds(*time), text.clone())).collect();
        // Threads write records in another order than that of their times.
        changes.sort_by(|a, b| a.0.total_cmp(&b.0));
        States { name: entry.name.clone(), changes }
    });
    let states = states.collect();
    Ok(Box::new(Wpilog { medium, channels, states, notes, of, start_us, entries }))
}

/// Counts a value of an entry, and keeps the changes of a text that may be the state of a test.
fn scan(entry: &mut Entry, time: u64, payload: &[u8]) {
    entry.count += 1;
    entry.span_us = [entry.span_us[0].min(time), entry.span_us[1].max(time)];
    let size = entry.kind.size();
    if entry.is_array && size > 0 {
        entry.width = entry.width.max(payload.len() / size).min(ARRAY_MAX);
    }
    if entry.kind == Kind::Text
        && let Ok(text) = std::str::from_utf8(payload)
    {
        let is_test = TESTS.contains(&text);
        entry.is_state |= is_test;
        // Texts that are no states end a test too, but their number is not limited by the tests.
        let text = if is_test { text } else { NO_TEST };
        if entry.changes.last().is_none_or(|(_, last)| last != text) && entry.changes.len() < CHANGES_MAX {
            entry.changes.push((time, text.to_owned()));
        }
    }
}

fn channel(entry: &Entry, seconds: &dyn Fn(u64) -> f64) -> Channel {
    let path = |n: usize| if entry.is_array { format!("[{n}]") } else { String::new() };
    let unit = entry.unit.clone().or_else(|| phoenix_unit(&entry.name));
    let fields = (0..entry.width).map(|n| Field { path: path(n), unit: unit.clone() }).collect();
    let span_s = (entry.count > 0).then(|| entry.span_us.map(seconds));
    Channel { name: entry.name.clone(), fields, count: entry.count, span_s: span_s.or(Some([0.0; 2])) }
}

/// Returns the unit of the position or velocity of a motor controller whose converted log names none: rotations.
fn phoenix_unit(name: &str) -> Option<String> {
    let of_controller = name.trim_start_matches('/').starts_with("Phoenix6/");
    let unit = match name.rsplit('/').next()? {
        "Position" | "RotorPosition" => "turn",
        "Velocity" | "RotorVelocity" => "turn/s",
        _ => return None,
    };
    of_controller.then(|| unit.to_owned())
}

impl Log for Wpilog {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&mut self, requests: &[(usize, Vec<usize>)]) -> Result<Vec<Series>> {
        let mut series: Vec<Series> = requests
            .iter()
            .map(|(_, fields)| Series { time_s: Vec::new(), columns: vec![Vec::new(); fields.len()] })
            .collect();
        let mut wanted: Vec<Option<usize>> = vec![None; self.entries.len()];
        for (n, (channel, _)) in requests.iter().enumerate() {
            let entry = self.of.get(*channel).and_then(|at| wanted.get_mut(*at));
            *entry.ok_or_else(|| Error::data("has no such channel", "Read the log again."))? = Some(n);
        }
        let (mut directory, mut clock) = (Directory::default(), Clock::default());
        let mut records = Records::new(self.medium.as_mut())?;
        while let Some(record) = records.next_record()? {
            if record.entry == 0 {
                directory.control(record.payload);
                continue;
            }
            let Some(at) = directory.by_number.get(&record.entry).copied() else { continue };
            let Some(time) = clock.continued(at, record.time_us) else { continue };
            let Some(n) = wanted.get(at).copied().flatten() else { continue };
            let (entry, (_, fields)) = (&self.entries[at], &requests[n]);
            series[n].time_s.push(count_u64(time.saturating_sub(self.start_us)) / 1e6);
            for (column, field) in series[n].columns.iter_mut().zip(fields) {
                let bytes = record.payload.get(field * entry.kind.size()..).unwrap_or_default();
                column.push(entry.kind.value(bytes).unwrap_or(f64::NAN));
            }
        }
        series.iter_mut().for_each(sort);
        Ok(series)
    }

    fn states(&self) -> &[States] {
        &self.states
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn is_of_changes(&self) -> bool {
        true
    }

    fn others(&self) -> Vec<String> {
        let others = self.entries.iter().filter(|entry| entry.kind.size() == 0);
        others.map(|entry| format!("{} ({})", entry.name, entry.type_name)).collect()
    }
}

/// Sorts samples by their time; those of equal times keep their order.
fn sort(series: &mut Series) {
    if series.time_s.windows(2).all(|pair| pair[0] <= pair[1]) {
        return;
    }
    let mut order: Vec<usize> = (0..series.time_s.len()).collect();
    order.sort_by(|a, b| series.time_s[*a].total_cmp(&series.time_s[*b]));
    let sorted = |values: &Vec<f64>| order.iter().map(|n| values[*n]).collect();
    series.columns = series.columns.iter().map(sorted).collect();
    series.time_s = sorted(&series.time_s);
}
