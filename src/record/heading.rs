//! Headings: which column holds what, in which unit.

use crate::setting::text;
use crate::text::{alternatives, excerpt};
use crate::{Error, Result};
use std::fmt;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
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
    /// Angle of the shaft: a source of its speed.
    Position,
}

use Quantity::{Current, Position, Speed, Time, Torque, Voltage};

/// Units and what turns a value in them into SI; the SI unit comes first. Compared in lower case.
type Units = &'static [(&'static str, f64)];
const TURN: f64 = std::f64::consts::TAU;
const TIME: Units = &[
    ("s", 1.0),
    ("sec", 1.0),
    ("second", 1.0),
    ("milliseconds", 1e-3),
    ("seconds", 1.0),
    ("ms", 1e-3),
    ("msec", 1e-3),
    ("us", 1e-6),
    ("ns", 1e-9),
    ("minutes", 60.0),
    ("min", 60.0),
];
const VOLTAGE: Units = &[("v", 1.0), ("volt", 1.0), ("volts", 1.0), ("mv", 1e-3), ("kv", 1e3)];
const CURRENT: Units = &[
    ("a", 1.0),
    ("amp", 1.0),
    ("ampere", 1.0),
    ("amperes", 1.0),
    ("amps", 1.0),
    ("ma", 1e-3),
    ("ua", 1e-6),
    ("ka", 1e3),
];
const TORQUE: Units = &[("nm", 1.0), ("mnm", 1e-3), ("ncm", 1e-2), ("knm", 1e3)];
const SPEED: Units = &[
    ("rad/s", 1.0),
    ("rads", 1.0),
    ("rad_s", 1.0),
    ("rad/sec", 1.0),
    ("krad/s", 1e3),
    ("rpm", TURN / 60.0),
    ("rev/min", TURN / 60.0),
    ("r/min", TURN / 60.0),
    ("1/min", TURN / 60.0),
    ("min-1", TURN / 60.0),
    ("u/min", TURN / 60.0),
    ("rps", TURN),
    ("rev/s", TURN),
    ("turns/s", TURN),
    ("rotations/s", TURN),
    ("hz", TURN),
    ("deg/s", TURN / 360.0),
    ("°/s", TURN / 360.0),
];
const POSITION: Units = &[
    ("rad", 1.0),
    ("radian", 1.0),
    ("radians", 1.0),
    ("deg", TURN / 360.0),
    ("degree", TURN / 360.0),
    ("degrees", TURN / 360.0),
    ("°", TURN / 360.0),
    ("turn", TURN),
    ("turns", TURN),
    ("rev", TURN),
    ("revs", TURN),
    ("revolutions", TURN),
    ("rotation", TURN),
    ("rotations", TURN),
];

const TIME_WORDS: &[&str] = &["time", "t", "timestamp", "timestep", "elapsed", "zeit", "tempo", "temps", "tiempo"];
const VOLTAGE_WORDS: &[&str] =
    &["voltage", "volt", "volts", "v", "u", "vin", "va", "spannung", "tension", "tensao", "tensão", "voltaje"];
const CURRENT_WORDS: &[&str] = &["current", "i", "ia", "amps", "ampere", "strom", "corrente", "courant", "corriente"];
const SPEED_WORDS: &[&str] =
    &["speed", "omega", "ω", "w", "velocity", "rpm", "drehzahl", "velocidade", "vitesse", "velocidad"];
const POSITION_WORDS: &[&str] =
    &["position", "angle", "theta", "θ", "winkel", "posição", "posicao", "posición", "posicion", "ângulo"];

impl Quantity {
    /// Those of a recording, in the order of the canonical file.
    pub const ALL: [Self; 5] = [Time, Voltage, Current, Speed, Torque];
    /// What a column may hold.
    pub(super) const COLUMNS: [Self; 6] = [Time, Voltage, Current, Speed, Torque, Position];

