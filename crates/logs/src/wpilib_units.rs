//! Names of units in logs of robots, such as `Rotation per Second` or `meters_per_second`, as symbols.

/// Symbols of units with their names in lower case, in the singular.
const NAMES: [(&str, &[&str]); 14] = [
    ("V", &["volt", "v"]),
    ("A", &["ampere", "amp", "a"]),
    ("turn", &["rotation", "turn", "revolution", "rot", "rev"]),
    ("rad", &["radian", "rad"]),
    ("deg", &["degree", "deg"]),
    ("m", &["meter", "metre", "m"]),
    ("cm", &["centimeter", "centimetre", "cm"]),
    ("mm", &["millimeter", "millimetre", "mm"]),
    ("ft", &["foot", "feet", "ft"]),
    ("in", &["inch", "inche", "in"]),
    ("s", &["second", "sec", "s"]),
    ("ms", &["millisecond", "ms"]),
    ("min", &["minute", "min"]),
    ("rpm", &["rpm", "rotation per minute", "revolution per minute", "rotations per minute", "revolutions per minute"]),
];

/// Returns the symbol of a unit that is written in words; `None` if a word is not known.
///
/// `Meter per Second` is `m/s`, `rotations_per_second` is `turn/s`.
pub(crate) fn symbol(name: &str) -> Option<String> {
    let name = name.trim().replace('_', " ").to_lowercase();
    let known = |word: &str| {
        let word = word.trim();
        let is = |names: &&(&str, &[&str])| {
            names.1.contains(&word) || word.strip_suffix('s').is_some_and(|one| names.1.contains(&one))
        };
        NAMES.iter().find(is).map(|(symbol, _)| *symbol)
    };
    if let Some(symbol) = known(&name) {
        return Some(symbol.to_owned());
    }
    let parts: Option<Vec<&str>> = name.replace(" per ", "/").split('/').map(known).collect();
    parts.map(|parts| parts.join("/"))
}

/// Splits a name in camel case at its capitals and underscores, and takes the unit in words off its end:
/// `DriveVelocityRadPerSec` gives `Drive Velocity` and `rad/s`.
pub fn split(name: &str) -> (String, Option<String>) {
    let mut words: Vec<String> = Vec::new();
    let mut before = ' ';
    for c in name.chars() {
        let begins = !c.is_alphanumeric() || (c.is_uppercase() && !before.is_uppercase()) || words.is_empty();
        if begins {
            words.push(String::new());
        }
        if c.is_alphanumeric()
            && let Some(word) = words.last_mut()
        {
            word.push(c);
        }
        before = c;
    }
    words.retain(|word| !word.is_empty());
    for count in [3, 1] {
        // At least one word remains as the name.
        let Some(at) = words.len().checked_sub(count).filter(|at| *at > 0) else { continue };
        let unit = words[at..].join(" ");
        let is_letter = unit.len() < 2;
        if let Some(symbol) = symbol(&unit).filter(|_| !is_letter) {
            return (words[..at].join(" "), Some(symbol));
        }
    }
    (words.join(" "), None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_units_become_symbols() {
        for (name, expected) in [
            ("Volt", "V"),
            ("volts", "V"),
            ("Rotation per Second", "turn/s"),
            ("Meter per Second", "m/s"),
            ("meters_per_second", "m/s"),
            ("turns_per_second", "turn/s"),
            ("rad/s", "rad/s"),
            ("Rotations per Minute", "rpm"),
            ("Rotation per Minute", "rpm"),
            ("RPM", "rpm"),
            ("Inches", "in"),
            ("Feet", "ft"),
            ("Degree", "deg"),
        ] {
            assert_eq!(symbol(name).as_deref(), Some(expected), "{name}");
        }
        assert_eq!(symbol("furlong per fortnight"), None);
        assert_eq!(symbol(""), None);
    }

    #[test]
    fn names_in_camel_case_are_split() {
        let of = |name| {
            let (words, unit) = split(name);
            format!("{words}|{}", unit.unwrap_or_default())
        };
        assert_eq!(of("DriveVelocityRadPerSec"), "Drive Velocity|rad/s");
        assert_eq!(of("AppliedVolts"), "Applied|V");
        assert_eq!(of("MotorPositionRotations"), "Motor Position|turn");
        assert_eq!(of("MotorVelocityRPM"), "Motor Velocity|rpm");
        assert_eq!(of("voltage-left-drive"), "voltage left drive|");
        assert_eq!(of("velocity_m"), "velocity m|", "a letter alone may be a name");
        assert_eq!(of("position"), "position|");
    }
}
