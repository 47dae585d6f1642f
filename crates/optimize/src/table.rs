//! Rows of the table of population searches: names, descriptions and settings.

use super::run::Optimizer;
use super::search_settings::SearchSettings;
use motorfit_core::numeric::{count, whole};
use motorfit_core::setting::text;
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};

/// A population search: a row of the table.
#[derive(Debug)]
pub struct Search {
    /// Name in settings and results.
    pub name: &'static str,
    /// Full name.
    pub text: &'static str,
    /// Settings specific to the search.
    pub settings: &'static [Hyperparameter],
    pub(super) defaults: fn() -> Values,
    pub(super) begin: fn(SearchSettings, &Values) -> Result<Box<dyn Optimizer>>,
    pub(super) debug: fn(&Values) -> String,
}

/// A setting of a search.
#[derive(Debug)]
pub struct Hyperparameter {
    /// Name of the setting.
    pub name: &'static str,
    /// Description, a sentence.
    pub text: &'static str,
    /// Values that it may have.
    pub range: Range,
}

/// Values that a setting may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// A finite number between two limits; `true` excludes the lower one.
    Number(f64, f64, bool),
    /// A whole number from 0 to this one.
    Count(u32),
    /// One of these words.
    Choice(&'static [&'static str]),
}

pub(super) const NOT_NEGATIVE: Range = Range::Number(0.0, f64::INFINITY, false);
pub(super) const PROBABILITY: Range = Range::Number(0.0, 1.0, false);

/// Largest number of settings of a search.
const SETTINGS_MAX: usize = 8;

/// The values of the settings of a search, in the order of its row: numbers, counts, or indices of choices.
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

    /// Makes the settings from values in the order of the row.
    fn of(values: &Values) -> Self;

    /// Returns the values in the order of the row.
    fn values(&self) -> Values;
}

/// Type of a typed setting.
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

/// Implements [`SettingValue`] for an enum: a value is the index of its variant in the list.
macro_rules! setting_choice {
    ($type:ty: $($choice:expr),+) => {
        impl $crate::table::SettingValue for $type {
            fn number(self) -> f64 {
                [$($choice),+].iter().position(|one| *one == self).map_or(0.0, motorfit_core::numeric::count)
            }

            fn of(number: f64) -> Self {
                [$($choice),+][usize::of(number)]
            }
        }
    };
}
pub(super) use setting_choice;
setting_choice!(bool: false, true);
/// Range of a setting that is on or off.
pub(super) const SWITCH: Range = Range::Choice(&["false", "true"]);

/// Defines the typed settings of a search and its table row: for each setting its description, field, type, default, name
/// and range.
macro_rules! search {
    (
        $search:ident = $name:literal, $text:literal;
        $(#[$meta:meta])*
        pub struct $options:ident {
            $($(#[doc = $doc:literal])+ $field:ident: $type:ty = $default:expr, $setting:literal in $range:expr;)*
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $options {
            $($(#[doc = $doc])+ pub $field: $type,)*
        }

        impl Default for $options {
            fn default() -> Self {
                Self { $($field: $default),* }
            }
        }

        use $crate::table::{Hyperparameter, Search, SearchOptions, SettingValue, Values};

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
            defaults: || $options::default().values(),
            begin: |setup, values| {
                let rule = $search { options: $options::of(values), ..$search::default() };
                Ok(Box::new($crate::rule::Moving::new(rule, setup)?))
            },
            debug: |values| format!("{}({:?})", stringify!($search), $options::of(values)),
        };
    };
}
pub(super) use search;

impl Hyperparameter {
    /// Returns the name, followed by the choices if it has any: `name=a|b`.
    #[must_use]
    pub fn form(&self) -> String {
        match self.range {
            Range::Choice(words) => {
                let mut words = words.to_vec();
                // "true" is listed before "false".
                words.sort_by_key(|word| *word == "false");
                format!("{}={}", self.name, words.join("|"))
            }
            _ => self.name.to_owned(),
        }
    }

    /// Returns a value formatted as in settings.
    pub(super) fn shown(&self, value: f64) -> String {
        match self.range {
            Range::Number(..) => format!("{value:?}"),
            Range::Count(_) => value.to_string(),
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
                Err(_) => wrong("not a number", "Use a decimal point.".to_owned()),
            },
            Range::Count(_) => match text.trim().parse::<u32>() {
                Ok(count) => Ok(f64::from(count)),
                Err(_) => wrong("not a count", "Give a whole number, 0 or more.".to_owned()),
            },
            Range::Choice(words) => match words.iter().position(|word| *word == text.trim()) {
                Some(place) => Ok(place.number()),
                None => wrong("not one of its values", format!("Write {}.", self.form())),
            },
        }
    }

    pub(super) fn check(&self, search: &Search, value: f64) -> Result<()> {
        let (min, max, above) = match self.range {
            Range::Number(min, max, above) => (min, max, above),
            Range::Count(max) => (0.0, f64::from(max), false),
            Range::Choice(_) => return Ok(()),
        };
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