    /// The heading in the canonical file.
    #[must_use]
    pub fn canonical(self) -> &'static str {
        match self {
            Time => "time_s",
            Voltage => "voltage_V",
            Torque => "load_torque_Nm",
            Current => "current_A",
            Speed => "speed_rad_s",
            Position => "position_rad",
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
            Position => "rad",
        }
    }

    /// The name of the quantity in requests for columns.
    pub(super) fn key(self) -> &'static str {
        match self {
            Time => "time",
            Voltage => "voltage",
            Torque => "load_torque",
            Current => "current",
            Speed => "speed",
            Position => "position",
        }
    }

    fn units(self) -> Units {
        match self {
            Time => TIME,
            Voltage => VOLTAGE,
            Torque => TORQUE,
            Current => CURRENT,
            Speed => SPEED,
            Position => POSITION,
        }
    }

    fn words(self) -> &'static [&'static str] {
        match self {
            Time => TIME_WORDS,
            Voltage => VOLTAGE_WORDS,
            Torque => &[],
            Current => CURRENT_WORDS,
            Speed => SPEED_WORDS,
            Position => POSITION_WORDS,
        }
    }

    /// What turns a value in `unit` into SI.
    pub(super) fn factor(self, unit: &str) -> Option<f64> {
        let unit = unit.trim().to_lowercase().replace(['µ', 'μ'], "u").replace(['·', '*', ' '], "");
        let known = self.units().iter().find(|(name, _)| *name == unit).map(|(_, factor)| *factor);
        known.or_else(|| if self == Time { tick(&unit) } else { None })
    }

    pub(super) fn check_unit(self, unit: &str) -> Result<f64> {
        self.factor(unit).ok_or_else(|| {
            let known: Vec<&str> = self.units().iter().map(|(name, _)| *name).collect();
            let more = match self {
                Time => "; ticks of a clock by its frequency, as time=HEADING:8kHz",
                Position => "; counts by how many there are in a turn, as position=HEADING/4096:turns",
                Voltage => "; duty and PWM ticks by operations, as voltage=HEADING*12/255:V",
                _ => "",
            };
            Error::data(
                format!("unit \"{}\" of {self} is not known", excerpt(unit)),
                text!(
                    "Name the unit with " [Columns = "{}=HEADING:UNIT", self.key()]
                    (", one of {}{more}.", alternatives(&known))
                ),
            )
        })
    }
}

/// The period of a clock: `8khz` is 125 µs.
fn tick(unit: &str) -> Option<f64> {
    let (number, prefix) = match unit.strip_suffix("hz")? {
        number if number.ends_with('k') => (&number[..number.len() - 1], 1e3),
        number if number.ends_with('m') => (&number[..number.len() - 1], 1e6),
        number => (number, 1.0),
    };
    let digits = !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    let rate = prefix * number.parse::<f64>().ok().filter(|_| digits)?;
    (rate > 0.0 && rate.is_finite()).then_some(1.0 / rate)
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Time => "time",
            Voltage => "voltage",
            Torque => "load torque",
            Current => "current",
            Speed => "speed",
            Position => "position",
        })
    }
}

/// A column named by the user: what it holds, its heading, its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnRequest {
    /// What it holds.
    pub quantity: Quantity,
    /// `HEADING[*NUMBER…][:UNIT]` or `HEADING:LOW..HIGH`, as given.
    pub name: String,
}

/// Reads `time=Tempo:s,current=Corrente:mA,…`; what may stand behind a heading is tried against the file's.
///
/// # Errors
/// `Usage` when an item has no `=`, an empty heading, or names no quantity, or a quantity comes twice.
pub fn parse_columns(text: &str) -> Result<Vec<ColumnRequest>> {
    let example = || {
        text!(
            "Write " [Columns = "time=Tempo:s,voltage=Tensao:V,current=Corrente:mA,speed=Velocidade:rad/s"]
            ", or columns by their numbers: " [Columns = "time=#1:s,voltage=#2:V"] "."
        )
    };
    let mut requests: Vec<ColumnRequest> = Vec::new();
    for item in text.split(',').filter(|item| !item.trim().is_empty()) {
        let Some((key, name)) = item.split_once('=').filter(|(_, name)| !name.trim().is_empty()) else {
            return Err(Error::usage(format!("\"{}\" names no column", excerpt(item)), example()));
        };
        let quantity = Quantity::COLUMNS.into_iter().find(|q| q.key() == key.trim()).ok_or_else(|| {
            Error::usage(format!("\"{}\" is no quantity of a recording", excerpt(key.trim())), example())
        })?;
        if requests.iter().any(|r| r.quantity == quantity) {
            let message = text!([Columns] " names {quantity} twice");
            return Err(Error::usage(message, "Name each quantity once."));
        }
        requests.push(ColumnRequest { quantity, name: name.trim().to_owned() });
    }
    Ok(requests)
}

/// Longer headings are prose.
const HEADING_MAX: usize = 200;

/// What a heading says: its quantity and the unit it names, if any.
///
/// The unit is what stands in brackets, or the longest run of words behind the first that is a unit of the quantity
/// that the other words mean: `Current (mA)`, `t[ms]`, `speed_rad_s`, `I/mA`, `current_mA_rms`.
pub(super) fn understand(heading: &str) -> Option<(Quantity, Option<String>)> {
    if heading.len() > HEADING_MAX {
        return None;
    }
    if let Some((name, unit)) = bracketed(heading) {
        return Some((quantity_of(&words_of(&name), Some(unit))?, Some(unit.to_owned())));
    }
    let words = words_of(heading);
    let runs = (1..words.len()).flat_map(|start| (start..words.len()).map(move |end| (start, end)));
    let unit_at = |(start, end): (usize, usize)| {
        let unit = &heading[words[start].0..words[end].0 + words[end].1.len()];
        let name: Vec<(usize, &str)> = words[..start].iter().chain(&words[end + 1..]).copied().collect();
        let quantity = quantity_of(&name, Some(unit))?;
        quantity.factor(unit).map(|_| (quantity, Some(unit.to_owned())))
    };
    if let Some(found) = runs.filter_map(|(s, e)| Some((e - s, unit_at((s, e))?))).max_by_key(|(length, _)| *length) {
        return Some(found.1);
    }
    let quantity = quantity_of(&words, None)?;
    // "rpm" is quantity and unit in one.
    let rpm = words.iter().find(|(_, word)| quantity == Speed && word.eq_ignore_ascii_case("rpm"));
    Some((quantity, rpm.map(|(_, word)| (*word).to_owned())))
}

