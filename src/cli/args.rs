//! Commands and the flags that belong to one command. Shared flags are in `flags`.

pub(crate) use super::bench_args::BenchArgs;
pub(crate) use super::flags::*;
pub(crate) use super::model::args::*;
pub(crate) use super::sweep::args::*;
pub(crate) use super::sysid_args::SysidArgs;
use clap::builder::ArgPredicate;
use clap::{ArgGroup, ArgMatches, Args, FromArgMatches};
use motorfit::identify::Method;
use motorfit::motor::Discretization;
use motorfit::report::ExportFormat;
use motorfit::study::compare::Preset;
use motorfit::study::suite::Suite;
use std::path::PathBuf;

const ABOUT: &str = "Identify the parameters of DC motors from recordings of voltage, current and speed";
const LONG_ABOUT: &str =
    "Estimates resistance R, inductance L, motor constant K, viscous friction B and inertia J, with standard errors.";
/// The arguments of the program.
pub(crate) struct Cli {
    pub command: Command,
    pub common: Common,
}

impl Cli {
    /// Returns the program with its commands. Only the command `wanted` gets its arguments; without a name all commands do, which
    /// takes 0.2 ms.
    pub(super) fn definition(wanted: Option<&str>) -> clap::Command {
        let program = clap::Command::new("motorfit")
            .version(env!("CARGO_PKG_VERSION"))
            .propagate_version(true)
            .max_term_width(100)
            .about(ABOUT)
            .long_about(format!("{ABOUT}\n\n{LONG_ABOUT}"))
            .after_help(super::failure::exit_codes())
            .subcommand_required(true)
            .arg_required_else_help(true);
        Common::augment_args(Command::add_to(program, wanted))
    }

    /// Reads the parsed arguments.
    pub(super) fn parsed(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Self { command: Command::parsed(matches)?, common: Common::from_arg_matches(matches)? })
    }
}

