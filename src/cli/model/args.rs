//! Subcommands and flags of `model`.

use crate::cli::args::PageArgs;
use clap::{Args, Subcommand};
use std::path::PathBuf;

#[derive(Args)]
pub(crate) struct ModelArgs {
    #[command(subcommand)]
    pub action: ModelAction,
}

#[derive(Subcommand)]
pub(crate) enum ModelAction {
    /// Show what was understood of a model: signals, states, equations, integration method
    Check(CheckArgs),
    /// List the built-in models
    List,
    /// Print the text of a built-in model, as a beginning for an own one
    Show {
        /// Name of the model
        #[arg(value_name = "NAME")]
        name: String,
    },
}

#[derive(Args)]
pub(crate) struct CheckArgs {
    /// Model: a file (TOML), or the name of a built-in one
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    /// Write report.html with the typeset equations, and result.json, to this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub page: PageArgs,
}
