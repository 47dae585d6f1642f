//! Detection of missing quantities in a table, and the error that suggests how to name them.

use super::headings::{Heading, listed};
use super::parse::parse_number;
use super::request::name_of;
use super::spec::Need;
use crate::heading::Quantity;
use motorfit_core::Error;
use motorfit_core::setting::{Text, text};

/// Returns the missing quantities by their canonical headings. Without a voltage, the current is the input and the speed the
/// output, unless `drives` is true because an unused column looks like a voltage.
pub(super) fn missing(has: &dyn Fn(Quantity) -> bool, need: Need, drives: bool, timed: bool) -> Vec<&'static str> {
    let moves = has(Quantity::Speed) || has(Quantity::Position);
    let output = || has(Quantity::Current) || moves;
    let mut missing = Vec::new();
    if !has(Quantity::Time) && !timed {
        missing.push("time_s");
    }
    if !has(Quantity::Voltage) && need != Need::Part {
        match (need == Need::Recording && !drives, has(Quantity::Current), moves) {
            (true, true, true) => {}
            (true, true, false) => missing.push("voltage_V or speed_rad_s"),
            (true, false, true) => missing.push("voltage_V or current_A"),
            _ => missing.push("voltage_V"),
        }
    }
    if need == Need::Recording && !output() {
        missing.push("current_A or speed_rad_s");
    }
    if need == Need::Part && !(output() || has(Quantity::Voltage) || has(Quantity::Torque)) {
        missing.push("voltage_V, current_A or speed_rad_s");
    }
    missing
}

/// Returns the error for a table that lacks quantities; `named` is a suggested request, which replaces the general hint.
pub(super) fn lacking(headings: &[Heading], missing: &[&str], named: Option<Text>) -> Error {
    if headings.iter().all(|h| parse_number(&h.name, true).is_ok()) {
        let hint = text!(
            "Put a heading above the rows, or name the columns by their numbers: "
            [Columns = "time=#N:UNIT,voltage=#N:UNIT,current=#N:UNIT,speed=#N:UNIT"] "; without a time column give " [Rate = "HZ"] "."
        );
        return Error::data("found numbers, expected a heading", hint);
    }
    let is_named = named.is_some();
    let mut hint = named.unwrap_or_else(|| {
        text!(
            "Rename the headings (time_s,voltage_V,current_A,speed_rad_s) or name them: "
            [Columns = "time=HEADING:UNIT,voltage=HEADING:UNIT,current=HEADING:UNIT,speed=HEADING:UNIT"] "."
        )
    });
    if missing.contains(&"time_s") && !is_named {
        hint.push(text!(" Without a time column give " [Rate = "HZ"] "."));
    }
    let drive = headings.iter().find(|heading| is_drive(heading));
    if let Some(heading) = drive.filter(|_| missing.iter().any(|m| m.starts_with("voltage_V"))) {
        let name = name_of(&heading.name);
        let in_volts = heading.unit_of(Quantity::Voltage);
        let ticks = if heading.unit.as_deref() == Some("%") { "12/100" } else { "12/255" };
        hint.push(match (is_named, in_volts) {
            (true, Some(_)) => Text::default(),
            (false, Some(unit)) => text!(" The voltage may be {name}: " [Columns = "voltage={name}:{unit}"] "."),
            (true, None) => text!(" A flag is converted by its two voltages (" [Columns = "voltage={name}:0..12"] ")."),
            (false, None) => text!(
                " A duty cycle or PWM ticks are converted to volts by operations (" [Columns = "voltage={name}*{ticks}:V"] "), \
                 a flag by its two voltages (" [Columns = "voltage={name}:0..12"] ")."
            ),
        });
        if missing == ["voltage_V"] {
            hint.push(text!(
                " If {name} does not drive the motor, declare that there is no voltage: " [Columns = "voltage=-"] "."
            ));
        }
    } else if missing.contains(&"voltage_V or speed_rad_s") {
        hint.push(" A current alone identifies nothing: it takes a voltage for R and L, or a speed for the mechanical parameters.");
    } else if missing.contains(&"voltage_V or current_A") {
        hint.push(" A speed alone identifies nothing: its input, a voltage or a current, is needed.");
    }
    Error::data(format!("no column for {}; the heading has {}", missing.join(" and "), listed(headings)), hint)
}

/// Returns true if a heading looks like the input of a motor: by a word such as `pwm`, or by a unit of voltage.
pub(super) fn is_drive(heading: &Heading) -> bool {
    const WORDS: [&str; 12] = [
        "pwm", "duty", "ciclo", "cyclique", "tastgrad", "tastverh", "throttle", "command", "degrau", "step", "flag",
        "volt",
    ];
    let name = heading.name.to_lowercase();
    let in_volts = |name: &str| {
        let name = name.trim_end_matches([')', ']']);
        let stands_apart = |rest: &str| rest.ends_with(['_', '[', '(', ' ']);
        ["v", "mv", "kv"].into_iter().any(|unit| name.strip_suffix(unit).is_some_and(stands_apart))
    };
    let unit = heading.unit.as_ref().map(|unit| format!("[{}", unit.to_lowercase()));
    WORDS.iter().any(|word| name.contains(word)) || in_volts(&name) || unit.is_some_and(|unit| in_volts(&unit))
}
