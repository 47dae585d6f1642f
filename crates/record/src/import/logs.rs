//! Signals from logs: the columns that are used, at the times of all of them, one table for each test.

use super::bad_rows::{BadRows, LeftOut};
use super::columns::choose;
use super::convert::Cells;
use super::headings::Heading;
use super::log_columns::{Columns, columns, duty_times_supply};
use super::merge::merged;
use super::numbers::Numbers;
use super::options::ReadOptions;
use super::routines::{Routine, Scope, Test, cut, notes};
use super::signals::Signals;
use super::spec::{Need, TableSpec};
use super::track::{Merged, Role, Wanted};
use super::used::Used;
use crate::heading::Quantity;
use crate::lines::Lines;
use crate::measured_at::MeasuredAt;
use crate::requests::ColumnRequest;
use motorfit_core::setting::text;
use motorfit_core::text::{counted, hexadecimal, listed, quoted, significant};
use motorfit_core::{Error, Result};
use motorfit_logs::{Log, Medium, Series, unreadable};
use sha2::{Digest as _, Sha256};

/// Largest number of values that are read from a log.
pub(super) const VALUES_MAX: u64 = 100_000_000;
/// Largest magnitude of a duty cycle that is a fraction.
const DUTY_MAX: f64 = 1.5;

/// Reads the tables of a log: the complete log, or one for each test of the chosen mechanism.
///
/// # Errors
/// Returns an error if columns cannot be selected, or the log is damaged.
pub(super) fn tables(log: &mut dyn Log, options: &ReadOptions, need: Need) -> Result<Vec<Signals>> {
    let scope = Scope::of(log, options.sheet.as_deref())?;
    let found = columns(log, &|channel, path| scope.takes(channel, path));
    let constants = log.constants().to_vec();
    let mut requests = options.columns.clone();
    let supplied = with_supply(log, &scope, (&found, need), (options, &mut requests));
    let spec = TableSpec { requests: &requests, constants: &constants, ..TableSpec::of(options, need) };
    let used =
        choose(&found.headings, &spec).map_err(|error| described(error, log, &scope, (&found.headings, &spec)))?;
    let selection = Selection::of(&used, &found, &spec);
    selection.check(log)?;
    let series = log.read(&selection.requests)?;
    if let Some(request) = requests.last().filter(|_| supplied.is_some()) {
        check_duty(&series, &selection, request)?;
    }
    let holds = log.is_of_changes();
    let mut all_notes = log.notes().to_vec();
    all_notes.extend(supplied);
    all_notes.extend(scope.routine.iter().flat_map(notes));
    let signals = |merged: Merged| {
        let read = selection.signals(used.clone(), merged, (&found, &all_notes), &spec);
        read.map(|read| Signals { holds, ..read })
    };
    let Some(routine) = &scope.routine else {
        return Ok(vec![signals(merged(series, &selection.wanted, holds))?]);
    };
    let mut tables = Vec::new();
    let mut short = Vec::new();
    for test in &routine.tests {
        let part = cut(&series, test, holds);
        let fewest = part.iter().zip(&selection.requests).min_by_key(|(series, _)| series.time_s.len());
        let fewest = fewest.and_then(|(series, (at, _))| Some((series.time_s.len(), log.channels().get(*at)?)));
        let before = selection.wanted.iter().map(|wanted| value_before(&series, &part, wanted, (routine, test)));
        let before: Vec<Option<f64>> = before.collect();
        let mut merged = merged(part, &selection.wanted, holds);
        if merged.time_s.len() < 2 {
            let why = fewest.map_or_else(String::new, |(count, channel)| {
                format!(" ({} has {} in it)", channel.name, counted(count, "sample"))
            });
            short.push(format!("test {} has {} samples{why} and is left out", test.name, merged.time_s.len()));
            continue;
        }
        if need == Need::Signals {
            merged.begin_with(&before, &selection.wanted);
        }
        let mut table = signals(merged)?;
        table.source.part = Some(test.name.clone());
        tables.push(table);
    }
    if tables.is_empty() {
        let message = format!("no test has samples: {}", short.join(", "));
        let hint = "Log voltage and speed while the tests run, in every period of the control loop.";
        return Err(Error::data(message, hint));
    }
    tables.iter_mut().for_each(|table| table.source.notes.extend(short.iter().cloned()));
    Ok(tables)
}

