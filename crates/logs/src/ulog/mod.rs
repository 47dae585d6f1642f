//! ULog files, as the autopilot PX4 writes them.

mod file;
mod format;
mod number;
mod topic;

use super::log::{Channel, Field, Log, Medium, Series};
use super::window::Window;
use file::Messages;
use format::NAME_MAX;
use motorfit_core::numeric::count_u64;
use motorfit_core::text::{counted, excerpt};
use motorfit_core::{Error, Result};
use number::Number;
use std::collections::HashMap;
use topic::Topics;

/// Largest number of values that are read at once.
const VALUES_MAX: u64 = 100_000_000;
/// Largest number of parameters.
const PARAMETERS_MAX: usize = 10_000;
/// Largest number of changes of parameters that notes name.
const CHANGES_MAX: usize = 20;

/// Opens a ULog file.
///
/// Each topic is a channel; further instances of it are named `topic[1]` and so on. Fields are named by their paths, such as
/// `q[0]`. Times are counted from the earliest sample. Parameters are constants, with their values at the start of the log.
///
/// # Errors
/// Returns a `Data` error if the file is not a ULog file, of an incompatible version, or has no topics with numbers.
pub(crate) fn open(medium: Box<dyn Medium>) -> Result<Box<dyn Log>> {
    let mut window = Window::new(medium)?;
    let mut messages = Messages::new(&mut window)?;
    let mut topics = Topics::default();
    let mut events = Events::default();
    while let Some((kind, message)) = messages.next(&mut window)? {
        events.started |= matches!(kind, b'A' | b'L' | b'C' | b'D');
        match kind {
            b'F' => topics.add_format(message),
            b'A' => topics.subscribe(message),
            b'D' => count_sample(&mut topics, &mut events, message),
            b'P' => events.parameter(message),
            b'O' => events.dropout(message),
            _ => (),
        }
    }
    let log = Ulog::new(window, topics, &events, &messages)?;
    Ok(Box::new(log))
}

/// Counts a sample and its time.
fn count_sample(topics: &mut Topics, events: &mut Events, message: &[u8]) {
    let Some((topic, data)) = topics.sample(message) else { return };
    let Some(topic) = topics.all.get_mut(topic) else { return };
    topic.count = topic.count.saturating_add(1);
    if let Some(time) = topic.layout.time(data) {
        let (first, _) = topic.span.unwrap_or((time, time));
        topic.span = Some((first, time));
        events.earliest = Some(events.earliest.map_or(time, |earliest| earliest.min(time)));
        events.latest = events.latest.max(time);
    }
}

/// Parameters, dropouts and times of a file.
#[derive(Debug, Default)]
struct Events {
    /// True after the definitions, which the first subscription or text ends.
    started: bool,
    /// Earliest and latest timestamp \[µs\].
    earliest: Option<u64>,
    latest: u64,
    parameters: Vec<(String, f64)>,
    /// Position of each parameter.
    positions: HashMap<String, usize>,
    /// Times \[µs\], names and values of the first changes of parameters.
    changes: Vec<(u64, String, f64)>,
    /// Number of changes.
    changed: usize,
    /// Number of dropouts and their total duration \[ms\].
    dropouts: (usize, u64),
}

impl Events {
    /// Adds a parameter or its change.
    fn parameter(&mut self, message: &[u8]) {
        let Some((length, rest)) = message.split_first() else { return };
        let Some((key, value)) = rest.split_at_checked(usize::from(*length)) else { return };
        let key = String::from_utf8_lossy(key);
        let (number, name) = match key.split_once(' ') {
            Some(("int32_t", name)) => (Number::I32, name),
            Some(("float", name)) => (Number::F32, name),
            _ => return,
        };
        if value.len() != 4 || name.len() > NAME_MAX {
            return;
        }
        let value = number.value(value);
        if self.started {
            self.changed = self.changed.saturating_add(1);
            if self.changes.len() < CHANGES_MAX {
                self.changes.push((self.latest, name.to_owned(), value));
            }
        } else if let Some(parameter) = self.positions.get(name).and_then(|at| self.parameters.get_mut(*at)) {
            parameter.1 = value;
        } else if self.parameters.len() < PARAMETERS_MAX {
            self.positions.insert(name.to_owned(), self.parameters.len());
            self.parameters.push((name.to_owned(), value));
        }
    }

