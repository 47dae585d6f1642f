//! Tests in a log: routines of a mechanism whose state, such as `dynamic-forward`, is logged as a text.

use super::log_columns::name as full_name;
use super::track::median_step;
use motorfit_core::setting::text;
use motorfit_core::text::{listed, quoted};
use motorfit_core::{Error, Result};
use motorfit_logs::{Channel, Log, NO_TEST, Series, States, TESTS};

/// Largest number of tests of a routine that are read.
pub(super) const TESTS_MAX: usize = 200;
/// Beginning of the name of an entry with the state of a routine.
const PREFIX: &str = "sysid-test-state-";

/// A test: its name and the times between which it ran.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Test {
    pub name: String,
    pub from_s: f64,
    pub to_s: f64,
}

/// The tests of a mechanism.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Routine {
    /// Name of the mechanism, or of the entry with the states.
    pub name: String,
    pub tests: Vec<Test>,
}

/// The part of a log that is read.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Scope {
    /// Routine whose tests are the recordings; `None` for the complete log.
    pub routine: Option<Routine>,
    /// Text in the names of the channels of a motor.
    pub motor: Option<String>,
    /// True if that text is the name of a channel.
    is_channel: bool,
    /// End of the names of the routine's channels.
    suffix: Option<String>,
    /// Longer ends of the names of channels of other routines.
    others: Vec<String>,
}

impl Scope {
    /// Selects the part of a log that `sheet` names: `MECHANISM`, `MECHANISM:MOTOR` or a text in the names of channels.
    ///
    /// # Errors
    /// Returns `Data` if the log has the tests of several mechanisms or motors and none is named, or the named one is missing.
    pub(super) fn of(log: &dyn Log, sheet: Option<&str>) -> Result<Self> {
        let routines = routines(log);
        let names: Vec<String> = routines.iter().map(|routine| quoted(&routine.name)).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let named = |sheet: &str| {
            let of = |routine: &&Routine| sheet == routine.name || sheet.starts_with(&format!("{}:", routine.name));
            let routine = routines.iter().filter(of).max_by_key(|routine| routine.name.len())?;
            Some((routine.clone(), sheet[routine.name.len()..].strip_prefix(':').map(str::to_owned)))
        };
        let (routine, motor) = match (sheet.and_then(&named), sheet, &routines[..]) {
            (Some((routine, motor)), ..) => (Some(routine), motor),
            (None, sheet, [only]) => (Some(only.clone()), sheet.map(str::to_owned)),
            (None, sheet, []) => (None, sheet.map(str::to_owned)),
            (None, sheet, [first, ..]) => {
                let all = format!("the tests of {} mechanisms: {}", routines.len(), listed(&names, "and"));
                let message = match sheet {
                    Some(sheet) => format!("no mechanism {}; the log holds {all}", quoted(sheet)),
                    None => format!("holds {all}"),
                };
                return Err(Error::data(message, text!("Choose one: " [Sheet = "{}", first.name] ".")));
            }
        };
        let end = routine.as_ref().map(|routine| format!("-{}", routine.name));
        let suffix = end.filter(|end| log.channels().iter().any(|channel| channel.name.ends_with(end)));
        // Channels of another mechanism may end alike: those of swerve-drive also end with -drive.
        let others = suffix.iter().flat_map(|own| {
            let ends = routines.iter().map(|other| format!("-{}", other.name));
            ends.filter(move |end| end.len() > own.len() && end.ends_with(own))
        });
        let others = others.collect();
        let is_channel =
            motor.as_ref().is_some_and(|motor| log.channels().iter().any(|channel| channel.name == *motor));
        let scope = Self { routine, motor, is_channel, suffix, others };
        scope.check_motor(log)?;
        Ok(scope)
    }

    /// Returns true if a channel has a field that belongs to the part.
    pub(super) fn has(&self, channel: &Channel) -> bool {
        channel.fields.iter().any(|field| self.takes(channel, &field.path))
    }

    /// Returns true if a field of a channel belongs to the part.
    pub(super) fn takes(&self, channel: &Channel, path: &str) -> bool {
        let name = channel.name.as_str();
        let Some(suffix) = &self.suffix else {
            return match &self.motor {
                None => true,
                Some(motor) if self.is_channel => name == motor,
                Some(motor) => has_word(&full_name(channel, path), motor),
            };
        };
        let Some(own) = name.strip_suffix(suffix.as_str()) else { return false };
        let is_of_other = self.others.iter().any(|other| name.ends_with(other));
        // WPILib names an entry by its quantity, its motor and its mechanism.
        let of_motor = |motor: &String| own.split_once('-').is_some_and(|(_, named)| named == motor);
        !is_of_other && self.motor.as_ref().is_none_or(of_motor)
    }

    /// Returns true if the channels of the part are known by their names.
    pub(super) fn is_named(&self) -> bool {
        self.suffix.is_some() || self.motor.is_some()
    }

