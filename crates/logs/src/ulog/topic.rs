//! Topics of ULog files: their formats, subscriptions and samples.

use super::format::{CHANNELS_MAX, Formats, Layout};
use motorfit_core::text::{counted, excerpt};
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// Largest number of topics that a note names.
const NAMED_MAX: usize = 5;

/// Topic, or an instance of one.
#[derive(Debug)]
pub(super) struct Topic {
    pub name: String,
    pub layout: Arc<Layout>,
    /// Number of samples.
    pub count: u64,
    /// Timestamps of the first and the last sample \[µs\].
    pub span: Option<(u64, u64)>,
}

/// Topics in the order of their subscription.
#[derive(Debug, Default)]
pub(super) struct Topics {
    pub all: Vec<Topic>,
    formats: Formats,
    /// Layout of each format that is subscribed; `None` if it is left out.
    layouts: HashMap<String, Option<Arc<Layout>>>,
    by_name: HashMap<String, usize>,
    /// Topic of each number of messages; `None` if it is left out.
    by_id: HashMap<u16, Option<usize>>,
    /// Number of fields of all topics.
    fields: usize,
    /// Reasons for topics that are left out, with their number and first names.
    left_out: BTreeMap<String, (usize, Vec<String>)>,
    /// First format that cannot be read, and the number of them.
    invalid: Option<(String, usize)>,
    /// Number of samples without a subscription.
    unknown: u64,
    /// Number of samples of another length than that of their format.
    mismatched: u64,
}

impl Topics {
    /// Adds a format.
    pub(super) fn add_format(&mut self, text: &[u8]) {
        if let Err(reason) = self.formats.add(text) {
            let (_, count) = self.invalid.get_or_insert((reason, 0));
            *count = count.saturating_add(1);
        }
    }

    /// Adds the subscription of a topic.
    pub(super) fn subscribe(&mut self, message: &[u8]) {
        let [instance, low, high, name @ ..] = message else { return };
        let format = String::from_utf8_lossy(name);
        let name = if *instance == 0 { format.clone().into_owned() } else { format!("{format}[{instance}]") };
        let topic = match self.by_name.get(&name) {
            Some(topic) => Some(*topic),
            None => self.add_topic(&format, name),
        };
        self.by_id.insert(u16::from_le_bytes([*low, *high]), topic);
    }

    /// Returns the number of a new topic, or `None` if it is left out.
    fn add_topic(&mut self, format: &str, name: String) -> Option<usize> {
        if !self.formats.contains(format) {
            self.leave_out("has no format", &name);
            return None;
        }
        if !self.layouts.contains_key(format) {
            let layout = self.formats.layout(format, CHANNELS_MAX);
            if let Err(reason) = &layout {
                self.leave_out(reason, &name);
            }
            self.layouts.insert(format.to_owned(), layout.ok().map(Arc::new));
        }
        let layout = self.layouts.get(format).cloned().flatten()?;
        let fields = self.fields.saturating_add(layout.leaves.len().max(1));
        if fields > CHANNELS_MAX {
            self.leave_out(&format!("exceeds {CHANNELS_MAX} fields of the file"), &name);
            return None;
        }
        self.fields = fields;
        self.by_name.insert(name.clone(), self.all.len());
        self.all.push(Topic { name, layout, count: 0, span: None });
        Some(self.all.len() - 1)
    }

    /// Notes that a topic is left out.
    pub(super) fn leave_out(&mut self, reason: &str, name: &str) {
        let (count, names) = self.left_out.entry(reason.to_owned()).or_default();
        *count = count.saturating_add(1);
        if names.len() < NAMED_MAX {
            names.push(excerpt(name));
        }
    }

    /// Returns notes on what is left out or damaged.
    pub(super) fn notes(&self) -> Vec<String> {
        let left_out = self.left_out.iter().map(|(reason, (count, names))| {
            let more = if *count > names.len() { ", …" } else { "" };
            format!("{} left out ({}{more}): {reason}", counted(*count, "topic"), names.join(", "))
        });
        let mut notes: Vec<String> = left_out.collect();
        if let Some((reason, count)) = &self.invalid {
            notes.push(format!("{} left out; the first is {reason}", counted(*count, "format")));
        }
        let samples = |count: u64| counted(usize::try_from(count).unwrap_or(usize::MAX), "sample");
        if self.unknown > 0 {
            notes.push(format!("{} of topics without a subscription left out", samples(self.unknown)));
        }
        if self.mismatched > 0 {
            notes.push(format!("{} of another length than their format left out", samples(self.mismatched)));
        }
        notes
    }

    /// Returns the number of the topic of a sample and its data.
    pub(super) fn sample<'m>(&mut self, message: &'m [u8]) -> Option<(usize, &'m [u8])> {
        let (id, data) = message.split_first_chunk()?;
        let Some(topic) = self.by_id.get(&u16::from_le_bytes(*id)) else {
            self.unknown = self.unknown.saturating_add(1);
            return None;
        };
        let (at, topic) = topic.and_then(|at| Some((at, self.all.get(at)?)))?;
        if data.len() < topic.layout.size_min || data.len() > topic.layout.size {
            self.mismatched = self.mismatched.saturating_add(1);
            return None;
        }
        Some((at, data))
    }
}

impl Layout {
    /// Returns the timestamp of a sample \[µs\].
    pub(super) fn time(&self, data: &[u8]) -> Option<u64> {
        data.get(self.timestamp?..)?.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))
    }
}