    fn dropout(&mut self, message: &[u8]) {
        let duration = message.first_chunk().map_or(0, |bytes| u16::from_le_bytes(*bytes));
        self.dropouts = (self.dropouts.0.saturating_add(1), self.dropouts.1.saturating_add(u64::from(duration)));
    }

    /// Returns notes on dropouts, changes of parameters and the end of the file.
    fn notes(&self, messages: &Messages, size: u64) -> Vec<String> {
        let mut notes = Vec::new();
        let since = |time: u64| count_u64(time.saturating_sub(self.earliest.unwrap_or(0))) / 1e6;
        if self.dropouts.0 > 0 {
            let (count, duration) = self.dropouts;
            notes.push(format!("{} of {duration} ms in total", counted(count, "dropout")));
        }
        for (time, name, value) in &self.changes {
            notes.push(format!("the parameter {} changes to {value} at {} s", excerpt(name), since(*time)));
        }
        if let Some(more) = self.changed.checked_sub(self.changes.len()).filter(|more| *more > 0) {
            notes.push(format!("{} of parameters not listed", counted(more, "more change")));
        }
        if let Some((bytes, first)) = messages.damaged {
            notes.push(format!("{bytes} bytes are damaged and left out, the first of them at byte {first}"));
        }
        notes.extend(messages.missing.clone());
        if let Some(at) = messages.cut {
            let lost = format!("samples after {} s are lost", since(self.latest));
            notes.push(format!("the file is cut off after {size} bytes, within the message at byte {at}; {lost}"));
        }
        notes
    }
}

struct Ulog {
    window: Window,
    channels: Vec<Channel>,
    /// Topic of each channel.
    topics: Vec<usize>,
    /// Earliest timestamp \[µs\].
    origin: u64,
    constants: Vec<(String, f64)>,
    notes: Vec<String>,
}

impl Ulog {
    /// Returns the log of a file that has been read once.
    fn new(window: Window, mut topics: Topics, events: &Events, messages: &Messages) -> Result<Self> {
        let origin = events.earliest.unwrap_or(0);
        let mut channels = Vec::new();
        let mut numbers = Vec::new();
        let mut without = Vec::new();
        for (at, topic) in topics.all.iter().enumerate().filter(|(_, topic)| topic.count > 0) {
            if topic.layout.leaves.is_empty() {
                without.push(topic.name.clone());
                continue;
            }
            let fields = topic.layout.leaves.iter().map(|leaf| Field { path: leaf.path.clone(), unit: None });
            let span_s = topic.span.map(|(first, last)| [first, last].map(|time| since(time, origin)));
            let (name, fields) = (topic.name.clone(), fields.collect());
            channels.push(Channel { name, fields, count: topic.count, span_s });
            numbers.push(at);
        }
        without.iter().for_each(|name| topics.leave_out("has no numbers", name));
        let mut notes = topics.notes();
        notes.extend(events.notes(messages, window.size()));
        if channels.is_empty() {
            let found = if notes.is_empty() { "no samples".to_owned() } else { notes.join("; ") };
            let hint = "Choose another log; this one may have been stopped before the first sample.";
            return Err(Error::data(format!("holds no topic with samples; found {found}"), hint));
        }
        let constants = events.parameters.clone();
        Ok(Self { window, channels, topics: numbers, origin, constants, notes })
    }

