//! Headings of columns: the quantity and the unit that they name.

use motorfit_core::setting::text;
use motorfit_core::text::{alternatives, quoted};
use motorfit_core::{Error, Result};
use std::fmt;

/// Physical quantity of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Quantity {
    /// Time.
    Time,
    /// Voltage at the motor.
    Voltage,
    /// Load torque.
    #[serde(rename = "load torque")]
    Torque,
    /// Current.
    Current,
    /// Speed of the shaft.
    Speed,
    /// Angle of the shaft, from which the speed is derived.
    Position,
    /// A signal of a user's model, by its number in the requests of the import.
    Signal(u8),
}

use Quantity::{Current, Position, Signal, Speed, Time, Torque, Voltage};

/// Names, units and headings of a quantity.
struct Facts {
    /// Name in requests for columns; messages replace its underscores by blanks.
    key: &'static str,
    /// Heading in the canonical file.
    canonical: &'static str,
    /// SI unit.
    unit: &'static str,
    /// Conversion factors to SI, each with the names of its unit, in any case; the SI unit comes first.
    units: &'static [(f64, &'static [&'static str])],
    /// Words that denote the quantity in headings, in lower case.
    words: &'static [&'static str],
}

/// One turn \[rad\].
const TURN: f64 = std::f64::consts::TAU;
const TIME: Facts = Facts {
    key: "time",
    canonical: "time_s",
    unit: "s",
    units: &[
        (1.0, &["s", "sec", "second"]),
        (1e-3, &["milliseconds"]),
        (1.0, &["seconds"]),
        (1e-3, &["ms", "msec"]),
        (1e-6, &["µs", "microseconds"]),
        (1e-9, &["ns", "nanoseconds"]),
        (60.0, &["minutes", "min"]),
    ],
    words: &["time", "t", "timestamp", "timestep", "elapsed", "zeit", "tempo", "temps", "tiempo"],
};
const VOLTAGE: Facts = Facts {
    key: "voltage",
    canonical: "voltage_V",
    unit: "V",
    units: &[(1.0, &["V", "volt", "volts", "VDC"]), (1e-3, &["mV"]), (1e3, &["kV"])],
    words: &["voltage", "volt", "volts", "v", "u", "vin", "va", "spannung", "tension", "tensao", "tensão", "voltaje"],
};
const TORQUE: Facts = Facts {
    key: "load_torque",
    canonical: "load_torque_Nm",
    unit: "N·m",
    units: &[(1.0, &["N·m"]), (1e-3, &["mN·m"]), (1e-2, &["N·cm"]), (1e3, &["kN·m"])],
    words: &[],
};
const CURRENT: Facts = Facts {
    key: "current",
    canonical: "current_A",
    unit: "A",
    units: &[(1.0, &["A", "amp", "ampere", "amperes", "amps"]), (1e-3, &["mA"]), (1e-6, &["µA"]), (1e3, &["kA"])],
    words: &["current", "i", "ia", "amps", "ampere", "strom", "corrente", "courant", "corriente"],
};
const SPEED: Facts = Facts {
    key: "speed",
    canonical: "speed_rad_s",
    unit: "rad/s",
    units: &[
        (1.0, &["rad/s", "rads", "rad_s", "rad/sec", "radian/s", "radians/s"]),
        (1e3, &["krad/s"]),
        (TURN / 60.0, &["rpm", "rev/min", "r/min", "1/min", "min-1", "min^-1", "u/min"]),
        (TURN, &["rps", "rev/s", "turn/s", "turns/s", "rotations/s", "hz"]),
        (TURN / 360.0, &["deg/s", "°/s", "deg/sec", "degrees/s"]),
    ],
    words: &["speed", "omega", "ω", "w", "velocity", "rpm", "drehzahl", "velocidade", "vitesse", "velocidad"],
};
const POSITION: Facts = Facts {
    key: "position",
    canonical: "position_rad",
    unit: "rad",
    units: &[
        (1.0, &["rad", "radian", "radians"]),
        (TURN / 360.0, &["deg", "degree", "degrees", "°"]),
        (TURN, &["turn", "turns", "rev", "revs", "revolutions", "rotation", "rotations"]),
    ],
    words: &["position", "angle", "theta", "θ", "winkel", "posição", "posicao", "posición", "posicion", "ângulo"],
};

/// Signals of models have the units and names of their requests.
const SIGNAL: Facts = Facts { key: "signal", canonical: "", unit: "", units: &[], words: &[] };

impl Quantity {
    /// Quantities of a recording, in the order of the canonical file.
    pub const ALL: [Self; 5] = [Time, Voltage, Current, Speed, Torque];
    /// Quantities that a column may have: also the position, from which the speed is derived.
    pub const COLUMNS: [Self; 6] = [Time, Voltage, Current, Speed, Torque, Position];

