//! Units of columns that neither a heading nor a request names, so that SI units, or those of a model, are assumed; and the units of a
//! speed and a position that agree.

use super::heading::Quantity;
use super::import::name_of;
use super::position::{cause, position_disagrees};
use super::record::Record;
use super::source::Column;
use motorfit_core::numeric::peak;
use motorfit_core::setting::{Text, text};
use motorfit_core::text::significant;

/// Period \[s\] from which a time without a unit may be in milliseconds: it is long for a motor.
pub const PERIOD_DOUBTED_S: f64 = 0.02;
/// Peak of a speed without a unit above which it is likelier in revolutions per minute than in rad/s: 100 rad/s are 955 min⁻¹, and most
/// loggers that name no unit count revolutions.
const SPEED_DOUBTED: f64 = 100.0;

/// Units that are assumed.
#[derive(Debug, Clone, PartialEq)]
pub struct AssumedUnits {
    /// Quantities with their units, as `speed in rad/s`.
    pub listed: String,
    /// Request for columns that names the units, the likelier one of a speed.
    pub request: String,
    /// Reason for a likelier unit; empty without one.
    pub doubt: String,
}

impl AssumedUnits {
    /// Returns the assumed units of a recording; `None` if all are named. `key` names a quantity in requests. A time in seconds needs no
    /// unit if the period is short: milliseconds would be far below it.
    pub fn of(record: &Record, key: &dyn Fn(Quantity) -> String) -> Option<Self> {
        let is_doubted = |column: &&Column| {
            let is_sure = column.quantity == Quantity::Time && record.period_s() < PERIOD_DOUBTED_S;
            !column.unit_named && !is_sure
        };
        let columns: Vec<&Column> = record.source().columns.iter().filter(is_doubted).collect();
        let peak_of = |column: &Column| record.samples().signal(column.quantity).map_or(0.0, peak);
        let is_omega = |heading: &str| ["w", "\u{3c9}", "omega"].contains(&heading.to_lowercase().as_str());
        let is_count =
            |column: &&&Column| column.unit == "rad/s" && peak_of(column) > SPEED_DOUBTED && !is_omega(&column.heading);
        let fast = columns.iter().find(is_count).copied();
        let doubt = fast.map_or_else(String::new, |column| {
            let most = significant(peak_of(column), 3);
            format!("a speed of {most} is likelier in revolutions per minute than in rad/s, which few loggers use")
        });
        let request = |column: &&Column| {
            let unit = if fast == Some(*column) { "rpm" } else { &column.unit };
            format!("{}={}:{unit}", key(column.quantity), name_of(&column.heading))
        };
        let listed = |column: &&Column| format!("{} in {}", key(column.quantity).replace('_', " "), column.unit);
        (!columns.is_empty()).then(|| Self {
            listed: columns.iter().map(listed).collect::<Vec<_>>().join(", "),
            request: columns.iter().map(request).collect::<Vec<_>>().join(","),
            doubt,
        })
    }

    /// Returns the assumed units of a recording of the DC motor.
    #[must_use]
    pub fn of_motor(record: &Record) -> Option<Self> {
        Self::of(record, &|quantity| quantity.key().to_owned())
    }

    /// Returns the message of a warning.
    #[must_use]
    pub fn message(&self) -> String {
        let doubt = if self.doubt.is_empty() { String::new() } else { format!("; {}", self.doubt) };
        format!("no unit is given; assumed: {}{doubt}", self.listed)
    }

    /// Returns the request that names the units, as a setting.
    #[must_use]
    pub fn step(&self) -> Text {
        text!([Columns = "{}", self.request])
    }

    /// Returns the remedy of a warning.
    #[must_use]
    pub fn remedy(&self) -> Text {
        text!("Name the units: ").and(self.step()).and(".")
    }
}

/// Returns the request for columns with the units by which the speed is the derivative of the position; `None` if they agree, or if their
/// ratio has no usual cause with one remedy.
#[must_use]
pub fn agreeing_units(record: &Record) -> Option<Text> {
    let source = record.source();
    let ratio = source.position_ratio.filter(|ratio| position_disagrees(*ratio, "").is_some())?;
    let (_, units) = cause(ratio).filter(|(_, [unit, _])| !unit.is_empty())?;
    let item = |(quantity, unit): (Quantity, &str)| {
        let is_plain = |column: &&Column| column.quantity == quantity && column.conversion.is_empty();
        let column = source.columns.iter().find(is_plain).filter(|column| column.unit == quantity.unit())?;
        Some(format!("{}={}:{unit}", quantity.key(), name_of(&column.heading)))
    };
    let [speed, position] = [(Quantity::Speed, units[0]), (Quantity::Position, units[1])].map(item);
    Some(text!([Columns = "{},{}", speed?, position?]))
}
