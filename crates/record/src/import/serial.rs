//! Logs of serial monitors: time stamps before each line, and rows of `key:value` pairs instead of a table.
//!
//! `14:03:00.018 -> t:18 pwm:0 rpm:2` is a row with the columns t, pwm and rpm. The time stamp is that of the monitor and is
//! dropped.

use super::parse::{Separator, parse_number};
use super::text::{Line, Lines};
use motorfit_core::Result;
use motorfit_core::text::excerpt;

/// Number of lines at the start of a file that are searched for rows of pairs.
const AHEAD: usize = 20;
/// Largest number of pairs of a row.
const PAIRS_MAX: usize = 1000;

/// Form of the lines of a serial monitor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Monitor {
    /// True if a time stamp precedes each line.
    stamped: bool,
    /// Keys of the pairs in their order; empty if the rows are those of a table.
    keys: Vec<String>,
}

impl Monitor {
    /// Detects the form of the lines from the first bytes of a file; `None` for a plain table.
    pub(super) fn of(head: &[u8]) -> Option<Self> {
        let text = String::from_utf8_lossy(head);
        let lines =
            || text.lines().map(|line| line.trim_start_matches('\u{feff}')).filter(|line| !line.trim().is_empty());
        let stamped = lines().next().is_some_and(|line| unstamped(line).len() < line.len());
        let row = |line: &str| {
            let pairs = pairs(unstamped(line));
            let numbers = pairs.iter().filter(|(_, value)| parse_number(value, false).is_ok()).count();
            (pairs.len() > 1 && numbers == pairs.len())
                .then(|| pairs.iter().map(|(key, _)| (*key).to_owned()).collect())
        };
        // A table may follow pairs that describe it, so that more than half of the lines must have these keys.
        let keys: Vec<String> = lines().take(AHEAD).find_map(row).unwrap_or_default();
        let alike = lines().take(AHEAD).filter(|line| row(line).is_some_and(|row: Vec<String>| row == keys)).count();
        let keys = if 2 * alike > lines().take(AHEAD).count() { keys } else { Vec::new() };
        (stamped || !keys.is_empty()).then_some(Self { stamped, keys })
    }

    /// Returns the separator of cells if rows are pairs; otherwise it is unknown.
    pub(super) fn separator(&self) -> Option<Separator> {
        (!self.keys.is_empty()).then_some(Separator::Sign(b'\t'))
    }

    /// Returns the values of a row of pairs separated by tabs; any other line becomes a single cell.
    fn row(&self, line: &str) -> String {
        let pairs = pairs(line);
        if pairs.is_empty() {
            return line.trim().replace('\t', " ");
        }
        let value = |key: &String| pairs.iter().find(|(k, _)| k == key).map_or("", |(_, value)| *value);
        let others: Vec<&str> =
            pairs.iter().filter(|(k, _)| !self.keys.iter().any(|key| key == k)).map(|p| p.1).collect();
        self.keys.iter().map(value).chain(others).collect::<Vec<_>>().join("\t")
    }
}

/// Returns a line without the time stamp of a monitor, `14:03:00.018 -> `.
fn unstamped(line: &str) -> &str {
    let Some((stamp, rest)) = line.split_once("->") else { return line };
    let stamp = stamp.trim();
    let is_clock =
        stamp.contains(':') && stamp.len() < 30 && stamp.bytes().all(|b| b.is_ascii_digit() || b":.,-/ T".contains(&b));
    if is_clock { rest.trim_start() } else { line }
}

/// Returns the pairs of a line; empty if the line has anything else.
fn pairs(line: &str) -> Vec<(&str, &str)> {
    const BETWEEN: [char; 4] = [' ', '\t', ',', ';'];
    let mut found = Vec::new();
    let mut rest = line.trim_matches(BETWEEN);
    while !rest.is_empty() {
        let Some(at) = rest.find([':', '=']) else { return Vec::new() };
        let key = rest[..at].trim();
        let is_name = key.starts_with(|c: char| c.is_alphabetic() || c == '_') && !key.contains([',', ';', '\t', '"']);
        let value = rest[at + 1..].trim_start();
        let end = value.find(BETWEEN).unwrap_or(value.len());
        if !is_name || found.len() >= PAIRS_MAX {
            return Vec::new();
        }
        found.push((key, &value[..end]));
        rest = value[end..].trim_matches(BETWEEN);
    }
    found
}

