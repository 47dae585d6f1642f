//! The settings of the library, and texts that refer to them.
//!
//! Messages of the library contain no flag, key or keyword. They refer to a [`Setting`] or a [`Command`], and each front end
//! has its own [`Spelling`]: a flag on the command line, `fix = {K = …}` in a study, `fix="K=…"` in Python.

use crate::text::printable;
use std::fmt;

/// Syntax of the value of a setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// On or off.
    Switch,
    /// One number.
    Number,
    /// One word, or a text with a syntax of the setting.
    Word,
    /// Words separated by commas.
    List,
    /// `KEY=VALUE` pairs separated by commas.
    Values,
}

/// A setting of an identification, of the import of files or of a study. The constants are those that several crates refer to; a crate adds a
/// row of its own by [`Setting::new`], without a change here, which would compile everything again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Setting {
    name: &'static str,
    form: Form,
}

/// Defines the constants of the settings from one table: constant, name, form and description.
macro_rules! settings {
    ($($setting:ident $name:literal $form:ident $about:literal)*) => {
        #[allow(non_upper_case_globals, reason = "they are written like variants, in texts and in patterns")]
        impl Setting {
            $(#[doc = $about] pub const $setting: Self = Self::new($name, Form::$form);)*

            /// All settings that are constants here.
            pub const ALL: &[Self] = &[$(Self::$setting),*];
        }
    };
}

settings! {
    Columns "columns" Word "The quantities of columns, and their units."
    Rate "rate" Number "The sampling rate \\[Hz\\] of files without a time column; others are resampled to it."
    Sheet "sheet" Word "The sheet of a workbook."
    BadRows "bad_rows" Word "The treatment of rows that cannot be read."
    Gaps "gaps" Word "The treatment of gaps in time."
    DropRepeats "drop_repeats" Switch "True to skip rows that repeat the time of the row before."
    Crop "crop" Word "The time interval that is used."
    Offset "offset" Word "Sensor offsets to subtract."
    Mask "mask" List "Samples that are excluded from the cost."
    Decimate "decimate" Number "The factor N of decimation: every Nth sample is kept."
    Filter "filter" Word "A low-pass filter on all signals."
    Split "split" Number "The fraction of each recording that is fitted; the remainder is held out."
    Method "method" Word "The identification method."
    Methods "methods" List "The methods of a comparison or a study."
    Set "set" List "Tuning parameters of a method."
    Polish "polish" Word "The local refinement of the optimum."
    Population "population" Number "The number of candidates per generation."
    Generations "generations" Number "The number of generations of a search."
    Seed "seed" Number "The seed of the random numbers."
    Bounds "bounds" Values "Bounds of parameters."
    Fix "fix" Values "Parameters with a fixed value."
    Criterion "criterion" Word "The criterion that a search minimizes."
    Criteria "criteria" List "The criteria of a comparison."
    Transform "transform" List "The coordinates in which searches move their candidates."
    Scale "scale" Word "The divisor of the residuals of each channel."
    Noise "noise" Word "The measurement noise."
    TimeOrigin "time_origin" Number "The origin of time in time-weighted criteria \\[s\\]."
    Discretization "discretization" Word "The discretization of the motor model."
    Initial "initial" Word "The state at the first sample."
    With "with" List "Extensions of the motor."
    PerRecording "per_recording" List "Parameters that are estimated for each recording separately."
    Device "device" Word "The device that evaluates candidates."
    Precision "precision" Word "The floating-point precision of the evaluation."
    Evaluator "evaluator" Word "The evaluator of costs on the CPU."
    Threads "threads" Number "The number of threads."
    Runs "runs" Number "The number of runs of each method."
    Budgets "budgets" List "The budgets of a run in a suite \\[evaluations\\]."
    Target "target" Number "The cost at which a run counts as successful."
    Sample "sample" Word "Candidates sampled from the bounds."
    Slice "slice" List "The two parameters of a slice of the cost function."
    Parameters "parameters" Values "The parameters of a simulated motor."
    Start "start" Values "The starting point of a refinement."
    Input "input" Word "The input of a simulation."
    Duration "duration" Number "The duration of a simulation \\[s\\]."
    Period "period" Number "The sampling period \\[s\\]."
    Populations "populations" List "The population sizes of a benchmark."
    Samples "samples" List "The lengths of the recordings of a benchmark, in samples."
    Seconds "seconds" Number "The time budget of a benchmark \\[s\\]."
    Limits "limits" Values "Tolerances of parameters."
    Shard "shard" Word "The shard of a sweep."
    Out "out" Word "The folder for results."
}

impl Setting {
    /// Returns a setting: its name in lower case, words joined by underscores, and the syntax of its value.
    #[must_use]
    pub const fn new(name: &'static str, form: Form) -> Self {
        Self { name, form }
    }

    /// Returns the name in lower case, words joined by underscores.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.name
    }

    /// Returns the syntax of the value.
    #[must_use]
    pub const fn form(self) -> Form {
        self.form
    }

    /// Returns a reference to this setting with a value, either an example or the given one.
    pub fn to(self, value: impl Into<String>) -> Reference {
        Reference::Setting(self, Some(value.into()))
    }
}

