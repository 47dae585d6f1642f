//! Commands and flags.

pub(crate) use super::flags::*;
pub(crate) use super::sweep::args::*;
use clap::{Args, Parser, Subcommand};
use motorfit::identify::Method;
use motorfit::motor::Discretization;
use motorfit::study::compare::Preset;
use std::path::PathBuf;

/// Parameters of DC motors from recordings of voltage, current and speed
///
/// Give it a recording and it returns resistance R, inductance L, motor constant K, viscous friction B and inertia J.
#[derive(Parser)]
#[command(name = "motorfit", version, propagate_version = true, max_term_width = 100)]
#[command(
    after_help = "Exit codes: 0 done, 2 wrong usage, 3 bad data, 4 not identified (or some runs of a sweep\nfailed), 5 device not there, 130 interrupted (129 by SIGHUP, 143 by SIGTERM)."
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub command: Command,
    #[command(flatten)]
    pub common: Common,
}

#[derive(Args)]
pub(crate) struct Common {
    /// Print results only: no notes, no warnings, no progress
    #[arg(short, long, global = true, conflicts_with = "verbose", help_heading = "Output", hide_short_help = true)]
    pub quiet: bool,
    /// Print details of what is done
    #[arg(short, long, global = true, help_heading = "Output", hide_short_help = true)]
    pub verbose: bool,
    /// When to use colour; NO_COLOR is respected
    #[arg(
        long,
        value_enum,
        default_value = "auto",
        global = true,
        value_name = "WHEN",
        help_heading = "Output",
        hide_short_help = true
    )]
    pub color: When,
    /// Show no progress bar
    #[arg(long, global = true, help_heading = "Output", hide_short_help = true)]
    pub no_progress: bool,
    /// Progress on stderr: a bar on a terminal, or JSON lines
    #[arg(
        long,
        value_enum,
        default_value = "auto",
        global = true,
        value_name = "HOW",
        help_heading = "Output",
        hide_short_help = true
    )]
    pub progress: ProgressKind,
}

#[derive(Subcommand)]
pub(crate) enum Command {
    /// Identify one motor from one or more recordings (several: one joint fit)
    Identify(Box<IdentifyArgs>),
    /// Costs of many candidates, from a file or sampled, in any number
    Evaluate(Box<EvaluateArgs>),
    /// Compare methods under equal budgets: runs, statistics, tables, plots
    Compare(Box<CompareArgs>),
    /// Run a study of methods, seeds and recordings as one batch that goes on where it was interrupted
    Sweep(Box<SweepArgs>),
    /// Simulate a motor at rest and write a recording
    Simulate(SimulateArgs),
    /// Show what a recording holds, how it was understood and what is odd about it
    Inspect(InspectArgs),
    /// Measure CPU against GPU evaluation over population sizes
    Bench(BenchArgs),
    /// List what can evaluate on this machine
    Devices(DevicesArgs),
    /// Print a completion script for a shell
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Print the manual (roff), or write a page for each command into a folder
    Man {
        /// The folder for motorfit.1, motorfit-identify.1 and so on
        #[arg(value_name = "DIR")]
        dir: Option<PathBuf>,
    },
}

#[derive(Args)]
pub(crate) struct Recordings {
    /// Recordings (CSV, XLSX, MAT, JSON); A+B makes one recording of two files
    #[arg(required = true, value_name = "RECORD")]
    pub records: Vec<PathBuf>,
    #[command(flatten)]
    pub reading: Reading,
}

