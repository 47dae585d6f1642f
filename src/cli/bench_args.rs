//! Flags of `bench`.

use super::model::args::OwnModel;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub(crate) struct BenchArgs {
    #[command(flatten)]
    pub model: OwnModel,
    /// Batch sizes, in candidates
    #[arg(long, value_delimiter = ',', value_name = "LIST", default_value = "1,10,100,1000,10000,100000,1000000")]
    pub populations: Vec<usize>,
    /// Lengths of the recordings, in samples
    #[arg(long, value_delimiter = ',', value_name = "LIST", default_value = "300,3000")]
    pub samples: Vec<usize>,
    /// Approximate time for the measurements, in seconds
    #[arg(long, default_value_t = 60.0, value_name = "S")]
    pub seconds: f64,
    /// Threads of the multithreaded CPU evaluator [default: all]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// Write a plot (SVG) of throughput against batch size to this file; with several lengths one file each, with the
    /// length in its name
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Measure no GPUs
    #[arg(long)]
    pub no_gpu: bool,
    /// Also measure GPUs in plain f32, without deviations from a reference: the fastest, but inaccurate near the optimum
    #[arg(long)]
    pub plain: bool,
    /// Do not store the measurements that --device auto uses
    #[arg(long)]
    pub no_keep: bool,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}
