//! Channels of an MCAP recording, and notes on what was left out or assumed.

use super::super::log::Channel;
use super::clock::seconds;
use super::limits::{CHANNELS_MAX, RECORD_MAX, SHOWN_MAX};
use super::topics::{Topic, Topics};
use motorfit_core::text::{counted, quoted};
use motorfit_core::{Error, Result};

/// Result of the scan of a recording.
pub(super) struct Summary {
    pub channels: Vec<Channel>,
    /// Index of the topic of each channel.
    pub shown: Vec<usize>,
    pub notes: Vec<String>,
    /// Earliest time of a message of the channels \[ns\].
    pub origin: u64,
}

/// Describes the topics after the scan; `cut` is the place at which the file is cut off.
///
/// # Errors
/// Returns a `Data` error if no topic has numbers.
pub(super) fn describe(topics: &mut Topics, cut: Option<u64>) -> Result<Summary> {
    let mut notes = overlong(topics);
    let mut shown = Vec::new();
    let mut left = CHANNELS_MAX;
    for (at, topic) in topics.topics.iter_mut().enumerate() {
        topic.leaves = topic.tree.leaves().0;
        topic.tree.freeze();
        match (left.checked_sub(topic.leaves.len()), why_not(topic)) {
            (_, Some(why)) => topics.left_out.push((topic.name.clone(), why)),
            (None, None) => {
                topics.left_out.push((topic.name.clone(), format!("more than {CHANNELS_MAX} fields in all")))
            }
            (Some(rest), None) => {
                left = rest;
                shown.push(at);
            }
        }
    }
    let left_out = left_out(&topics.left_out);
    if shown.is_empty() {
        return Err(nothing(&left_out, cut));
    }
    let used: Vec<&Topic> = shown.iter().filter_map(|&at| topics.topics.get(at)).collect();
    let spans = || used.iter().filter_map(|topic| topic.clock.span());
    let origin = spans().map(|[first, _]| first).min().unwrap_or(0);
    let end = spans().map(|[_, last]| last).max().unwrap_or(0);
    let channels = used.iter().map(|topic| topic.channel(origin)).collect();
    if let Some(cut) = cut {
        let end = (seconds(end, origin) * 1000.0).round() / 1000.0;
        notes.insert(0, format!("the file is cut off after {cut} bytes; samples after {end} s are lost"));
    }
    notes.extend(assumed(&used));
    if topics.too_large > 0 {
        let records = counted(usize::try_from(topics.too_large).unwrap_or(usize::MAX), "record");
        notes.push(format!("left out {records} of more than {RECORD_MAX} bytes"));
    }
    notes.extend(left_out);
    Ok(Summary { channels, shown, notes, origin })
}

/// Returns the reason why a topic is not a channel.
fn why_not(topic: &Topic) -> Option<String> {
    match topic.faults {
        _ if !topic.leaves.is_empty() => None,
        _ if topic.clock.count == 0 => Some("no messages".to_owned()),
        Some((_, fault)) => Some(format!("its messages cannot be read ({fault})")),
        None if topic.tree.full => Some("more paths than can be read".to_owned()),
        None => Some("no numbers".to_owned()),
    }
}

/// Returns notes on arrays whose elements are not fields.
fn overlong(topics: &Topics) -> Vec<String> {
    let all = topics.topics.iter().flat_map(|topic| {
        let of = |(path, count)| {
            let path = if topic.name.is_empty() { path } else { format!("{} {path}", topic.name) };
            format!("left out {}: an array of {count} elements", quoted(&path))
        };
        topic.tree.leaves().1.into_iter().map(of)
    });
    let mut notes: Vec<String> = all.collect();
    if notes.len() > SHOWN_MAX {
        let more = notes.len() - SHOWN_MAX;
        notes.truncate(SHOWN_MAX);
        notes.push(format!("left out {more} more arrays"));
    }
    notes
}

/// Returns notes on times and values of channels.
fn assumed(used: &[&Topic]) -> Vec<String> {
    let names = |is: &dyn Fn(&Topic) -> bool| -> Vec<&str> {
        used.iter().filter(|topic| is(topic)).map(|topic| topic.name.as_str()).collect()
    };
    let mut notes = Vec::new();
    let mut add = |names: &[&str], what: &str| {
        if !names.is_empty() {
            notes.push(format!("{}: {what}", listed(names)));
        }
    };
    add(&names(&|topic| topic.clock.uses_stamps()), "the times are those of the headers, header.stamp");
    let stamped = names(&|topic| topic.clock.uses_stamps());
    if !stamped.is_empty() {
        let others = "the times are those of logging, later than those of the headers by the latency of the messages";
        add(&names(&|topic| !topic.clock.uses_stamps() && !topic.clock.refuses_stamps()), others);
    }
    let refused = "the times are those of logging, because many headers have none or one far from it";
    add(&names(&|topic| topic.clock.refuses_stamps()), refused);
    let some = "headers without a usable time have that of logging";
    add(&names(&|topic| topic.clock.uses_stamps() && topic.clock.without > 0), some);
    add(&names(&|topic| topic.clock.unordered), "messages are out of order and were sorted by time");
    add(&names(&Topic::has_wide_text), "members after a wide string are left out");
    add(&names(&|topic| topic.tree.full), "more paths than can be read; some are left out");
    for topic in used {
        if let Some((count, fault)) = topic.faults {
            let all = topic.clock.count;
            let what =
                format!("{count} of {all} messages cannot be read to the end ({fault}); their values are missing");
            add(&[&topic.name], &what);
        }
    }
    notes
}

/// Returns notes on topics that are left out, one for each reason.
fn left_out(topics: &[(String, String)]) -> Vec<String> {
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    let mut more = 0;
    for (name, why) in topics {
        let known = reasons.len();
        match reasons.iter_mut().find(|(reason, _)| reason == why) {
            Some((_, names)) => names.push(name),
            None if known < SHOWN_MAX => reasons.push((why, vec![name])),
            None => more += 1,
        }
    }
    let mut notes: Vec<String> =
        reasons.iter().map(|(why, names)| format!("left out {}: {why}", listed(names))).collect();
    if more > 0 {
        notes.push(format!("left out {more} more topics"));
    }
    notes
}

/// Returns topics as a text: `topics "/a", "/b"`.
fn listed(names: &[&str]) -> String {
    let shown: Vec<String> = names.iter().take(SHOWN_MAX).map(|name| quoted(name)).collect();
    let more = names.len().saturating_sub(SHOWN_MAX);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{} {}{more}", if names.len() == 1 { "topic" } else { "topics" }, shown.join(", "))
}

/// Returns the error for a recording without numbers.
fn nothing(left_out: &[String], cut: Option<u64>) -> Error {
    let found = if left_out.is_empty() { "found no topics".to_owned() } else { left_out.join("; ") };
    let cut = cut.map_or_else(String::new, |cut| format!("; the file is cut off after {cut} bytes"));
    let hint = "Record the topics as messages of ROS 2 (cdr with ros2msg) or as JSON, or export them as CSV, for example with \
                PlotJuggler.";
    Error::data(format!("no topic with numbers: {found}{cut}"), hint)
}
