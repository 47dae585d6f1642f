//! Flags of `sysid`.

use super::flags::{PageArgs, Recordings, described};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};
use motorfit::analysis::CONTROLLERS;
use motorfit::identify::mechanism::MechanismKind;
use std::path::PathBuf;

#[derive(Args)]
pub(crate) struct SysidArgs {
    #[command(flatten)]
    pub recordings: Recordings,
    /// Gravity of the mechanism [default: selected by the tests]
    #[arg(long, value_parser = described::<MechanismKind>(), value_name = "KIND", help_heading = "Mechanism")]
    pub mechanism: Option<MechanismKind>,
    /// Controller of the feedback loop, which sets period, delay and units of the gains
    #[arg(long, value_parser = controllers(), default_value = "wpilib", value_name = "NAME", help_heading = "Feedback")]
    pub controller: String,
    /// Period of the controller, in seconds [default: that of the controller]
    #[arg(long, value_name = "S", help_heading = "Feedback", allow_negative_numbers = true)]
    pub period: Option<f64>,
    /// Delay of the measurement, in seconds [default: that of the controller]
    #[arg(long, value_name = "S", help_heading = "Feedback", allow_negative_numbers = true)]
    pub delay: Option<f64>,
    /// Largest acceptable error of the position, in the unit of the log
    #[arg(long, value_name = "UNITS", default_value_t = 1.0, help_heading = "Feedback", allow_negative_numbers = true)]
    pub position_error: f64,
    /// Largest acceptable error of the velocity, in the unit of the log per second
    #[arg(long, value_name = "UNITS", default_value_t = 1.5, help_heading = "Feedback", allow_negative_numbers = true)]
    pub velocity_error: f64,
    /// Largest voltage of the controller
    #[arg(long, value_name = "V", default_value_t = 7.0, help_heading = "Feedback", allow_negative_numbers = true)]
    pub max_voltage: f64,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    /// Write report.html, result.json and curves.csv to this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub page: PageArgs,
    /// Exit with code 4 unless the level of trust is good
    #[arg(long)]
    pub strict: bool,
    /// Number of threads [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
}

/// Returns the parser of the names of controllers.
fn controllers() -> PossibleValuesParser {
    let row = |of: &motorfit::analysis::Controller| PossibleValue::new(of.name).help(of.text);
    CONTROLLERS.iter().map(row).collect::<Vec<_>>().into()
}
