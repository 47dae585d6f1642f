//! Commands and flags of `sweep`.

use clap::{Args, Subcommand};
use std::path::PathBuf;

#[derive(Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct SweepArgs {
    #[command(subcommand)]
    pub action: Option<SweepAction>,
    /// The study (TOML); its lists are factors, and its runs their product
    #[arg(value_name = "STUDY", required = true)]
    pub study: Option<PathBuf>,
    /// The folder of the sweep: a new one, or one that this study was planned in
    #[arg(long, value_name = "DIR", required = true)]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub shown: Shown,
    /// A folder for report.html, result.json and CSV files
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
    /// Pin a study in a folder: recordings with their digests, device, runs
    Plan {
        /// The study (TOML)
        #[arg(value_name = "STUDY")]
        study: PathBuf,
        /// A new folder
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Run what is left of a planned sweep, or of one shard of it
    Run {
        /// The folder of the sweep
        #[arg(value_name = "DIR")]
        dir: PathBuf,
        /// Which part of the runs, as I/N: any N shards together are the sweep
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
    /// Show how far a sweep is
    Status {
        /// The folder of the sweep
        #[arg(value_name = "DIR")]
        dir: PathBuf,
        /// Print one JSON document
        #[arg(long)]
        json: bool,
    },
    /// Put the results of all shards in order and sum them up
    Merge {
        /// The folder of the sweep
        #[arg(value_name = "DIR")]
        dir: PathBuf,
        #[command(flatten)]
        shown: Shown,
        /// A folder for report.html, result.json and CSV files
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
    /// Threads [default: all]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub threads: Option<usize>,
}

#[derive(Args, Clone, Copy)]
pub(crate) struct Strict {
    /// Exit with 4 unless the standard errors of every finished run can be believed (trust: good)
    #[arg(long)]
    pub strict: bool,
}

/// Outputs made of the results.
#[derive(Args)]
pub(crate) struct Shown {
    /// Limits that parameters of a motor must keep, as R=0.8:1.0,… in SI units; motors outside are named
    #[arg(long, value_name = "LIMITS", value_delimiter = ',')]
    pub limits: Vec<String>,
    /// A file for all results as Parquet
    #[arg(long, value_name = "FILE")]
    pub parquet: Option<PathBuf>,
}
