//! TDMS files, as LabVIEW and other programs of National Instruments write them.

mod block;
mod channels;
mod file;
mod kind;
mod object;
mod scale;
mod source;
mod time;

use super::log::{Channel, IsTime, Log, Medium, Series};
use super::window::Window;
use block::{Block, Part, read_block};
use channels::{Table, channels, constants, tables};
use file::{Segment, Walker};
use kind::{Kind, numbers, times};
use motorfit_core::{Error, Result};
use source::COPY_AGAIN;
use time::difference_s;

/// Largest number of values that are read at once.
const VALUES_MAX: u64 = 100_000_000;

/// Opens a TDMS file.
///
/// A group whose channels have the same number of samples and the same waveform properties is a channel of the log; other groups
/// give several. Waveforms have times, counted from the earliest start. Timestamps are fields \[s\], counted from the earliest
/// timestamp of the file. Linear and polynomial scales are applied.
///
/// # Errors
/// Returns a `Data` error if the file is damaged, too large or has no channels of numbers.
pub(crate) fn open(medium: Box<dyn Medium>, is_time: IsTime) -> Result<Box<dyn Log>> {
    let mut window = Window::new(medium)?;
    match window.get(0, 4)? {
        b"TDSm" => (),
        b"TDSh" => {
            let hint = "Choose the file of the same name that ends in .tdms instead of .tdms_index.";
            return Err(Error::data("is the index of a TDMS file, expected the file with the data", hint));
        }
        _ => {
            let message = "is not a TDMS file: it does not begin with the letters TDSm";
            return Err(Error::data(message, "Save the recording as .tdms or as CSV in LabVIEW."));
        }
    }
    let mut walker = Walker::default();
    let mut origin: Option<i128> = None;
    each_block(&mut window, &mut walker, true, |window, walker, segment, block| {
        for part in &block.parts {
            if let Some(object) = walker.objects.all.get_mut(part.object) {
                object.count = object.count.saturating_add(part.count.saturating_mul(block.chunks));
            }
        }
        let is_time = |part: &Part| part.kind == Kind::Time;
        read_block(window, block, is_time, |_, bytes| {
            // A timestamp of 0 stands for an unknown time.
            let earliest = times(segment.big_endian, bytes).filter(|&time| time != 0).chain(origin).min();
            origin = earliest;
        })
    })?;
    let (tables, mut notes) = tables(&walker, is_time)?;
    if walker.objects.all.iter().any(|object| object.daqmx && object.count > 0) {
        notes.push("channels lack the samples of segments with raw DAQmx data".to_owned());
    }
    notes.extend(walker.end.take());
    let (channels, constants) = (channels(&tables), constants(&walker));
    Ok(Box::new(Tdms { window, channels, tables, origin: origin.unwrap_or(0), constants, notes }))
}

/// Calls `use_block` for each block of values of a file.
fn each_block(
    window: &mut Window,
    walker: &mut Walker,
    keep: bool,
    mut use_block: impl FnMut(&mut Window, &mut Walker, &Segment, &Block) -> Result<()>,
) -> Result<()> {
    while let Some(segment) = walker.next(window, keep)? {
        for block in walker.blocks(&segment)? {
            use_block(window, walker, &segment, &block)?;
        }
    }
    Ok(())
}

struct Tdms {
    window: Window,
    channels: Vec<Channel>,
    /// Table of each channel.
    tables: Vec<Table>,
    /// Earliest timestamp.
    origin: i128,
    constants: Vec<(String, f64)>,
    notes: Vec<String>,
}

impl Log for Tdms {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&mut self, requests: &[(usize, Vec<usize>)]) -> Result<Vec<Series>> {
        let (mut columns, of_object) = self.requested(requests)?;
        let origin = self.origin;
        each_block(&mut self.window, &mut Walker::default(), false, |window, _, segment, block| {
            let columns_of = |part: &Part| of_object.get(part.object).map_or(&[][..], Vec::as_slice);
            read_block(
                window,
                block,
                |part| !columns_of(part).is_empty(),
                |part, bytes| {
                    for &at in columns_of(part) {
                        let Some(column) = columns.get_mut(at) else { continue };
                        if part.kind == Kind::Time {
                            let times = times(segment.big_endian, bytes);
                            column.extend(times.map(|time| difference_s(time, origin)));
                        } else {
                            numbers(part.kind, segment.big_endian, bytes, column);
                        }
                    }
                },
            )
        })?;
        self.series(requests, columns)
    }

    fn constants(&self) -> &[(String, f64)] {
        &self.constants
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }
}

/// Columns, and those of each object.
type Columns = (Vec<Vec<f64>>, Vec<Vec<usize>>);

impl Tdms {
    /// Returns an empty column for each requested field, in their order.
    fn requested(&self, requests: &[(usize, Vec<usize>)]) -> Result<Columns> {
        let mut of_object: Vec<Vec<usize>> = Vec::new();
        let mut counts = Vec::new();
        let mut values = 0_u64;
        for (table, fields) in requests {
            let table = self.tables.get(*table).ok_or_else(no_field)?;
            values = values.saturating_add(if table.clock.is_some() { table.count } else { 0 });
            for field in fields {
                let object = table.columns.get(*field).ok_or_else(no_field)?.object;
                if of_object.len() <= object {
                    of_object.resize(object + 1, Vec::new());
                }
                if let Some(of_object) = of_object.get_mut(object) {
                    of_object.push(counts.len());
                }
                counts.push(table.count);
                values = values.saturating_add(table.count);
            }
        }
        if values > VALUES_MAX {
            let message = format!("the chosen channels have {values} values, expected at most {VALUES_MAX}");
            return Err(Error::data(message, "Choose fewer channels, or save a shorter part of the recording."));
        }
        // The file holds each value that was counted.
        let columns = counts.into_iter().map(|count| Vec::with_capacity(usize::try_from(count).unwrap_or(0)));
        Ok((columns.collect(), of_object))
    }

    /// Returns the columns of all requests with their times, and with scales applied.
    fn series(&self, requests: &[(usize, Vec<usize>)], columns: Vec<Vec<f64>>) -> Result<Vec<Series>> {
        let mut columns = columns.into_iter();
        let mut all = Vec::new();
        for (table, fields) in requests {
            let table = self.tables.get(*table).ok_or_else(no_field)?;
            let mut series = Series::default();
            if let Some(clock) = table.clock {
                series.time_s.extend((0..table.count).map(|sample| clock.time_s(sample)));
            }
            for (field, mut values) in fields.iter().zip(columns.by_ref()) {
                if values.len() as u64 != table.count {
                    return Err(Error::data("has changed since it was opened", COPY_AGAIN));
                }
                let column = table.columns.get(*field).ok_or_else(no_field)?;
                column.scales.apply(&mut values);
                series.columns.push(values);
            }
            all.push(series);
        }
        Ok(all)
    }
}

/// Returns the error for a request of a channel or field that the log does not have.
fn no_field() -> Error {
    Error::data("has no such channel", "Choose one of the channels of the file.")
}
