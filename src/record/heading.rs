//! Headings: which column holds what, in which unit.

use crate::text::{alternatives, excerpt};
use crate::{Error, Result};
use std::fmt;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Time.
    Time,
    /// Voltage at the motor.
    Voltage,
    /// Load torque.
    Torque,
    /// Current.
    Current,
    /// Speed of the shaft.
    Speed,
}

use Quantity::{Current, Speed, Time, Torque, Voltage};

/// Units and what turns a value in them into SI; the SI unit comes first. Compared in lower case.
type Units = &'static [(&'static str, f64)];
const TURN: f64 = std::f64::consts::TAU;
const TIME: Units = &[
    ("s", 1.0),
    ("sec", 1.0),
    ("seconds", 1.0),
    ("ms", 1e-3),
    ("msec", 1e-3),
    ("us", 1e-6),
    ("ns", 1e-9),
    ("min", 60.0),
];
const VOLTAGE: Units = &[("v", 1.0), ("volt", 1.0), ("volts", 1.0), ("mv", 1e-3), ("kv", 1e3)];
const CURRENT: Units = &[("a", 1.0), ("amp", 1.0), ("amps", 1.0), ("ma", 1e-3), ("ua", 1e-6), ("ka", 1e3)];
const TORQUE: Units = &[("nm", 1.0), ("mnm", 1e-3), ("ncm", 1e-2), ("knm", 1e3)];
const SPEED: Units = &[
    ("rad/s", 1.0),
    ("rads", 1.0),
    ("rad_s", 1.0),
    ("rad/sec", 1.0),
    ("krad/s", 1e3),
    ("rpm", TURN / 60.0),
    ("rev/min", TURN / 60.0),
    ("1/min", TURN / 60.0),
    ("min-1", TURN / 60.0),
    ("u/min", TURN / 60.0),
    ("rps", TURN),
    ("rev/s", TURN),
    ("turns/s", TURN),
    ("hz", TURN),
    ("deg/s", TURN / 360.0),
    ("°/s", TURN / 360.0),
];

const TIME_WORDS: &[&str] = &["time", "t", "timestamp", "elapsed", "zeit", "tempo", "temps", "tiempo"];
const VOLTAGE_WORDS: &[&str] =
    &["voltage", "volt", "volts", "v", "u", "vin", "va", "spannung", "tension", "tensao", "tensão", "voltaje"];
const CURRENT_WORDS: &[&str] = &["current", "i", "ia", "amps", "ampere", "strom", "corrente", "courant", "corriente"];
const TORQUE_WORDS: &[&str] = &["load", "lasttorque", "loadtorque"];
const SPEED_WORDS: &[&str] =
    &["speed", "omega", "ω", "w", "velocity", "rpm", "drehzahl", "velocidade", "vitesse", "velocidad"];

impl Quantity {
    /// All of them, in the order of the canonical file.
    pub const ALL: [Self; 5] = [Time, Voltage, Current, Speed, Torque];

    /// The heading in the canonical file.
    #[must_use]
    pub fn canonical(self) -> &'static str {
        match self {
            Time => "time_s",
            Voltage => "voltage_V",
            Torque => "load_torque_Nm",
            Current => "current_A",
            Speed => "speed_rad_s",
        }
    }

    /// The SI unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Time => "s",
            Voltage => "V",
            Torque => "N·m",
            Current => "A",
            Speed => "rad/s",
        }
    }

    fn units(self) -> Units {
        match self {
            Time => TIME,
            Voltage => VOLTAGE,
            Torque => TORQUE,
            Current => CURRENT,
            Speed => SPEED,
        }
    }

    fn words(self) -> &'static [&'static str] {
        match self {
            Time => TIME_WORDS,
            Voltage => VOLTAGE_WORDS,
            Torque => TORQUE_WORDS,
            Current => CURRENT_WORDS,
            Speed => SPEED_WORDS,
        }
    }

    /// What turns a value in `unit` into SI.
    pub(super) fn factor(self, unit: &str) -> Option<f64> {
        let unit = unit.trim().to_lowercase().replace(['µ', 'μ'], "u").replace(['·', '*', ' '], "");
        self.units().iter().find(|(name, _)| *name == unit).map(|(_, factor)| *factor)
    }

    pub(super) fn check_unit(self, unit: &str) -> Result<f64> {
        self.factor(unit).ok_or_else(|| {
            let known: Vec<&str> = self.units().iter().map(|(name, _)| *name).collect();
            Error::data(
                format!("unit \"{}\" of {self} is not known", excerpt(unit)),
                format!("Name the unit with --columns {self}=HEADING:UNIT, one of {}.", alternatives(&known)),
            )
        })
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Time => "time",
            Voltage => "voltage",
            Torque => "load torque",
            Current => "current",
            Speed => "speed",
        })
    }
}

