//! Subcommands and flags of `model`.

use crate::cli::flags::{PageArgs, named};
use clap::{Args, Subcommand};
use motorfit::model::ShaderPrecision;
use std::path::PathBuf;

/// Model of a user.
#[derive(Args)]
pub(crate) struct OwnModel {
    /// Equations of another machine in place of the DC motor: a file (TOML), or a built-in model (see motorfit model list)
    #[arg(long, value_name = "MODEL", help_heading = "Problem", hide_short_help = true)]
    pub model: Option<PathBuf>,
}

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
    /// Print the WGSL compute shader that a GPU evaluates the model with, in f64 or f32
    #[arg(long, value_name = "PRECISION", num_args = 0..=1, require_equals = true, default_missing_value = "f64",
          value_parser = named::<ShaderPrecision>())]
    pub wgsl: Option<ShaderPrecision>,
    /// Write report.html with the typeset equations, and result.json, to this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub page: PageArgs,
}
