//! Physical units: their dimensions, factors to SI, and the reading of expressions such as `N*m*s/rad`.
//!
//! The radian is dimensionless, so that `V*s/rad` and `N*m/A` have the same dimension.

use crate::text::{nearest, quoted};

/// Number of base quantities: length, mass, time, current, temperature.
const BASES: usize = 5;
/// Symbols of the base units.
const BASE_SYMBOLS: [&str; BASES] = ["m", "kg", "s", "A", "K"];

/// Dimension of a quantity: the exponents of metre, kilogram, second, ampere and kelvin, in halves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Dimension([i8; BASES]);

impl Dimension {
    /// The dimension of a number.
    pub const ONE: Self = Self([0; BASES]);
    /// The dimension of a time.
    pub const TIME: Self = whole([0, 0, 1, 0, 0]);

    /// Returns the dimension of a product.
    #[must_use]
    pub fn times(self, other: Self) -> Self {
        Self(std::array::from_fn(|n| self.0[n].saturating_add(other.0[n])))
    }

    /// Returns the dimension of a quotient.
    #[must_use]
    pub fn per(self, other: Self) -> Self {
        Self(std::array::from_fn(|n| self.0[n].saturating_sub(other.0[n])))
    }

    /// Returns the dimension of a power with the exponent `halves/2`; `None` if an exponent is not a multiple of a half or too large.
    #[must_use]
    pub fn power(self, halves: i32) -> Option<Self> {
        let mut result = [0; BASES];
        for (result, own) in result.iter_mut().zip(self.0) {
            let doubled = i32::from(own).checked_mul(halves)?;
            *result = (doubled % 2 == 0).then(|| i8::try_from(doubled / 2).ok()).flatten()?;
        }
        Some(Self(result))
    }
}

/// Returns a dimension with integer exponents.
const fn whole(exponents: [i8; BASES]) -> Dimension {
    let mut halves = [0; BASES];
    let mut n = 0;
    while n < BASES {
        halves[n] = 2 * exponents[n];
        n += 1;
    }
    Dimension(halves)
}

/// Writes the dimension in SI base units: `kg·m²/s³`, `1` for a number.
impl std::fmt::Display for Dimension {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let named = DERIVED.iter().find(|unit| unit.dimension == *self && unit.factor.to_bits() == 1_f64.to_bits());
        if let Some(unit) = named.filter(|_| *self != Self::ONE) {
            return f.write_str(unit.symbols[0]);
        }
        let part = |is_above: bool| {
            let exponents = BASE_SYMBOLS.iter().zip(self.0).filter(move |(_, e)| (*e > 0) == is_above && *e != 0);
            let shown = exponents.map(|(symbol, halves)| match halves.unsigned_abs() {
                2 => (*symbol).to_owned(),
                halves if halves % 2 == 0 => format!("{symbol}^{}", halves / 2),
                halves => format!("{symbol}^({halves}/2)"),
            });
            shown.collect::<Vec<_>>()
        };
        let (above, below) = (part(true).join("*"), part(false));
        f.write_str(if above.is_empty() { "1" } else { &above })?;
        match below.len() {
            0 => Ok(()),
            1 => write!(f, "/{}", below[0]),
            _ => write!(f, "/({})", below.join("*")),
        }
    }
}

/// A unit: a value `x` in it is `factor x + offset` in SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// The dimension.
    pub dimension: Dimension,
    /// Factor to SI.
    pub factor: f64,
    /// Value of the unit's zero in SI; 0 except for degrees Celsius.
    pub offset: f64,
}

impl Unit {
    /// The unit of a number.
    pub const ONE: Self = Self { dimension: Dimension::ONE, factor: 1.0, offset: 0.0 };

    /// Returns factor and offset with which a value in this unit becomes one in `other`; `None` if the dimensions differ.
    #[must_use]
    pub fn to(&self, other: &Self) -> Option<(f64, f64)> {
        (self.dimension == other.dimension)
            .then(|| (self.factor / other.factor, (self.offset - other.offset) / other.factor))
    }
}

/// A row of the table of units.
struct Row {
    symbols: &'static [&'static str],
    dimension: Dimension,
    factor: f64,
    /// True if the symbols may have a prefix.
    is_prefixed: bool,
}

const fn row(symbols: &'static [&'static str], exponents: [i8; BASES], factor: f64, is_prefixed: bool) -> Row {
    Row { symbols, dimension: whole(exponents), factor, is_prefixed }
}

/// One turn \[rad\].
const TURN: f64 = std::f64::consts::TAU;