    const fn facts(self) -> Facts {
        match self {
            Time => TIME,
            Voltage => VOLTAGE,
            Torque => TORQUE,
            Current => CURRENT,
            Speed => SPEED,
            Position => POSITION,
            Signal(_) => SIGNAL,
        }
    }

    /// Returns the heading in the canonical file.
    #[must_use]
    pub fn canonical(self) -> &'static str {
        self.facts().canonical
    }

    /// Returns the SI unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        self.facts().unit
    }

    /// Returns the sign of each unit that is understood, the SI unit first.
    pub fn units(self) -> impl Iterator<Item = &'static str> {
        let units = self.facts().units;
        let sign = |(factor, names): &(f64, &[&'static str])| {
            let sign = *names.first()?;
            let same =
                |(other, names): &&(f64, &[&str])| (other / factor - 1.0).abs() < 1e-12 && names[0].len() < sign.len();
            (!units.iter().any(|unit| same(&unit))).then_some(sign)
        };
        units.iter().filter_map(sign)
    }

    /// Returns the name of the quantity in requests for columns.
    #[must_use]
    pub fn key(self) -> &'static str {
        self.facts().key
    }

    /// Returns the factor from a unit to SI; `None` if the unit is unknown.
    pub(super) fn factor(self, unit: &str) -> Option<f64> {
        let unit = plain(unit);
        let is_named = |names: &[&str]| names.iter().any(|name| plain(name) == unit);
        let known = self.facts().units.iter().find(|(_, names)| is_named(names)).map(|row| row.0);
        known.or_else(|| if self == Time { tick(&unit) } else { None })
    }

    pub(super) fn check_unit(self, unit: &str) -> Result<f64> {
        self.factor(unit).ok_or_else(|| {
            let known: Vec<&str> = self.facts().units.iter().flat_map(|(_, names)| *names).copied().collect();
            let more = match self {
                Time => "; for clock ticks, the frequency of the clock, as in time=HEADING:8kHz",
                Position => "; for encoder counts, divide by the counts per turn, as in position=HEADING/4096:turns",
                Speed => {
                    "; a linear speed is divided by the radius of the wheel or drum, as in speed=HEADING/0.05:rad/s"
                }
                Voltage => "; for duty cycles and PWM ticks, scale to volts, as in voltage=HEADING*12/255:V",
                _ => "",
            };
            let hint = text!(
                "Name the unit with " [Columns = "{}=HEADING:UNIT", self.key()]
                (", one of {}{more}.", alternatives(&known))
            );
            Error::data(format!("unit {} of {self} is not known", quoted(unit)), hint)
        })
    }
}

/// Returns the name of a unit in lower case, without signs of multiplication.
fn plain(unit: &str) -> String {
    unit.trim().to_lowercase().replace(['µ', 'μ'], "u").replace(['·', '*', ' '], "")
}

/// Returns the period \[s\] of a clock given by its frequency: `8khz` is 125 µs.
fn tick(unit: &str) -> Option<f64> {
    let number = unit.strip_suffix("hz")?;
    let prefixed = [("k", 1e3), ("m", 1e6)].into_iter().find_map(|(k, factor)| Some((number.strip_suffix(k)?, factor)));
    let (number, prefix) = prefixed.unwrap_or((number, 1.0));
    let digits = !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    let rate = prefix * number.parse::<f64>().ok().filter(|_| digits)?;
    (rate > 0.0 && rate.is_finite()).then_some(1.0 / rate)
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.key().replace('_', " "))
    }
}

/// Largest length of a heading \[bytes\]; longer cells are prose.
const HEADING_MAX: usize = 200;
/// Largest number of words of a heading.
const WORDS_MAX: usize = 16;

/// Returns the quantity of a heading and the unit that it names, if any.
///
/// The unit is the text in brackets, or the longest run of words after the first one that is a unit of the quantity
/// denoted by the other words: `Current (mA)`, `t[ms]`, `speed_rad_s`, `I/mA`, `current_mA_rms`.
pub(super) fn understand(heading: &str) -> Option<(Quantity, Option<String>)> {
    if heading.len() > HEADING_MAX {
        return None;
    }
    if let Some((name, unit)) = bracketed(heading) {
        return Some((quantity_of(&words_of(&name), Some(unit))?, Some(unit.to_owned())));
    }
    let words = words_of(heading);
    if words.len() > WORDS_MAX {
        return None;
    }
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
    // "rpm" and "Drehzahl" denote both the quantity and its unit.
    let is_per_minute = |word: &str| ["rpm", "drehzahl"].iter().any(|own| word.eq_ignore_ascii_case(own));
    let rpm = words.iter().find(|(_, word)| quantity == Speed && is_per_minute(word));
    Some((quantity, rpm.map(|_| "rpm".to_owned())))
}

/// Returns true if a heading denotes times.
pub(crate) fn is_time(heading: &str) -> bool {
    understand(heading).is_some_and(|(quantity, _)| quantity == Time)
}

