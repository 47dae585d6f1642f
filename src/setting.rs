//! The library's settings by name, and texts that refer to them.
//!
//! A message of the library names no flag, key or keyword. It refers to a [`Setting`] or a [`Command`], and a front end
//! gives the [`Spelling`]: a flag on the command line, `fix = {K = …}` in a study, `fix="K=…"` in Python.

use crate::text::printable;
use std::fmt;

/// The form that the value of a setting has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// On or off.
    Switch,
    /// One number.
    Number,
    /// One word or a text of its own syntax.
    Word,
    /// Words separated by commas.
    List,
    /// `KEY=VALUE`, separated by commas.
    Values,
}

/// Makes the enum of the settings from one table.
macro_rules! settings {
    ($($setting:ident $name:literal $form:ident $about:literal)*) => {
        /// A setting of the library, of its reading of files or of one of its studies.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum Setting {
            $(#[doc = $about] $setting,)*
        }

        impl Setting {
            /// All settings.
            pub const ALL: &[Self] = &[$(Self::$setting),*];

            /// Returns the name, words joined by underscores.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$setting => $name,)* }
            }

            /// Returns the form of its value.
            #[must_use]
            pub const fn form(self) -> Form {
                match self { $(Self::$setting => Form::$form,)* }
            }
        }
    };
}

settings! {
    Columns "columns" Word "The quantities that columns hold, and their units."
    Rate "rate" Number "Samples per second."
    Sheet "sheet" Word "The sheet of a workbook."
    BadRows "bad_rows" Word "The treatment of rows that cannot be read."
    Gaps "gaps" Word "The treatment of gaps in time."
    DropRepeats "drop_repeats" Switch "Whether rows that repeat a time are left out."
    Crop "crop" Word "The interval of time that is used."
    Offset "offset" Word "Offsets of sensors that are subtracted."
    Mask "mask" List "Samples that do not count."
    Decimate "decimate" Number "Every Nth sample is kept."
    Filter "filter" Word "A low-pass filter on all signals."
    Split "split" Number "The fraction of each recording that is fitted."
    Method "method" Word "The method that finds the optimum."
    Methods "methods" List "The methods of a comparison or a study."
    Set "set" List "Settings of a method."
    Polish "polish" Word "The refinement."
    Population "population" Number "Candidates in a generation."
    Generations "generations" Number "Generations of a search."
    Seed "seed" Number "The seed of the random numbers."
    Bounds "bounds" Values "Bounds of parameters."
    Fix "fix" Values "Parameters held fixed."
    Criterion "criterion" Word "The criterion that a search minimizes."
    Criteria "criteria" List "The criteria of a comparison."
    Scale "scale" Word "The divisor of each channel's error."
    Noise "noise" Word "Noise of the sensors."
    TimeOrigin "time_origin" Number "The time at which time weights begin, in seconds."
    Discretization "discretization" Word "The one-step method."
    Initial "initial" Word "The state at the first sample."
    With "with" List "Extensions of the motor."
    PerRecording "per_recording" List "Parameters that each recording has for itself."
    Device "device" Word "The device that evaluates."
    Precision "precision" Word "The precision of the evaluation."
    Threads "threads" Number "Threads."
    Runs "runs" Number "Runs of each method."
    Target "target" Number "The cost that runs are to reach."
    Sample "sample" Word "Candidates sampled from the bounds."
    Slice "slice" List "The two parameters of a slice of the cost."
    Parameters "parameters" Values "The parameters of a simulated motor."
    Start "start" Values "The parameters at which a refinement starts."
    Input "input" Word "The input of a simulation."
    Duration "duration" Number "The length of a simulation in seconds."
    Period "period" Number "The time between samples in seconds."
    Populations "populations" List "The batch sizes of a benchmark."
    Samples "samples" List "The lengths of the recordings of a benchmark."
    Seconds "seconds" Number "The time that a benchmark may take."
    Limits "limits" Values "Tolerances of parameters."
    Shard "shard" Word "The shard of a sweep."
    Out "out" Word "The folder for results."
}

impl Setting {
    /// Returns a reference to this setting with a value, as an example or as what was given.
    pub fn to(self, value: impl Into<String>) -> Reference {
        Reference::Setting(self, Some(value.into()))
    }
}

/// An operation of the library that a hint may send the reader to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
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

/// References in a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reference {
    /// A setting, with a value where one is meant.
    Setting(Setting, Option<String>),
    /// An operation.
    Command(Command),
}

/// The words of a front end for a reference.
pub type Spelling = fn(&Reference) -> String;

/// Spells a reference where there is no front end: `fix K=…`.
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

/// A text of words and references to settings. `Display` gives it with the names of the library.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Text(Vec<Part>);

impl Text {
    /// Returns the text in the words of a front end.
    #[must_use]
    pub fn spelled(&self, spelling: Spelling) -> String {
        let word = |part: &Part| match part {
            Part::Words(words) => words.clone(),
            Part::Reference(reference) => spelling(reference),
        };
        self.0.iter().map(word).collect()
    }

    /// Returns the text with words for those references that `words` has words for.
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

    /// Returns the text with another behind it.
    #[must_use]
    pub fn and(mut self, more: impl Into<Self>) -> Self {
        self.push(more);
        self
    }

    /// Returns whether it says nothing.
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

/// Makes a [`Text`]. Literals and `(format, arguments)` are words, `[Setting]` and `[Setting = format, arguments]` refer
/// to a setting, `[Command::Name]` to an operation, and `{expression}` is whatever a text can be made of:
/// `text!("{symbol} is at its bound; widen it with " [Bounds = "{symbol}=0.1:1"])`.
macro_rules! text {
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
pub(crate) use text;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_front_end_spells_references_and_no_word_beside_them() {
        let symbol = "K";
        let text = text!("hold {symbol} with " [Fix = "{symbol}=…"] " or " [TimeOrigin] "; " [Command::Devices]);
        assert_eq!(text.to_string(), "hold K with fix K=… or time_origin; the list of devices");
        let shout: Spelling = |reference| neutral(reference).to_uppercase();
        assert_eq!(text.spelled(shout), "hold K with FIX K=… or TIME_ORIGIN; THE LIST OF DEVICES");
    }

    #[test]
    fn texts_of_the_same_words_are_the_same() {
        assert_eq!(text!("a" "b"), Text::from("ab"));
        assert_eq!(Text::from(""), Text::default());
        let evil = text!("a\u{1b}"[Sheet = "\u{1b}x"]).printable();
        assert_eq!(evil.to_string(), "a\\u{1b}sheet \\u{1b}x");
    }

    #[test]
    fn each_setting_has_a_name_of_its_own() {
        let mut names: Vec<&str> = Setting::ALL.iter().map(|setting| setting.name()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Setting::ALL.len());
        assert!(names.iter().all(|name| name.chars().all(|c| c.is_ascii_lowercase() || c == '_')));
    }
}