    /// Checks that the part has channels, and is of one motor.
    fn check_motor(&self, log: &dyn Log) -> Result<()> {
        let channels = || log.channels().iter().filter(|channel| self.has(channel));
        if let Some(motor) = self.motor.as_ref().filter(|_| channels().next().is_none()) {
            let fields = |channel: &Channel| {
                channel.fields.iter().map(|field| full_name(channel, &field.path)).collect::<Vec<_>>()
            };
            let all: Vec<String> = log.channels().iter().flat_map(fields).take(20).collect();
            let all: Vec<&str> = all.iter().map(String::as_str).collect();
            let message = format!("no channel has {} in its name; there are {}", quoted(motor), listed(&all, "and"));
            return Err(Error::data(message, text!("Correct " [Sheet] ", or leave it out.")));
        }
        let Some((suffix, routine)) = self.suffix.as_ref().zip(self.routine.as_ref()) else { return Ok(()) };
        let motor = |channel: &Channel| Some(channel.name.strip_suffix(suffix)?.strip_prefix("voltage-")?.to_owned());
        let motors: Vec<String> = channels().filter_map(motor).collect();
        if let [first, _, ..] = &motors[..] {
            let names: Vec<&str> = motors.iter().map(String::as_str).collect();
            let (count, names) = (motors.len(), listed(&names, "and"));
            let message = format!("{} has {count} motors: {names}", quoted(&routine.name));
            return Err(Error::data(message, text!("Choose one: " [Sheet = "{}:{first}", routine.name] ".")));
        }
        Ok(())
    }
}

/// Returns the routines whose tests are in a log.
fn routines(log: &dyn Log) -> Vec<Routine> {
    let of = |states: &States| {
        let last = states.name.rsplit('/').next().unwrap_or_default();
        let name = last.strip_prefix(PREFIX).unwrap_or(states.name.trim_start_matches('/'));
        Routine { name: name.to_owned(), tests: tests_of(states) }
    };
    let mut all: Vec<Routine> = Vec::new();
    for routine in log.states().iter().map(of).filter(|routine| !routine.tests.is_empty()) {
        // A copy of the states on another topic, as by NetworkTables, is the same routine.
        if !all.iter().any(|known| is_copy(&known.tests, &routine.tests)) {
            all.push(routine);
        }
    }
    all
}

/// Largest difference between the times of two copies of a state \[s\].
const COPY_S: f64 = 0.1;

/// Returns true if two lists of tests are the same, up to a delay.
fn is_copy(a: &[Test], b: &[Test]) -> bool {
    let is_same = |(a, b): (&Test, &Test)| a.name == b.name && (a.from_s - b.from_s).abs() < COPY_S;
    a.len() == b.len() && a.iter().zip(b).all(is_same)
}

/// Returns the tests of an entry: each from its state to the next one. A test that ran again is numbered.
fn tests_of(states: &States) -> Vec<Test> {
    let mut tests: Vec<Test> = Vec::new();
    let mut runs = [0; TESTS.len()];
    for (n, (from_s, state)) in states.changes.iter().enumerate().filter(|(_, (_, state))| state != NO_TEST) {
        let Some(at) = TESTS.iter().position(|test| test == state).filter(|_| tests.len() < TESTS_MAX) else {
            continue;
        };
        let to_s = states.changes.get(n + 1).map_or(f64::INFINITY, |(time, _)| *time);
        runs[at] += 1;
        let name = if runs[at] == 1 { state.clone() } else { format!("{state}, run {}", runs[at]) };
        tests.push(Test { name, from_s: *from_s, to_s });
    }
    tests
}

/// Returns the name of a test without the number of its run.
pub(super) fn base(name: &str) -> &str {
    name.split(", run").next().unwrap_or(name)
}

/// Returns the test of a part of a file, such as `dynamic-forward, run 2`, or `fast-forward` of older files; `None` if the part is
/// no test.
#[must_use]
pub fn test_of(part: &str) -> Option<&'static str> {
    /// Names of the tests in the files of SysId before 2024, in the order of [`TESTS`].
    const OLD: [&str; 4] = ["slow-forward", "slow-backward", "fast-forward", "fast-backward"];
    let name = part.split(", ").next().unwrap_or(part);
    let at = TESTS.iter().position(|test| *test == name).or_else(|| OLD.iter().position(|test| *test == name))?;
    TESTS.get(at).copied()
}

/// Returns notes on tests that a routine lacks or that ran several times.
pub(super) fn notes(routine: &Routine) -> Vec<String> {
    let runs = |test: &str| routine.tests.iter().filter(|own| base(&own.name) == test).count();
    let missing = TESTS.iter().filter(|test| runs(test) == 0).map(|test| format!("test {test} is missing"));
    let repeated = TESTS.iter().filter(|test| runs(test) > 1);
    missing.chain(repeated.map(|test| format!("test {test} ran {} times", runs(test)))).collect()
}

/// Returns true if a name has a word, with nothing alphanumeric beside it: the 1 of `motor-1`, not of `motor-10`.
fn has_word(name: &str, word: &str) -> bool {
    let is_apart = |(at, _): (usize, &str)| {
        let before = name[..at].chars().next_back().is_none_or(|c| !c.is_alphanumeric());
        before && name[at + word.len()..].chars().next().is_none_or(|c| !c.is_alphanumeric())
    };
    name.match_indices(word).any(is_apart)
}