#[derive(Args)]
pub(crate) struct IdentifyArgs {
    #[command(flatten)]
    pub recordings: Recordings,
    /// Recordings for validation, which are simulated but not fitted; repeatable
    #[arg(long, value_name = "RECORD", help_heading = "Validation")]
    pub validate: Vec<PathBuf>,
    /// Fraction of each recording that is fitted; the rest is for validation
    #[arg(long, value_name = "FRACTION", allow_negative_numbers = true, help_heading = "Validation")]
    pub split: Option<f64>,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    /// A folder for report.html, result.json and curves.csv
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// A file for a plot of measured and modelled signals, one for each recording
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Exit with 4 unless the level of trust is good
    #[arg(long)]
    pub strict: bool,
    #[command(flatten)]
    pub search: SearchArgs,
    #[command(flatten)]
    pub problem: ProblemArgs,
    #[command(flatten)]
    pub device: DeviceArgs,
}

#[derive(Args)]
pub(crate) struct CompareArgs {
    /// Recordings of one motor; without any, the paper's experiment on its M2 motor is simulated
    #[arg(value_name = "RECORD")]
    pub records: Vec<PathBuf>,
    #[command(flatten)]
    pub reading: Reading,
    /// The set-up of the paper, its tables beside ours
    #[arg(long, value_parser = described::<Preset>(), conflicts_with_all = ["records", "methods", "criteria", "population", "generations", "set", "bounds", "fix"])]
    pub preset: Option<Preset>,
    #[arg(long, help = methods_compared(), value_parser = described::<Method>(), value_delimiter = ',')]
    #[arg(default_value = "gwo,jaya,ga,sm", value_name = "LIST")]
    pub methods: Vec<Method>,
    /// Runs of each method
    #[arg(long, default_value_t = 50, value_name = "N", allow_negative_numbers = true)]
    pub runs: usize,
    /// Criteria with scales, as CRITERION:SCALE,…; several are compared one by one
    #[arg(long, value_delimiter = ',', default_value = "nrmse:std", value_name = "LIST")]
    pub criteria: Vec<String>,
    /// Agents; several are compared one by one
    #[arg(long, value_delimiter = ',', default_value = "100", value_name = "LIST")]
    pub population: Vec<usize>,
    /// Generations, the first population included; several are compared one by one
    #[arg(long, value_delimiter = ',', default_value = "100", value_name = "LIST")]
    pub generations: Vec<usize>,
    /// Settings of methods, as ga.mutation=0.1,…; several values as 0.1/0.2 are compared one by one
    #[arg(long, value_name = "METHOD.KEY=VALUE", value_delimiter = ',')]
    pub set: Vec<String>,
    /// Seed of all runs
    #[arg(long, default_value_t = 1, value_name = "N", allow_negative_numbers = true)]
    pub seed: u64,
    /// Records with new noise for Steiglitz–McBride, which has no seeds
    #[arg(long, default_value_t = 200, value_name = "N", allow_negative_numbers = true)]
    pub noise_records: usize,
    /// The cost that runs are to reach [default: a range of targets]
    #[arg(long, value_name = "COST", allow_negative_numbers = true)]
    pub target: Option<f64>,
    /// Bounds as of identify [default: table2 without a recording, else auto]; repeatable
    #[arg(long, value_delimiter = ',', value_name = "BOUNDS")]
    pub bounds: Vec<String>,
    /// Parameters that are held, as R=0.92,…; repeatable
    #[arg(long, value_delimiter = ',', value_name = "VALUES")]
    pub fix: Vec<String>,
    /// One-step method
    #[arg(long, value_parser = named::<Discretization>(), default_value = "zoh")]
    pub discretization: Discretization,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    /// A folder for report.html, result.json and CSV files
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub device: DeviceArgs,
}

