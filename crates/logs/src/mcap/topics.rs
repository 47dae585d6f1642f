//! Topics of an MCAP file: which of them can be read, and the numbers in their messages.

use super::super::log::{Channel, Field};
use super::cdr::{self, Fault};
use super::clock::{Clock, seconds};
use super::json;
use super::limits::{
    FIRST_MESSAGES, MEMBERS_MAX, NODES_MAX, SCHEMA_MAX, SCHEMAS_MAX, STAMP_AWAY_MAX_NS, TOPIC_MAX, TOPIC_NODES_MAX,
};
use super::records::Record;
use super::schema::{Schema, short};
use super::tree::{Leaf, Tree};
use motorfit_core::text::{excerpt, quoted};
use std::collections::{BTreeMap, BTreeSet};

/// Decoder of the messages of a topic.
#[derive(PartialEq)]
enum Decoder {
    Cdr(Schema),
    Joints(Schema),
    Json,
}

/// A topic whose messages can be read.
pub(super) struct Topic {
    pub name: String,
    decoder: Decoder,
    pub tree: Tree,
    pub clock: Clock,
    pub leaves: Vec<Leaf>,
    /// Number of messages that cannot be read to their end, and the reason for the first of them.
    pub faults: Option<(u64, Fault)>,
}

impl Topic {
    /// Takes a message while the log is scanned.
    fn scan(&mut self, time: u64, message: &[u8]) {
        if matches!(self.decoder, Decoder::Json) && self.clock.count == FIRST_MESSAGES {
            self.tree.freeze();
        }
        let stamp = self.stamp(message);
        self.clock.add(time, stamp);
        if let Err(fault) = self.read(message) {
            let (count, first) = self.faults.unwrap_or((0, fault));
            self.faults = Some((count + 1, first));
        }
    }

    /// Reads the numbers of a message into the row of the tree.
    pub fn read(&mut self, message: &[u8]) -> Result<(), Fault> {
        match &self.decoder {
            Decoder::Cdr(schema) => cdr::read(schema, message, &mut self.tree),
            Decoder::Joints(schema) => cdr::read_joints(schema, message, &mut self.tree),
            Decoder::Json => json::read(message, &mut self.tree),
        }
    }

    /// Returns the time in the header of a message.
    fn stamp(&self, message: &[u8]) -> Option<u64> {
        match &self.decoder {
            Decoder::Cdr(schema) | Decoder::Joints(schema) if schema.has_stamp() => cdr::stamp(message),
            _ => None,
        }
    }

    /// Returns the time of a message \[ns\]: that of its header if nearly all headers have acceptable ones, or that of logging.
    pub fn time(&self, logged: u64, message: &[u8]) -> u64 {
        let stamp = if self.clock.uses_stamps() { self.stamp(message) } else { None };
        let stamp = stamp.filter(|stamp| stamp.abs_diff(logged) <= STAMP_AWAY_MAX_NS);
        stamp.unwrap_or(logged)
    }

    /// Returns the topic as a channel of a log that starts at `origin`.
    pub fn channel(&self, origin: u64) -> Channel {
        let joints = matches!(self.decoder, Decoder::Joints(_));
        let unit = |path: &str| match path.split('/').next() {
            Some("position") if joints => Some("rad".to_owned()),
            Some("velocity") if joints => Some("rad/s".to_owned()),
            Some("effort") if joints => Some("N*m".to_owned()),
            _ => None,
        };
        let fields = self.leaves.iter().map(|leaf| Field { path: leaf.path.clone(), unit: unit(&leaf.path) });
        let span_s = self.clock.span().map(|span| span.map(|time| seconds(time, origin)));
        Channel { name: self.name.clone(), fields: fields.collect(), count: self.clock.count, span_s }
    }

    /// Returns true if the messages have wide strings.
    pub fn has_wide_text(&self) -> bool {
        matches!(&self.decoder, Decoder::Cdr(schema) if schema.has_wide_text())
    }
}

/// Record of a schema.
struct Definition {
    name: String,
    encoding: String,
    data: Vec<u8>,
}

/// Topics found so far.
pub(super) struct Topics {
    pub topics: Vec<Topic>,
    /// Index of the topic of each channel; `None` if it cannot be read.
    channels: BTreeMap<u16, Option<usize>>,
    /// Channels with messages before their records.
    early: BTreeSet<u16>,
    definitions: BTreeMap<u16, Definition>,
    /// Size of all definitions \[bytes\].
    definitions_size: usize,
    /// Number of members that schemas may still declare.
    members_left: usize,
    /// Number of nodes by which trees may still grow.
    nodes_left: usize,
    names: BTreeMap<String, usize>,
    /// Names of topics that cannot be read, with the reason.
    pub left_out: Vec<(String, String)>,
    /// Number of records that are too large.
    pub too_large: u64,
}

