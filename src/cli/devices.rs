//! `devices`: what can evaluate here.

use super::Outcome;
use super::args::DevicesArgs;
use super::output::{STRONG, data};
use motorfit::Result;
use motorfit::evaluate::{Level, cpu_name};
use motorfit::report::{Devices, json};
use std::fmt::Write as _;

pub(super) fn run(args: &DevicesArgs) -> Result<Outcome> {
    let threads = rayon::current_num_threads();
    if args.json {
        data(&json(&Devices::of(threads)))?;
        return Ok(Outcome::Done);
    }
    let levels: Vec<&str> = Level::available().map(Level::name).collect();
    let mut text = String::new();
    let _ = writeln!(text, "{STRONG}cpu{STRONG:#}  {}", cpu_name());
    let _ = writeln!(text, "     {threads} threads, f64, SIMD {} (has {})", Level::best().name(), levels.join(", "));
    text.push_str("gpu  not in this version\n");
    data(&text)?;
    Ok(Outcome::Done)
}