#[derive(Args)]
pub(crate) struct Common {
    /// Print only results: no notes, warnings or progress
    #[arg(short, long, global = true, conflicts_with = "verbose", help_heading = "Output", hide_short_help = true)]
    pub quiet: bool,
    /// Print remarks too, the models of a selection and the cost of each generation
    #[arg(short, long, global = true, help_heading = "Output", hide_short_help = true)]
    pub verbose: bool,
    /// Use of colour; NO_COLOR is respected
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
    /// Form of progress on stderr: a bar if it is a terminal (auto), or lines of JSON
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

/// Defines the commands by their rows: purpose, name and arguments.
macro_rules! commands {
    ($($about:literal, $name:literal => $variant:ident($args:ty);)+) => {
        pub(crate) enum Command {
            $($variant(Box<$args>)),+
        }

        impl Command {
            /// The names of the commands.
            pub(super) const NAMES: &[&str] = &[$($name),+];

            fn add_to(program: clap::Command, wanted: Option<&str>) -> clap::Command {
                $(
                    let command = clap::Command::new($name);
                    let is_wanted = wanted.is_none_or(|wanted| wanted == $name);
                    let command = if is_wanted { <$args as Args>::augment_args(command) } else { command };
                    let program = program.subcommand(command.about($about));
                )+
                program
            }

            fn parsed(matches: &ArgMatches) -> Result<Self, clap::Error> {
                match matches.subcommand() {
                    $(Some(($name, own)) => Ok(Self::$variant(Box::new(<$args>::from_arg_matches(own)?))),)+
                    _ => Err(clap::Error::new(clap::error::ErrorKind::MissingSubcommand)),
                }
            }
        }
    };
}

commands! {
    "Identify one motor from one or more recordings (several make one joint fit)", "identify" => Identify(IdentifyArgs);
    "Compute the costs of any number of candidates, read from a file or sampled", "evaluate" => Evaluate(EvaluateArgs);
    "Compare methods under equal budgets, with statistics, tables and plots", "compare" => Compare(CompareArgs);
    "Run a study of methods, seeds and recordings as one batch; an interrupted sweep can be resumed", "sweep" => Sweep(SweepArgs);
    "Simulate a motor that starts at rest, and write a recording", "simulate" => Simulate(SimulateArgs);
    "Check, list and show models: the equations of a machine as text", "model" => Model(ModelArgs);
    "Show the contents of recordings, how columns were interpreted, and suspect data", "inspect" => Inspect(InspectArgs);
    "Identify a mechanism of a robot from a log with the tests of SysId: kS, kV, kA, kG and feedback gains", "sysid" => Sysid(SysidArgs);
    "Measure the throughput of CPU and GPU evaluation over population sizes", "bench" => Bench(BenchArgs);
    "List the devices of this machine that can evaluate candidates", "devices" => Devices(DevicesArgs);
    "Open recordings in the page, in a browser on this machine", "view" => View(ViewArgs);
    "Print a completion script for a shell", "completions" => Completions(CompletionsArgs);
    "Print the manual pages (roff), or write one page per command into a folder", "man" => Man(ManArgs);
}

#[derive(Args)]
pub(crate) struct ViewArgs {
    /// Recordings (CSV, XLSX, MAT, JSON, wpilog) that the page opens; it reads no other file
    #[arg(value_name = "RECORD")]
    pub records: Vec<PathBuf>,
    /// Print the address of the page without opening a browser
    #[arg(long)]
    pub no_open: bool,
}

#[derive(Args)]
pub(crate) struct CompletionsArgs {
    /// Shell that runs the script
    pub shell: clap_complete::Shell,
}

#[derive(Args)]
pub(crate) struct ManArgs {
    /// Folder for motorfit.1, motorfit-identify.1 and so on
    #[arg(value_name = "DIR")]
    pub dir: Option<PathBuf>,
}

#[derive(Args)]
pub(crate) struct IdentifyArgs {
    #[command(flatten)]
    pub recordings: Recordings,
    #[command(flatten)]
    pub model: OwnModel,
    /// With --model: values from which one more descent begins, as R=0.9,L=0.01 in the units of the model, such as those found for a model that it contains; repeatable: one that gives a name again is another start
    #[arg(long, value_name = "VALUES", help_heading = "Search", hide_short_help = true)]
    pub start: Vec<String>,
    /// Held-out recordings, which are simulated but not fitted; repeatable
    #[arg(long, value_name = "RECORD", help_heading = "Validation")]
    pub validate: Vec<PathBuf>,
    /// Fraction of each recording to fit (0 to 1); the rest is for validation
    #[arg(long, value_name = "FRACTION", allow_negative_numbers = true, help_heading = "Validation")]
    pub split: Option<f64>,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    /// Write report.html, result.json and curves.csv to this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub page: PageArgs,
    /// Write an SVG plot of measured and modelled signals; one file per recording; - writes it to stdout instead of the result
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Print a file for a simulator instead of the result; with --out, write it to that folder as motor.xml, .urdf, .mo or .json
    #[arg(long, value_name = "FORMAT", value_parser = named::<ExportFormat>(), hide_short_help = true)]
    pub export: Option<ExportFormat>,
    /// Plot measured and modelled signals and their residuals in the terminal
    #[arg(long, conflicts_with = "json")]
    pub plot: bool,
    /// Exit with code 4 unless the level of trust is good
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
    /// Recordings of one machine [default: a simulation of the paper's experiment with its motor M2]
    #[arg(value_name = "RECORD")]
    pub records: Vec<PathBuf>,
    #[command(flatten)]
    pub reading: Reading,
    #[command(flatten)]
    pub model: OwnModel,
    /// Use the settings of the paper, and show its tables beside the results
    #[arg(long, value_parser = described::<Preset>(), conflicts_with_all = ["records", "model", "methods", "criteria", "population", "generations", "set", "transform", "bounds", "fix"])]
    pub preset: Option<Preset>,
    /// Compare searches on a suite of simulated problems with known optima, at each of the budgets
    #[arg(long, value_parser = described::<Suite>(), conflicts_with_all = ["records", "model", "preset", "criteria", "generations", "bounds", "fix", "target", "discretization"])]
    pub suite: Option<Suite>,
    /// With --suite: budgets of a run in evaluations, each compared separately
    #[arg(long, value_delimiter = ',', requires = "suite", value_name = "LIST")]
    #[arg(default_value = "100,1000,10000,100000")]
    pub budgets: Vec<u64>,
    #[arg(long, help = methods_compared(), value_parser = described::<Method>(), value_delimiter = ',')]
    #[arg(default_value = "gwo,jaya,ga,sm", value_name = "LIST")]
    #[arg(default_value_if("suite", ArgPredicate::IsPresent, searches()))]
    #[arg(default_value_if("model", ArgPredicate::IsPresent, "gwo,jaya,ga"))]
    pub methods: Vec<Method>,
    /// Runs of each method, each with its own random numbers [with --suite: 15]
    #[arg(long, default_value_t = 50, value_name = "N", allow_negative_numbers = true)]
    #[arg(default_value_if("suite", ArgPredicate::IsPresent, "15"))]
    pub runs: usize,
    /// Criteria with scales, as CRITERION:SCALE,…; each is compared separately
    #[arg(long, value_delimiter = ',', default_value = "nrmse:std", value_name = "LIST")]
    pub criteria: Vec<String>,
    /// Candidates in each generation; each value of a list is compared separately [with --suite: about the root of the budget, up to 100]
    #[arg(long, value_delimiter = ',', default_value = "100", value_name = "LIST")]
    #[arg(default_value_if("suite", ArgPredicate::IsPresent, None::<&str>))]
    pub population: Vec<usize>,
    /// Generations, the initial population included; each value of a list is compared separately
    #[arg(long, value_delimiter = ',', default_value = "100", value_name = "LIST")]
    pub generations: Vec<usize>,
    /// Settings of methods, as ga.mutation=0.1,…; alternatives, as 0.1/0.2, are compared separately
    #[arg(long, value_name = "METHOD.KEY=VALUE", value_delimiter = ',')]
    pub set: Vec<String>,
    /// Other coordinates in which each setting is searched too, to test whether a method depends on them: mirror, shift:SHARE of the
    /// range (as shift:0.1), log
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "none")]
    pub transform: Vec<String>,
    /// Seed of the random numbers of all runs
    #[arg(long, default_value_t = 1, value_name = "N", allow_negative_numbers = true)]
    pub seed: u64,
    /// Noise realizations on which Steiglitz–McBride, which uses no random numbers, is run
    #[arg(long, default_value_t = 200, value_name = "N", allow_negative_numbers = true, conflicts_with = "model")]
    pub noise_records: usize,
    /// Target cost; the share of runs that reach it is reported [default: a range of targets]
    #[arg(long, value_name = "COST", allow_negative_numbers = true)]
    pub target: Option<f64>,
    /// Bounds of the search, as for identify [default: table2 without a recording, else auto: a decade to each side of the
    /// Steiglitz–McBride or, where there is none, the refined estimate; with --model: those of the model]; repeatable
    #[arg(long, value_delimiter = ',', value_name = "BOUNDS")]
    pub bounds: Vec<String>,
    /// Parameters fixed at known values, as R=0.92,… in SI units, or in those of the model; repeatable
    #[arg(long, value_delimiter = ',', value_name = "VALUES")]
    pub fix: Vec<String>,
    /// Discretization of the motor; a model takes zoh, foh or rk4
    #[arg(long, value_parser = named::<Discretization>(), default_value = "zoh")]
    pub discretization: Discretization,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    /// Write report.html, result.json and CSV files to this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub page: PageArgs,
    #[command(flatten)]
    pub device: DeviceArgs,
}

