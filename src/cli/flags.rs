//! Flags that commands share; those of settings are built from the library's table. Parsers for named values of other flags.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, ValueEnum, value_parser};
use motorfit::named::Named;
use motorfit::optimize::SEARCHES;
use motorfit::report::command_line;
use motorfit::setting::Setting;
use motorfit::settings::{DEVICE, Given, Kind, PROBLEM, READING, SEARCH, Value, row};
use std::path::PathBuf;

/// Choices whose values help lists with their descriptions.
const DESCRIBED: [Setting; 4] = [Setting::Method, Setting::Polish, Setting::BadRows, Setting::Gaps];

/// Settings shown in the short help (`-h`), with their short texts; the long help shows the texts of the table.
const FIRST: [(Setting, &str); 10] = [
    (Setting::Columns, "Columns, as time=t:ms,voltage=pwm*12/255:V,speed=rpm"),
    (Setting::Rate, "Sampling rate in Hz, if there is no time column"),
    (Setting::Gaps, "Treatment of gaps in time"),
    (Setting::Mask, "Samples excluded from the fit: auto, or FROM:TO in seconds"),
    (Setting::Method, "Method that finds the optimum"),
    (Setting::Seed, "Seed of the random numbers"),
    (Setting::Bounds, "Bounds of the search, as R=0.1:10,L=0.001:0.1"),
    (Setting::Fix, "Parameters fixed at known values, as R=0.92"),
    (Setting::With, "Extensions of the motor (coulomb, load, dead-time, …) or terms of a model, or auto"),
    (Setting::Device, "Device that evaluates candidates: auto, cpu, gpu, gpu:INDEX or gpu:NAME"),
];

fn flag(setting: Setting) -> Option<Arg> {
    let row = row(setting)?;
    let arg = Arg::new(setting.name()).long(setting.name().replace('_', "-")).help_heading(row.topic);
    let text = row.text.spelled(command_line);
    let first = FIRST.iter().find(|(first, _)| *first == setting).map(|(_, text)| *text);
    let arg = match first {
        Some(short) => arg.help(short).long_help(text),
        None => arg.help(text).hide_short_help(true),
    };
    let arg = arg.action(ArgAction::Set).value_name(row.stands);
    let arg = row.default.iter().fold(arg, |arg, default| arg.default_value(*default));
    let arg = if setting == Setting::Decimate { arg.conflicts_with(Setting::Rate.name()) } else { arg };
    let hyphens = [Setting::Crop, Setting::Mask].contains(&setting);
    Some(match row.kind {
        Kind::Switch => arg.action(ArgAction::SetTrue),
        Kind::Number => arg.value_parser(value_parser!(f64)).allow_negative_numbers(true),
        Kind::Count => arg.value_parser(value_parser!(u64)).allow_negative_numbers(true),
        Kind::Word => arg.allow_hyphen_values(hyphens),
        Kind::List => arg.action(ArgAction::Append).value_delimiter(',').allow_hyphen_values(hyphens),
        Kind::Choice(rows) => {
            let described = DESCRIBED.contains(&setting);
            let value = |(name, text): (&'static str, &'static str)| {
                if described { PossibleValue::new(name).help(text) } else { PossibleValue::new(name) }
            };
            arg.value_parser(PossibleValuesParser::new(rows.into_iter().map(value)))
        }
    })
}

/// Returns the values of `settings` in parsed arguments, defaults included.
fn given(matches: &ArgMatches, settings: &[Setting]) -> Given {
    let mut given = Given::default();
    for row in settings.iter().filter_map(|setting| row(*setting)) {
        let name = row.setting.name();
        let value = match row.kind {
            Kind::Switch => Some(Value::Switch(matches.get_flag(name))),
            Kind::Number => matches.get_one(name).copied().map(Value::Number),
            Kind::Count => matches.get_one(name).copied().map(Value::Count),
            Kind::Word | Kind::Choice(_) => matches.get_one(name).cloned().map(Value::Text),
            Kind::List => matches.get_many(name).map(|items| Value::List(items.cloned().collect())),
        };
        value.into_iter().for_each(|value| given.put(row.setting, value));
    }
    given
}

macro_rules! flags {
    ($($(#[doc = $text:literal])+ $group:ident = $settings:expr;)+) => {$(
        $(#[doc = $text])+
        pub(crate) struct $group(pub Given);

        impl Args for $group {
            fn augment_args(command: Command) -> Command {
                command.args($settings.iter().filter_map(|setting| flag(*setting)))
            }

            fn augment_args_for_update(command: Command) -> Command {
                Self::augment_args(command)
            }
        }

        impl FromArgMatches for $group {
            fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
                Ok(Self(given(matches, &$settings)))
            }

            fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
                *self = Self::from_arg_matches(matches)?;
                Ok(())
            }
        }
    )+};
}

flags! {
    /// The flag that names the columns of recordings.
    Columns = [Setting::Columns];
    /// Flags for reading and preparing recordings.
    Reading = READING;
    /// Flags of the search and the refinement.
    SearchArgs = SEARCH;
    /// Flags of the problem: parameters, criterion and model.
    ProblemArgs = PROBLEM;
    /// Flags of the device that evaluates candidates.
    DeviceArgs = DEVICE;
}

#[derive(Args)]
pub(crate) struct Recordings {
    /// Recordings (CSV, XLSX, MAT, JSON) or logs (wpilog, MCAP, Parquet, HDF5, TDMS, MDF4, ULog); A+B combines two files into one recording, - reads one from stdin
    #[arg(required = true, value_name = "RECORD")]
    pub records: Vec<PathBuf>,
    #[command(flatten)]
    pub reading: Reading,
}

/// Settings of pages.
#[derive(Args, Clone, Copy)]
pub(crate) struct PageArgs {
    /// Write report.html without its script, which adds values under the pointer, zoom and tables that can be sorted
    #[arg(long)]
    pub no_script: bool,
}

/// Returns a parser for the names of a table; help lists the names.
pub(crate) fn named<T: Named + Send + Sync + 'static>() -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(T::names()).try_map(|name| T::named("value", &name))
}

/// Returns a parser for the names of a table; help lists the names with their descriptions.
pub(crate) fn described<T: Named + Send + Sync + 'static>() -> impl TypedValueParser<Value = T> {
    let row = |row: &T| PossibleValue::new(row.name()).help(row.text());
    PossibleValuesParser::new(T::all().iter().map(row)).try_map(|name| T::named("value", &name))
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum When {
    Auto,
    Always,
    Never,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum ProgressKind {
    Auto,
    Json,
}

/// Returns the help text of `--methods`.
pub(crate) fn methods_compared() -> String {
    format!(
        "Methods to compare: {}, sm [with --suite: all searches; with --model: without sm]",
        SEARCHES.map(|search| search.name).join(", ")
    )
}

/// Returns the names of all searches as a list.
pub(crate) fn searches() -> String {
    SEARCHES.map(|search| search.name).join(",")
}
