//! Quantities that a table lacks, and the request that would name them.

use super::columns::{Heading, Need, listed};
use super::parse::parse_number;
use super::request::name_of;
use crate::Error;
use crate::record::heading::Quantity;
use crate::setting::{Text, text};

/// The quantities that are not there, by their canonical headings. A current drives a speed where there is no voltage,
/// unless some column looks like one.
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

/// The error of a table without some quantities; `named` are the words of a request that names its columns.
pub(super) fn lacking(headings: &[Heading], missing: &[&str], named: Option<Text>) -> Error {
    if headings.iter().all(|h| parse_number(&h.name, true).is_ok()) {
        let hint = text!(
            "Put a heading in front of the rows, or name columns by their numbers: "
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
        hint.push(match is_named {
            true => text!(" A flag becomes volts by its two voltages (" [Columns = "voltage={name}:0..12"] ")."),
            false => text!(
                " Duty or PWM ticks become volts by operations (" [Columns = "voltage={name}*12/255:V"] "), a flag by \
                 its two voltages (" [Columns = "voltage={name}:0..12"] ")."
            ),
        });
        if missing == ["voltage_V"] {
            hint.push(text!(" If it drives nothing, say so: " [Columns = "voltage=-"] "."));
        }
    } else if missing.contains(&"voltage_V or speed_rad_s") {
        hint.push(" A current alone tells nothing: with a voltage it gives R and L, with a speed the mechanical side.");
    } else if missing.contains(&"voltage_V or current_A") {
        hint.push(" A speed alone tells nothing: what drives it must be there.");
    }
    Error::data(format!("no column for {}; the heading has {}", missing.join(" and "), listed(headings)), hint)
}

/// Returns whether a heading looks like what drives a motor: by a word, or by a unit of volts.
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
