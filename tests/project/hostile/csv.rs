//! Proves: 100,000 random malformed recordings as text are read completely, or rejected with the file and a remedy.

use motorfit::record::{BadRows, Gaps, ReadOptions, Record, parse_columns, read_bytes};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::path::Path;

const HEADINGS: [&str; 24] = [
    "time",
    "time_s",
    "t [ms]",
    "Timestamp (us)",
    "voltage",
    "voltage_V",
    "V",
    "u [mV]",
    "pwm",
    "current",
    "i_A",
    "I [mA]",
    "speed",
    "rpm",
    "omega_rad_s",
    "position [deg]",
    "torque",
    "",
    "\"a,b\"",
    "\"",
    "speed",
    "é",
    "\u{202e}x",
    "1.5",
];
const CELLS: [&str; 28] = [
    "",
    " ",
    "nan",
    "NaN",
    "inf",
    "-inf",
    "1e999",
    "-1e-999",
    "1,5",
    "1.5",
    "1'000.5",
    "1 000",
    "0x1F",
    "--1",
    "+1",
    "1e",
    "\"1\"",
    "\"1",
    "'2'",
    "12:30:00.5",
    "2024-01-01T00:00:00Z",
    "true",
    "1_000",
    "1.2.3",
    "\u{2212}1",
    "\0",
    "é",
    "1e9",
];
const COLUMNS: [&str; 12] = [
    "",
    "",
    "time=#1,voltage=#2,speed=#3:rpm",
    "time=#1:8kHz,voltage=#2*12/255:V,current=#3",
    "voltage=#2:0..12,speed=#9",
    "time=#1,voltage=sin(#2)/(#3-1),speed=cumsum(#3)",
    "position=int16(#3):turns,voltage=#2",
    "time=#2,time=#1",
    "time=time,voltage=voltage,speed=rpm",
    "current=#3*-1+0.5:mA,voltage=#2,time=#1:ms",
    "speed=abs(#2)/0,voltage=#1",
    "load_torque=sin(position),position=#3,voltage=#2",
];

struct Maker(Xoshiro256PlusPlus);

impl Maker {
    fn below(&mut self, count: usize) -> usize {
        self.0.random_range(0..count)
    }

    fn one<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.below(of.len())]
    }

    fn once_in(&mut self, times: usize) -> bool {
        self.below(times) == 0
    }

    /// Returns a time that increases in most rows.
    fn time(&mut self, row: usize) -> String {
        match self.below(60) {
            0 => "0".to_owned(),
            1 => format!("{}", row * 1_000_000),
            2 => format!("-{row}"),
            _ => format!("{:.3}", 0.001 * motorfit::numeric::count(row)),
        }
    }

    fn text(&mut self) -> Vec<u8> {
        let separator = self.one(&[",", ",", ",", ";", "\t", " ", "|", ", "]);
        let end = self.one(&["\n", "\n", "\r\n", "\r", "\n\n", "\n# note\n"]);
        let (width, rows, odd) = (1 + self.below(5), self.below(12), [3, 20, 1000][self.below(3)]);
        let mut text = String::new();
        if self.once_in(10) {
            text.push_str(self.one(&[
                "\u{feff}",
                "sep=;\n",
                "# logged\n",
                "14:03:00 -> ",
                "{",
                "[1,2]\n",
                "PK\u{3}\u{4}",
            ]));
        }
        if !self.once_in(8) {
            let plain = ["time", "voltage", "speed", "current", "torque"];
            let heads: Vec<&str> =
                (0..width).map(|n| if self.once_in(odd.min(20)) { self.one(&HEADINGS) } else { plain[n] }).collect();
            text.push_str(&heads.join(separator));
            text.push_str(end);
        }
        for row in 0..rows {
            let count = if self.once_in(odd) { self.below(9) } else { width };
            let cells: Vec<String> = (0..count)
                .map(|n| match n {
                    _ if self.once_in(odd) => self.one(&CELLS).to_owned(),
                    0 => self.time(row),
                    _ => format!("{:.2}", self.0.random_range(-20.0..20.0)),
                })
                .collect();
            text.push_str(&cells.join(separator));
            text.push_str(end);
        }
        self.encoded(text)
    }

    fn encoded(&mut self, text: String) -> Vec<u8> {
        let mut bytes = match self.below(20) {
            0 => [0xff, 0xfe].into_iter().chain(text.encode_utf16().flat_map(u16::to_le_bytes)).collect(),
            1 => text.encode_utf16().flat_map(u16::to_be_bytes).collect(),
            _ => text.into_bytes(),
        };
        if self.once_in(10) && !bytes.is_empty() {
            let at = self.below(bytes.len());
            bytes[at] = self.0.random();
        }
        if self.once_in(20) {
            bytes.truncate(self.below(bytes.len() + 1));
        }
        bytes
    }

    fn options(&mut self) -> ReadOptions {
        ReadOptions {
            columns: parse_columns(self.one(&COLUMNS)).unwrap_or_default(),
            rate_hz: self.once_in(4).then_some(1000.0),
            gaps: Gaps::ALL[self.below(3)],
            bad_rows: BadRows::ALL[self.below(BadRows::ALL.len())],
            drop_repeats: self.once_in(3),
            ..ReadOptions::default()
        }
    }
}

/// Checks the invariants of a recording.
fn check(record: &Record) -> bool {
    let samples = record.samples();
    let finite = |(_, signal): (_, &[f64])| signal.len() == record.len() && signal.iter().all(|v| v.is_finite());
    samples.time_s.len() >= 2 && samples.time_s.windows(2).all(|t| t[0] < t[1]) && samples.signals().all(finite)
}

#[test]
fn odd_recordings_are_read_completely_or_rejected() {
    let path = Path::new("odd.csv");
    let mut maker = Maker(Xoshiro256PlusPlus::seed_from_u64(24));
    let (mut read, mut with_line) = (0, 0);
    for case in 0..100_000 {
        let (text, options) = (maker.text(), maker.options());
        let shown = || format!("case {case}: {:?} {options:?}", String::from_utf8_lossy(&text));
        let answer = std::panic::catch_unwind(|| read_bytes(&text, Some(path), &options));
        match answer.unwrap_or_else(|_| panic!("{}", shown())) {
            Ok(records) => {
                read += 1;
                assert!(!records.is_empty() && records.iter().all(check), "{}", shown());
            }
            Err(error) => {
                with_line += usize::from(error.line().is_some());
                assert!(error.path() == Some(path) && !error.hint().is_empty(), "{error}: {}", shown());
            }
        }
    }
    // Both outcomes occur, so the generator reaches the code behind headings and numbers.
    assert!(read > 2000 && with_line > 10_000, "{read} read, {with_line} refused at a line");
}
