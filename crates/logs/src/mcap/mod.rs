//! MCAP recordings of ROS 2 and of tools that write JSON messages.
//!
//! The file is read twice: to find the numbers in the messages and their times, and to read those that are requested. Its bytes
//! are never in memory as a whole.

mod cdr;
mod clock;
mod json;
mod limits;
mod notes;
mod records;
mod schema;
#[cfg(test)]
mod tests;
mod topics;
mod tree;
mod walk;

use super::log::{Channel, Log, Medium, Series};
use clock::{seconds, sort};
use limits::VALUES_MAX;
use motorfit_core::{Error, Result};
use notes::{Summary, describe};
use records::{Record, visit_records};
use std::collections::BTreeSet;
use topics::{Topic, Topics};
use walk::{Outline, Source, outline, unreadable};

/// Opens an MCAP recording: finds the topics with numbers and the times of their messages.
///
/// Topics with messages of ROS 2 (`cdr` with `ros2msg`) and JSON messages are channels. The times are those of logging, or
/// those of the headers of the messages if all of a topic are acceptable.
///
/// # Errors
/// Returns a `Data` error if the file is not an MCAP file, is damaged or too large, or has no topic with numbers.
pub(crate) fn open(medium: Box<dyn Medium>) -> Result<Box<dyn Log>> {
    let mut source = Source::new(medium).map_err(|e| unreadable(&e))?;
    let mut outline = outline(&mut source)?;
    let mut topics = Topics::new();
    for piece in &mut outline.pieces {
        if topics.none_of(&piece.channels) {
            continue;
        }
        let mut channels = BTreeSet::new();
        visit_records(&mut source, piece, &mut |record| {
            if let Record::Message { channel, .. } = record {
                channels.insert(channel);
            }
            topics.take(record);
            Ok(())
        })?;
        piece.channels = channels.into_iter().collect();
    }
    let summary = describe(&mut topics, outline.cut)?;
    Ok(Box::new(Mcap { source, outline, topics, summary }))
}

/// An open recording.
struct Mcap {
    source: Source,
    outline: Outline,
    topics: Topics,
    summary: Summary,
}

/// Columns of a request while they are read.
struct Job {
    /// Places of the columns in the row of the topic.
    places: Vec<usize>,
    times: Vec<u64>,
    columns: Vec<Vec<f64>>,
}

impl Log for Mcap {
    fn channels(&self) -> &[Channel] {
        &self.summary.channels
    }

    fn notes(&self) -> &[String] {
        &self.summary.notes
    }

    fn read(&mut self, requests: &[(usize, Vec<usize>)]) -> Result<Vec<Series>> {
        let (mut jobs, of_topic) = self.jobs(requests)?;
        let Self { source, outline, topics, summary } = self;
        for piece in &outline.pieces {
            let requested =
                |&id: &u16| topics.of(id).is_some_and(|at| of_topic.get(at).is_some_and(|jobs| !jobs.is_empty()));
            if !piece.channels.is_empty() && !piece.channels.iter().any(requested) {
                continue;
            }
            visit_records(source, piece, &mut |record| {
                let Record::Message { channel, time, data } = record else { return Ok(()) };
                let Some(at) = topics.of(channel) else { return Ok(()) };
                let (Some(topic), Some(indices)) = (topics.topics.get_mut(at), of_topic.get(at)) else { return Ok(()) };
                if !indices.is_empty() {
                    take(topic, (time, data), indices.iter().copied(), &mut jobs);
                }
                Ok(())
            })?;
        }
        let finished = |mut job: Job| {
            sort(&mut job.times, &mut job.columns);
            let time_s = job.times.iter().map(|&time| seconds(time, summary.origin)).collect();
            Series { time_s, columns: job.columns }
        };
        Ok(jobs.into_iter().map(finished).collect())
    }
}

/// Appends a message to the columns of the requests of its topic.
fn take(topic: &mut Topic, (time, data): (u64, &[u8]), indices: impl Iterator<Item = usize>, jobs: &mut [Job]) {
    let time = topic.time(time, data);
    topic.tree.row.fill(f64::NAN);
    // A message that ends early lacks the values after its end, as a note says.
    let _ = topic.read(data);
    for index in indices {
        let Some(job) = jobs.get_mut(index) else { continue };
        job.times.push(time);
        for (column, &place) in job.columns.iter_mut().zip(&job.places) {
            column.push(topic.tree.row.get(place).copied().unwrap_or(f64::NAN));
        }
    }
}

impl Mcap {
    /// Returns the columns of all requests, still empty, and the indices of the requests of each topic.
    fn jobs(&mut self, requests: &[(usize, Vec<usize>)]) -> Result<(Vec<Job>, Vec<Vec<usize>>)> {
        let mut of_topic = vec![Vec::new(); self.topics.topics.len()];
        let mut values = 0_u64;
        for (index, (channel, fields)) in requests.iter().enumerate() {
            let found = self
                .summary
                .channels
                .get(*channel)
                .filter(|found| fields.iter().all(|&field| field < found.fields.len()));
            let (Some(found), Some(&at)) = (found, self.summary.shown.get(*channel)) else {
                return Err(Error::data(
                    format!("has no such field in channel {channel}"),
                    "Choose a field of a channel.",
                ));
            };
            values = values.saturating_add(found.count.saturating_mul(fields.len() as u64 + 1));
            if let Some(indices) = of_topic.get_mut(at) {
                indices.push(index);
            }
        }
        if values > VALUES_MAX {
            let message = format!("{values} values are requested, expected at most {VALUES_MAX}");
            return Err(Error::data(message, "Choose fewer columns, or cut the recording: `mcap filter`."));
        }
        let mut jobs: Vec<Job> = requests
            .iter()
            .map(|(_, fields)| Job { places: Vec::new(), times: Vec::new(), columns: vec![Vec::new(); fields.len()] })
            .collect();
        for (topic, indices) in self.topics.topics.iter_mut().zip(&of_topic) {
            let fields = indices.iter().filter_map(|&index| requests.get(index)).flat_map(|(_, fields)| fields);
            let leaves = fields.filter_map(|&field| topic.leaves.get(field));
            let mut places = topic.tree.select(leaves).into_iter();
            for &index in indices {
                if let Some(job) = jobs.get_mut(index) {
                    job.places = places.by_ref().take(job.columns.len()).collect();
                }
            }
        }
        Ok((jobs, of_topic))
    }
}