/// An operation of the library that a hint may refer to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Identification.
    Identify,
    /// Inspection of recordings.
    Inspect,
    /// The list of devices.
    Devices,
    /// The planning of a sweep in a new folder.
    PlanSweep,
    /// The runs of a planned sweep.
    RunSweep,
}

/// A reference to a setting or an operation inside a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reference {
    /// A setting, optionally with a value.
    Setting(Setting, Option<String>),
    /// An operation.
    Command(Command),
}

/// Function of a front end that spells a reference.
pub type Spelling = fn(&Reference) -> String;

/// Spells a reference by the library's own names, such as `fix K=…`.
fn neutral(reference: &Reference) -> String {
    match reference {
        Reference::Setting(setting, None) => setting.name().to_owned(),
        Reference::Setting(setting, Some(value)) => format!("{} {value}", setting.name()),
        Reference::Command(command) => match command {
            Command::Identify => "identify",
            Command::Inspect => "inspect",
            Command::Devices => "the list of devices",
            Command::PlanSweep => "plan the study",
            Command::RunSweep => "run the plan",
        }
        .to_owned(),
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Part {
    Words(String),
    Reference(Reference),
}

/// A text with references to settings and operations. `Display` spells them by the library's own names.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Text(Vec<Part>);

impl Text {
    /// Returns the text with its references spelled by a front end.
    #[must_use]
    pub fn spelled(&self, spelling: Spelling) -> String {
        let word = |part: &Part| match part {
            Part::Words(words) => words.clone(),
            Part::Reference(reference) => spelling(reference),
        };
        self.0.iter().map(word).collect()
    }

    /// Returns the text with each reference for which `words` returns `Some` replaced by these words.
    #[must_use]
    pub fn respelled(&self, words: fn(&Reference) -> Option<String>) -> Self {
        let part = |part: &Part| match part {
            Part::Words(words) => Self::from(words.as_str()),
            Part::Reference(reference) => words(reference).map_or_else(|| reference.clone().into(), Self::from),
        };
        self.0.iter().map(part).fold(Self::default(), Self::and)
    }

    /// Appends another text.
    pub fn push(&mut self, more: impl Into<Self>) {
        for part in more.into().0 {
            match (self.0.last_mut(), part) {
                (Some(Part::Words(words)), Part::Words(more)) => words.push_str(&more),
                (_, part) => self.0.push(part),
            }
        }
    }

    /// Returns the text with another one appended.
    #[must_use]
    pub fn and(mut self, more: impl Into<Self>) -> Self {
        self.push(more);
        self
    }

    /// Returns the references to settings whose values are complete, without placeholders for the user to replace.
    pub fn steps(&self) -> impl Iterator<Item = &Reference> {
        const PLACEHOLDERS: [&str; 6] = ["HEADING", "UNIT", "VALUE", "MIN", "HZ", "\u{2026}"];
        self.0.iter().filter_map(|part| match part {
            Part::Reference(reference @ Reference::Setting(_, Some(value))) => {
                (!PLACEHOLDERS.iter().any(|placeholder| value.contains(placeholder))).then_some(reference)
            }
            _ => None,
        })
    }

    /// Returns true if the text is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the text free of control characters.
    #[must_use]
    pub(crate) fn printable(self) -> Self {
        let safe = |part| match part {
            Part::Words(words) => Part::Words(printable(&words)),
            Part::Reference(Reference::Setting(setting, value)) => {
                Part::Reference(Reference::Setting(setting, value.as_deref().map(printable)))
            }
            command @ Part::Reference(_) => command,
        };
        Self(self.0.into_iter().map(safe).collect())
    }
}

impl fmt::Display for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.spelled(neutral))
    }
}