#[derive(Args)]
pub(crate) struct EvaluateArgs {
    #[command(flatten)]
    pub recordings: Recordings,
    /// Candidates, CSV or .parquet, with a column for each free parameter (R,L,K,B,J; SI units; with --per-recording R
    /// R[0],R[1]); - reads CSV from stdin
    #[arg(long, value_name = "FILE", required_unless_present_any = ["sample", "slice"])]
    #[arg(conflicts_with_all = ["sample", "slice"])]
    pub candidates: Option<PathBuf>,
    /// Candidates from the bounds: uniform:N, lhs:N (Latin hypercube), or grid:N (N an axis)
    #[arg(long, value_name = "SAMPLE")]
    pub sample: Option<String>,
    /// The cost over two parameters around the identified optimum, as R,L; --sample grid:N sets the points a side
    #[arg(long, value_name = "P,Q", conflicts_with_all = ["top", "json"])]
    pub slice: Option<String>,
    /// With --slice: a file for the heat map, with the optimum and its 95 % ellipse
    #[arg(long, value_name = "FILE", requires = "slice")]
    pub svg: Option<PathBuf>,
    /// Print the K best only, the lowest cost first [default with --json: 10]
    #[arg(long, value_name = "K")]
    pub top: Option<usize>,
    /// Seed of the sample
    #[arg(long, default_value_t = 1, value_name = "N", allow_negative_numbers = true)]
    pub seed: u64,
    /// Print one JSON document with the best
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub problem: ProblemArgs,
    #[command(flatten)]
    pub device: DeviceArgs,
}

#[derive(Args)]
pub(crate) struct SimulateArgs {
    /// The motor: R=…,L=…,K=…,B=…,J=… in SI units, or m2 for the motor of the paper; behind it parameters of
    /// extensions (see identify --with): m2,Tc=0.01,td=0.004
    #[arg(long, value_name = "VALUES")]
    pub parameters: String,
    /// Input: step:VOLTS@SECONDS, or a CSV file with time and voltage (and load torque)
    #[arg(long, value_name = "INPUT")]
    pub input: String,
    /// Length in seconds, for a step
    #[arg(long, default_value_t = 3.0, value_name = "S", allow_negative_numbers = true)]
    pub duration: f64,
    /// Time between samples in seconds, for a step
    #[arg(long, default_value_t = 0.001, value_name = "S", allow_negative_numbers = true)]
    pub period: f64,
    /// White noise on current and speed: 40dB, or i=0.05,w=0.5 [A, rad/s]
    #[arg(long, value_name = "NOISE")]
    pub noise: Option<String>,
    /// Seed of the noise
    #[arg(long, default_value_t = 1, value_name = "N", allow_negative_numbers = true)]
    pub seed: u64,
    /// The file to write; - writes to stdout
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    #[command(flatten)]
    pub columns: Columns,
    #[command(flatten)]
    pub band: Band,
}

#[derive(Args)]
pub(crate) struct Band {
    /// Band of the settling time, in percent of the steady state
    #[arg(long, default_value_t = 2.0, value_name = "PERCENT")]
    pub settling_band: f64,
}

#[derive(Args)]
pub(crate) struct InspectArgs {
    #[command(flatten)]
    pub recordings: Recordings,
    #[command(flatten)]
    pub band: Band,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    /// A folder for report.html and result.json
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(Args)]
pub(crate) struct BenchArgs {
    /// Candidates in a batch
    #[arg(long, value_delimiter = ',', value_name = "LIST", default_value = "1,10,100,1000,10000,100000,1000000")]
    pub populations: Vec<usize>,
    /// Samples of the recordings
    #[arg(long, value_delimiter = ',', value_name = "LIST", default_value = "300,3000")]
    pub samples: Vec<usize>,
    /// About how long measuring may take, in seconds
    #[arg(long, default_value_t = 60.0, value_name = "S")]
    pub seconds: f64,
    /// Threads of the CPU contender that uses several [default: all]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// A file for a plot of rate against population; with several recordings one each, their samples in the name
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Measure no adapters
    #[arg(long)]
    pub no_gpu: bool,
    /// Measure adapters in f32 without deviations too: the fastest there is, and wrong near the optimum
    #[arg(long)]
    pub plain: bool,
    /// Do not keep what was measured for --device auto
    #[arg(long)]
    pub no_keep: bool,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub(crate) struct DevicesArgs {
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}
