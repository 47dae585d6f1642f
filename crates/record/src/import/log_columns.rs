//! Headings of the channels of a log: the name of each numeric field, and the words in which its quantity is recognized.

use super::headings::Heading;
use super::input::Input;
use crate::heading::{Quantity, is_time};
use motorfit_core::Result;
use motorfit_core::numeric::count_u64;
use motorfit_logs::{Channel, Field, Format, HEAD, Log, Reader, split, unreadable};
use std::io::Read as _;
use std::path::Path;

/// Name of the column with the times of the log.
pub(super) const TIME: &str = "time_s";
/// Words of the voltage that supplies a drive, not the motor.
const SUPPLY: [&str; 5] = ["battery", "bus", "supply", "input", "rail"];
/// Words of references and limits, which are not measured.
const REFERENCES: [&str; 7] = ["setpoint", "goal", "target", "desired", "reference", "limit", "error"];
/// Words of what a motor controller measures beside its position and velocity.
const INTERNAL: [&str; 5] = ["rotor", "differential", "analog", "alternate", "duty"];
/// Parts of the names of channels that belong to the supply of a robot, in lower case.
const SUPPLIES: [&str; 4] = ["battery", "powerdistribution", "systemstats", "batterystate"];
/// Words of a duty cycle.
const DUTY: [&str; 4] = ["duty", "dutycycle", "appliedoutput", "motoroutput"];
/// Names of fields that add nothing to the name of their channel.
const PLAIN: [&str; 3] = ["", "data", "value"];

/// A numeric field of a log.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ChannelFacts {
    /// Name for requests of columns: `channel/field`.
    pub name: String,
    /// Unit in the log or in the name.
    pub unit: Option<String>,
    /// Name of the quantity that the name denotes.
    pub quantity: Option<&'static str>,
    /// Number of samples.
    pub samples: u64,
    /// Mean rate of the samples \[Hz\]; `None` without times.
    pub rate_hz: Option<f64>,
    /// Times of the first and the last sample \[s\]; `None` without times.
    pub span_s: Option<[f64; 2]>,
}

/// Returns the numeric fields of a log; `None` for a file of another format.
///
/// # Errors
/// Returns a `Data` error if the file cannot be read, or the log is damaged.
pub fn channels(path: &Path) -> Result<Option<Vec<ChannelFacts>>> {
    let read = || {
        let mut input = Input::open(path)?;
        let mut head = Vec::new();
        (&mut input).take(HEAD as u64).read_to_end(&mut head).map_err(|error| unreadable(&error))?;
        let Some(Reader::Log(open)) = Format::of(&head)?.map(|format| format.read) else { return Ok(None) };
        Ok(Some(facts(open(input.medium(head)?, is_time)?.as_ref())))
    };
    read().map_err(|error: motorfit_core::Error| error.in_file(path))
}

fn facts(log: &dyn Log) -> Vec<ChannelFacts> {
    let Columns { headings, of } = columns(log, &|_, _| true);
    let fact = |(heading, at): (Heading, Option<(usize, usize)>)| {
        let channel = log.channels().get(at?.0)?;
        let steps = count_u64(channel.count.saturating_sub(1));
        let rate = channel.span_s.map(|[from, to]| steps / (to - from));
        let understood = heading.understood();
        Some(ChannelFacts {
            quantity: understood.as_ref().map(|(quantity, _)| quantity.key()),
            unit: understood.and_then(|(_, unit)| unit).or(heading.unit),
            name: heading.name,
            samples: channel.count,
            rate_hz: rate.filter(|rate| rate.is_finite() && *rate > 0.0),
            span_s: channel.span_s,
        })
    };
    headings.into_iter().zip(of).filter_map(fact).collect()
}

/// Numeric fields of a log as columns.
pub(super) struct Columns {
    pub headings: Vec<Heading>,
    /// Channel and field of each column; `None` for the times of the log.
    pub of: Vec<Option<(usize, usize)>>,
}

/// Returns the name of a field of a channel: `channel/field`.
pub(super) fn name(channel: &Channel, path: &str) -> String {
    match (channel.name.is_empty(), path.is_empty()) {
        (true, _) => path.to_owned(),
        (_, true) => channel.name.clone(),
        _ if path.starts_with('[') => format!("{}{path}", channel.name),
        _ => format!("{}/{path}", channel.name),
    }
}

/// Returns the columns of a log. The quantity of a field outside `scope` is not recognized by its name.
pub(super) fn columns(log: &dyn Log, scope: &dyn Fn(&Channel, &str) -> bool) -> Columns {
    let (mut headings, mut of) = (Vec::new(), Vec::new());
    if log.channels().iter().any(|channel| channel.span_s.is_some()) {
        headings.push(Heading { name: TIME.to_owned(), ..Heading::default() });
        of.push(None);
    }
    for (c, channel) in log.channels().iter().enumerate() {
        for (f, field) in channel.fields.iter().enumerate() {
            let is_in_scope = channel.count > 0 && scope(channel, &field.path);
            let (alias, own) = alias(channel, &field.path);
            let unit = field.unit.clone().or(own);
            // A table has the headings of its writer, as a CSV file.
            let is_table = channel.span_s.is_none();
            let alias = match is_in_scope {
                // pandas names an index of times that has no name so.
                true if is_table && field.path == "__index_level_0__" && field.unit.is_some() => Some(TIME.to_owned()),
                true if is_table => None,
                true => Some(alias),
                false => Some(String::new()),
            };
            let unit = if is_table { field.unit.clone() } else { unit };
            headings.push(Heading { name: name(channel, &field.path), unit, alias });
            of.push(Some((c, f)));
        }
    }
    Columns { headings, of }
}