#[derive(Args)]
#[command(group(ArgGroup::new("points").args(["candidates", "sample", "slice", "profile"]).required(true).multiple(true)))]
#[command(group(ArgGroup::new("drawn").args(["slice", "profile"])))]
pub(crate) struct EvaluateArgs {
    #[command(flatten)]
    pub recordings: Recordings,
    #[command(flatten)]
    pub model: OwnModel,
    /// File of candidates, CSV or .parquet, with a column for each free parameter in SI units (R,L,K,B,J; with
    /// --per-recording R: R[0],R[1]); - reads CSV from stdin
    #[arg(long, value_name = "FILE", conflicts_with_all = ["sample", "slice", "profile"])]
    pub candidates: Option<PathBuf>,
    /// Sample candidates within the bounds: uniform:N, lhs:N (Latin hypercube), sobol:N (Sobol' sequence), or grid:N (N values per parameter)
    #[arg(long, value_name = "SAMPLE")]
    pub sample: Option<String>,
    /// Compute the cost over two parameters, as R,L, around the identified optimum; --sample grid:N sets the points per
    /// axis
    #[arg(long, value_name = "P,Q", conflicts_with_all = ["top", "json"])]
    pub slice: Option<String>,
    /// Profile likelihood of every free parameter around the identified optimum, with its 95 % interval beside that of the standard
    /// error
    #[arg(long, conflicts_with_all = ["sample", "slice", "top"])]
    pub profile: bool,
    /// With --slice: write the heat map (SVG), with the optimum and its 95 % confidence ellipse, to this file instead of the
    /// costs as CSV to stdout; with --profile: write the curves; - writes to stdout
    #[arg(long, value_name = "FILE", requires = "drawn")]
    pub svg: Option<PathBuf>,
    /// Print only the K candidates of lowest cost, the best first [default: all; with --json: 10]
    #[arg(long, value_name = "K")]
    pub top: Option<usize>,
    /// Seed of the random sample
    #[arg(long, default_value_t = 1, value_name = "N", allow_negative_numbers = true)]
    pub seed: u64,
    /// Print one JSON document with the best candidates, or with --profile with the points
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub problem: ProblemArgs,
    #[command(flatten)]
    pub device: DeviceArgs,
}