impl Topics {
    pub fn new() -> Self {
        Self {
            topics: Vec::new(),
            channels: BTreeMap::new(),
            early: BTreeSet::new(),
            definitions: BTreeMap::new(),
            definitions_size: 0,
            members_left: MEMBERS_MAX,
            nodes_left: NODES_MAX,
            names: BTreeMap::new(),
            left_out: Vec::new(),
            too_large: 0,
        }
    }

    /// Returns the topic of a channel.
    pub fn of(&self, channel: u16) -> Option<usize> {
        self.channels.get(&channel).copied().flatten()
    }

    /// Returns true if none of the channels, of which there is at least one, can be read.
    pub fn none_of(&self, channels: &[u16]) -> bool {
        !channels.is_empty() && channels.iter().all(|id| matches!(self.channels.get(id), Some(None)))
    }

    /// Takes a record.
    pub fn take(&mut self, record: Record<'_>) {
        match record {
            Record::Schema { id, name, encoding, data } => {
                let size = name.len() + encoding.len() + data.len();
                let all = self.definitions_size.saturating_add(size);
                if size <= SCHEMA_MAX && all <= SCHEMAS_MAX && !self.definitions.contains_key(&id) {
                    self.definitions_size = all;
                    let (name, encoding) = (name.into_owned(), encoding.into_owned());
                    self.definitions.insert(id, Definition { name, encoding, data: data.to_vec() });
                }
            }
            Record::Channel { id, schema, topic, encoding } => {
                if self.early.remove(&id) {
                    self.left_out.push((excerpt(&topic), "messages before the record of the channel".to_owned()));
                } else if !self.channels.contains_key(&id) {
                    let topic = self.channel(&topic, &encoding, schema);
                    self.channels.insert(id, topic);
                }
            }
            Record::Message { channel, time, data } => {
                let at = *self.channels.entry(channel).or_insert_with(|| {
                    self.early.insert(channel);
                    None
                });
                if let Some(topic) = at.and_then(|at| self.topics.get_mut(at)) {
                    let before = topic.tree.len();
                    topic.tree.allow(self.nodes_left.min(TOPIC_NODES_MAX.saturating_sub(before)));
                    topic.scan(time, data);
                    self.nodes_left = self.nodes_left.saturating_sub(topic.tree.len() - before);
                }
            }
            Record::TooLarge => self.too_large += 1,
        }
    }

    /// Returns the index of the topic of a new channel; channels of one topic and one type are read as one.
    fn channel(&mut self, name: &str, encoding: &str, schema: u16) -> Option<usize> {
        let decoder = match self.decoder(encoding, schema) {
            _ if name.len() > TOPIC_MAX => Err(format!("a name of {} bytes", name.len())),
            decoder => decoder,
        };
        let why = match decoder {
            Err(why) => why,
            Ok(decoder) => match self.names.get(name).copied().map(|at| (at, self.topics.get(at))) {
                Some((at, Some(topic))) if topic.decoder == decoder => return Some(at),
                Some(_) => "a second type of messages".to_owned(),
                None => {
                    self.names.insert(name.to_owned(), self.topics.len());
                    let (tree, clock) = (Tree::new(), Clock::default());
                    let topic = Topic { name: name.to_owned(), decoder, tree, clock, leaves: Vec::new(), faults: None };
                    self.topics.push(topic);
                    return Some(self.topics.len() - 1);
                }
            },
        };
        // The name may be longer than the longest one.
        self.left_out.push((excerpt(name), why));
        None
    }

    /// Returns the decoder of an encoding, or the reason why there is none.
    fn decoder(&mut self, encoding: &str, schema: u16) -> Result<Decoder, String> {
        let definition = self.definitions.get(&schema);
        match (encoding, definition) {
            ("json", _) => Ok(Decoder::Json),
            ("cdr", None) => Err(format!("schema {schema} is missing")),
            ("cdr", Some(Definition { name, encoding, data })) if encoding == "ros2msg" => {
                if short(name) == "diagnostic_msgs/DiagnosticArray" {
                    return Err("diagnostics".to_owned());
                }
                let text = String::from_utf8_lossy(data);
                let schema = Schema::ros2(name, &text, &mut self.members_left)
                    .map_err(|why| format!("schema {}: {why}", quoted(name)))?;
                let joints = short(name) == "sensor_msgs/JointState" && schema.is_joint_state();
                Ok(if joints { Decoder::Joints(schema) } else { Decoder::Cdr(schema) })
            }
            ("cdr", Some(definition)) => {
                Err(format!("encoding cdr with a schema in {}, expected ros2msg", quoted(&definition.encoding)))
            }
            _ => Err(format!("encoding {}, expected cdr or json", quoted(encoding))),
        }
    }
}