impl serde::Serialize for Text {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl From<String> for Text {
    fn from(words: String) -> Self {
        Self(if words.is_empty() { Vec::new() } else { vec![Part::Words(words)] })
    }
}

impl From<&str> for Text {
    fn from(words: &str) -> Self {
        words.to_owned().into()
    }
}

impl From<&Self> for Text {
    fn from(text: &Self) -> Self {
        text.clone()
    }
}

impl From<Reference> for Text {
    fn from(reference: Reference) -> Self {
        Self(vec![Part::Reference(reference)])
    }
}

impl From<Setting> for Text {
    fn from(setting: Setting) -> Self {
        Reference::Setting(setting, None).into()
    }
}

/// Creates a [`Text`]. Literals and `(format, arguments)` are words, `[Setting]` and `[Setting = format, arguments]` refer
/// to a setting, `[Command::Name]` to an operation, and `{expression}` is any value that converts into a text:
/// `text!("{symbol} is at its bound; widen it with " [Bounds = "{symbol}=0.1:1"])`.
#[doc(hidden)]
#[macro_export]
macro_rules! __text {
    (@ $text:expr;) => { $text };
    (@ $text:expr; $words:literal $($rest:tt)*) => { $crate::setting::text!(@ $text.and(format!($words)); $($rest)*) };
    (@ $text:expr; ($($words:tt)+) $($rest:tt)*) => {
        $crate::setting::text!(@ $text.and(format!($($words)+)); $($rest)*)
    };
    (@ $text:expr; [Command::$command:ident] $($rest:tt)*) => {
        $crate::setting::text!(@ $text.and($crate::setting::Reference::Command($crate::setting::Command::$command)); $($rest)*)
    };
    (@ $text:expr; [$setting:ident] $($rest:tt)*) => {
        $crate::setting::text!(@ $text.and($crate::setting::Setting::$setting); $($rest)*)
    };
    (@ $text:expr; [$setting:ident = $($value:tt)+] $($rest:tt)*) => {
        $crate::setting::text!(@ $text.and($crate::setting::Setting::$setting.to(format!($($value)+))); $($rest)*)
    };
    (@ $text:expr; {$part:expr} $($rest:tt)*) => { $crate::setting::text!(@ $text.and($part); $($rest)*) };
    ($($parts:tt)+) => { $crate::setting::text!(@ $crate::setting::Text::default(); $($parts)+) };
}
#[doc(hidden)]
pub use __text as text;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_front_end_spells_references_only() {
        let symbol = "K";
        let text = text!("set {symbol} by " [Fix = "{symbol}=…"] " or " [TimeOrigin] "; " [Command::Devices]);
        assert_eq!(text.to_string(), "set K by fix K=… or time_origin; the list of devices");
        let shout: Spelling = |reference| neutral(reference).to_uppercase();
        assert_eq!(text.spelled(shout), "set K by FIX K=… or TIME_ORIGIN; THE LIST OF DEVICES");
        // A setting of another crate.
        const LOCK: Setting = Setting::new("lock", Form::Word);
        let text = text!("wait for " {LOCK} ", or try " {LOCK.to("off")});
        assert_eq!(text.spelled(shout), "wait for LOCK, or try LOCK OFF");
    }

    #[test]
    fn texts_of_the_same_words_are_the_same() {
        assert_eq!(text!("a" "b"), Text::from("ab"));
        assert_eq!(Text::from(""), Text::default());
        let evil = text!("a\u{1b}"[Sheet = "\u{1b}x"]).printable();
        assert_eq!(evil.to_string(), "a\\u{1b}sheet \\u{1b}x");
    }

    #[test]
    fn names_of_settings_are_unique() {
        let mut names: Vec<&str> = Setting::ALL.iter().map(|setting| setting.name()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Setting::ALL.len());
        assert!(names.iter().all(|name| name.chars().all(|c| c.is_ascii_lowercase() || c == '_')));
    }
}
