//! The rows of the table of population searches: what one says of a search and of its settings.

use super::population::SearchSettings;
use super::run::Optimizer;
use crate::numeric::{count, whole};
use crate::setting::text;
use crate::text::excerpt;
use crate::{Error, Result};

/// A population search: a row of the table.
#[derive(Debug)]
pub struct Search {
    /// The name in settings and results.
    pub name: &'static str,
    /// The name in words.
    pub text: &'static str,
    /// The settings of its own.
    pub settings: &'static [Hyperparameter],
    pub(super) usual: fn() -> Values,
    pub(super) begin: fn(SearchSettings, &Values) -> Result<Box<dyn Optimizer>>,
    pub(super) debug: fn(&Values) -> String,
}

/// A setting of a search.
#[derive(Debug)]
pub struct Hyperparameter {
    /// Its name.
    pub name: &'static str,
    /// A sentence that describes it.
    pub text: &'static str,
    /// The values that it may have.
    pub range: Range,
}

/// The values that a setting may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// A finite number from the first to the second; `true` excludes the first.
    Number(f64, f64, bool),
    /// A whole number, 0 or more.
    Count,
    /// One of these words.
    Choice(&'static [&'static str]),
}

pub(super) const NOT_NEGATIVE: Range = Range::Number(0.0, f64::INFINITY, false);
pub(super) const PROBABILITY: Range = Range::Number(0.0, 1.0, false);

/// The most settings that a search has.
const SETTINGS_MAX: usize = 8;

/// The values of the settings of a search, in the order of its row: numbers, counts, or places among the choices.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Values(pub(super) [f64; SETTINGS_MAX]);

impl Values {
    /// Returns these values followed by zeros.
    pub(super) fn of<const N: usize>(given: [f64; N]) -> Self {
        const { assert!(N <= SETTINGS_MAX) };
        let mut values = [0.0; SETTINGS_MAX];
        values[..N].copy_from_slice(&given);
        Self(values)
    }
}

/// Typed settings of a search.
pub trait SearchOptions: Default {
    /// The row of the search.
    const SEARCH: &'static Search;

    /// Takes the values in the order of the row.
    fn of(values: &Values) -> Self;

    /// Returns the values in the order of the row.
    fn values(&self) -> Values;
}

/// A type that a typed setting may have.
pub(super) trait SettingValue: Copy {
    fn number(self) -> f64;
    fn of(number: f64) -> Self;
}

impl SettingValue for f64 {
    fn number(self) -> f64 {
        self
    }

    fn of(number: f64) -> Self {
        number
    }
}

impl SettingValue for usize {
    fn number(self) -> f64 {
        count(self)
    }

    fn of(number: f64) -> Self {
        whole(number)
    }
}

/// A choice is its place among all.
macro_rules! setting_choice {
    ($type:ty: $($choice:expr),+) => {
        impl SettingValue for $type {
            fn number(self) -> f64 {
                [$($choice),+].iter().position(|one| *one == self).map_or(0.0, $crate::numeric::count)
            }

            fn of(number: f64) -> Self {
                [$($choice),+][usize::of(number)]
            }
        }
    };
}
pub(super) use setting_choice;
setting_choice!(bool: false, true);
/// The words of a setting that is on or off.
pub(super) const SWITCH: Range = Range::Choice(&["false", "true"]);

/// Defines the typed settings of a search and its row: for each setting its text, field, type, default, name and range.
macro_rules! search {
    (
        $search:ident = $name:literal, $text:literal;
        $(#[$meta:meta])*
        pub struct $options:ident {
            $($(#[doc = $doc:literal])+ $field:ident: $type:ty = $usual:expr, $setting:literal in $range:expr;)*
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $options {
            $($(#[doc = $doc])+ pub $field: $type,)*
        }

        impl Default for $options {
            fn default() -> Self {
                Self { $($field: $usual),* }
            }
        }

        use $crate::optimize::table::{Hyperparameter, Search, SearchOptions, SettingValue, Values};

        impl SearchOptions for $options {
            const SEARCH: &'static Search = &SEARCH;

            fn of(values: &Values) -> Self {
                let mut values = values.0.into_iter();
                let mut next = || values.next().unwrap_or_default();
                Self { $($field: SettingValue::of(next())),* }
            }

            fn values(&self) -> Values {
                Values::of([$(SettingValue::number(self.$field)),*])
            }
        }

        pub(super) const SEARCH: Search = Search {
            name: $name,
            text: $text,
            settings: &[$(Hyperparameter { name: $setting, text: concat!($($doc),+).trim_ascii(), range: $range }),*],
            usual: || $options::default().values(),
            begin: |setup, values| {
                let rule = $search { options: $options::of(values), ..$search::default() };
                Ok(Box::new($crate::optimize::population::Moving::new(rule, setup)?))
            },
            debug: |values| format!("{}({:?})", stringify!($search), $options::of(values)),
        };
    };
}
pub(super) use search;

impl Hyperparameter {
    /// Returns the name, and behind it the words that it may be.
    #[must_use]
    pub fn form(&self) -> String {
        match self.range {
            Range::Choice(words) => {
                let mut words = words.to_vec();
                // On before off.
                words.sort_by_key(|word| *word == "false");
                format!("{}={}", self.name, words.join("|"))
            }
            _ => self.name.to_owned(),
        }
    }

    /// Returns a value as it is written.
    pub(super) fn shown(&self, value: f64) -> String {
        match self.range {
            Range::Number(..) => format!("{value:?}"),
            Range::Count => value.to_string(),
            Range::Choice(words) => words[usize::of(value)].to_owned(),
        }
    }

    pub(super) fn read(&self, text: &str) -> Result<f64> {
        let wrong = |what: &str, remedy: String| {
            Err(Error::usage(text!([Set](" {}=\"{}\" is {what}", self.name, excerpt(text))), remedy))
        };
        match self.range {
            Range::Number(..) => match text.trim().parse() {
                Ok(number) => Ok(number),
                Err(_) => wrong("no number", "Use a decimal point.".to_owned()),
            },
            Range::Count => match text.trim().parse::<u32>() {
                Ok(count) => Ok(f64::from(count)),
                Err(_) => wrong("no count", "Give a whole number, 0 or more.".to_owned()),
            },
            Range::Choice(words) => match words.iter().position(|word| *word == text.trim()) {
                Some(place) => Ok(place.number()),
                None => wrong("none of its values", format!("Write {}.", self.form())),
            },
        }
    }

    pub(super) fn check(&self, search: &Search, value: f64) -> Result<()> {
        let Range::Number(min, max, above) = self.range else { return Ok(()) };
        if value.is_finite() && value <= max && if above { value > min } else { value >= min } {
            return Ok(());
        }
        let range = match (max.is_finite(), above) {
            (true, _) => format!("between {min} and {max}"),
            (false, true) => format!("more than {min}"),
            (false, false) => format!("{min} or more"),
        };
        let message = format!("{} of {} is {value}", self.name, search.name);
        Err(Error::usage(message, format!("Give {} {range}.", self.name)))
    }
}