#[derive(Args)]
pub(crate) struct SimulateArgs {
    /// Equations of another machine in place of the DC motor: a file (TOML), or a built-in model (see motorfit model list);
    /// parameters are those of the model, inputs steps NAME=step:VALUE@SECONDS,… or a CSV file with the columns of the model
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// Parameters of the motor: R=…,L=…,K=…,B=…,J=… in SI units, or m2 for the paper's motor M2; parameters of
    /// extensions may follow (see identify --with): m2,Tc=0.01,td=0.004
    #[arg(long, value_name = "VALUES", required = false, required_unless_present = "model")]
    #[arg(default_value_if("model", ArgPredicate::IsPresent, ""))]
    pub parameters: String,
    /// Input: step:VOLTS@SECONDS, or a CSV file with columns time and voltage (optionally load torque)
    #[arg(long, value_name = "INPUT")]
    pub input: String,
    /// With a step: length of the simulation, in seconds
    #[arg(long, default_value_t = 3.0, value_name = "S", allow_negative_numbers = true)]
    pub duration: f64,
    /// With a step: time between samples, in seconds
    #[arg(long, default_value_t = 0.001, value_name = "S", allow_negative_numbers = true)]
    pub period: f64,
    /// White noise added to current and speed: 40dB (below the rms value of each), or i=0.05,w=0.5 [A, rad/s] [default: none]
    #[arg(long, value_name = "NOISE")]
    pub noise: Option<String>,
    /// Seed of the random noise
    #[arg(long, default_value_t = 1, value_name = "N", allow_negative_numbers = true)]
    pub seed: u64,
    /// Recording to write (CSV); - writes to stdout
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    #[command(flatten)]
    pub columns: Columns,
    #[command(flatten)]
    pub band: Band,
}

#[derive(Args)]
pub(crate) struct Band {
    /// Half-width of the band that defines the settling time, in percent of the steady state
    #[arg(long, default_value_t = 2.0, value_name = "PERCENT")]
    pub settling_band: f64,
}

#[derive(Args)]
pub(crate) struct InspectArgs {
    #[command(flatten)]
    pub recordings: Recordings,
    #[command(flatten)]
    pub model: OwnModel,
    #[command(flatten)]
    pub band: Band,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    /// Write report.html and result.json to this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub page: PageArgs,
}

#[derive(Args)]
pub(crate) struct DevicesArgs {
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}