/// Adds the request of a voltage that is the product of a duty cycle and the supply voltage, if the log has no voltage; returns the
/// note.
fn with_supply(
    log: &dyn Log,
    scope: &Scope,
    (found, need): (&Columns, Need),
    (options, requests): (&ReadOptions, &mut Vec<ColumnRequest>),
) -> Option<String> {
    let spec = TableSpec::of(options, need);
    let is_voltage = |quantity: &Quantity| match quantity {
        Quantity::Voltage => true,
        Quantity::Signal(n) => spec.signals.get(usize::from(*n)).is_some_and(|signal| signal.is_voltage()),
        _ => false,
    };
    let has_none = !spec.signals.is_empty() && !spec.signals.iter().any(|signal| signal.is_voltage());
    let is_named = has_none
        || spec.requests.iter().any(|request| is_voltage(&request.quantity))
        || found.headings.iter().any(|h| h.understood().is_some_and(|(quantity, _)| is_voltage(&quantity)));
    let name = duty_times_supply(log, &|channel, path| scope.takes(channel, path)).filter(|_| !is_named)?;
    let note = format!("the voltage is the duty cycle times the supply voltage, {}", name.trim_end_matches(":V"));
    requests.push(ColumnRequest { quantity: Quantity::Voltage, name });
    Some(note)
}

/// Checks that the duty cycle in the product with a supply voltage is a fraction.
fn check_duty(series: &[Series], selection: &Selection, request: &ColumnRequest) -> Result<()> {
    let name = request.name.split('"').nth(1).unwrap_or_default();
    let Some(duty) = selection.wanted.iter().find(|wanted| wanted.name == name) else { return Ok(()) };
    let values = series.get(duty.at.0).and_then(|series| series.columns.get(duty.at.1));
    let most = values.into_iter().flatten().fold(0.0, |most: f64, value| most.max(value.abs()));
    let is_percent = request.name.starts_with(&format!("\"{name}\"/100*"));
    if most <= DUTY_MAX || is_percent {
        return Ok(());
    }
    let scaled = request.name.replacen(&format!("\"{name}\""), &format!("\"{name}\"/100"), 1);
    let message = format!("the duty cycle reaches {}, expected a fraction from -1 to 1", significant(most, 3));
    let hint = text!("Name the voltage; if the duty cycle is in percent: " [Columns = "voltage={scaled}"] ".");
    Err(Error::data(message, hint).in_column(name))
}