/// Returns the samples of a test in each series. A robot may log the values of a period before the state, so that a test begins half
/// a period early. If values are logged when they change, the last one before the test holds from its start.
pub(super) fn cut(all: &[Series], test: &Test, holds: bool) -> Vec<Series> {
    let range = |series: &Series, early: f64| {
        let from = series.time_s.partition_point(|t| *t < test.from_s - early);
        from..series.time_s.partition_point(|t| *t < test.to_s - early).max(from)
    };
    let steps = all.iter().map(|series| median_step(&series.time_s[range(series, 0.0)]));
    let shortest = steps.fold(f64::INFINITY, f64::min);
    let early = if shortest.is_finite() { 0.5 * shortest } else { 0.0 };
    let one = |series: &Series| {
        let range = range(series, early);
        let mut cut = Series {
            time_s: series.time_s[range.clone()].to_vec(),
            columns: series.columns.iter().map(|column| column[range.clone()].to_vec()).collect(),
        };
        let starts_late = cut.time_s.first().is_none_or(|first| first - test.from_s > 1.5 * shortest);
        if holds && starts_late && range.start > 0 {
            cut.time_s.insert(0, test.from_s);
            for (column, all) in cut.columns.iter_mut().zip(&series.columns) {
                column.insert(0, all[range.start - 1]);
            }
        }
        cut
    };
    all.iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_lasts_from_its_state_to_the_next() {
        let change = |time: f64, state: &str| (time, state.to_owned());
        let states = States {
            name: "/RealOutputs/Drive/SysIdState".to_owned(),
            changes: vec![
                change(1.0, "quasistatic-forward"),
                change(2.0, NO_TEST),
                change(3.0, "dynamic-forward"),
                change(4.0, NO_TEST),
                change(5.0, "dynamic-forward"),
            ],
        };
        let routine = Routine { name: "drive".to_owned(), tests: tests_of(&states) };
        let named = |name: &str, from_s, to_s| Test { name: name.to_owned(), from_s, to_s };
        assert_eq!(
            routine.tests,
            [
                named("quasistatic-forward", 1.0, 2.0),
                named("dynamic-forward", 3.0, 4.0),
                named("dynamic-forward, run 2", 5.0, f64::INFINITY)
            ]
        );
        let notes = notes(&routine);
        assert_eq!(
            notes,
            [
                "test quasistatic-reverse is missing",
                "test dynamic-reverse is missing",
                "test dynamic-forward ran 2 times"
            ]
        );
    }

    #[test]
    fn the_value_before_a_test_holds_in_logs_of_changes() {
        let series = Series { time_s: vec![0.0, 5.0, 5.1, 5.2], columns: vec![vec![1.0, 2.0, 3.0, 4.0]] };
        let test = Test { name: "dynamic-forward".to_owned(), from_s: 4.0, to_s: 5.15 };
        let held = cut(std::slice::from_ref(&series), &test, true).remove(0);
        assert_eq!((held.time_s, &held.columns[0][..]), (vec![4.0, 5.0, 5.1], &[1.0, 2.0, 3.0][..]));
        assert_eq!(cut(std::slice::from_ref(&series), &test, false)[0].time_s, [5.0, 5.1]);
    }

    #[test]
    fn one_value_in_a_test_holds_from_its_start_in_logs_of_changes() {
        let battery = Series { time_s: vec![0.0, 4.8], columns: vec![vec![12.0, 11.5]] };
        let times: Vec<f64> = (0..50).map(|n| 4.0 + 0.02 * f64::from(n)).collect();
        let speed = Series { columns: vec![times.clone()], time_s: times };
        let test = Test { name: "dynamic-forward".to_owned(), from_s: 4.0, to_s: 5.0 };
        let held = cut(&[battery, speed], &test, true);
        assert_eq!((&held[0].time_s[..], &held[0].columns[0][..]), (&[4.0, 4.8][..], &[12.0, 11.5][..]));
        assert_eq!(held[1].time_s.len(), 50);
    }

    #[test]
    fn a_test_begins_half_a_period_before_its_state() {
        let times: Vec<f64> = (0..10).map(|n| 0.02 * f64::from(n)).collect();
        let series = [Series { columns: vec![times.clone()], time_s: times }];
        let test = Test { name: "dynamic-forward".to_owned(), from_s: 0.0401, to_s: 0.1001 };
        assert_eq!(cut(&series, &test, false)[0].time_s, [0.04, 0.06, 0.08]);
    }

    #[test]
    fn words_of_names_stand_apart() {
        assert!(has_word("Phoenix6/TalonFX-1/Velocity", "TalonFX-1"));
        assert!(!has_word("Phoenix6/TalonFX-10/Velocity", "TalonFX-1"));
        assert!(has_word("/Drive/Module0/Velocity", "Module0") && !has_word("/Drive/Module0/Velocity", "Module"));
    }
}
