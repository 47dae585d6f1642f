//! Ends a population search from an observer once its cost is low enough; refinement and verification follow.
//!
//! ```sh
//! cargo run --release --example observed_search
//! ```
#![allow(clippy::print_stdout, reason = "an example prints")]

use motorfit::identify::{IdentifySpec, Method, identify_with};
use motorfit::motor::Parameter;
use motorfit::optimize::GwoOptions;
use motorfit::record::read_recording;
use std::ops::ControlFlow;
use std::path::Path;

fn main() -> motorfit::Result<()> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/m2-step.csv");
    let records = [read_recording(&path, &[])?];
    let spec = IdentifySpec { method: Method::from(GwoOptions::default()), ..IdentifySpec::default() };
    let mut generations = 0;
    let found = identify_with(&records, &spec, &mut |progress| {
        generations = progress.generation;
        // At an nrmse of 5 % the refinement converges faster than the search.
        if progress.cost < 0.05 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    println!("{} after {generations} generations, {}", found.stop.name(), found.verification.status.name());
    let errors = found.uncertainty.as_ref().map(|u| u.std_error.clone()).unwrap_or_default();
    for (parameter, error) in Parameter::ALL.iter().zip(errors) {
        let value = found.parameters.get(*parameter);
        println!("{} = {value:.6e} ± {:.1e} {}", parameter.symbol(), error.unwrap_or(f64::NAN), parameter.unit());
    }
    assert!(generations < 100 && found.fit_percent.iter().flatten().all(|fit| *fit > 98.0));
    Ok(())
}
