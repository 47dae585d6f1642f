//! Subcommands and flags of `sweep`.

use crate::cli::flags::PageArgs;
use clap::{Args, Subcommand};
use std::path::PathBuf;

#[derive(Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct SweepArgs {
    #[command(subcommand)]
    pub action: Option<SweepAction>,
    /// Study (TOML); each list in it is a factor, and the runs are the product of the factors
    #[arg(value_name = "STUDY", required = true)]
    pub study: Option<PathBuf>,
    /// Folder of the sweep: a new one, or one in which this study was planned before
    #[arg(long, value_name = "DIR", required = true)]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub shown: Shown,
    /// Write report.html, result.json and CSV files to this folder
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub strict: Strict,
}

#[derive(Subcommand)]
pub(crate) enum SweepAction {
    /// Plan a study in a new folder: pin digests of its recordings, the device and the runs
    Plan {
        /// Study (TOML)
        #[arg(value_name = "STUDY")]
        study: PathBuf,
        /// New folder for the sweep
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Do the remaining runs of a planned sweep, or of one shard of it
    Run {
        /// Folder of the sweep
        #[arg(value_name = "DIR")]
        dir: PathBuf,
        /// Shard to run, as I/N: shard I of N, which together are the sweep
        #[arg(long, value_name = "I/N", default_value = "1/1")]
        shard: String,
        #[command(flatten)]
        threads: Threads,
        /// Print one JSON document
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        strict: Strict,
    },
    /// Show the progress of a sweep and its shards
    Status {
        /// Folder of the sweep
        #[arg(value_name = "DIR")]
        dir: PathBuf,
        /// Print one JSON document
        #[arg(long)]
        json: bool,
    },
    /// Merge the results of all shards and summarize them
    Merge {
        /// Folder of the sweep
        #[arg(value_name = "DIR")]
        dir: PathBuf,
        #[command(flatten)]
        shown: Shown,
        /// Write report.html, result.json and CSV files to this folder
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Print one JSON document
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        strict: Strict,
    },
}

#[derive(Args)]
pub(crate) struct Threads {
    /// Number of CPU threads [default: all]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub threads: Option<usize>,
}

#[derive(Args, Clone, Copy)]
pub(crate) struct Strict {
    /// Exit with code 4 unless the level of trust of every finished run is good
    #[arg(long)]
    pub strict: bool,
}

/// Flags for outputs made from merged results.
#[derive(Args)]
pub(crate) struct Shown {
    #[command(flatten)]
    pub page: PageArgs,
    /// Tolerances of parameters, as R=0.8:1.0,… in SI units, in place of those of the study; motors outside are listed, and
    /// the capability of the line is computed
    #[arg(long, value_name = "LIMITS", value_delimiter = ',')]
    pub limits: Vec<String>,
    /// Exit with code 6 if a motor is outside the limits
    #[arg(long)]
    pub strict_limits: bool,
    /// Write all motors as CSV, a line each, to this file; - writes to stdout
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Write all results as Parquet to this file
    #[arg(long, value_name = "FILE")]
    pub parquet: Option<PathBuf>,
}