/// Adds to an error the entries of the part that are empty, and those without numbers; of two channels that have the same quantity, what
/// chooses all those of one motor.
fn described(error: Error, log: &dyn Log, scope: &Scope, (headings, spec): (&[Heading], &TableSpec<'_>)) -> Error {
    if let Some(part) = part_of_one(headings, spec).filter(|_| !scope.is_named()) {
        let hint = error
            .hint()
            .clone()
            .and(text!(" To select all channels of one motor, give a part of their names: " [Sheet = "{part}"] "."));
        return error
            .column()
            .into_iter()
            .fold(Error::new(error.kind(), error.message().clone(), hint), Error::in_column);
    }
    let empty: Vec<&str> = log
        .channels()
        .iter()
        .filter(|channel| channel.count == 0 && scope.has(channel))
        .map(|channel| channel.name.as_str())
        .take(10)
        .collect();
    let others = log.others();
    let others: Vec<&str> = others.iter().map(String::as_str).take(10).collect();
    let mut more = String::new();
    if !empty.is_empty() {
        more.push_str(&format!("; without samples: {}", listed(&empty, "and")));
    }
    if !others.is_empty() && !scope.is_named() {
        more.push_str(&format!("; without numbers: {}", listed(&others, "and")));
    }
    if more.is_empty() {
        return error;
    }
    let described = Error::new(error.kind(), error.message().clone().and(more), error.hint().clone());
    error.column().into_iter().fold(described, |described, column| described.in_column(column))
}

/// Returns the part by which the names of two channels of the same quantity differ, such as `TalonFX-1`; `None` if no quantity has two,
/// or they differ in the part that names the quantity.
fn part_of_one(headings: &[Heading], spec: &TableSpec<'_>) -> Option<String> {
    let understood = |heading: &Heading| Some((heading.understood()?.0, heading.name.clone()));
    let all: Vec<(Quantity, String)> = headings.iter().filter_map(understood).collect();
    let is_open = |quantity: Quantity| spec.requests.iter().all(|request| request.quantity != quantity);
    let pairs = all.iter().enumerate().flat_map(|(n, (quantity, first))| {
        let others = all[n + 1..].iter().filter(move |(other, _)| other == quantity);
        others.map(move |(_, second)| (*quantity, first, second))
    });
    let (_, first, second) = pairs.into_iter().find(|(quantity, ..)| is_open(*quantity))?;
    let [first, second]: [Vec<&str>; 2] = [first, second].map(|name| name.split('/').collect());
    let is_alike = first.len() == second.len() && first.last() == second.last();
    let (part, _) = first.iter().zip(&second).find(|(a, b)| a != b)?;
    (is_alike && !part.is_empty()).then(|| (*part).to_owned())
}

/// The columns that are used, and the fields of channels that they are read from.
struct Selection {
    /// Index of each column among the headings.
    columns: Vec<usize>,
    /// Channel and fields of each series.
    requests: Vec<(usize, Vec<usize>)>,
    /// Place of each column in the series.
    wanted: Vec<Wanted>,
}

impl Selection {
    /// Selects the columns from which the used quantities are computed.
    fn of(used: &[Used], found: &Columns, spec: &TableSpec<'_>) -> Self {
        let has_voltage = used.iter().any(|used| used.column.quantity == Quantity::Voltage);
        let role = |quantity: Quantity| match quantity {
            Quantity::Time => Role::Time,
            Quantity::Voltage | Quantity::Torque => Role::Input,
            // Without a voltage the current is the input.
            Quantity::Current if !has_voltage => Role::Input,
            Quantity::Signal(n) if spec.signals.get(usize::from(n)).is_some_and(|signal| signal.is_input) => {
                Role::Input
            }
            _ => Role::Output,
        };
        let mut selection = Self { columns: Vec::new(), requests: Vec::new(), wanted: Vec::new() };
        for used in used {
            for at in used.column_indices() {
                let Some((channel, field)) = found.of[at].filter(|_| !selection.columns.contains(&at)) else {
                    continue;
                };
                let name = found.headings[at].name.clone();
                let place = selection.place(channel, field);
                selection.columns.push(at);
                selection.wanted.push(Wanted { at: place, name, role: role(used.column.quantity) });
            }
        }
        selection
    }

    /// Returns the series and the column of a field, which is requested if it was not before.
    fn place(&mut self, channel: usize, field: usize) -> (usize, usize) {
        let own = self.requests.iter().position(|(own, _)| *own == channel);
        let series = own.unwrap_or_else(|| {
            self.requests.push((channel, Vec::new()));
            self.requests.len() - 1
        });
        self.requests[series].1.push(field);
        (series, self.requests[series].1.len() - 1)
    }

    /// Checks the number of values, that channels without times have the same number of samples, and that others have no time besides.
    fn check(&self, log: &dyn Log) -> Result<()> {
        let has_times = |wanted: &&Wanted| {
            let (channel, _) = self.requests[wanted.at.0];
            wanted.role == Role::Time && log.channels().get(channel).is_some_and(|channel| channel.span_s.is_some())
        };
        if let Some(time) = self.wanted.iter().find(has_times) {
            let message =
                format!("{} cannot be the time: the channels of the log have times of their own", quoted(&time.name));
            return Err(Error::data(message, "Leave the time out, or convert the log to a table with one time."));
        }
        let channels =
            || self.requests.iter().filter_map(|(at, fields)| Some((log.channels().get(*at)?, fields.len())));
        let values: u64 = channels().map(|(channel, fields)| channel.count.saturating_mul(1 + fields as u64)).sum();
        if values > VALUES_MAX {
            let message = format!("the columns have {values} values, expected at most {VALUES_MAX}");
            return Err(Error::data(message, "Cut the log, or read fewer columns."));
        }
        let is_timeless = channels().any(|(channel, _)| channel.span_s.is_none());
        let is_timed = channels().any(|(channel, _)| channel.span_s.is_some());
        let mut counts = channels().map(|(channel, _)| (&channel.name, channel.count));
        let Some((name, count)) = counts.next() else { return Ok(()) };
        match counts.find(|(_, other)| is_timeless && (is_timed || *other != count)) {
            None => Ok(()),
            Some((other, others)) => {
                let message = format!(
                    "{} has {count} samples and {} {others}, and they have no times in common",
                    quoted(name),
                    quoted(other)
                );
                Err(Error::data(message, "Name columns of one group, or save the recording with times."))
            }
        }
    }

    /// Returns the signals of merged columns.
    fn signals(
        &self,
        used: Vec<Used>,
        merged: Merged,
        (found, notes): (&Columns, &[String]),
        spec: &TableSpec<'_>,
    ) -> Result<Signals> {
        let rows = merged.columns.first().map_or(0, Vec::len);
        let mut lines = Lines::default();
        lines.extend(1, rows);
        let mut columns: Vec<(usize, &str)> =
            self.columns.iter().map(|at| (*at, found.headings[*at].name.as_str())).collect();
        let measured_at = self.measured_at(&used, &merged.measured);
        let mut values = merged.columns;
        if let Some(time) = found.of.iter().position(Option::is_none) {
            columns.push((time, found.headings[time].name.as_str()));
            values.push(merged.time_s);
        }
        let cells = Cells { columns, values, lines };
        let (blank, bad, skips) = (Vec::new(), LeftOut::default(), spec.bad_rows == BadRows::Skip);
        let notes = notes.iter().cloned().chain(merged.notes).collect();
        let table = Numbers { cells, headings: &found.headings, notes, measured_at, blank, bad, skips };
        table.signals(used, spec)
    }

    /// Returns the rows at which outputs were measured: where their only column was, or the one with the fewest samples of several.
    fn measured_at(&self, used: &[Used], measured: &[Vec<bool>]) -> Vec<MeasuredAt> {
        let of = |used: &Used| {
            let columns = used.column_indices();
            let own = columns.iter().filter_map(|at| measured.get(self.columns.iter().position(|own| own == at)?));
            let own = own.filter(|own| !own.is_empty());
            let fewest = own.min_by_key(|own| own.iter().filter(|is| **is).count())?;
            Some(MeasuredAt { quantity: used.column.quantity, samples: fewest.clone() })
        };
        used.iter().filter_map(of).collect()
    }
}

/// Returns the last value of a column between a test and the one before it, if the log has one.
fn value_before(all: &[Series], part: &[Series], wanted: &Wanted, (routine, test): (&Routine, &Test)) -> Option<f64> {
    let (series, column) = wanted.at;
    let first = part[series].time_s.first().copied().unwrap_or(test.from_s).min(test.from_s);
    let ends = routine.tests.iter().map(|other| other.to_s).filter(|end| *end <= test.from_s);
    let end = ends.fold(f64::NEG_INFINITY, f64::max);
    let before = all[series].time_s.partition_point(|t| *t < first).checked_sub(1)?;
    let value = all[series].columns[column].get(before).copied()?;
    (all[series].time_s[before] > end && value.is_finite()).then_some(value)
}

/// Returns the hexadecimal SHA-256 digest of a file.
///
/// # Errors
/// Returns `Data` if the file cannot be read.
pub(super) fn digest(medium: &mut dyn Medium) -> Result<String> {
    let (mut digest, mut buffer) = (Sha256::new(), vec![0; 1 << 18]);
    medium.rewind().map_err(|error| unreadable(&error))?;
    loop {
        match medium.read(&mut buffer) {
            Ok(0) => return Ok(hexadecimal(&digest.finalize())),
            Ok(count) => digest.update(&buffer[..count]),
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(unreadable(&error)),
        }
    }
}