/// The units, in lengths, masses, times, currents and temperatures.
const DERIVED: [Row; 28] = [
    row(&["1", "-"], [0, 0, 0, 0, 0], 1.0, false),
    row(&["m"], [1, 0, 0, 0, 0], 1.0, true),
    row(&["ft"], [1, 0, 0, 0, 0], 0.3048, false),
    row(&["in"], [1, 0, 0, 0, 0], 0.0254, false),
    row(&["g"], [0, 1, 0, 0, 0], 1e-3, true),
    row(&["s", "sec"], [0, 0, 1, 0, 0], 1.0, true),
    row(&["A"], [0, 0, 0, 1, 0], 1.0, true),
    row(&["K"], [0, 0, 0, 0, 1], 1.0, true),
    row(&["N"], [1, 1, -2, 0, 0], 1.0, true),
    row(&["J"], [2, 1, -2, 0, 0], 1.0, true),
    row(&["Nm"], [2, 1, -2, 0, 0], 1.0, true),
    row(&["W"], [2, 1, -3, 0, 0], 1.0, true),
    row(&["V"], [2, 1, -3, -1, 0], 1.0, true),
    row(&["ohm", "Ohm", "Ω", "Ω"], [2, 1, -3, -2, 0], 1.0, true),
    row(&["H"], [2, 1, -2, -2, 0], 1.0, true),
    row(&["F"], [-2, -1, 4, 2, 0], 1.0, true),
    row(&["Wb"], [2, 1, -2, -1, 0], 1.0, true),
    row(&["T"], [0, 1, -2, -1, 0], 1.0, true),
    row(&["C"], [0, 0, 1, 1, 0], 1.0, true),
    row(&["Hz"], [0, 0, -1, 0, 0], 1.0, true),
    row(&["rad"], [0, 0, 0, 0, 0], 1.0, true),
    row(&["deg", "°"], [0, 0, 0, 0, 0], TURN / 360.0, false),
    row(&["rev", "turn"], [0, 0, 0, 0, 0], TURN, false),
    row(&["rpm"], [0, 0, -1, 0, 0], TURN / 60.0, false),
    row(&["%"], [0, 0, 0, 0, 0], 0.01, false),
    row(&["min"], [0, 0, 1, 0, 0], 60.0, false),
    row(&["h"], [0, 0, 1, 0, 0], 3600.0, false),
    row(&["degC", "°C"], [0, 0, 0, 0, 1], 1.0, false),
];

/// Zero of the Celsius scale \[K\].
const CELSIUS: f64 = 273.15;

const PREFIXES: [(&str, f64); 9] =
    [("n", 1e-9), ("u", 1e-6), ("µ", 1e-6), ("μ", 1e-6), ("m", 1e-3), ("c", 1e-2), ("k", 1e3), ("M", 1e6), ("G", 1e9)];

/// Largest length of a unit \[bytes\].
const UNIT_MAX: usize = 64;
/// Largest exponent in a unit.
const EXPONENT_MAX: i32 = 6;

/// Error of a unit: the byte at which it is, and the message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnitError {
    /// Byte offset in the unit.
    pub at: usize,
    /// Description of what was found and expected.
    pub message: String,
}

/// Reads a unit such as `N*m*s/rad`, `kg*m^2`, `1/s` or `W/(m*K)`.
///
/// # Errors
/// Returns the position and a message if a symbol is unknown, the syntax is wrong, or the text exceeds 64 bytes.
pub fn parse_unit(text: &str) -> Result<Unit, UnitError> {
    if text.len() > UNIT_MAX {
        return Err(UnitError { at: 0, message: format!("a unit of more than {UNIT_MAX} bytes") });
    }
    let trimmed = text.trim();
    if matches!(trimmed, "degC" | "°C") {
        return Ok(Unit { offset: CELSIUS, ..symbol(trimmed).unwrap_or(Unit::ONE) });
    }
    let mut reader = Reader { text, at: 0 };
    let unit = reader.product(0)?;
    match reader.peek() {
        None => Ok(unit),
        Some(c) => Err(reader.error(format!("'{c}' is not expected in the unit {}", quoted(text)))),
    }
}

/// Returns the unit of one symbol, with or without a prefix.
fn symbol(name: &str) -> Option<Unit> {
    let find = |name: &str, is_prefixed: bool| {
        let row = DERIVED.iter().find(|row| row.symbols.contains(&name) && (row.is_prefixed || !is_prefixed))?;
        Some(Unit { dimension: row.dimension, factor: row.factor, offset: 0.0 })
    };
    find(name, false).or_else(|| {
        PREFIXES.iter().find_map(|(prefix, factor)| {
            let unit = find(name.strip_prefix(prefix)?, true)?;
            // A prefixed gram is a power of ten of the kilogram without rounding.
            Some(Unit { factor: if name == "kg" { 1.0 } else { unit.factor * factor }, ..unit })
        })
    })
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
}

