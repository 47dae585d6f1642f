//! Names that flags take: those of the library's tables, and a few of the program alone.

use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use motorfit::identify::Extension;
use motorfit::motor::Parameter;
use motorfit::named::Named;
use motorfit::optimize::{Hyperparameter, SEARCHES, Search};

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

/// The help of `--set`.
pub(crate) fn method_settings() -> String {
    let forms = |search: &Search| search.settings.iter().map(Hyperparameter::form).collect::<Vec<_>>().join(", ");
    let searches = SEARCHES.into_iter().filter(|search| !search.settings.is_empty());
    let searches: Vec<String> = searches.map(|search| format!("{} ({})", forms(search), search.name)).collect();
    format!("Settings of the method: {}", searches.join("; "))
}

/// The help of `--with`.
pub(crate) fn extensions() -> String {
    format!(
        "What the motor has beyond the linear one: {}; or auto, which chooses. Their parameters {} take --bounds and --fix \
         too",
        Extension::ALL.map(Extension::name).join(", "),
        Parameter::EXTENSIONS.map(Parameter::symbol).join(", ")
    )
}
