//! Names that flags take: those of the library's tables, and a few of the program alone.

use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use motorfit::named::Named;
use motorfit::optimize::SEARCHES;

/// Reads a row of a table; help lists the names.
pub(crate) fn named<T: Named + Send + Sync + 'static>() -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(T::names()).try_map(|name| T::named("value", &name))
}

/// The same; help lists the names with their texts.
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

/// The help of `--methods`.
pub(crate) fn methods_compared() -> String {
    format!("Methods: {}, sm", SEARCHES.map(|search| search.name).join(", "))
}
