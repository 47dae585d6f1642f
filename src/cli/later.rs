//! What the contract names and this version does not have yet: asking for it says so.

use clap::error::{ContextKind, ContextValue, ErrorKind};
use motorfit::Error;

const FLAGS: [&str; 0] = [];

/// The error for a flag that a later version brings; `None` when clap's own words fit.
pub(super) fn planned(error: &clap::Error) -> Option<Error> {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let what = match error.kind() {
        ErrorKind::UnknownArgument => {
            let flag = text(ContextKind::InvalidArg)?;
            FLAGS.contains(&flag).then(|| flag.to_owned())?
        }
        _ => return None,
    };
    Some(Error::usage(
        format!("{what} is planned but not in motorfit {}", env!("CARGO_PKG_VERSION")),
        "See motorfit --help for what there is; a later version brings it.",
    ))
}