impl Reader<'_> {
    fn error(&self, message: String) -> UnitError {
        UnitError { at: self.at, message }
    }

    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
        self.text[self.at..].chars().next()
    }

    fn take(&mut self, wanted: &[char]) -> Option<char> {
        let found = self.peek().filter(|c| wanted.contains(c))?;
        self.at += found.len_utf8();
        Some(found)
    }

    fn product(&mut self, depth: usize) -> Result<Unit, UnitError> {
        let mut unit = self.factor(depth)?;
        while let Some(operator) = self.take(&['*', '·', '/']) {
            let other = self.factor(depth)?;
            let (dimension, factor) = match operator {
                '/' => (unit.dimension.per(other.dimension), unit.factor / other.factor),
                _ => (unit.dimension.times(other.dimension), unit.factor * other.factor),
            };
            unit = Unit { dimension, factor, offset: 0.0 };
        }
        Ok(unit)
    }

    fn factor(&mut self, depth: usize) -> Result<Unit, UnitError> {
        let unit = if self.take(&['(']).is_some() {
            if depth > 4 {
                return Err(self.error("brackets are nested too deeply".to_owned()));
            }
            let unit = self.product(depth + 1)?;
            if self.take(&[')']).is_none() {
                return Err(self.error("\")\" is missing".to_owned()));
            }
            unit
        } else {
            self.symbol()?
        };
        let exponent = match self.take(&['^', '²', '³']) {
            None => return Ok(unit),
            Some('²') => 2,
            Some('³') => 3,
            Some(_) => self.exponent()?,
        };
        let dimension = unit.dimension.power(2 * exponent);
        let dimension = dimension.ok_or_else(|| self.error("the exponent is too large".to_owned()))?;
        Ok(Unit { dimension, factor: unit.factor.powi(exponent), offset: 0.0 })
    }

    fn symbol(&mut self) -> Result<Unit, UnitError> {
        let Some(first) = self.peek() else {
            return Err(self.error("a unit is missing; a number has the unit \"1\"".to_owned()));
        };
        let is_part = |c: char| c.is_alphabetic() || matches!(c, '°' | '%' | 'Ω' | 'µ');
        let rest = &self.text[self.at..];
        let end = match first {
            '1' | '-' => 1,
            _ => rest.find(|c| !is_part(c)).unwrap_or(rest.len()),
        };
        let name = &rest[..end];
        let Some(unit) = symbol(name) else {
            let known: Vec<&str> = DERIVED.iter().flat_map(|row| row.symbols.iter().copied()).collect();
            let near = nearest(name, &known).filter(|_| name.len() > 1);
            let near = near.map_or_else(String::new, |near| format!("; did you mean \"{near}\"?"));
            let name = if name.is_empty() { &rest[..first.len_utf8()] } else { name };
            return Err(self.error(format!("{} is not a unit{near}", quoted(name))));
        };
        self.at += end;
        Ok(unit)
    }

    fn exponent(&mut self) -> Result<i32, UnitError> {
        let is_negative = self.take(&['-']).is_some();
        let digit = self.peek().and_then(|c| c.to_digit(10)).and_then(|digit| i32::try_from(digit).ok());
        match digit.filter(|digit| (1..=EXPONENT_MAX).contains(digit)) {
            Some(digit) => {
                self.at += 1;
                Ok(if is_negative { -digit } else { digit })
            }
            None => Err(self.error(format!("an exponent from 1 to {EXPONENT_MAX} is expected"))),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::float_cmp, reason = "a test may stop; powers of ten are exact")]

    use super::*;

    #[test]
    fn units_have_the_dimensions_of_physics() {
        let of = |text: &str| parse_unit(text).unwrap();
        let same = [
            ("V*s/rad", "N*m/A"),
            ("N*m*s/rad", "kg*m^2/s"),
            ("ohm*A", "V"),
            ("H*A/s", "V"),
            ("Wb", "V*s"),
            ("W/(m*K)", "kg*m/(s^3*K)"),
            ("rpm", "1/s"),
            ("kg·m²", "Nm*s^2"),
            ("C", "A*s"),
            ("F*V", "C"),
        ];
        for (a, b) in same {
            assert_eq!(of(a).dimension, of(b).dimension, "{a} {b}");
        }
        assert_eq!([of("mH").factor, of("kg").factor, of("cNm").factor, of("µs").factor], [1e-3, 1.0, 1e-2, 1e-6]);
        assert_eq!(of("1/min").factor, 1.0 / 60.0);
        assert_eq!(of("degC").to(&of("K")), Some((1.0, 273.15)));
        assert_eq!(of("rpm").to(&of("rad/s")).unwrap().0, TURN / 60.0);
        assert_eq!(of("V").to(&of("A")), None);
        assert_eq!(of("K*rad").dimension.to_string(), "K");
        assert_eq!(of("kg*m^2").dimension.to_string(), "m^2*kg");
        assert_eq!(of("N*s/m").dimension.to_string(), "kg/s");
        assert_eq!(Dimension::TIME.power(1).unwrap().to_string(), "s^(1/2)");
        assert_eq!(Dimension::TIME.power(1).unwrap().power(1), None);
    }

    #[test]
    fn wrong_units_are_located() {
        for (text, at, message) in [
            ("", 0, "missing"),
            ("V*", 2, "missing"),
            ("N*mm*volt", 5, "\"volt\" is not a unit"),
            ("kg*m^9", 5, "exponent from 1 to 6"),
            ("W/(m*K", 6, "\")\" is missing"),
            ("V s", 2, "'s' is not expected"),
            ("((((((((V", 6, "nested"),
            ("\u{1f600}", 0, "is not a unit"),
        ] {
            let error = parse_unit(text).unwrap_err();
            assert!(error.at == at && error.message.contains(message), "{text}: {error:?}");
        }
        assert!(parse_unit(&"m*".repeat(100)).is_err());
    }
}