    /// Returns the columns of the requests in their order, those with the times of a channel before those of its fields.
    fn requested(&self, requests: &[(usize, Vec<usize>)]) -> Result<Vec<Column>> {
        let mut columns = Vec::new();
        let mut values = 0_u64;
        for (channel, fields) in requests {
            let topic = *self.topics.get(*channel).ok_or_else(no_field)?;
            let channel = self.channels.get(*channel).ok_or_else(no_field)?;
            let times = channel.span_s.is_some().then_some(None);
            for field in times.into_iter().chain(fields.iter().copied().map(Some)) {
                if field.is_some_and(|field| field >= channel.fields.len()) {
                    return Err(no_field());
                }
                values = values.saturating_add(channel.count);
                columns.push(Column { topic, field, values: Vec::new(), count: channel.count });
            }
        }
        if values > VALUES_MAX {
            let message = format!("the chosen fields have {values} values, expected at most {VALUES_MAX}");
            return Err(Error::data(message, "Choose fewer fields, or a shorter log."));
        }
        for column in &mut columns {
            // The file holds each sample that was counted.
            column.values.reserve_exact(usize::try_from(column.count).unwrap_or(0));
        }
        Ok(columns)
    }

    /// Returns the columns of all requests as series.
    fn series(&self, requests: &[(usize, Vec<usize>)], columns: Vec<Column>) -> Result<Vec<Series>> {
        if columns.iter().any(|column| column.values.len() as u64 != column.count) {
            return Err(Error::data("has changed since it was opened", "Copy the file again."));
        }
        let mut columns = columns.into_iter().map(|column| column.values);
        let mut all = Vec::new();
        for (channel, fields) in requests {
            let with_times = self.channels.get(*channel).is_some_and(|channel| channel.span_s.is_some());
            let time_s = if with_times { columns.next().unwrap_or_default() } else { Vec::new() };
            all.push(Series { time_s, columns: columns.by_ref().take(fields.len()).collect() });
        }
        Ok(all)
    }
}

/// Column of times or of a field.
struct Column {
    topic: usize,
    /// Field; `None` for the times.
    field: Option<usize>,
    values: Vec<f64>,
    /// Number of samples that were counted.
    count: u64,
}

impl Log for Ulog {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&mut self, requests: &[(usize, Vec<usize>)]) -> Result<Vec<Series>> {
        let mut columns = self.requested(requests)?;
        let mut of_topic: HashMap<usize, Vec<usize>> = HashMap::new();
        for (at, column) in columns.iter().enumerate() {
            of_topic.entry(column.topic).or_default().push(at);
        }
        let mut messages = Messages::new(&mut self.window)?;
        let mut topics = Topics::default();
        while let Some((kind, message)) = messages.next(&mut self.window)? {
            match kind {
                b'F' => topics.add_format(message),
                b'A' => topics.subscribe(message),
                b'D' => {
                    let Some((at, data)) = topics.sample(message) else { continue };
                    let wanted = of_topic.get(&at).into_iter().flatten();
                    let Some(topic) = topics.all.get(at) else { continue };
                    for &column in wanted {
                        let Some(column) = columns.get_mut(column) else { continue };
                        column.values.push(match column.field.map(|field| topic.layout.leaves.get(field)) {
                            None => since(topic.layout.time(data).unwrap_or(self.origin), self.origin),
                            Some(leaf) => leaf.map_or(f64::NAN, |leaf| leaf.value(data)),
                        });
                    }
                }
                _ => (),
            }
        }
        self.series(requests, columns)
    }

    fn constants(&self) -> &[(String, f64)] {
        &self.constants
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }
}

/// Returns the error for a request of a channel or field that the log does not have.
fn no_field() -> Error {
    Error::data("has no such field", "Choose one of the fields of the file.")
}

/// Returns a time since the earliest one \[s\].
fn since(time: u64, origin: u64) -> f64 {
    count_u64(time.saturating_sub(origin)) / 1e6
}