/// Lines of a serial monitor, converted to lines of a table.
pub(super) struct SerialLines<'a, L> {
    lines: L,
    monitor: &'a Monitor,
    begun: bool,
    text: String,
    /// First line, which follows the generated heading.
    first: Option<(u64, String)>,
}

impl<'a, L: Lines> SerialLines<'a, L> {
    pub(super) fn new(lines: L, monitor: &'a Monitor) -> Self {
        Self { lines, monitor, begun: false, text: String::new(), first: None }
    }

    /// Returns the underlying lines.
    pub(super) fn into_inner(self) -> L {
        self.lines
    }
}

impl<L: Lines> Lines for SerialLines<'_, L> {
    fn next_line(&mut self) -> Result<Option<Line<'_>>> {
        let has_pairs = !self.monitor.keys.is_empty();
        if let Some((number, text)) = self.first.take() {
            self.text = text;
            return Ok(Some(Line { number, bytes: self.text.as_bytes() }));
        }
        let Some(line) = self.lines.next_line()? else { return Ok(None) };
        let number = line.number;
        // A line that is not text is passed on, and refused or skipped as in any other file.
        let Ok(text) = line.text() else {
            self.text = String::from_utf8_lossy(line.bytes).into_owned();
            return Ok(Some(Line { number, bytes: self.text.as_bytes() }));
        };
        let bare = if self.monitor.stamped { unstamped(&text) } else { &text };
        let row = match has_pairs && !bare.trim().is_empty() {
            true => self.monitor.row(bare),
            false => bare.to_owned(),
        };
        if !has_pairs || self.begun {
            self.text = row;
            return Ok(Some(Line { number, bytes: self.text.as_bytes() }));
        }
        self.begun = true;
        self.first = Some((number, row));
        self.text = self.monitor.keys.join("\t");
        Ok(Some(Line { number, bytes: self.text.as_bytes() }))
    }

    fn is_open(&self) -> bool {
        self.lines.is_open()
    }
}

impl Monitor {
    /// Returns the note on the conversion of the lines.
    pub(super) fn note(&self) -> String {
        match (self.keys.is_empty(), self.stamped) {
            (true, _) => "time stamps of a serial monitor before the lines left out".to_owned(),
            (false, stamped) => {
                let keys: Vec<String> = self.keys.iter().take(20).map(|key| excerpt(key)).collect();
                let stamps = if stamped { "; time stamps of a serial monitor left out" } else { "" };
                format!("rows of KEY:VALUE read as columns {}{stamps}", keys.join(", "))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_and_other_lines() {
        assert_eq!(pairs("t:0 pwm:0 rpm:-1.5"), [("t", "0"), ("pwm", "0"), ("rpm", "-1.5")]);
        assert_eq!(pairs("t = 3, motor speed: 4;"), [("t", "3"), ("motor speed", "4")]);
        for none in ["", "1,2,3", "t:0 4", "12:00:00,1", "time [s],u", "\"a\":1", "t:1,\"b\":2", "::", "a", "t:0 \u{0}"]
        {
            assert!(pairs(none).is_empty(), "{none}");
        }
        assert_eq!(unstamped("14:03:00.018 -> 1,2"), "1,2");
        assert_eq!(unstamped("a -> b"), "a -> b");
        assert_eq!(Monitor::of(b"time_s,voltage_V\n0,1\n"), None);
        assert!(
            Monitor::of(b"Booting\n\nt:1 u:2\nt:2 u:3\n")
                .is_some_and(|monitor| monitor.keys == ["t", "u"] && !monitor.stamped)
        );
    }
}