/// Returns the words in which the quantity of a field is recognized, and the unit in its name: those of the last part of its
/// path that names a quantity, or of the channel if the path is plain.
fn alias(channel: &Channel, path: &str) -> (String, Option<String>) {
    let parts = path.rsplit(['/', '.']).map(|part| part.split('[').next().unwrap_or_default());
    let of_channel = channel.name.rsplit('/').next().unwrap_or_default();
    let is_plain = path.split(['/', '.']).all(|part| PLAIN.contains(&part.split('[').next().unwrap_or_default()));
    let all = parts.chain(is_plain.then_some(of_channel));
    let is_named = |(words, _): &(String, Option<String>)| {
        let heading = Heading { name: words.clone(), ..Heading::default() };
        heading.understood().is_some() || has(words, &SUPPLY) || has(words, &REFERENCES) || is_duty(words)
    };
    let with_unit = |part: &str| {
        let (words, unit) = split(part);
        // "AppliedVolts" names its quantity by the unit.
        let named_by_unit = match unit.as_deref() {
            Some("V") => Quantity::Voltage.key(),
            Some("A") => Quantity::Current.key(),
            Some("turn/s" | "rad/s" | "deg/s" | "rpm") => Quantity::Speed.key(),
            _ => "",
        };
        let heading = Heading { name: words.clone(), ..Heading::default() };
        let is_unnamed = !named_by_unit.is_empty() && heading.understood().is_none();
        (if is_unnamed { format!("{words} {named_by_unit}") } else { words }, unit)
    };
    let found: Option<(String, Option<String>)> = all.map(with_unit).find(is_named);
    let Some((words, unit)) = found else { return (String::new(), None) };
    // Supplies, references and what a controller measures before its gear are used on request alone.
    let is_other = has(&words, &SUPPLY) || has(&words, &REFERENCES) || has(&words, &INTERNAL) || is_duty(&words);
    let is_other = is_other || is_of_supply(&channel.name);
    let words = if is_other { String::new() } else { words };
    (words, unit)
}

fn has(words: &str, list: &[&str]) -> bool {
    words.split(' ').any(|word| list.contains(&word.to_lowercase().as_str()))
}

fn is_duty(words: &str) -> bool {
    let joined = words.to_lowercase().replace(' ', "");
    // An absolute encoder has a duty cycle too.
    let is_of_encoder = ["position", "velocity", "encoder"].iter().any(|word| joined.contains(word));
    !is_of_encoder && DUTY.iter().any(|duty| joined.contains(duty))
}

/// Returns the product of a duty cycle and the voltage that supplies the drive, as an expression of columns, if the log has one
/// duty cycle in scope; of several supplies the one whose name has the longest beginning in common.
pub(super) fn duty_times_supply(log: &dyn Log, scope: &dyn Fn(&Channel, &str) -> bool) -> Option<String> {
    let fields = || {
        let channels = log.channels().iter().filter(|channel| channel.count > 0);
        channels.flat_map(|channel| channel.fields.iter().map(move |field| (channel, field)))
    };
    let words = |(channel, field): (&Channel, &Field)| {
        let last = field.path.rsplit(['/', '.']).next().unwrap_or_default();
        let last = if PLAIN.contains(&last) { channel.name.rsplit('/').next().unwrap_or_default() } else { last };
        split(last)
    };
    let mut duties =
        fields().filter(|(channel, field)| scope(channel, &field.path) && is_duty(&words((channel, field)).0));
    let duty = duties.next().filter(|_| duties.next().is_none())?;
    let supplies = fields().filter(|(channel, field)| {
        let (words, own) = words((channel, field));
        let unit = field.unit.as_deref().or(own.as_deref());
        let is_voltage = unit == Some("V") || has(&words, &["voltage", "volts", "volt"]);
        (has(&words, &SUPPLY) || is_of_supply(&channel.name)) && is_voltage && !field.path.contains('[')
    });
    let named = |(channel, field): (&Channel, &Field)| name(channel, &field.path);
    let own = named(duty);
    let common = |of: &(&Channel, &Field)| named(*of).bytes().zip(own.bytes()).take_while(|(a, b)| a == b).count();
    let supply = named(supplies.max_by_key(common)?);
    let percent = if duty.1.unit.as_deref() == Some("%") { "/100" } else { "" };
    (!own.contains('"') && !supply.contains('"')).then(|| format!("\"{own}\"{percent}*\"{supply}\":V"))
}

/// Returns true if a part of the name of a channel is that of the supply of a robot.
fn is_of_supply(channel: &str) -> bool {
    let plain = |part: &str| part.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase();
    channel.split('/').map(plain).any(|part| SUPPLIES.iter().any(|supply| part == *supply))
}