/// Returns a heading without its first bracket, and the text in the bracket.
fn bracketed(heading: &str) -> Option<(String, &str)> {
    let open = heading.find(['(', '['])?;
    let close = if heading[open..].starts_with('(') { ')' } else { ']' };
    let end = open + heading[open..].find(close)?;
    Some((format!("{} {}", &heading[..open], &heading[end + 1..]), heading[open + 1..end].trim()))
}

/// Returns the unit that a heading names whatever its quantity: the text in brackets, or the word after its last underscore or slash.
pub(super) fn unit_in(heading: &str) -> Option<&str> {
    if heading.len() > HEADING_MAX {
        return None;
    }
    let is_unit = |word: &str| {
        let mut known =
            Quantity::COLUMNS.iter().flat_map(|quantity| quantity.facts().units).flat_map(|(_, names)| *names);
        known.any(|name| *name == word)
    };
    match bracketed(heading) {
        Some((_, unit)) => Some(unit).filter(|unit| !unit.is_empty()),
        None => heading.rsplit_once(['_', '/']).map(|(_, word)| word).filter(|word| is_unit(word)),
    }
}

/// Returns the words of a heading with their byte offsets.
fn words_of(heading: &str) -> Vec<(usize, &str)> {
    let words = heading.split(|c: char| !(c.is_alphanumeric() || c == '°')).filter(|word| !word.is_empty());
    words.map(|word| (word.as_ptr() as usize - heading.as_ptr() as usize, word)).collect()
}

/// Last parts of compound words that denote a quantity.
const COMPOUNDS: [&str; 3] = ["spannung", "strom", "drehzahl"];
/// First part of a compound word for a reference.
const REFERENCE_PART: &str = "soll";

/// Words that mark a current or a speed as a reference or limit instead of a measurement.
const REFERENCE_WORDS: &[&str] =
    &["ref", "reference", "setpoint", "set", "target", "cmd", "command", "commanded", "limit", "max"];

/// Returns the quantity that words denote; in a heading of several words, those of one or two letters do not count.
fn quantity_of(words: &[(usize, &str)], unit: Option<&str>) -> Option<Quantity> {
    let words: Vec<String> = words.iter().map(|(_, word)| word.to_lowercase()).collect();
    let any = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
    if any(&["torque", "moment", "drehmoment", "lastmoment", "loadtorque"]) {
        return any(&["load", "last", "lastmoment", "loadtorque"]).then_some(Torque);
    }
    if words.len() == 1 && any(&["load"]) {
        return unit.is_some_and(|unit| Torque.factor(unit).is_some()).then_some(Torque);
    }
    let is_reference = any(REFERENCE_WORDS) || words.iter().any(|word| word.starts_with(REFERENCE_PART));
    let is_word = |word: &str| {
        let is_last = COMPOUNDS.contains(&word);
        words.iter().any(|own| own == word || (is_last && own.ends_with(word)))
    };
    let means = |quantity: &Quantity| {
        let counts = |word: &&&str| words.len() == 1 || word.chars().count() > 2;
        let named = quantity.facts().words.iter().filter(counts).any(|word| is_word(word));
        named && !(is_reference && matches!(quantity, Current | Speed))
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
            ("Ankerspannung (V)", Voltage, Some("V")),
            ("Ankerstrom_mA", Current, Some("mA")),
            ("Motordrehzahl", Speed, None),
            ("wheel_speed_km_h", Speed, None),
            ("timestep (8kHz)", Time, Some("8kHz")),
            ("position [turns]", Position, Some("turns")),
            ("Encoder angle (deg)", Position, Some("deg")),
            ("Position (m)", Position, Some("m")),
        ] {
            assert_eq!(understand(heading), Some((quantity, unit.map(str::to_owned))), "{heading}");
        }
        for heading in [
            "speed_ref",
            "current limit",
            "Solldrehzahl",
            "torque_Nm",
            "load",
            "temperature_C",
            "duty",
            "x",
            "",
            "()",
            "[",
            "µ",
        ] {
            assert_eq!(understand(heading), None, "{heading}");
        }
        for (heading, unit) in [("u_a [V]", "V"), ("CH1 (V)", "V"), ("bus_V", "V"), ("x (furlong)", "furlong")] {
            assert_eq!(unit_in(heading), Some(unit));
        }
        assert_eq!([unit_in("phase_a"), unit_in("duty"), unit_in("()")], [None; 3]);
        assert_eq!(Time.factor("8 kHz"), Some(1.0 / 8000.0));
        assert_eq!(Time.factor("2.5MHz"), Some(1.0 / 2.5e6));
        for none in ["Hz", "kHz", "-8kHz", "1e3Hz", "0Hz", "..Hz"] {
            assert_eq!(Time.factor(none), None, "{none}");
        }
        assert_eq!(understand("speed (furlong)"), Some((Speed, Some("furlong".to_owned()))), "refused later, by name");
    }
}