/// A name without its bracket, and what is in the bracket.
fn bracketed(heading: &str) -> Option<(String, &str)> {
    let open = heading.find(['(', '['])?;
    let close = if heading[open..].starts_with('(') { ')' } else { ']' };
    let end = open + heading[open..].find(close)?;
    Some((format!("{} {}", &heading[..open], &heading[end + 1..]), heading[open + 1..end].trim()))
}

/// The words of a heading with where they begin.
fn words_of(heading: &str) -> Vec<(usize, &str)> {
    let mut words = Vec::new();
    for word in heading.split(|c: char| !(c.is_alphanumeric() || c == '°')).filter(|word| !word.is_empty()) {
        words.push((word.as_ptr() as usize - heading.as_ptr() as usize, word));
    }
    words
}

/// Words that make a current or a speed something that was wanted, not measured.
const WANTED: &[&str] =
    &["ref", "reference", "setpoint", "set", "target", "cmd", "command", "commanded", "limit", "max"];

/// The quantity that words mean; in several words only those longer than a symbol count.
fn quantity_of(words: &[(usize, &str)], unit: Option<&str>) -> Option<Quantity> {
    let words: Vec<String> = words.iter().map(|(_, word)| word.to_lowercase()).collect();
    let any = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
    if any(&["torque", "moment", "drehmoment", "lastmoment", "loadtorque"]) {
        return any(&["load", "last", "lastmoment", "loadtorque"]).then_some(Torque);
    }
    if words.len() == 1 && any(&["load"]) {
        return unit.is_some_and(|unit| Torque.factor(unit).is_some()).then_some(Torque);
    }
    let wanted = any(WANTED);
    let means = |quantity: &Quantity| {
        let counts = |word: &&&str| words.len() == 1 || word.chars().count() > 2;
        let named = quantity.words().iter().filter(counts).any(|word| words.iter().any(|w| w == word));
        named && !(wanted && matches!(quantity, Current | Speed))
    };
    [Time, Voltage, Current, Speed, Position].into_iter().find(means)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_of_real_loggers() {
        for (heading, quantity, unit) in [
            ("time_s", Time, Some("s")),
            ("Timestamp(ms)", Time, Some("ms")),
            ("t/s", Time, Some("s")),
            ("U/V", Voltage, Some("V")),
            ("Load Voltage (V)", Voltage, Some("V")),
            ("load_current_A", Current, Some("A")),
            ("I/mA", Current, Some("mA")),
            ("current-mA", Current, Some("mA")),
            ("current_mA_rms", Current, Some("mA")),
            ("Current (amperes)", Current, Some("amperes")),
            ("speed_rad_s", Speed, Some("rad_s")),
            ("Speed [1/min] filtered", Speed, Some("1/min")),
            ("rpm_filtered", Speed, Some("rpm")),
            ("Motor_Speed(RPM)", Speed, Some("RPM")),
            ("speed, measured (rad/s)", Speed, Some("rad/s")),
            ("load_torque_Nm", Torque, Some("Nm")),
            ("load (mNm)", Torque, Some("mNm")),
            ("omega", Speed, None),
            ("wheel_speed_km_h", Speed, None),
            ("timestep (8kHz)", Time, Some("8kHz")),
            ("position [turns]", Position, Some("turns")),
            ("Encoder angle (deg)", Position, Some("deg")),
            ("Position (m)", Position, Some("m")),
        ] {
            assert_eq!(understand(heading), Some((quantity, unit.map(str::to_owned))), "{heading}");
        }
        for heading in
            ["speed_ref", "current limit", "torque_Nm", "load", "temperature_C", "duty", "x", "", "()", "[", "µ"]
        {
            assert_eq!(understand(heading), None, "{heading}");
        }
        assert_eq!(Time.factor("8 kHz"), Some(1.0 / 8000.0));
        assert_eq!(Time.factor("2.5MHz"), Some(1.0 / 2.5e6));
        for none in ["Hz", "kHz", "-8kHz", "1e3Hz", "0Hz", "..Hz"] {
            assert_eq!(Time.factor(none), None, "{none}");
        }
        assert_eq!(understand("speed (furlong)"), Some((Speed, Some("furlong".to_owned()))), "refused later, by name");
    }
}