/// A column named by the user: what it holds, its heading, its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnRequest {
    /// What it holds.
    pub quantity: Quantity,
    /// `HEADING` or `HEADING:UNIT`, as given.
    pub name: String,
}

/// Reads `time=Tempo:s,current=Corrente:mA,…`.
///
/// # Errors
/// `Usage` when an item has no `=`, an empty heading, or names no quantity, or a quantity comes twice.
pub fn parse_columns(text: &str) -> Result<Vec<ColumnRequest>> {
    const EXAMPLE: &str = "Write --columns time=Tempo:s,voltage=Tensao:V,current=Corrente:mA,speed=Velocidade:rad/s.";
    let mut requests: Vec<ColumnRequest> = Vec::new();
    for item in text.split(',').filter(|item| !item.trim().is_empty()) {
        let Some((key, name)) = item.split_once('=').filter(|(_, name)| !name.trim().is_empty()) else {
            return Err(Error::usage(format!("\"{}\" names no column", excerpt(item)), EXAMPLE));
        };
        let quantity = match key.trim() {
            "time" => Time,
            "voltage" => Voltage,
            "torque" | "load_torque" => Torque,
            "current" => Current,
            "speed" => Speed,
            other => {
                return Err(Error::usage(format!("\"{}\" is no quantity of a recording", excerpt(other)), EXAMPLE));
            }
        };
        if requests.iter().any(|r| r.quantity == quantity) {
            return Err(Error::usage(format!("--columns names {quantity} twice"), "Name each quantity once."));
        }
        requests.push(ColumnRequest { quantity, name: name.trim().to_owned() });
    }
    Ok(requests)
}

/// What a heading says: its quantity and the unit it names, if any.
pub(super) fn understand(heading: &str) -> Option<(Quantity, Option<String>)> {
    let heading = heading.trim();
    if let Some((name, unit)) = bracketed(heading) {
        return Some((quantity_of(name)?, Some(unit.to_owned())));
    }
    for (at, joint) in heading.char_indices().filter(|(_, c)| matches!(c, '_' | ' ')) {
        let (name, unit) = (&heading[..at], &heading[at + joint.len_utf8()..]);
        if let Some(quantity) = quantity_of(name)
            && quantity.factor(unit).is_some()
        {
            return Some((quantity, Some(unit.to_owned())));
        }
    }
    let quantity = quantity_of(heading)?;
    // A heading such as "rpm" is quantity and unit in one.
    let unit = heading.eq_ignore_ascii_case("rpm").then(|| heading.to_owned());
    Some((quantity, unit))
}

/// `Current (mA)` and `t[ms]` in their two parts.
fn bracketed(heading: &str) -> Option<(&str, &str)> {
    let close = heading.chars().last()?;
    let open = match close {
        ')' => '(',
        ']' => '[',
        _ => return None,
    };
    let (name, rest) = heading.split_once(open)?;
    Some((name, rest.strip_suffix(close)?.trim()))
}

/// The quantity that a name without unit means; words inside count when they are longer than a symbol.
fn quantity_of(name: &str) -> Option<Quantity> {
    let name = name.trim().to_lowercase();
    let tokens: Vec<&str> = name.split(|c: char| !c.is_alphanumeric()).filter(|t| !t.is_empty()).collect();
    if let [only] = tokens[..] {
        return Quantity::ALL.into_iter().find(|q| q.words().contains(&only));
    }
    let long = |word: &&str| word.chars().count() > 2;
    // The load torque first: "load torque" must not be read as anything else.
    [Torque, Time, Voltage, Current, Speed]
        .into_iter()
        .find(|q| tokens.iter().any(|token| q.words().iter().filter(|w| long(w)).any(|w| w == token)))
}
