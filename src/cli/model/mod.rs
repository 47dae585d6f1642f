//! Users' models: the command `model`, and `identify` and `simulate` with a model.

pub(super) mod args;
mod check;
pub(super) mod inputs;
pub(super) mod inspect;
pub(super) mod simulate;

use super::prelude::*;
use args::{ModelAction, ModelArgs};
use motorfit::model::BuiltIn;
use motorfit::named::Named as _;

pub(super) fn run(args: &ModelArgs, style: &Style) -> Result<Outcome> {
    match &args.action {
        ModelAction::Check(args) => check::run(args, style),
        ModelAction::Show { name } => {
            data(BuiltIn::named("model", name)?.source())?;
            Ok(Outcome::Done)
        }
        ModelAction::List => {
            let width = BuiltIn::ALL.iter().map(|of| of.name().len()).max().unwrap_or(0);
            let lines =
                BuiltIn::ALL.iter().map(|of| format!("{:<width$}  {}\n", of.name(), motorfit::named::Named::text(of)));
            data(&lines.collect::<String>())?;
            Ok(Outcome::Done)
        }
    }
}
